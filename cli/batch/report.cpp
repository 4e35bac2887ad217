// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <numeric>

#include "bake/quantity_text.h"
#include "cli/tools/junit.h"
#include "cli/tools/provenance.h"

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

// Removes control characters, so that no name acts on a terminal.
std::string plain(std::string text) {
  for (char& c : text) c = std::iscntrl(static_cast<unsigned char>(c)) != 0 ? '?' : c;
  return text;
}

std::string row(const Job& job, const JobResult& result, int width) {
  const std::string what = describe(result.state);
  if (result.state == State::failed)
    return fmt::format("  {:<10}  {:<{}}  {}\n", what, plain(job.output), width, plain(result.error));
  std::string line = fmt::format("  {:<10}  {:<{}}  {:>8}", what, plain(job.output), width, size_text(result.bytes));
  if (result.state == State::baked)
    line += fmt::format("  {:>7.2f} s  {:>8} of memory", result.seconds, size_text(result.memory_bytes));
  if (result.state == State::would_bake && result.memory_bytes > 0)
    line += fmt::format("  {:>8} of memory", size_text(result.memory_bytes));
  if (!result.reasons.empty()) line += "  " + joined(result.reasons, "; ");
  return line + '\n';
}

}  // namespace

std::string to_table(const std::vector<Job>& jobs, const std::vector<JobResult>& results, double seconds) {
  std::size_t width = 0;
  std::map<State, std::size_t> counts;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    ++counts[results[i].state];
    if (results[i].state != State::unchanged) width = std::max(width, jobs[i].output.size());
  }
  std::string out;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (results[i].state == State::unchanged) continue;
    out += row(jobs[i], results[i], static_cast<int>(std::min<std::size_t>(width, 48)));
    for (const std::string& note : results[i].notes) out += fmt::format("              note: {}\n", note);
  }
  std::string total;
  for (const auto& [state, count] : counts)
    total += fmt::format("{}{} {}", total.empty() ? "" : ", ", count, describe(state));
  return out + fmt::format("{} {}: {}; {:.1f} s\n", jobs.size(), jobs.size() == 1 ? "mesh" : "meshes", total, seconds);
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
    if (result.state == State::failed) {
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
    one.output =
        fmt::format("{}: {}\n{}", describe(result.state), joined(result.reasons, "; "), joined(result.notes, "\n"));
    suite.cases.push_back(std::move(one));
  }
  return cli::to_junit({suite}, provenance(0));
}

bool any_failed(const std::vector<JobResult>& results) {
  return std::any_of(results.begin(), results.end(),
                     [](const JobResult& result) { return result.state == State::failed; });
}

}  // namespace vps::cli::batch
