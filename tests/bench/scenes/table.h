// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Rows of the benchmark by scenes, as Markdown and as JSON. Worst rows first.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/bench/scenes/scenes.h"

namespace vps::bench {

/// Of the narrowphase of a step. [us]
struct StepTimes {
  double median = 0, p99 = 0, max = 0;
  std::vector<double> starts{};  ///< median of each start
};

/// A side in a phase of a scene.
struct TimeRow {
  std::string scene, phase, side;
  Kind kind = Kind::baked;
  std::vector<StepTimes> times;  ///< one for each instruction set; Bullet's own shapes have one
};

/// A side in a scene.
struct QualityRow {
  std::string scene, side;
  Kind kind = Kind::baked;
  double voxel = 0;  ///< of the finest shape. [m]
  Quality quality;
  /// The worst of: depth in the last fifth in voxels, drift in mm/s, energy gained in hundredths of what was released,
  /// hundredths of the play in which a stack lay.
  [[nodiscard]] double badness() const;
};

struct Table {
  std::vector<std::string> sets;  ///< instruction sets
  std::vector<TimeRow> times;
  std::vector<QualityRow> qualities;
  [[nodiscard]] std::string markdown() const;
  [[nodiscard]] nlohmann::ordered_json json() const;

 private:
  /// Median of the baked row over that of the first side of a kind in the same scene and phase.
  [[nodiscard]] std::optional<double> ratio(const TimeRow& row, Kind kind) const;
  /// Ratio to the first of hull, box, HACD that plays the scene.
  [[nodiscard]] double first_ratio(const TimeRow& row) const;
};

}  // namespace vps::bench
