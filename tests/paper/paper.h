// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The paper's experiments. Each returns JSON, from which paper.py makes tables and figures. Lengths are in
/// metres and times in microseconds, unless a name says otherwise.
#pragma once

#include <nlohmann/json.hpp>

#include "tests/paper/bodies.h"

namespace vps::paper {

/// Sec. 4.1: heights (Fig. 6) and deepest penetrations (Table 1) of a ball dropped on a plane.
[[nodiscard]] nlohmann::json run_ball(const Balls& balls, const std::vector<Floor>& floors);

/// Sec. 4.2.1: time, speed and energy of each step of a dropped bunny (Figs. 8 and 10).
[[nodiscard]] nlohmann::json run_bunny(const Bunnies& bunnies, const std::vector<Floor>& floors);

/// Table 2: time by segmentation level, over initial rotations.
[[nodiscard]] nlohmann::json run_levels(const Bunnies& bunnies, const std::vector<Floor>& floors);

/// Sec. 4.2.2: how deep the bunny sinks at low rates, and whether it stays on the plane.
[[nodiscard]] nlohmann::json run_low_rates(const Bunnies& bunnies, const std::vector<Floor>& floors);

/// Sec. 4.1, last paragraph: how long stacks stand.
[[nodiscard]] nlohmann::json run_stacks(const Balls& balls, const Bunnies& bunnies, const std::vector<Floor>& floors);

}  // namespace vps::paper
