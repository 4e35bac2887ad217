// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/stress/stress.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vps::stress {
namespace {

// The solver explains a value that is at most this many times as bad as that of Bullet's own boxes or hull.
constexpr double kAsBullets = 1.5;

// How near a trial is to its limit; 1: at the limit.
double utilisation(const Trial& trial) {
  if (trial.verdict == Verdict::skipped) return -std::numeric_limits<double>::infinity();
  if (!std::isfinite(trial.value)) return std::numeric_limits<double>::infinity();
  // Both limits are equal, as for a value that is cut off there: it does not show how near the trial was.
  if (trial.least == trial.limit && trial.verdict == Verdict::held) return 0;
  const double above = trial.limit > 0 ? trial.value / trial.limit : trial.value - trial.limit;
  double below = 0;
  if (trial.least > 0) below = trial.value > 0 ? trial.least / trial.value : std::numeric_limits<double>::infinity();
  return std::max(above, below);
}

// Larger for worse verdicts; smallest where nothing was run.
int severity(const Trial& trial) {
  return trial.verdict == Verdict::skipped ? -1 : int(trial.verdict);
}

std::vector<Axis> axes_of(const Case& asked, Effort effort) {
  std::vector<Axis> axes = asked.axes;
  for (Axis& axis : axes) {
    if (effort == Effort::quick && !axis.quick.empty()) axis.values = axis.quick;
  }
  return axes;
}

// Every combination, the last axis fastest; one empty combination without axes.
std::vector<std::vector<double>> settings(const std::vector<Axis>& axes) {
  std::vector<std::vector<double>> all{{}};
  for (const Axis& axis : axes) {
    std::vector<std::vector<double>> longer;
    for (const auto& one : all) {
      for (const double value : axis.values) {
        longer.push_back(one);
        longer.back().push_back(value);
      }
    }
    all = std::move(longer);
  }
  return all;
}

// Why a case cannot be run with this asset; empty when it can.
std::string missing(const Case& asked, const Subject& subject) {
  if (!subject.asset->has_pointshell()) return "the asset has no pointshell";
  if (asked.needs == Requirement::both && !subject.asset->has_voxelmap()) return "the asset has no voxelmap";
  if (asked.needs == Requirement::mesh && !subject.mesh) return why_no_mesh(*subject.asset);
  return "";
}

Outcome run_column(const Case& asked, const Subject& subject, const Column& column, const std::vector<Axis>& axes) {
  Outcome out;
  out.column = column.name;
  out.ours = column.ours;
  out.promised = column.ours && !(asked.needs_continuous && column.detection == Detection::discrete);
  const std::string why = missing(asked, subject);
  for (const std::vector<double>& at : settings(axes)) {
    Trial trial;
    if (!why.empty()) {
      trial = skipped(why);
    } else if (asked.alone.empty() && column.body.shape == nullptr) {
      trial = skipped(column.absent);
    } else {
      trial = asked.run(subject, column, at);
    }
    trial.at = at;
    out.trials.push_back(std::move(trial));
  }
  for (std::size_t i = 0; i < out.trials.size(); ++i) {
    const Trial& trial = out.trials[i];
    const Trial& worst = out.trials[out.worst];
    if (std::pair(severity(trial), utilisation(trial)) > std::pair(severity(worst), utilisation(worst))) out.worst = i;
    // The worst verdict of the trials that were run.
    const bool first = out.verdict == Verdict::skipped;
    if (trial.verdict != Verdict::skipped && (first || trial.verdict > out.verdict)) out.verdict = trial.verdict;
  }
  return out;
}

}  // namespace

const char* why_no_mesh(const Asset& asset) {
  return asset.has_voxelmap() ? "an asset holds no mesh, and this one's walls are too thin for its voxels to make one "
                                "of its field; give it with --mesh"
                              : "an asset holds no mesh, and this one no voxelmap to make one of; give it with --mesh";
}

const char* describe(Verdict verdict) {
  switch (verdict) {
    case Verdict::held:
      return "held";
    case Verdict::solver:
      return "solver";
    case Verdict::broken:
      return "broken";
    case Verdict::shown:
      return "shown";
    case Verdict::skipped:
      return "skipped";
  }
  return "";
}

void judge(Trial& trial, double value, double limit) {
  trial.value = value;
  trial.limit = limit;
  trial.verdict = value <= limit && value >= trial.least ? Verdict::held : Verdict::broken;
}

bool is_as_bullets(double value, double limit, double of_bullets) {
  return std::isfinite(value) ? !(of_bullets <= limit) && !(value > kAsBullets * of_bullets)
                              : !std::isfinite(of_bullets);
}

void judge_beside(Trial& trial, double value, double limit, double of_bullets) {
  judge(trial, value, limit);
  if (trial.verdict == Verdict::broken && is_as_bullets(value, limit, of_bullets)) trial.verdict = Verdict::solver;
}

void judge_standing(Trial& trial, double seconds, double asked, double of_boxes) {
  trial.least = asked;
  judge(trial, seconds, std::numeric_limits<double>::infinity());
  const bool as_boxes = of_boxes < asked && seconds * kAsBullets >= of_boxes;
  if (trial.verdict == Verdict::broken && as_boxes) trial.verdict = Verdict::solver;
}

Trial skipped(std::string why) {
  Trial trial;
  trial.remark = std::move(why);
  return trial;
}

const std::vector<Case>& all_cases() {
  static const std::vector<Case> cases = [] {
    std::vector<Case> all;
    add_penalty_cases(all);
    add_rest_cases(all);
    add_pile_cases(all);
    add_impact_cases(all);
    add_energy_cases(all);
    add_scale_cases(all);
    return all;
  }();
  return cases;
}

CaseResult run_case(const Case& asked, const Subject& subject, Effort effort) {
  CaseResult result{&asked, axes_of(asked, effort), {}};
  if (!asked.alone.empty()) {
    Column only;
    only.name = asked.alone;
    only.ours = true;
    result.outcomes.push_back(run_column(asked, subject, only, result.axes));
    return result;
  }
  for (const Column& column : subject.columns) {
    result.outcomes.push_back(run_column(asked, subject, column, result.axes));
  }
  return result;
}

bool counts(const Outcome& outcome, Strictness strictness) {
  return strictness == Strictness::strict ? outcome.ours : outcome.promised;
}

bool is_broken(const CaseResult& result, Strictness strictness) {
  return std::any_of(result.outcomes.begin(), result.outcomes.end(), [&](const Outcome& one) {
    return counts(one, strictness) &&
           (one.verdict == Verdict::broken || (strictness == Strictness::strict && one.verdict == Verdict::solver));
  });
}

Verdict verdict_of(const CaseResult& result, Strictness strictness) {
  if (is_broken(result, strictness)) return Verdict::broken;
  Verdict verdict = Verdict::skipped;
  bool was_run = false;
  for (const Outcome& one : result.outcomes) {
    if (one.verdict == Verdict::skipped) continue;
    was_run = true;
    if (!counts(one, strictness)) continue;
    verdict = verdict == Verdict::skipped ? one.verdict : std::max(verdict, one.verdict);
  }
  return verdict == Verdict::skipped && was_run ? Verdict::shown : verdict;
}

}  // namespace vps::stress
