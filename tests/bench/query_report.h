// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Percentiles, ratios and targets of the query benchmarks, as Markdown and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/lab/statistics.h"

namespace vps::bench {

using lab::percentile;
/// Formats with three digits, as no more are reproducible.
[[nodiscard]] std::string number(double value);
/// A row of a Markdown table.
[[nodiscard]] std::string row(const std::vector<std::string>& cells);

/// Times of one side for one kind of work.
struct Series {
  std::string work;
  std::string side;  ///< "HACD", "ours, 35,000 points" ...
  std::vector<double> microseconds;
  std::vector<double> contacts;      ///< per query; empty: not reported
  std::vector<double> depth_errors;  ///< |reported - oracle's|; empty: not reported. [m]
  std::string remark;
};

/// At most `factor` times the median of `peer` in the same work; without a peer, at most `factor` microseconds.
struct Target {
  std::string work;
  std::string peer;
  double factor = 0;
};

class Report {
 public:
  explicit Report(std::vector<Target> targets) : targets_(std::move(targets)) {}
  void add(Series series) { series_.push_back(std::move(series)); }
  /// Ratios of this project's medians to those of each peer, with the targets.
  [[nodiscard]] std::string ratio_table() const;
  [[nodiscard]] std::string time_table() const;
  [[nodiscard]] nlohmann::json json() const;

 private:
  [[nodiscard]] const Series* find(const std::string& work, const std::string& side) const;
  [[nodiscard]] std::string verdicts(const Series& ours) const;
  std::vector<Target> targets_;
  std::vector<Series> series_;
};

}  // namespace vps::bench
