// SPDX-License-Identifier: Zlib
// Checks the header's scalars. Queries compute with them in float, scaled, squared and divided by each other: within
// these ranges nothing overflows and nothing is divided by 0. Every comparison is written so that NaN fails.
#include "formats/check_info.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "formats/quantize.h"

namespace vps::detail {
namespace {

constexpr double kLeastVoxel = 1e-15, kMostVoxel = 1e13;  // [m]
constexpr double kLongest = 1e15;                         // [m]
constexpr double kLongest_vx = 1u << 21;
constexpr std::uint32_t kMostDim = 1u << 20;  // [vx]
constexpr double kMostBand_vx = 64;
constexpr double kMostArea = 1e32;  // of all points together, each with the largest code. [m^2]
constexpr std::uint32_t kMostBranching = 64;
constexpr std::uint32_t kMostLevels = 64;
constexpr double kLargestAngle = 3.15;  // [rad]

bool is_between(double x, double low, double high) noexcept {
  return x >= low && x <= high;
}

// Largest length and coordinate that an asset may have: its square fits a float at any scale. [m]
double longest_length(const AssetInfo& info) noexcept {
  return std::min(kLongest_vx * info.voxel_size, kLongest);
}

// Ranges of lengths, which depend on the voxel size.
class Lengths {
 public:
  explicit Lengths(const AssetInfo& info) noexcept : voxel_size_(info.voxel_size), longest_(longest_length(info)) {}
  [[nodiscard]] bool is_length(double x) const noexcept { return is_between(x, 0, longest_); }
  // Not 0, and not so small that its inverse counts.
  [[nodiscard]] bool is_step(double x) const noexcept { return is_between(x, 0x1p-20 * voxel_size_, longest_); }
  [[nodiscard]] bool is_point(const std::array<double, 3>& p) const noexcept {
    return std::all_of(p.begin(), p.end(), [&](double x) { return std::abs(x) <= longest_; });
  }
  [[nodiscard]] bool is_certificate(const FieldCertificate& c) const noexcept {
    return is_length(c.max) && is_length(c.rms) && is_length(c.p99) && is_length(c.bound) && is_point(c.worst_at) &&
           c.bound >= c.max;
  }

 private:
  double voxel_size_, longest_;
};

// What every solid has. The slack is for slivers, whose integrals lose digits.
bool solid_is_good(const AssetInfo& info) noexcept {
  double box = 1;
  double longest = 0;
  double squared = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double extent = info.bounds_max[axis] - info.bounds_min[axis];
    if (!(extent > 0)) return false;
    box *= extent;
    longest = std::max(longest, extent);
    squared += extent * extent;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double slack = 1e-3 * longest;
    if (!is_between(info.centre_of_mass[axis], info.bounds_min[axis] - slack, info.bounds_max[axis] + slack))
      return false;
  }
  // Below this a double holds no digit of the volume.
  constexpr double kLeastShare = 1e-18;
  const double volume = info.volume;
  if (!is_between(volume, kLeastShare * longest * longest * longest, 1.01 * box)) return false;
  // Of all solids of a volume, the ball has the smallest surface and the smallest moments of inertia.
  const double radius = std::cbrt(3 * volume / (4 * std::numbers::pi));
  const double most = 1.01 * volume * squared;
  const double least = 0.99 * 0.4 * volume * radius * radius;
  const auto& i = info.inertia;
  return info.surface_area >= 0.99 * 4 * std::numbers::pi * radius * radius && info.surface_area <= kMostArea &&
         std::all_of(i.begin(), i.end(), [&](double x) { return std::abs(x) <= most; }) &&
         std::max({i[0], i[1], i[2]}) >= least;
}

bool grid_is_good(const AssetInfo& info, const Lengths& lengths) noexcept {
  const auto& dims = info.dims;
  if (dims == std::array<std::uint32_t, 3>{}) return true;
  std::uint64_t bricks = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (dims[axis] == 0 || dims[axis] % kBrickEdge != 0 || dims[axis] > kMostDim) return false;
    bricks *= dims[axis] / kBrickEdge;
    // The grid holds the mesh.
    const double end = info.origin[axis] + dims[axis] * info.voxel_size;
    if (!(info.origin[axis] <= info.bounds_min[axis] && info.bounds_max[axis] <= end)) return false;
  }
  const double s = info.voxel_size;
  return bricks <= kMostBricks && lengths.is_point(info.origin) &&
         is_between(info.lambda, kLeastVoxel * 1e-6, std::max(1.0, s)) &&
         is_between(info.band_inner, s, kMostBand_vx * s) && is_between(info.band_outer, s, kMostBand_vx * s);
}

bool shell_is_good(const AssetInfo& info, const Lengths& lengths) noexcept {
  if (info.points == 0) return info.levels == 0;
  return info.points <= kMostCount && is_between(info.levels, 1, kMostLevels) &&
         is_between(info.branching, 2, kMostBranching) && lengths.is_step(info.spacing) &&
         lengths.is_length(info.covering_radius) && is_between(info.feature_covering_radius, 0, info.covering_radius) &&
         is_between(info.normal_error_mean, 0, kLargestAngle) && is_between(info.normal_error_max, 0, kLargestAngle) &&
         lengths.is_point(info.position_origin) && info.position_step >= std::numeric_limits<float>::min() &&
         lengths.is_length(kLargestCode * info.position_step) && info.area_step >= std::numeric_limits<float>::min() &&
         static_cast<double>(info.points) * decode_area(kLargestAreaCode, info.area_step) <= kMostArea;
}

// Either there is no far grid, or its values can be used.
bool far_is_good(const AssetInfo& info, const Lengths& lengths) noexcept {
  if (info.far_spacing == 0) {
    return info.far_origin == std::array<double, 3>{} && info.far_step_inner == 0 && info.far_step_outer == 0 &&
           info.far_range == 0 && info.far_error.bound == 0;
  }
  return lengths.is_point(info.far_origin) && info.far_spacing >= info.voxel_size &&
         lengths.is_length(info.far_spacing) && lengths.is_step(info.far_step_inner) &&
         lengths.is_step(info.far_step_outer) && lengths.is_length(kLargestFarValue * info.far_step_inner) &&
         lengths.is_length(kLargestFarValue * info.far_step_outer) && info.far_range > 0 &&
         info.far_range <= kLargestFarValue * info.far_step_outer;
}

}  // namespace

bool info_is_good(const AssetInfo& info) noexcept {
  if (!is_between(info.voxel_size, kLeastVoxel, kMostVoxel)) return false;
  const Lengths lengths(info);
  return lengths.is_point(info.bounds_min) && lengths.is_point(info.bounds_max) && solid_is_good(info) &&
         lengths.is_certificate(info.layers_error) && lengths.is_certificate(info.scaled_error) &&
         lengths.is_certificate(info.real_error) && lengths.is_certificate(info.far_error) &&
         grid_is_good(info, lengths) && far_is_good(info, lengths) && shell_is_good(info, lengths) &&
         info.generator.back() == '\0';
}

}  // namespace vps::detail
