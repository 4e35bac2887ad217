// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Curves of cost over size: measured in rounds, fitted by a power, printed as Markdown. Steepest curve first.
#pragma once

#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace vps::bench {

using Times = std::vector<double>;  ///< [us]

/// A sample of a curve.
struct Job {
  std::string curve;
  std::string column;  ///< name of the size
  double size = 0;
  std::function<Times()> run;
  Times us{};  ///< of all rounds
};

struct Section {
  static constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  std::string title;
  std::string size_name;  ///< "points"
  std::vector<Job> jobs{};
  double most_exponent = kNoLimit;  ///< target of a curve's last two samples
  double most_us = kNoLimit;        ///< target of a curve's slowest sample; with it rows are ordered by time
  std::string judged{};             ///< the targets are those of curves whose names begin with this
};

/// "TITLE, CURVE, COLUMN", in which --only searches.
[[nodiscard]] std::string name_of(const Section& section, const Job& job);
[[nodiscard]] double median(const Times& us);
/// Runs all jobs in turn in every round.
void measure(Section& section, int rounds);
/// @param json  gets each sample and each exponent
[[nodiscard]] std::string markdown(const Section& section, nlohmann::ordered_json& json);

}  // namespace vps::bench
