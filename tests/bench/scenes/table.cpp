// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/scenes/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/bench/query_report.h"

namespace vps::bench {
namespace {

constexpr Kind kOthers[] = {Kind::hull, Kind::hacd, Kind::box};

std::string header(const std::vector<std::string>& cells) {
  return row(cells) + row(std::vector<std::string>(cells.size(), "---"));
}

std::string known(double value, double scale) {
  return std::isnan(value) ? "" : number(scale * value);
}

// Least and greatest median of the starts; empty with one start.
std::string span_of(const std::vector<double>& starts) {
  if (starts.size() < 2) return "";
  const auto [least, most] = std::minmax_element(starts.begin(), starts.end());
  return fmt::format("{} to {}", number(*least), number(*most));
}

std::string least_and_mean(const std::vector<double>& of) {
  if (of.empty()) return "";
  const double sum = std::accumulate(of.begin(), of.end(), 0.0);
  return fmt::format("{}, {}", number(*std::min_element(of.begin(), of.end())), number(sum / double(of.size())));
}

nlohmann::ordered_json json_number(double value) {
  return std::isnan(value) ? nlohmann::ordered_json() : nlohmann::ordered_json(value);
}

// Rows in order of a key that falls.
template <class Row, class Key>
std::vector<const Row*> worst_first(const std::vector<Row>& rows, Key key) {
  std::vector<const Row*> out;
  for (const Row& r : rows) out.push_back(&r);
  std::stable_sort(out.begin(), out.end(), [&](const Row* a, const Row* b) { return key(*a) > key(*b); });
  return out;
}

}  // namespace

double QualityRow::badness() const {
  double worst = 0;
  for (const double part :
       {quality.deepest_late / voxel, 1000 * quality.drift, 100 * quality.gain / quality.released}) {
    if (part > worst) worst = part;
  }
  for (const double stands : quality.stands) worst = std::max(worst, 100 * (1 - stands / quality.played));
  return worst;
}

std::optional<double> Table::ratio(const TimeRow& row, Kind kind) const {
  const auto other = std::find_if(times.begin(), times.end(), [&](const TimeRow& t) {
    return t.kind == kind && t.scene == row.scene && t.phase == row.phase;
  });
  if (other == times.end()) return {};
  return row.times[0].median / other->times[0].median;
}

double Table::first_ratio(const TimeRow& row) const {
  for (const Kind kind : {Kind::hull, Kind::box, Kind::hacd}) {
    if (const auto found = ratio(row, kind)) return *found;
  }
  return 0;
}

std::string Table::markdown() const {
  std::vector<std::string> head = {"scene", "baked side", "/ hull", "/ HACD", "/ box"};
  for (std::size_t i = 0; i < sets.size(); ++i) {
    head.push_back(sets[i] + ": median, us");
    head.insert(head.end(), {"of starts", "99 %", "max"});
  }
  std::string out = header(head);
  const auto time_cells = [](std::vector<std::string>& cells, const TimeRow& r) {
    for (const StepTimes& t : r.times) {
      cells.insert(cells.end(), {number(t.median), span_of(t.starts), number(t.p99), number(t.max)});
    }
  };
  for (const TimeRow* r : worst_first(times, [this](const TimeRow& t) { return first_ratio(t); })) {
    if (r->kind != Kind::baked) continue;
    std::vector<std::string> cells = {r->scene + " " + r->phase, r->side};
    for (const Kind kind : kOthers) {
      const auto found = ratio(*r, kind);
      cells.push_back(found ? number(*found) : "");
    }
    time_cells(cells, *r);
    out += row(cells);
  }
  out += "\n" + header({"scene", "side", "median, us", "of starts", "99 %", "max"});
  for (const TimeRow& r : times) {
    if (r.kind == Kind::baked) continue;
    std::vector<std::string> cells = {r.scene + " " + r.phase, r.side};
    time_cells(cells, r);
    out += row(cells);
  }
  out += "\n" + header({"scene", "side", "deepest, mm", "in the last fifth, mm", "of start", "drift, mm/s", "of start",
                        "median of starts", "energy gained, mJ", "% of released", "stands, s: least, mean"});
  for (const QualityRow* r : worst_first(qualities, [](const QualityRow& q) { return q.badness(); })) {
    const Quality& q = r->quality;
    if (std::isnan(q.deepest)) continue;
    out += row({r->scene, r->side, number(1000 * q.deepest), number(1000 * q.deepest_late),
                std::to_string(q.deepest_play), known(q.drift, 1000),
                std::isnan(q.drift) ? "" : std::to_string(q.drift_play), known(lab::percentile(q.drifts, 0.5), 1000),
                number(1000 * q.gain), known(q.gain / q.released, 100), least_and_mean(q.stands)});
  }
  return out;
}

nlohmann::ordered_json Table::json() const {
  nlohmann::ordered_json out;
  for (const TimeRow& r : times) {
    nlohmann::ordered_json entry{{"scene", r.scene}, {"phase", r.phase}, {"side", r.side}};
    for (std::size_t i = 0; i < r.times.size(); ++i) {
      const StepTimes& t = r.times[i];
      entry["times"][r.kind == Kind::baked ? sets[i] : "any"] = {
          {"median_us", t.median}, {"p99_us", t.p99}, {"max_us", t.max}, {"starts_us", t.starts}};
    }
    if (r.kind == Kind::baked) {
      const std::string names[] = {"hull", "HACD", "box"};
      for (std::size_t i = 0; i < 3; ++i) {
        if (const auto found = ratio(r, kOthers[i])) entry["ratios"][names[i]] = *found;
      }
    }
    out["times"].push_back(entry);
  }
  for (const QualityRow& r : qualities) {
    const Quality& q = r.quality;
    out["quality"].push_back({{"scene", r.scene},
                              {"side", r.side},
                              {"voxel_m", r.voxel},
                              {"deepest_m", json_number(q.deepest)},
                              {"deepest_late_m", json_number(q.deepest_late)},
                              {"deepest_start", q.deepest_play},
                              {"drift_m_per_s", json_number(q.drift)},
                              {"drift_start", q.drift_play},
                              {"drifts_m_per_s", q.drifts},
                              {"stands_s", q.stands},
                              {"energy_gained_j", json_number(q.gain)},
                              {"energy_released_j", json_number(q.released)}});
  }
  return out;
}

}  // namespace vps::bench
