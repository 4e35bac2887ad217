// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Estimates how much of a long work is done, and how long the rest takes, from the fractions that it reports.
#pragma once

#include <deque>

namespace vps::cli {

/// Corrects itself while the work runs. What it shows rises at every later time, and stays below 1 until 1 is reported.
class Estimate {
 public:
  struct Shown {
    double fraction = 0;
    double left = -1;  ///< [s]; below 0: not known yet
  };

  /// @param fraction  done, 0 to 1. Lower ones than before are ignored.
  /// @param time  since the work began; never falls. [s]
  void report(double fraction, double time);
  /// @param time  as above
  [[nodiscard]] Shown at(double time);

 private:
  struct Report {
    double fraction = 0, time = 0;
  };
  [[nodiscard]] double pace() const;  // [1/s]

  double reported_ = 0, reported_at_ = 0;
  std::deque<Report> reports_;
  double shown_ = 0, shown_at_ = 0;
};

}  // namespace vps::cli
