// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Finds the setting to bake with, for limits on error, time and bytes, by measured trial bakes.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "cli/lab/assets.h"
#include "cli/lab/scene_steps.h"
#include "cli/lab/truth.h"

namespace vps::lab {

/// 0: no limit.
struct Limits {
  double error = 0;         ///< of queries, and of the field by its certificate. [m]
  double microseconds = 0;  ///< of 99 % of the whole steps in the scene that takes longest, with the noise
  double bytes = 0;         ///< size of the asset's file
  double missed = 0;        ///< depth of a missed contact. [m]
};

struct RecommendOptions {
  bake::BakeOptions base;  ///< the repair and so on; voxel size and alpha are ignored
  Limits limits;           ///< `missed` is ignored
  RecordOf record;         ///< may be empty
  std::size_t poses = 90;  ///< two thirds in contact, the rest apart
  std::uint64_t seed = 1;
  int rounds = 5;
  std::filesystem::path cache;                                             ///< folder for poses; empty: none is kept
  std::function<void(const std::string& what, double fraction)> progress;  ///< may be empty
};

/// A setting that was baked and measured.
struct Tried {
  bake::BakeOptions bake;
  std::size_t bytes = 0;
  std::size_t points = 0;
  double field_bound = 0;     ///< [m]
  Spread penetration;         ///< error of `traverse` in contact. [m]
  std::size_t missed = 0;     ///< contacts
  double deepest_missed = 0;  ///< depth of the deepest missed contact. [m]
  Spread distance;            ///< error of `separation`. [m]
  SceneTimes steps;
  /// The largest error of field, penetration and distance. [m]
  [[nodiscard]] double error() const;
  /// Whether it misses a contact that is deeper than its error: then the error says too little, and it is not advised.
  [[nodiscard]] bool misses_beyond_error() const;
  /// Time within which 99 % of the whole steps end in the scene that takes longest, with the noise. [us]
  [[nodiscard]] double slowest() const { return steps.dearest().p99 + steps.dearest().noise_p99; }
  /// The limits that it exceeds, in words; empty when it keeps all.
  [[nodiscard]] std::vector<std::string> exceeds(const Limits& limits) const;
};

struct Recommendation {
  TruthOptions truth;
  Limits limits;                      ///< as asked; `missed` is half of the limit on the error or of the deepest pose
  std::size_t poses[3] = {0, 0, 0};   ///< found, by range
  std::vector<Tried> tried;           ///< by bytes, the smallest first
  std::optional<std::size_t> chosen;  ///< of `tried`; nothing when none keeps the limits
  std::size_t nearest = 0;  ///< of `tried`: `chosen`, or else the one that exceeds its limits by the smallest factor
};

/// Sorts the settings that were tried, and chooses among those that keep all limits: with a limit on the error, the one
/// with the fastest steps, and of those that are as fast within the noise the smallest file; without, the smallest
/// error.
void choose(Recommendation& recommendation);

/// Tries settings until it can choose one.
/// @param mesh  as imported
/// @throw BakeError, MeasureError, std::runtime_error
[[nodiscard]] Recommendation recommend(const TriangleMesh& mesh, const RecommendOptions& options);

}  // namespace vps::lab
