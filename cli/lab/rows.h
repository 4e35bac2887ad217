// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The rows of a report, and which of them no other beats.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/lab/errors.h"
#include "cli/lab/peers.h"
#include "cli/lab/settings.h"

namespace vps::lab {

/// One point of the plots: a setting of ours, or a peer.
struct Row {
  std::string name;
  std::string series;
  std::string knob;    ///< of Setting; "bullet": a setting of another row, asked in Bullet; "peer"
  std::string remark;  ///< what the row is; may be empty
  Way way = Way::query;
  DepthOf depth_of = DepthOf::bodies;
  std::optional<Setting> setting;  ///< nothing: a peer
  std::size_t bytes = 0;           ///< of the asset's file; 0: there is none
  std::size_t points = 0;
  double field_bound = 0;      ///< of the certificate. [m]
  double covering_radius = 0;  ///< [m]
  double bake_seconds = 0;     ///< without the import; 0: not baked
  Times contacts;              ///< of all poses
  Times distances;             ///< of the poses apart
  Errors errors;
  Spread distance;       ///< error; of none asked: tells no distance in this row
  Held separation_held;  ///< bounds of `separation`, over all poses
  Held budget_held;      ///< delta_bound, with a level or a budget
};

enum class Cost : std::uint8_t { time, bytes };

/// Of the rows that are asked in one way: what no other has as little or less of in both RMS error of penetration in
/// contact and cost.
struct Front {
  struct Member {
    std::size_t row = 0;
    bool tied = false;  ///< its cost and that of the member before are within the noise of both
  };
  Way way = Way::query;
  Cost cost = Cost::time;         ///< the median time of a query, or the file
  std::vector<Member> members;    ///< from the cheapest
  std::vector<LeftOut> left_out;  ///< rows of this way that were not compared
};

[[nodiscard]] const char* describe(Way way);        ///< "bare query", "in Bullet"
[[nodiscard]] const char* describe(DepthOf depth);  ///< "bodies", "pairs of hulls", "pairs of triangles"

/// Bare queries by time, whole collisions in Bullet by time, files by size.
[[nodiscard]] std::vector<Front> find_fronts(std::span<const Row> rows);

}  // namespace vps::lab
