// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The rows of a report, and their Pareto fronts.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/lab/errors.h"
#include "cli/lab/peers.h"
#include "cli/lab/scene_steps.h"
#include "cli/lab/settings.h"

namespace vps::lab {

/// One point of the plots: a setting of this library, or another library.
struct Row {
  std::string name;
  std::string series;
  std::string knob;    ///< of Setting; "bullet": another row's setting, queried in Bullet; "peer": another library
  std::string remark;  ///< describes the row; may be empty
  Way way = Way::query;
  DepthOf depth_of = DepthOf::bodies;
  std::optional<Setting> setting;  ///< nothing: another library
  std::size_t bytes = 0;           ///< of the asset's file; 0: no asset
  std::size_t points = 0;
  double field_bound = 0;      ///< error bound of the field's certificate. [m]
  double covering_radius = 0;  ///< [m]
  double bake_seconds = 0;     ///< without the import; 0: not baked
  Times contacts;              ///< contact queries, over all poses
  Times distances;             ///< distance queries, over the poses apart
  SceneTimes steps;            ///< of rows in Bullet
  Errors errors;
  Spread distance;       ///< error of the distance; `asked` is 0 where the row has no distance
  Held separation_held;  ///< bounds of `separation`, over all poses
  Held budget_held;      ///< `delta_bound`, for rows with a level or a budget
};

enum class Cost : std::uint8_t {
  time,   ///< the median time of a query
  bytes,  ///< the file's size
  step,   ///< 99 % of the whole steps, in the scene that takes longest
};

/// The Pareto front of the rows that are queried in one way, by cost and RMS error of penetration in contact.
struct Front {
  struct Member {
    std::size_t row = 0;
    bool tied = false;  ///< its cost differs from that of the member before by no more than the noise
  };
  Way way = Way::query;
  Cost cost = Cost::time;
  std::vector<Member> members;    ///< from the cheapest
  std::vector<LeftOut> left_out;  ///< rows of this way that were not compared
};

[[nodiscard]] const char* describe(Way way);        ///< "bare query", "in Bullet"
[[nodiscard]] const char* describe(DepthOf depth);  ///< "bodies", "pairs of hulls", "pairs of triangles"

/// Bare queries by time, whole collisions in Bullet by time, files by size, whole steps in Bullet.
[[nodiscard]] std::vector<Front> find_fronts(std::span<const Row> rows);

}  // namespace vps::lab
