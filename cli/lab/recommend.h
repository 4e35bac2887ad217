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
#include "cli/lab/rounds.h"
#include "cli/lab/truth.h"

namespace vps::lab {

/// 0: no limit.
struct Limits {
  double error = 0;         ///< of queries, and of the field by its certificate. [m]
  double microseconds = 0;  ///< of a contact query, for 99 % of the poses, with the noise
  double bytes = 0;         ///< size of the asset's file
};

struct RecommendOptions {
  bake::BakeOptions base;  ///< the repair and so on; voxel size and alpha are ignored
  Limits limits;
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
  double field_bound = 0;  ///< [m]
  Spread penetration;      ///< error of `traverse` in contact. [m]
  std::size_t missed = 0;  ///< contacts
  Spread distance;         ///< error of `separation`. [m]
  Times contacts;          ///< [us]
  /// The largest error of field, penetration and distance. [m]
  [[nodiscard]] double error() const;
  /// Time within which 99 % of the contact queries end, with the noise. [us]
  [[nodiscard]] double slowest() const { return contacts.p99 + contacts.noise_p99; }
  /// The limits that it exceeds, in words; empty when it keeps all.
  [[nodiscard]] std::vector<std::string> exceeds(const Limits& limits) const;
};

struct Recommendation {
  TruthOptions truth;
  std::size_t poses[3] = {0, 0, 0};   ///< found, by range
  std::vector<Tried> tried;           ///< by bytes, the smallest first
  std::optional<std::size_t> chosen;  ///< of `tried`; nothing when none keeps the limits
  std::size_t nearest = 0;  ///< of `tried`: `chosen`, or else the one that exceeds its limits by the smallest factor
};

/// Chooses among the settings that keep all limits: with a limit on the error, the smallest file; without, the smallest
/// error.
/// @param mesh  as imported
/// @throw BakeError, MeasureError, std::runtime_error
[[nodiscard]] Recommendation recommend(const TriangleMesh& mesh, const RecommendOptions& options);

}  // namespace vps::lab
