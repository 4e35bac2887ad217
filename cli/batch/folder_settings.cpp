// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/folder_settings.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <toml++/toml.h>
#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>

#include "cli/tools/nearest_name.h"
#include "cli/tools/toml_keys.h"

namespace vps::cli::batch {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& file, const toml::source_region& place, const std::string& reason) {
  throw BatchError(fmt::format("{}:{}", file.string(), place.begin.line), reason);
}

std::string settings_text(const fs::path& file) {
  std::error_code failed;
  std::ifstream stream;
  if (fs::is_regular_file(file, failed)) stream.open(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream.is_open() || !stream)
    throw BatchError(file.string(), "it cannot be read; check its name and rights", kIo);
  return text;
}

// The text of an option's value, which may be a text, a number, true or false, or a list of texts.
std::string option_text(const fs::path& file, const std::string& key, const toml::node& node) {
  if (const auto text = node.value_exact<std::string>()) {
    if (text->empty()) refuse(file, node.source(), key + " is empty; give a value, or leave the line out");
    return *text;
  }
  if (const auto flag = node.value_exact<bool>()) return *flag ? "true" : "false";
  if (const auto number = node.value_exact<std::int64_t>()) return std::to_string(*number);
  if (const auto number = node.value_exact<double>()) return fmt::format("{}", *number);
  std::string list;
  const toml::array* const array = node.as_array();
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    const auto text = array->get(i)->value_exact<std::string>();
    if (!text) refuse(file, node.source(), key + " is a list of texts");
    list += (i == 0 ? "" : ",") + *text;
  }
  if (list.empty())
    refuse(file, node.source(),
           key + " is a text in quotes, such as \"5mm\", a number, true or false, or a list of texts");
  return list;
}

std::vector<std::string> texts(const fs::path& file, const std::string& key, const toml::node& node) {
  if (const auto text = node.value_exact<std::string>()) return {*text};
  const toml::array* const array = node.as_array();
  std::vector<std::string> out;
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    if (const auto text = array->get(i)->value_exact<std::string>()) out.push_back(*text);
  }
  if (array == nullptr || out.size() != array->size())
    refuse(file, node.source(), key + " is a list of texts, such as [\"*.obj\"]");
  return out;
}

[[noreturn]] void refuse_key(const fs::path& file, const toml::key& key, std::vector<std::string> keys,
                             const OptionReader& reader) {
  const std::string name(key.str());
  keys.insert(keys.end(), reader.names.begin(), reader.names.end());
  const auto meant = nearest_name(name, keys);
  refuse(file, key.source(),
         fmt::format("there is no key '{}' here; {}", name,
                     meant ? fmt::format("did you mean '{}'?", *meant) : "the options of vpsbake --help are keys"));
}

bool is_option(const std::string& key, const OptionReader& reader) {
  return std::find(reader.names.begin(), reader.names.end(), key) != reader.names.end();
}

// Checks one value as the command line does, so that an error names its line.
void take_option(const fs::path& file, const std::string& key, const toml::node& node, const OptionReader& reader,
                 OptionTexts& out) {
  Job probe;
  probe.options = {{key, option_text(file, key, node)}};
  if (key != "voxel" && key != "resolution" && key != "max-error") probe.options["voxel"] = "1mm";
  if (key == "fields" || key == "precision" || key == "field-error") probe.options["parts"] = "voxelmap";
  try {
    (void)read_settings(probe, reader);
  } catch (const BatchError& error) {
    std::string reason = error.what();
    if (const std::string option = "--" + key + ": "; reason.starts_with(option)) reason.erase(0, option.size());
    refuse(file, node.source(), fmt::format("{}: {}", key, reason));
  }
  out[key] = probe.options[key];
}

// Options of one table that exclude each other.
void check_together(const fs::path& file, const toml::table& table, const OptionTexts& options,
                    const OptionReader& reader) {
  Job probe;
  probe.options = options;
  if (options.count("voxel") + options.count("resolution") + options.count("max-error") == 0)
    probe.options["voxel"] = "1mm";
  try {
    (void)read_settings(probe, reader);
  } catch (const BatchError& error) {
    refuse(file, table.source(), error.what());
  }
}

