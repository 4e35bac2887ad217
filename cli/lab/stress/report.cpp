// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/stress/report.h"
#include "cli/tools/junit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

namespace vps::stress {
namespace {

using nlohmann::ordered_json;

std::string with_unit(const std::string& number, const std::string& unit) {
  return unit.empty() ? number : number + " " + unit;
}

// "60 Hz, 0.5 friction".
std::string setting(const std::vector<Axis>& axes, const std::vector<double>& at) {
  std::string out;
  for (std::size_t i = 0; i < axes.size() && i < at.size(); ++i) {
    const Axis& axis = axes[i];
    const auto label = static_cast<std::size_t>(at[i]);
    out += (i == 0 ? "" : ", ") + axis.name + " ";
    out += axis.labels.empty() ? with_unit(fmt::format("{:.4g}", at[i]), axis.unit) : axis.labels.at(label);
  }
  return out;
}

std::string limit_text(const Trial& trial) {
  if (!std::isfinite(trial.limit) || trial.least == trial.limit) return fmt::format("{:.3g}", trial.least);
  return std::isfinite(trial.least) ? fmt::format("{:.3g} to {:.3g}", trial.least, trial.limit)
                                    : fmt::format("{:.3g}", trial.limit);
}

// The value of a trial that was run, with its limit.
std::string value_text(const Case& asked, const Trial& trial) {
  if (!std::isfinite(trial.value)) return trial.remark;
  // The number is within its limit, so only the remark says why the trial is broken.
  const bool breaks = trial.verdict == Verdict::broken || trial.verdict == Verdict::solver;
  if (breaks && trial.value <= trial.limit && trial.value >= trial.least) return trial.remark;
  if (trial.value < 0 && !asked.below_zero.empty()) {
    return fmt::format("{} {}, limit {}", with_unit(fmt::format("{:.3g}", -trial.value), asked.unit), asked.below_zero,
                       with_unit(limit_text(trial), asked.unit));
  }
  return with_unit(fmt::format("{:.3g} of {}", trial.value, limit_text(trial)), asked.unit);
}

std::string outcome_text(const CaseResult& result, const Outcome& outcome) {
  const Trial& worst = outcome.trials[outcome.worst];
  if (outcome.verdict == Verdict::skipped) return fmt::format("{} skipped ({})", outcome.column, worst.remark);
  const bool shown_only = outcome.ours && !outcome.promised;
  std::string text = fmt::format("{}{} {} {}", outcome.column, shown_only ? " (not promised)" : "",
                                 describe(outcome.verdict), value_text(*result.asked, worst));
  if (const std::string at = setting(result.axes, worst.at); !at.empty()) text += " at " + at;
  return text;
}

const CaseResult* find_case(const AssetResult& result, const char* name) {
  for (const CaseResult& one : result.cases) {
    if (one.asked->name == name) return &one;
  }
  return nullptr;
}

const Outcome* find_column(const AssetResult& result, const char* name, const char* column) {
  const CaseResult* const one = find_case(result, name);
  if (one == nullptr) return nullptr;
  for (const Outcome& outcome : one->outcomes) {
    if (outcome.column == column && outcome.verdict != Verdict::skipped) return &outcome;
  }
  return nullptr;
}

// JSON has no infinity and no NaN.
ordered_json number(double x) {
  return std::isfinite(x) ? ordered_json(x) : ordered_json(nullptr);
}

ordered_json rounded(const std::vector<double>& values) {
  ordered_json out = ordered_json::array();
  for (const double x : values)
    out.push_back(std::isfinite(x) ? ordered_json(std::stod(fmt::format("{:.4g}", x))) : ordered_json());
  return out;
}

ordered_json to_json(const Trial& trial) {
  ordered_json j = {{"at", trial.at},
                    {"value", number(trial.value)},
                    {"limit", number(trial.limit)},
                    {"least", number(trial.least)},
                    {"verdict", describe(trial.verdict)},
                    {"remark", trial.remark}};
  if (!trial.trace.empty()) j["trace"] = rounded(trial.trace);
  return j;
}

ordered_json to_json(const CaseResult& result, Strictness strictness) {
  const Case& asked = *result.asked;
  ordered_json j = {{"name", asked.name},
                    {"family", asked.family},
                    {"question", asked.question},
                    {"setup", asked.setup},
                    {"measured", asked.measured},
                    {"quantity", asked.quantity},
                    {"below_zero", asked.below_zero},
                    {"unit", asked.unit},
                    {"limit", asked.limit},
                    {"limit_from", asked.limit_from},
                    {"trace", asked.trace},
                    {"verdict", describe(verdict_of(result, strictness))},
                    {"axes", ordered_json::array()},
                    {"columns", ordered_json::array()}};
  for (const Axis& axis : result.axes) {
    j["axes"].push_back({{"name", axis.name}, {"unit", axis.unit}, {"values", axis.values}, {"labels", axis.labels}});
  }
  for (const Outcome& outcome : result.outcomes) {
    ordered_json column = {{"column", outcome.column},     {"ours", outcome.ours},
                           {"promised", outcome.promised}, {"verdict", describe(outcome.verdict)},
                           {"worst", outcome.worst},       {"trials", ordered_json::array()}};
    for (const Trial& trial : outcome.trials) column["trials"].push_back(to_json(trial));
    j["columns"].push_back(std::move(column));
  }
  return j;
}

// Every trial that breaks the case, one per line.
std::string failures(const CaseResult& result, Strictness strictness) {
  std::string out;
  for (const Outcome& outcome : result.outcomes) {
    if (!counts(outcome, strictness)) continue;
    for (const Trial& trial : outcome.trials) {
      const bool solver = trial.verdict == Verdict::solver && strictness == Strictness::strict;
      if (trial.verdict != Verdict::broken && !solver) continue;
      const std::string at = setting(result.axes, trial.at);
      std::string what = value_text(*result.asked, trial);
      if (what != trial.remark) what += "; " + trial.remark;
      out += fmt::format("{}{}: {}\n", outcome.column, at.empty() ? "" : " at " + at, what);
    }
  }
  return out;
}

cli::JUnitCase junit_case(const std::string& asset, const CaseResult& result, Strictness strictness) {
  cli::JUnitCase one{asset, result.asked->name, {}, {}, {}, to_line(result, strictness)};
  const Verdict verdict = verdict_of(result, strictness);
  if (verdict == Verdict::broken) {
    one.failure = {result.asked->measured + "; limit " + result.asked->limit, failures(result, strictness)};
  } else if (verdict == Verdict::skipped) {
    one.skipped = result.outcomes.empty() ? "no column" : result.outcomes[0].trials[0].remark;
  }
  return one;
}

// "1000, 60 and 10".
std::string listed(const std::vector<double>& values) {
  std::string text;
  for (std::size_t i = 0; i < values.size(); ++i)
    text += fmt::format("{}{:g}", i == 0 ? "" : i + 1 == values.size() ? " and " : ", ", values[i]);
  return text;
}

std::string stiffness_part(const AssetResult& result) {
  const Outcome* const bound = find_column(result, "penalty_bound_plane", "penalty loop");
  if (bound == nullptr) return "";
  std::string text;
  for (const Trial& trial : bound->trials) {
    if (trial.verdict == Verdict::skipped) continue;
    const double stiffness = std::strtod(trial.remark.c_str(), nullptr);
    text += fmt::format("{}{:.2e} N/m at {:g} Hz ({:.3g} ms, {:.2f} of theory)", text.empty() ? "" : ", ", stiffness,
                        trial.at[0], 1000 / trial.at[0], trial.value);
  }
  return fmt::format("{:g} kg in a penalty loop is stable to {}", result.mass, text);
}

// At rest a body is on the plane and stays still there.
std::string rest_part(const AssetResult& result) {
  const Outcome* const depth = find_column(result, "rest_depth", "ours");
  const Outcome* const jitter = find_column(result, "rest_jitter", "ours");
  if (depth == nullptr || jitter == nullptr) return "";
  std::vector<double> rests;
  std::vector<double> does_not;
  double step = 0;  // largest step that holds together with all smaller ones. [s]
  for (std::size_t i = 0; i < depth->trials.size() && i < jitter->trials.size(); ++i) {
    const bool held = depth->trials[i].verdict == Verdict::held && jitter->trials[i].verdict == Verdict::held;
    const double rate = depth->trials[i].at[0];
    (held ? rests : does_not).push_back(rate);
    if (held && does_not.empty()) step = 1 / rate;
  }
  if (rests.empty()) return fmt::format("does not rest in Bullet at {} Hz", listed(does_not));
  return fmt::format("rests in Bullet at {} Hz{}{}", listed(rests),
                     does_not.empty() ? "" : ", not at " + listed(does_not) + " Hz",
                     step > 0 ? fmt::format(": up to a step of {:.3g} ms", 1000 * step) : "");
}

// Lists the highest speed and the thinnest wall there for which all slower and thicker trials hold, with those trials.
std::string impact_part(const AssetResult& result, const char* column, const char* how) {
  const Outcome* const impact = find_column(result, "impact_baked", column);
  if (impact == nullptr) return "";
  const auto is_milder = [](const Trial& trial, const Trial& than) {
    return trial.at[0] <= than.at[0] && trial.at[1] >= than.at[1];
  };
  const Trial* best = nullptr;
  for (const Trial& candidate : impact->trials) {
    const bool holds = std::all_of(impact->trials.begin(), impact->trials.end(), [&](const Trial& trial) {
      return !is_milder(trial, candidate) || trial.verdict == Verdict::held;
    });
    if (!holds) continue;
    if (best == nullptr || candidate.at[0] > best->at[0] ||
        (candidate.at[0] == best->at[0] && candidate.at[1] < best->at[1])) {
      best = &candidate;
    }
  }
  if (best == nullptr) return fmt::format("passes through walls {}", how);
  std::vector<double> speeds;
  std::vector<double> walls;
  for (const Trial& trial : impact->trials) {
    if (trial.at[1] == best->at[1] && is_milder(trial, *best)) speeds.push_back(trial.at[0]);
    if (trial.at[0] == best->at[0] && is_milder(trial, *best)) walls.push_back(trial.at[1]);
  }
  return fmt::format("is stopped at {} m/s by walls of {} voxels {}", listed(speeds), listed(walls), how);
}

}  // namespace

std::string to_line(const CaseResult& result, Strictness strictness) {
  std::string line = fmt::format("{:<8} {:<22}", describe(verdict_of(result, strictness)), result.asked->name);
  for (std::size_t i = 0; i < result.outcomes.size(); ++i)
    line += (i == 0 ? " " : "; ") + outcome_text(result, result.outcomes[i]);
  return result.outcomes.empty() ? line + " no column" : line;
}

std::string certificate(const AssetResult& result, Strictness strictness) {
  std::string text;
  for (const std::string& part :
       {stiffness_part(result), rest_part(result), impact_part(result, "ours", "as bodies are by default"),
        impact_part(result, "continuous", "with ContinuousMotion")}) {
    if (!part.empty()) text += (text.empty() ? "" : "; ") + part;
  }
  const auto broken = std::count_if(result.cases.begin(), result.cases.end(),
                                    [&](const CaseResult& one) { return is_broken(one, strictness); });
  text += fmt::format("{}{} of {} cases broken", text.empty() ? "" : "; ", broken, result.cases.size());
  return fmt::format("certificate: {}: {}", result.asset, text);
}

ordered_json to_json(const std::vector<AssetResult>& results, const ordered_json& provenance, Strictness strictness) {
  ordered_json j = provenance;
  j["strict"] = strictness == Strictness::strict;
  j["assets"] = ordered_json::array();
  for (const AssetResult& result : results) {
    ordered_json asset = {{"asset", result.asset},
                          {"mass", result.mass},
                          {"length", result.size},
                          {"voxel_size", result.voxel},
                          {"points", result.points},
                          {"peers", ordered_json::object()},
                          {"certificate", certificate(result, strictness)},
                          {"cases", ordered_json::array()}};
    for (const auto& [column, from] : result.peers) asset["peers"][column] = from;
    for (const CaseResult& one : result.cases) asset["cases"].push_back(to_json(one, strictness));
    j["assets"].push_back(std::move(asset));
  }
  return j;
}

std::string to_junit(const std::vector<AssetResult>& results, const ordered_json& provenance, Strictness strictness) {
  std::vector<cli::JUnitSuite> suites;
  for (const AssetResult& result : results) {
    suites.push_back({result.asset, {}, {}});
    for (const CaseResult& one : result.cases) suites.back().cases.push_back(junit_case(result.asset, one, strictness));
  }
  return cli::to_junit(suites, provenance);
}

}  // namespace vps::stress
