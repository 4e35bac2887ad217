// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/find_jobs.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <tuple>

#include "cli/batch/folder_settings.h"
#include "formats/mesh/mesh_import.h"

namespace vps::cli::batch {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSettings = "vpsbake.toml";
constexpr const char* kAsset = ".vps.hdf";

// A vpsbake.toml and its folder, relative to the given folder.
struct Layer {
  std::string folder;  // with a slash at the end; empty: the given folder itself
  FolderSettings settings;
  std::set<std::string> idle = {};  // globs of [[files]] that have matched no mesh yet
};

bool any_matches(const std::vector<std::string>& globs, const std::string& path) {
  return std::any_of(globs.begin(), globs.end(), [&](const std::string& glob) { return glob_matches(glob, path); });
}

void drop_matching(const std::string& path, std::set<std::string>& globs) {
  std::erase_if(globs, [&](const std::string& glob) { return glob_matches(glob, path); });
}

void overlay(const OptionTexts& on_top, OptionTexts& out) {
  // These three set the same: one of them on top replaces all of them below.
  for (const char* const grid : {"voxel", "resolution", "max-error"}) {
    if (on_top.count(grid) == 0) continue;
    for (const char* const other : {"voxel", "resolution", "max-error"}) out.erase(other);
  }
  for (const auto& [name, text] : on_top) out[name] = text;
}

class Finder {
 public:
  Finder(const Inputs& inputs, const OptionReader& reader) : inputs_(inputs), reader_(reader) {
    for (const auto* const globs : {&inputs.include, &inputs.exclude}) idle_.insert(globs->begin(), globs->end());
  }

  [[nodiscard]] const SettingsRead& settings() const { return settings_; }

  std::vector<Job> find() {
    for (const std::string& path : inputs_.paths) {
      std::error_code failed;
      const fs::file_status status = fs::status(path, failed);
      if (!fs::exists(status)) throw BatchError(path, "there is no such folder or file; check its name", kIo);
      if (fs::is_directory(status)) {
        search(path, "");
      } else if (fs::path(path).extension() == ".toml") {
        read_list(path);
      } else {
        add_file(path);
      }
    }
    if (jobs_.empty()) throw BatchError(inputs_.paths.front(), "no mesh is found; check the folder and the globs");
    for (const std::string& glob : idle_) settings_.idle.push_back({"command line", glob});
    std::sort(jobs_.begin(), jobs_.end(),
              [](const Job& a, const Job& b) { return std::tie(a.output, a.mesh) < std::tie(b.output, b.mesh); });
    drop_repeated();
    read_options();
    refuse_twins();
    return std::move(jobs_);
  }

