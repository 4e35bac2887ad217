// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <numeric>
#include <string_view>

#include "bake/quantity_text.h"
#include "cli/tools/junit.h"
#include "cli/tools/provenance.h"
#include "cli/tools/utf8.h"

namespace vps::cli::batch {
namespace {

using nlohmann::ordered_json;
using State = JobResult::State;

std::string joined(const std::vector<std::string>& texts, const char* between) {
  return fmt::format("{}", fmt::join(texts, between));
}

std::string size_text(std::size_t bytes) {
  return bytes == 0 ? "" : bake::format_bytes(static_cast<double>(bytes));
}

// Errors were printed when they occurred.
bool has_row(const JobResult& result, TableRows rows) {
  const bool is_made = result.state != State::unchanged && result.state != State::not_started;
  return (rows == TableRows::all || is_made) && result.state != State::failed;
}

std::string row(const Job& job, const JobResult& result, int width) {
  std::string line = fmt::format("  {:<11}  {:<{}}  {:>8}", describe(result.state), one_line(job.output), width,
                                 size_text(result.bytes));
  if (result.state == State::baked)
    line += fmt::format("  {:>7.2f} s  {:>8} of memory", result.seconds, size_text(result.memory_bytes));
  if (result.state == State::would_bake && result.memory_bytes > 0)
    line += fmt::format("  {:>8} of memory", size_text(result.memory_bytes));
  if (!result.reasons.empty()) line += "  " + joined(result.reasons, "; ");
  return line + '\n';
}

// Where an error names an option: it ends with what to do, the best first.
std::size_t advised_at(const std::string& error, std::string_view option) {
  return error.find(option, std::min(error.find(';'), error.size()));
}

// "to bake those that failed: 11 with --repair fill"; empty when no error names an option.
std::string advice(const std::vector<JobResult>& results) {
  constexpr std::string_view kOptions[] = {"--repair fill", "--repair wrap", "--open-surface",  "--unit",
                                           "--memory",      "--timeout",     "--import-memory", "--import-timeout"};
  std::map<std::string_view, std::size_t> counts;
  for (const JobResult& result : results) {
    if (result.state != State::failed) continue;
    const auto* const first =
        std::min_element(std::begin(kOptions), std::end(kOptions), [&](std::string_view a, std::string_view b) {
          return advised_at(result.error, a) < advised_at(result.error, b);
        });
    if (advised_at(result.error, *first) != std::string::npos) ++counts[*first];
  }
  std::string text;
  for (const auto& [option, count] : counts)
    text += fmt::format("{}{} with {}", text.empty() ? "to bake those that failed: try " : ", ", count, option);
  return text.empty() ? text : text + '\n';
}

bool may_differ_with_more_memory_or_time(const std::string& error) {
  const auto names = [&](std::string_view word) { return error.find(word) != std::string::npos; };
  return names("memory") || names("--timeout") || names("--import-timeout") || names("--jobs");
}

}  // namespace

std::map<std::string, std::string> known_failures(const std::filesystem::path& log) {
  std::error_code failed;
  std::ifstream file;
  if (std::filesystem::is_regular_file(log, failed)) file.open(log, std::ios::binary);
  const auto json = nlohmann::json::parse(file, nullptr, false);
  std::map<std::string, std::string> out;
  if (!json.is_object() || !json.contains("items")) return out;
  const auto text_of = [](const nlohmann::json& item, const char* name) {
    return item.contains(name) && item[name].is_string() ? item[name].get<std::string>() : std::string();
  };
  for (const auto& item : json["items"]) {
    if (!item.is_object() || !item.contains("exit_code") || item["exit_code"] != int{kBadInput}) continue;
    const std::string key = text_of(item, "key");
    const std::string error = text_of(item, "error");
    const bool is_twin = error.ends_with(", the same mesh)");  // it names the other mesh
    if (!key.empty() && !is_twin && !may_differ_with_more_memory_or_time(error)) out.emplace(key, error);
  }
  return out;
}

std::string to_table(const std::vector<Job>& jobs, const std::vector<JobResult>& results, double seconds,
                     TableRows rows) {
  std::size_t width = 0;
  std::map<State, std::size_t> counts;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    ++counts[results[i].state];
    if (has_row(results[i], rows)) width = std::max(width, jobs[i].output.size());
  }
  std::string out;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (!has_row(results[i], rows)) continue;
    out += row(jobs[i], results[i], static_cast<int>(std::min<std::size_t>(width, 48)));
    for (const std::string& note : results[i].notes) out += fmt::format("               note: {}\n", note);
  }
  std::string total;
  const auto known = std::count_if(results.begin(), results.end(), [](const JobResult& one) { return one.known; });
  for (const auto& [state, count] : counts) {
    total += fmt::format("{}{} {}", total.empty() ? "" : ", ", count, describe(state));
    if (state == State::failed && known > 0) total += fmt::format(" ({} as before, not tried again)", known);
  }
  return out + fmt::format("{} {}: {}; {:.1f} s\n", jobs.size(), jobs.size() == 1 ? "mesh" : "meshes", total, seconds) +
         advice(results);
}

ordered_json to_json(const std::vector<Job>& jobs, const std::vector<JobResult>& results) {
  ordered_json items = ordered_json::array();
  ordered_json counts = ordered_json::object();
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const JobResult& result = results[i];
    ordered_json item = {{"mesh", jobs[i].mesh.string()}, {"asset", jobs[i].asset().string()},
                         {"options", jobs[i].options},    {"state", describe(result.state)},
                         {"reasons", result.reasons},     {"key", result.key},
                         {"bytes", result.bytes},         {"memory_bytes", result.memory_bytes},
                         {"seconds", result.seconds},     {"notes", result.notes}};
    if (result.state == State::failed || result.state == State::not_started) {
      item["error"] = result.error;
      item["exit_code"] = result.code;
    }
    auto& count = counts[describe(result.state)];
    count = count.is_null() ? 1 : count.get<int>() + 1;
    items.push_back(std::move(item));
  }
  ordered_json j = {{"format", "vpsbake batch 1"}};
  j.update(provenance(0));
  j.erase("seed");
  j["counts"] = std::move(counts);
  j["items"] = std::move(items);
  return j;
}

std::string to_junit(const std::vector<Job>& jobs, const std::vector<JobResult>& results) {
  JUnitSuite suite{"vpsbake batch", 0.0, {}};
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const JobResult& result = results[i];
    *suite.seconds += result.seconds;
    JUnitCase one{"vpsbake batch", jobs[i].output, result.seconds, {}, {}, {}};
    if (result.state == State::failed) {
      const std::string message = fmt::format("{}: {}", jobs[i].mesh.string(), result.error);
      one.failure = {message, message};
    }
    if (result.state == State::not_started) one.skipped = result.error;
    one.output =
        fmt::format("{}: {}\n{}", describe(result.state), joined(result.reasons, "; "), joined(result.notes, "\n"));
    suite.cases.push_back(std::move(one));
  }
  return cli::to_junit({suite}, provenance(0));
}

bool any_failed(const std::vector<JobResult>& results) {
  return std::any_of(results.begin(), results.end(), [](const JobResult& result) {
    return result.state == State::failed || result.state == State::not_started;
  });
}

}  // namespace vps::cli::batch
