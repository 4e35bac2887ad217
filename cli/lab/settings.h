// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The settings of bakes and queries that a report sweeps, around a base. Deterministic.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "cli/lab/other_reading.h"
#include "runtime/vps_runtime.h"

namespace vps::lab {

/// One point of a plot.
struct Setting {
  std::string name;    ///< unique in a sweep: the settings in words
  std::string series;  ///< in plots: "scaled", "real", "layers" ...
  /// The setting that differs from the base: base, voxel, alpha, voxel_alpha, field, precision, branching, level, tests
  /// or time.
  std::string knob;
  bake::BakeOptions bake;  ///< with one field
  Reading reading = Reading::queries;
  std::uint32_t level = 0;  ///< of QueryOptions, as are the next two
  std::uint32_t max_tests = 0;
  float max_microseconds = 0;

  /// Whether the answers do not depend on a clock.
  [[nodiscard]] bool repeatable() const { return max_microseconds == 0; }
};

/// The size of a sweep.
enum class SweepSize : std::uint8_t { full, quick };

/// "layers", "scaled" or "real".
[[nodiscard]] const char* describe(Field field);

/// The base with another field.
[[nodiscard]] bake::BakeOptions with_field(bake::BakeOptions base, Field field);
[[nodiscard]] Field field_of(const bake::BakeOptions& options);

/// The base comes first.
/// @param base    with a voxel size; its fields do not matter
/// @param levels  of the base's point-sphere tree
[[nodiscard]] std::vector<Setting> sweep(const bake::BakeOptions& base, std::uint32_t levels, SweepSize size);

}  // namespace vps::lab