bool is_below(const std::string& name) {
  const fs::path path(name);
  if (name.empty() || path.is_absolute() || !path.has_filename()) return false;
  return std::none_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
}

FileSettings read_entry(const fs::path& file, const toml::table& table, SettingsKind kind, const OptionReader& reader) {
  const char* const subject = kind == SettingsKind::list ? "mesh" : "match";
  FileSettings entry;
  for (const auto& [key, node] : table) {
    const std::string name(key.str());
    if (name == subject && kind == SettingsKind::list) {
      entry.mesh = node.value_exact<std::string>().value_or("");
      if (entry.mesh.empty()) refuse(file, node.source(), "mesh is the name of a file, in quotes");
    } else if (name == subject) {
      entry.match = texts(file, name, node);
    } else if (name == "output") {
      entry.output = node.value_exact<std::string>().value_or("");
      if (!is_below(entry.output) || !entry.output.ends_with(".vps.hdf"))
        refuse(file, node.source(), "output is a name below the folder of assets, such as \"parts/gear.vps.hdf\"");
      entry.output = fs::path(entry.output).lexically_normal().generic_string();
    } else if (name == "skip") {
      const auto value = node.value_exact<bool>();
      if (!value) refuse(file, node.source(), "skip is true or false");
      entry.skip = value;
    } else if (is_option(name, reader)) {
      take_option(file, name, node, reader, entry.options);
    } else {
      refuse_key(file, key, {subject, "skip", "output"}, reader);
    }
  }
  check_together(file, table, entry.options, reader);
  if (entry.mesh.empty() && entry.match.empty())
    refuse(file, table.source(), fmt::format("an entry of [[files]] says which, with {} = \"...\"", subject));
  return entry;
}

}  // namespace

FolderSettings read_folder_settings(const fs::path& file, SettingsKind kind, const OptionReader& reader) {
  const std::string text = settings_text(file);
  if (const int line = line_of_deep_key(text); line > 0) {
    throw BatchError(fmt::format("{}:{}", file.string(), line),
                     fmt::format("a key has more than {} parts; keys here have one", kMostKeyParts));
  }
  toml::table table;
  try {
    table = toml::parse(text, file.string());
  } catch (const toml::parse_error& error) {
    refuse(file, error.source(), fmt::format("this is not TOML: {}; correct the line", error.description()));
  }
  FolderSettings out;
  for (const auto& [key, node] : table) {
    const std::string name(key.str());
    if (name == "files") {
      const toml::array* const list = node.as_array();
      if (list == nullptr || !list->is_array_of_tables())
        refuse(file, node.source(), "files is written as [[files]], once for each entry");
      for (const toml::node& entry : *list) out.files.push_back(read_entry(file, *entry.as_table(), kind, reader));
    } else if (kind == SettingsKind::beside_meshes && (name == "include" || name == "exclude")) {
      (name == "include" ? out.include : out.exclude) = texts(file, name, node);
    } else if (is_option(name, reader)) {
      take_option(file, name, node, reader, out.options);
    } else {
      refuse_key(file, key,
                 kind == SettingsKind::list ? std::vector<std::string>{"files"}
                                            : std::vector<std::string>{"files", "include", "exclude"},
                 reader);
    }
  }
  check_together(file, table, out.options, reader);
  return out;
}

bool glob_matches(const std::string& glob, const std::string& path) {
  if (glob.ends_with('/')) return glob_matches(glob + '*', path);
  if (glob.find('/') != std::string::npos) {
    // The path with a slash in front lets a leading **/ match the folder itself, too.
    return ::fnmatch(glob.c_str(), path.c_str(), 0) == 0 || ::fnmatch(glob.c_str(), ('/' + path).c_str(), 0) == 0;
  }
  std::istringstream names(path);
  for (std::string name; std::getline(names, name, '/');) {
    if (::fnmatch(glob.c_str(), name.c_str(), 0) == 0) return true;
  }
  return false;
}

}  // namespace vps::cli::batch
