// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Plays a body on a box in stock Bullet and times every step.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "cli/lab/bullet.h"
#include "cli/lab/statistics.h"

namespace vps::lab {

/// What is timed of a body of 1 kg on a btBoxShape, at 240 Hz.
enum class Scene : std::uint8_t {
  landing,  ///< thrown in several rotations from a quarter of its length, at most 1 m: half a second from its first
            ///< contact on
  resting,  ///< laid down in the same rotations: half a second after a second
  flat,     ///< laid on its most stable flat side: half a second after a second; not played without such a side
};
inline constexpr std::array kScenes = {Scene::landing, Scene::resting, Scene::flat};
/// "landing", "resting", "flat".
[[nodiscard]] const char* describe(Scene scene);

/// Times of a scene's steps. No rounds: not played.
struct StepTimes {
  Times whole;        ///< of the whole step
  Times narrowphase;  ///< of the narrowphase within it
};

struct SceneTimes {
  std::array<StepTimes, kScenes.size()> scenes;  ///< by Scene
  std::string failure;                           ///< why no scene counts, such as a fall through the box; empty: none
  /// Whole steps of the scene with the largest 99th percentile. No rounds: nothing was played.
  [[nodiscard]] const Times& dearest() const;
};

/// A shape to play with. Called in every round, so that the measured noise includes the effect of memory layout.
struct Player {
  std::string name;
  std::function<BulletShape()> make;  ///< empty: not played
};

struct SceneOptions {
  double voxel = 0;                ///< split impulses start at twice this. [Limits: value > 0] [Units: m]
  std::vector<btVector3> corners;  ///< of the body's convex hull, about its centre of mass. [m]
  int rotations = 8;               ///< [Limits: value > 0]
  int rounds = 5;                  ///< [Limits: value > 0]
  std::uint64_t seed = 1;          ///< of the rotations
  /// `fraction`: 0 to 1. May be empty.
  std::function<void(const std::string& player, double fraction)> progress;
};

/// Every round plays the scenes with all players in turn, twice. A scene repeats to the bit: a step's time in a round
/// is the shorter of the two, and its time the median of the rounds. A player that takes longer than a second is played
/// once.
[[nodiscard]] std::vector<SceneTimes> play_in_turn(std::span<const Player> players, const SceneOptions& options);

}  // namespace vps::lab