 private:
  // @param below  the folder relative to `root`, with a slash at the end
  void search(const fs::path& root, const std::string& below) {
    const fs::path folder = root / below;
    std::error_code failed;
    std::vector<fs::directory_entry> entries;
    for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed))
      entries.push_back(*it);
    if (failed) {
      Job job{folder, inputs_.folder, below.empty() ? "." : below, inputs_.options, {}, {}};
      job.refusal = fmt::format("the folder cannot be read ({}); check its rights", failed.message());
      jobs_.push_back(std::move(job));
      return;
    }
    const std::size_t depth = layers_.size();
    push_layer(folder, below);
    for (const fs::directory_entry& entry : entries) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with('.')) continue;
      if (entry.is_directory(failed) && !entry.is_symlink(failed)) {
        const std::string inner = below + name + '/';
        drop_matching(inner, idle_);
        if (!is_excluded(inner) && !fs::equivalent(entry.path(), inputs_.folder, failed)) search(root, inner);
      } else if (has_mesh_extension(name) && !entry.is_directory(failed)) {
        add(root, below + name);
      }
    }
    if (layers_.size() > depth && inputs_.include.empty() && inputs_.exclude.empty()) {
      for (const std::string& glob : layers_.back().idle)
        settings_.idle.push_back({(folder / kSettings).lexically_normal(), glob});
    }
    layers_.resize(depth);
  }

  void push_layer(const fs::path& folder, const std::string& below) {
    std::error_code ignored;
    const fs::file_type type = fs::symlink_status(folder / kSettings, ignored).type();
    if (type == fs::file_type::not_found || type == fs::file_type::none) return;
    if (!fs::is_regular_file(folder / kSettings, ignored))
      throw BatchError((folder / kSettings).string(), "it is no regular file; remove it or correct the link");
    settings_.files.push_back((folder / kSettings).lexically_normal());
    Layer layer{below, read_folder_settings(settings_.files.back(), SettingsKind::beside_meshes, reader_)};
    for (const FileSettings& entry : layer.settings.files) layer.idle.insert(entry.match.begin(), entry.match.end());
    layers_.push_back(std::move(layer));
  }

  void add_file(const fs::path& file) {
    const fs::path folder = file.has_parent_path() ? file.parent_path() : ".";
    push_layer(folder, "");
    add(folder, file.filename().string());
    layers_.clear();
  }

  void read_list(const fs::path& file) {
    settings_.files.push_back(file);
    const FolderSettings list = read_folder_settings(file, SettingsKind::list, reader_);
    OptionTexts common = inputs_.options;
    overlay(list.options, common);
    for (const FileSettings& entry : list.files) {
      if (entry.skip.value_or(false)) continue;
      const fs::path mesh(entry.mesh);
      Job job{file.parent_path() / mesh, inputs_.folder, entry.output, common, {}, {}};
      // The asset's path below the folder of assets is the mesh's path below the list's folder, or else its name.
      const bool outside = mesh.is_absolute() || *mesh.lexically_normal().begin() == "..";
      const fs::path place = outside ? mesh.filename() : mesh.lexically_normal();
      if (job.output.empty()) job.output = fs::path(place).replace_extension(kAsset).generic_string();
      overlay(entry.options, job.options);
      jobs_.push_back(std::move(job));
    }
  }

  // @param path  relative to the given folder; with a slash at the end it means all below that folder
  [[nodiscard]] bool is_excluded(const std::string& path) const {
    return any_matches(inputs_.exclude, path) || std::any_of(layers_.begin(), layers_.end(), [&](const Layer& layer) {
             return any_matches(layer.settings.exclude, path.substr(layer.folder.size()));
           });
  }

  // @param path  relative to `root`
  void add(const fs::path& root, const std::string& path) {
    drop_matching(path, idle_);
    for (Layer& layer : layers_) drop_matching(path.substr(layer.folder.size()), layer.idle);
    if (is_excluded(path)) return;
    if (!inputs_.include.empty() && !any_matches(inputs_.include, path)) return;
    Job job{root / path, inputs_.folder, fs::path(path).replace_extension(kAsset).generic_string(), inputs_.options, {},
            {}};
    for (const Layer& layer : layers_) {
      const std::string rest = path.substr(layer.folder.size());
      if (!layer.settings.include.empty() && !any_matches(layer.settings.include, rest)) return;
      overlay(layer.settings.options, job.options);
      bool skip = false;
      for (const FileSettings& entry : layer.settings.files) {
        if (!any_matches(entry.match, rest)) continue;
        overlay(entry.options, job.options);
        if (!entry.output.empty()) job.output = layer.folder + entry.output;
        skip = entry.skip.value_or(skip);
      }
      if (skip) return;
    }
    jobs_.push_back(std::move(job));
  }

  // A mesh that was given twice is baked once.
  void drop_repeated() {
    const auto same = [](const Job& a, const Job& b) {
      return a.output == b.output && a.options == b.options &&
             fs::absolute(a.mesh).lexically_normal() == fs::absolute(b.mesh).lexically_normal();
    };
    jobs_.erase(std::unique(jobs_.begin(), jobs_.end(), same), jobs_.end());
  }

  // Refuses options that do not go together, before anything is baked.
  void read_options() {
    std::map<OptionTexts, bake::BakeSettings> known;
    for (Job& job : jobs_) {
      if (!job.refusal.empty()) continue;
      auto it = known.find(job.options);
      if (it == known.end()) it = known.emplace(job.options, read_settings(job, reader_)).first;
      job.settings = it->second;
    }
  }

  void refuse_twins() {
    for (std::size_t i = 0; i < jobs_.size();) {
      std::size_t end = i + 1;
      while (end < jobs_.size() && jobs_[end].output == jobs_[i].output) ++end;
      for (std::size_t j = i; j < end && end - i > 1; ++j) {
        jobs_[j].refusal = fmt::format(
            "{} would be written to {} as well; leave one out with --exclude, or give it another output in "
            "vpsbake.toml",
            jobs_[j == i ? i + 1 : i].mesh.string(), jobs_[j].asset().string());
      }
      i = end;
    }
  }

  const Inputs& inputs_;
  const OptionReader& reader_;
  std::set<std::string> idle_;  // globs of `inputs_` that have matched nothing yet
  std::vector<Layer> layers_;   // of the folders from the given one to the present one
  std::vector<Job> jobs_;
  SettingsRead settings_;
};

}  // namespace

std::vector<Job> find_jobs(const Inputs& inputs, const OptionReader& reader, SettingsRead* read) {
  Finder finder(inputs, reader);
  std::vector<Job> jobs = finder.find();
  if (read != nullptr) *read = finder.settings();
  return jobs;
}

nlohmann::ordered_json to_json(const Inputs& inputs) {
  return {{"paths", inputs.paths},
          {"folder", inputs.folder.string()},
          {"options", inputs.options},
          {"include", inputs.include},
          {"exclude", inputs.exclude}};
}

Inputs inputs_from(const nlohmann::ordered_json& json) {
  Inputs inputs;
  json.at("paths").get_to(inputs.paths);
  inputs.folder = json.at("folder").get<std::string>();
  inputs.options = json.at("options").get<OptionTexts>();
  json.at("include").get_to(inputs.include);
  json.at("exclude").get_to(inputs.exclude);
  return inputs;
}

}  // namespace vps::cli::batch
