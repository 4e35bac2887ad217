// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/jobs_file.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/tools/standard_streams.h"
#include "cli/tools/utf8.h"

namespace vps::cli::batch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The file's folder; empty when it is the current one.
fs::path folder_of(const fs::path& file) {
  return file.parent_path();
}

Job to_job(const Json& json, const fs::path& folder) {
  Job job;
  // Not normalised, because a folder before .. may be a link.
  job.mesh = folder / json.at("mesh").get<std::string>();
  job.folder = folder / json.at("folder").get<std::string>();
  job.output = json.at("output");
  job.options = json.at("options").get<OptionTexts>();
  if (json.contains("refusal")) job.refusal = json["refusal"];
  const fs::path output(job.output);
  const auto is_outside = [&] { return output.is_absolute() || *output.lexically_normal().begin() == ".."; };
  if (!job.output.ends_with(".vps.hdf") || is_outside())
    throw BatchError("", "'output' is not the name of an asset below its folder");
  return job;
}

}  // namespace

void refuse_unwritable(std::vector<Job>& jobs) {
  for (Job& job : jobs) {
    const std::string names = job.mesh.string() + job.output;
    if (job.refusal.empty() && valid_utf8(names) != names)
      job.refusal = "its name is not UTF-8, as names of jobs have to be; rename it, or bake it with vpsbake batch";
  }
}

std::string to_lines(const std::vector<Job>& jobs, const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : ".";
  std::string text;
  for (const Job& job : jobs) {
    Json json = {{"mesh", path_from(job.mesh, folder)},
                 {"folder", path_from(job.folder, folder)},
                 {"output", job.output},
                 {"options", job.options}};
    if (!job.refusal.empty()) json["refusal"] = job.refusal;
    text += json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
  }
  return text;
}

std::vector<Job> read_jobs(const fs::path& file, const OptionReader& reader) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored))
    throw BatchError(file.string(), "this is a folder; give a file that vpsbake plan wrote", kIo);
  std::ifstream in(file_to_read(file), std::ios::binary);
  if (!in) throw BatchError(file.string(), "the file cannot be read; make it with vpsbake plan", kIo);
  std::vector<Job> jobs;
  std::set<fs::path> assets;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.empty()) continue;
    const std::string place = fmt::format("{}:{}", file.string(), number);
    try {
      jobs.push_back(to_job(Json::parse(line), folder_of(file)));
      if (jobs.back().refusal.empty()) jobs.back().settings = read_settings(jobs.back(), reader);
      if (jobs.back().refusal.empty() && !assets.insert(jobs.back().asset().lexically_normal()).second)
        throw BatchError("", "its asset is that of an earlier line; remove one");
    } catch (const Json::exception&) {
      throw BatchError(place, "this is not a line that vpsbake plan writes; make the file again");
    } catch (const BatchError& error) {
      throw BatchError(place, error.what());
    }
  }
  if (jobs.empty()) throw BatchError(file.string(), "there is no job in it; make it with vpsbake plan");
  return jobs;
}

std::vector<Job> share_of(const std::vector<Job>& jobs, std::size_t i, std::size_t n) {
  std::vector<Job> share;
  for (std::size_t at = i - 1; at < jobs.size(); at += n) share.push_back(jobs[at]);
  return share;
}

}  // namespace vps::cli::batch
