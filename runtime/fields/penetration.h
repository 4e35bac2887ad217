// SPDX-License-Identifier: Zlib
/// @file Point lookups in a voxelmap and in analytic fields, inline for the traverse and for slices. Paper: Sec. 2.2.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "formats/cell_plane.h"
#include "runtime/fields/far_grid.h"

namespace vps::detail {

inline Vec3 operator+(Vec3 a, Vec3 b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator*(float by, Vec3 a) noexcept {
  return {by * a.x, by * a.y, by * a.z};
}
inline Vec3 operator-(Vec3 a, Vec3 b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline bool is_finite(Vec3 a) noexcept {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}
inline float dot(Vec3 a, Vec3 b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(Vec3 a, Vec3 b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(Vec3 a) noexcept {
  return std::sqrt(dot(a, a));
}

/// Two unit vectors across a normal, unit too, and across each other.
struct Tangents {
  Vec3 u, v;
  Tangents() = default;
  explicit Tangents(Vec3 normal) noexcept {
    const Vec3 aside = cross(normal, std::abs(normal.x) < 0.6F ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
    u = (1 / length(aside)) * aside;
    v = cross(normal, u);
  }
};

/// False for NaN.
inline bool is_within(Vec3 a, float farthest) noexcept {
  return std::abs(a.x) <= farthest && std::abs(a.y) <= farthest && std::abs(a.z) <= farthest;
}

/// Where a point lies in the grid of voxels.
struct Voxel {
  bool in_grid = false;
  std::size_t brick = 0;  ///< position in brick_index
  std::size_t voxel = 0;  ///< position inside the brick
  std::size_t block = 0;  ///< position in coarse_layers
  Vec3 to_centre;         ///< e = C - P of Eq. (4), C the voxel's centre. [m]
  Vec3 to_block_centre;   ///< [m]
};

inline Voxel find_voxel(const VoxelmapView& map, Vec3 point) noexcept {
  constexpr std::uint32_t kHalfBlock = kCoarseEdge / 2;
  Voxel found;
  const float p[3] = {point.x, point.y, point.z};
  std::uint32_t index[3];
  float to_centre[3];
  float to_block_centre[3];
  for (int axis = 0; axis < 3; ++axis) {
    const auto local = static_cast<float>(p[axis] - map.origin[axis]);
    const float grid = local / map.voxel_size;
    // Written so that NaN counts as outside.
    if (!(grid >= 0.0F && grid < static_cast<float>(map.dims[axis]))) return found;
    index[axis] = static_cast<std::uint32_t>(grid);
    to_centre[axis] = (static_cast<float>(index[axis]) + 0.5F) * map.voxel_size - local;
    to_block_centre[axis] =
        static_cast<float>((index[axis] & ~(kCoarseEdge - 1)) + kHalfBlock) * map.voxel_size - local;
  }
  found.in_grid = true;
  const std::size_t bx = index[0] / kBrickEdge;
  const std::size_t by = index[1] / kBrickEdge;
  const std::size_t bz = index[2] / kBrickEdge;
  found.brick = (bz * map.brick_dims[1] + by) * map.brick_dims[0] + bx;
  static_assert(kCoarseEdge == kRootCells);
  const std::size_t row = std::size_t{index[2] / kCoarseEdge} * map.root_dims[1] + index[1] / kCoarseEdge;
  found.block = row * map.root_dims[0] + index[0] / kCoarseEdge;
  constexpr std::uint32_t kMask = kBrickEdge - 1;
  found.voxel = ((index[2] & kMask) * kBrickEdge + (index[1] & kMask)) * kBrickEdge + (index[0] & kMask);
  found.to_centre = {to_centre[0], to_centre[1], to_centre[2]};
  found.to_block_centre = {to_block_centre[0], to_block_centre[1], to_block_centre[2]};
  return found;
}

/// Entry of a map's octree for a cell of a voxel's size.
inline octree::Found find_entry(const VoxelmapView& map, const std::uint32_t (&cell)[3]) noexcept {
  return octree::find_entry(map.field_roots, map.field_nodes, map.root_dims, cell);
}

/// Where a point lies between the samples of a field brick.
struct FieldCell {
  std::uint32_t entry = kFarOutside;  ///< of the octree; kFarOutside beyond the grid too
  bool in_grid = false;               ///< the point lies in the grid of samples
  octree::Corners corners;            ///< in `values`
  float part[3] = {};                 ///< [0, 1] along x, y, z
  float edge = 0;                     ///< of the cell. [m]
};

/// 2^exponent, without std::ldexp's call.
/// @param exponent  [Limits: -126 to 127]
inline float power_of_two(int exponent) noexcept {
  return std::bit_cast<float>(static_cast<std::uint32_t>(exponent + 127) << 23);
}

inline FieldCell find_cell(const VoxelmapView& map, Vec3 point) noexcept {
  FieldCell cell;
  const float p[3] = {point.x, point.y, point.z};
  float at[3];
  std::uint32_t index[3];
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = static_cast<float>(p[axis] - map.origin[axis]) / map.voxel_size - 0.5F;
    if (!(at[axis] >= 0.0F && at[axis] < static_cast<float>(map.dims[axis] - 1))) return cell;
    index[axis] = static_cast<std::uint32_t>(at[axis]);
  }
  cell.in_grid = true;
  const std::uint32_t entry = find_entry(map, index).entry;
  cell.entry = entry;
  if (!octree::is_brick(entry)) return cell;
  const int level = octree::level_of(entry);
  std::uint32_t low[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float cells = at[axis] * power_of_two(-level);
    const auto whole = static_cast<std::uint32_t>(cells);
    low[axis] = whole % (kFieldEdge - 1);
    cell.part[axis] = cells - static_cast<float>(whole);
  }
  cell.corners = octree::corners_of(entry, low);
  cell.edge = power_of_two(level) * map.voxel_size;
  return cell;
}

/// A value of `real` as a float. No one has checked it: what is no length of an asset counts as far outside, or far
/// inside. [m]
inline float real_value(double stored) noexcept {
  constexpr double kLongest = 1e15;
  return static_cast<float>(stored > -kLongest ? std::min(stored, kLongest) : -kLongest);
}

/// Calls use(samples, value) with the samples of `scaled` or `real`, and a function that gives a sample's value in this
/// cell. [m]
template <class Use>
auto use_samples(const VoxelmapView& map, const FieldCell& cell, const Use& use) noexcept {
  if (map.field == Field::real) {
    return use(static_cast<const double*>(map.values), [&](double v) { return map.scale * real_value(v); });
  }
  const float step = cell.edge > map.voxel_size ? 2 * map.lambda : map.lambda;
  const auto scaled = [=](std::int32_t v) { return static_cast<float>(v) * step; };
  if (map.element == ElementType::i8) return use(static_cast<const std::int8_t*>(map.values), scaled);
  return use(static_cast<const std::int16_t*>(map.values), scaled);
}

/// A sample of `scaled` or `real`. [m]
inline float sample_value(const VoxelmapView& map, const FieldCell& cell, std::size_t at) noexcept {
  return use_samples(map, cell, [at](const auto* samples, const auto& value) { return value(samples[at]); });
}

/// The eight samples round a point, x fastest. [m]
inline void corner_values(const VoxelmapView& map, const FieldCell& cell, float (&out)[8]) noexcept {
  use_samples(map, cell, [&](const auto* samples, const auto& value) {
    for (std::size_t corner = 0; corner < 8; ++corner) out[corner] = value(samples[cell.corners.number(corner)]);
  });
}

inline float interpolate(const VoxelmapView& map, const FieldCell& cell) noexcept {
  float v[8];
  corner_values(map, cell, v);
  return trilinear(v, cell.part);
}

/// Whether the layer of a voxel is stored. @pre the map has layers
inline bool has_layer(const VoxelmapView& map, const Voxel& found) noexcept {
  return found.in_grid && is_stored(map.brick_index[found.brick]);
}

/// The layer of a voxel of a stored brick. [vx]
inline std::int32_t layer_of(const VoxelmapView& map, const Voxel& found) noexcept {
  const std::size_t at = std::size_t{map.brick_index[found.brick]} * kBrickVoxels + found.voxel;
  return map.element == ElementType::i8 ? static_cast<const std::int8_t*>(map.values)[at]
                                        : static_cast<const std::int16_t*>(map.values)[at];
}

/// Distance from a point outside the mesh's bounding box to that box; 0 inside. [m]
inline float distance_to_bounds(const VoxelmapView& map, Vec3 point) noexcept {
  const float p[3] = {point.x, point.y, point.z};
  float sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float gap = std::max({map.bounds_min[axis] - p[axis], p[axis] - map.bounds_max[axis], 0.0F});
    sum += gap * gap;
  }
  return std::sqrt(sum);
}

struct Interval {
  float low, high;
};
/// Interval of the distance to the surface beyond the band. The coarse layer is up to three voxels below the distance
/// at the block's centre. The triangle inequality moves this bound to the point (a distance field is 1-Lipschitz). The
/// lower end also uses the band, beyond which the nearest voxel's centre lies.
inline Interval far_interval(const VoxelmapView& map, const Voxel& found, float band) noexcept {
  const auto layer = static_cast<float>(std::abs(map.coarse_layers[found.block]));
  const float reach = length(found.to_block_centre);
  const float s = map.voxel_size;
  return {std::max({layer * s - reach, band - length(found.to_centre), 0.0F}), (layer + kCoarseLayerSlack) * s + reach};
}

/// `outward_normal` of a voxelmap.
Vec3 normal_at(const VoxelmapView& map, Vec3 point) noexcept;

struct PenetrationAndNormal {
  float penetration = 0;
  Vec3 normal;
};
/// V and `outward_normal`, from one walk down the octree. V of layers is by this normal.
PenetrationAndNormal penetration_and_normal(const VoxelmapView& map, Vec3 point) noexcept;

// Interpolation between the corners of a cell of edge h never exceeds sqrt(d^2 + 3 h^2 / 4), d the true distance:
// docs/internals/bounds.md has the proof.
inline constexpr float kHalfDiagonalSquared = 0.75F;

/// Where the last cells of the band begin. From there on a field's own values may be clamped. [m]
inline float end_of_band(float band, float voxel_size) noexcept {
  return std::max(band - std::sqrt(kHalfDiagonalSquared) * voxel_size, 0.0F);
}
/// V is known up to this distance outside. [m]
inline float known_distance(const VoxelmapView& map) noexcept {
  return map.far.range > 0 ? map.far.range : end_of_band(map.band_outer, map.voxel_size);
}

/// The plane of a cell of 8x8x8 voxels: its own, or that of its block.
struct CellBound {
  CellPlane plane;
  float centre[3];  ///< of the cell or block. [vx]
};
/// @param cell  in the grid
/// @pre the map has planes
inline CellBound bound_of_cell(const VoxelmapView& map, const std::uint32_t (&cell)[3]) noexcept {
  static_assert(kRootCells == 2 * kPlaneCell);
  const std::uint32_t root =
      map.field_roots[(std::size_t{cell[2] / 2} * map.root_dims[1] + cell[1] / 2) * map.root_dims[0] + cell[0] / 2];
  const bool is_block = !octree::has_octant_planes(root);
  const std::uint32_t octant = cell[2] % 2 * 4 + cell[1] % 2 * 2 + cell[0] % 2;
  CellBound found;
  found.plane =
      is_block ? decode_block(root) : decode_plane(map.planes[8 * std::size_t{octree::planes_of(root)} + octant]);
  for (int axis = 0; axis < 3; ++axis) {
    const float centre = is_block ? static_cast<float>(cell[axis] | 1U) : static_cast<float>(cell[axis]) + 0.5F;
    found.centre[axis] = centre * kPlaneCell;
  }
  return found;
}

/// The plane of the cell or block at a point, and its height there: docs/internals/bounds.md, "The planes".
struct PlaneAt {
  bool in_grid = false;
  CellPlane plane;
  float height = 0;  ///< [m]
};
/// @pre the map has planes
inline PlaneAt find_plane(const VoxelmapView& map, Vec3 point) noexcept {
  const float p[3] = {point.x, point.y, point.z};
  std::uint32_t cell[3];
  float at[3];
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = static_cast<float>(p[axis] - map.origin[axis]) / map.voxel_size - 0.5F;
    // Written so that NaN counts as beyond the grid.
    if (!(at[axis] >= 0 && at[axis] < static_cast<float>(map.dims[axis] - 1))) return {};
    cell[axis] = static_cast<std::uint32_t>(at[axis]) / kPlaneCell;
  }
  const CellBound found = bound_of_cell(map, cell);
  const float from_centre[3] = {at[0] - found.centre[0], at[1] - found.centre[1], at[2] - found.centre[2]};
  return {true, found.plane, map.voxel_size * height_at(found.plane, from_centre)};
}

/// V without the far grid.
struct OwnPenetration {
  float v = 0;           ///< beyond the band no farther from 0 than the true V, with the right sign. [m]
  bool sampled = false;  ///< the field has values there; beyond the band they may be clamped
};
inline OwnPenetration own_penetration(const VoxelmapView& map, Vec3 point, Vec3 inward_normal) noexcept {
  bool inside = false;
  if (map.field != Field::layers) {
    const FieldCell cell = find_cell(map, point);
    if (octree::is_brick(cell.entry)) return {interpolate(map, cell), true};
    inside = cell.entry == kFarInside;
  }
  const Voxel found = find_voxel(map, point);
  if (map.field == Field::layers) {
    if (has_layer(map, found)) {
      // Eq. (4) with sigma = s.
      return {dot(inward_normal, found.to_centre) + static_cast<float>(layer_of(map, found)) * map.voxel_size, true};
    }
    inside = found.in_grid && map.brick_index[found.brick] == kNoBrickInside;
  }
  if (inside && found.in_grid) return {far_interval(map, found, map.band_inner).low};
  const float to_bounds = distance_to_bounds(map, point);
  return {-(found.in_grid ? std::max(to_bounds, far_interval(map, found, map.band_outer).low) : to_bounds)};
}

/// V from the field's own value: at the band's end it changes over to the far grid, in the range of own values that may
/// be clamped.
inline float with_far_grid(const VoxelmapView& map, Vec3 point, OwnPenetration own) noexcept {
  const float band = own.v >= 0 ? map.band_inner : map.band_outer;
  const float end = end_of_band(band, map.voxel_size);
  if (std::abs(own.v) < end) return own.v;
  const FarCell cell = find_far_cell(map.far, point);
  if (!cell.in_grid) return own.v;
  const float far = far_value(cell);
  const float weight = own.sampled ? std::min((std::abs(own.v) - end) / (band - end), 1.0F) : 1.0F;
  return mix(own.v, own.v >= 0 ? std::max(own.v, far) : std::min(own.v, far), weight);
}

/// V(P). Paper: Sec. 2.2. Beyond the band it comes from the far grid.
inline float voxelmap_penetration(const VoxelmapView& map, Vec3 point, Vec3 inward_normal) noexcept {
  return with_far_grid(map, point, own_penetration(map, point, inward_normal));
}

/// Lower bound of the true signed distance where interpolation gives `interpolated`. [m]
inline float least_distance(float interpolated, float h) noexcept {
  const float squared = interpolated * interpolated - kHalfDiagonalSquared * h * h;
  return interpolated > 0 && squared > 0 ? std::sqrt(squared) : interpolated - std::sqrt(kHalfDiagonalSquared) * h;
}

/// Error bound of the interpolated V in the band, from the certificate; rounding of samples included. [m]
inline float field_error(const VoxelmapView& map) noexcept {
  return map.field == Field::real ? map.error : std::max(map.lambda, map.error);
}

/// Upper bound of the true penetration.
inline float voxelmap_bound(const VoxelmapView& map, Vec3 point) noexcept {
  constexpr float kUnbounded = std::numeric_limits<float>::max();
  bool inside = false;
  if (map.field == Field::layers) {
    const Voxel found = find_voxel(map, point);
    if (!found.in_grid) return -distance_to_bounds(map, point);
    if (has_layer(map, found)) {
      // Outside, a voxel of layer -n is separated from every surface voxel by n - 1 whole voxels along some axis.
      const auto layer = static_cast<float>(layer_of(map, found));
      return layer < 0 ? (layer + 1) * map.voxel_size : kUnbounded;
    }
    inside = map.brick_index[found.brick] == kNoBrickInside;
  } else {
    const FieldCell cell = find_cell(map, point);
    if (octree::is_brick(cell.entry)) {
      const float v = interpolate(map, cell);
      // Samples are fitted and rounded.
      const float slack = field_error(map);
      // Near the band's end inside, samples may be clamped.
      if (v > map.band_inner - 2 * std::sqrt(kHalfDiagonalSquared) * cell.edge) return kUnbounded;
      return slack - least_distance(-v, cell.edge);
    }
    inside = cell.entry == kFarInside;
  }
  const Voxel found = find_voxel(map, point);
  if (!found.in_grid) return -distance_to_bounds(map, point);
  return inside ? far_interval(map, found, map.band_inner).high : -far_interval(map, found, map.band_outer).low;
}

/// The interpolated V is within field_error of the true V where -outer < V < inner. [m]
struct CertifiedBand {
  float inner, outer;
};
inline CertifiedBand certified_band(const VoxelmapView& map) noexcept {
  // Certificates end half a voxel's diagonal from the ends of the band.
  const float end = std::sqrt(kHalfDiagonalSquared) * map.voxel_size + field_error(map);
  const CertifiedBand band{map.band_inner - end, map.band_outer - end};
  constexpr float kNever = std::numeric_limits<float>::lowest();
  return std::min(band.inner, band.outer) > 0 ? band : CertifiedBand{kNever, kNever};
}

/// Interval of the distance to the surface at any point, from the coarse layers. For a point beyond the grid it is
/// that of the nearest point in the grid, extended by the gap between them. The angle at the nearest point to any point
/// of the grid is at least a right one. [m]
inline Interval coarse_interval(const VoxelmapView& map, Vec3 point) noexcept {
  const float p[3] = {point.x, point.y, point.z};
  float nearest[3];
  float gap_squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = map.origin[axis] + 0.5 * map.voxel_size;
    const double high = low + static_cast<double>(map.dims[axis] - 1) * map.voxel_size;
    nearest[axis] = static_cast<float>(std::clamp(static_cast<double>(p[axis]), low, high));
    gap_squared += (p[axis] - nearest[axis]) * (p[axis] - nearest[axis]);
  }
  const Voxel found = find_voxel(map, {nearest[0], nearest[1], nearest[2]});
  if (!found.in_grid) return {0, std::numeric_limits<float>::max()};  // NaN
  const Interval near = far_interval(map, found, 0);
  const float low = std::sqrt(gap_squared + near.low * near.low);
  return {std::max(low, distance_to_bounds(map, point)), std::sqrt(gap_squared) + near.high};
}

inline Interval signed_interval(Interval distance, bool inside) noexcept {
  return inside ? distance : Interval{-distance.high, -distance.low};
}

/// Interval of the true V from the layer of a point's voxel.
inline Interval layer_interval(const VoxelmapView& map, const Voxel& found, Interval coarse) noexcept {
  const float diagonal = std::sqrt(3.0F) * map.voxel_size;
  const std::int32_t layer = layer_of(map, found);
  if (layer == 0) return {-diagonal, diagonal};  // the voxel holds a point of the surface
  const auto n = static_cast<float>(std::abs(layer));
  coarse.low = std::max(coarse.low, (n - 1) * map.voxel_size);
  constexpr float kLargest = std::numeric_limits<std::int8_t>::max();  // layers may be clamped there
  if (n < kLargest) coarse.high = std::min(coarse.high, (n + 1) * diagonal);
  return signed_interval(coarse, layer > 0);
}

/// An interval of the true V, made narrower by the far grid's. [m]
inline Interval within_far_grid(const VoxelmapView& map, Vec3 point, Interval known) noexcept {
  const FarCell cell = find_far_cell(map.far, point);
  if (!cell.in_grid) return known;
  const float v = far_value(cell);
  const float rounding = 0.5F * std::max(map.far.step_inner, map.far.step_outer);
  known.high = std::min(known.high, -least_distance(-v - rounding, map.far.spacing));
  // Clamped samples hide how far outside a point is.
  if (v - map.far.error > farthest_value(map.far)) known.low = std::max(known.low, v - map.far.error);
  return {std::min(known.low, known.high), known.high};
}

/// Interval of the true V at any point, without the far grid.
inline Interval interval_of_field(const VoxelmapView& map, Vec3 point) noexcept {
  const float error = field_error(map);
  FieldCell cell;
  float v = 0;
  if (map.field != Field::layers) {
    cell = find_cell(map, point);
    if (octree::is_brick(cell.entry)) {
      v = interpolate(map, cell);
      const CertifiedBand certified = certified_band(map);
      if (v > -certified.outer && v < certified.inner) return {v - error, v + error};
      Interval far = coarse_interval(map, point);
      far.low = std::max(least_distance(std::abs(v) - error, cell.edge),
                         (v >= 0 ? certified.inner : certified.outer) - error);
      return signed_interval({far.low, std::max(far.low, far.high)}, v >= 0);
    }
  }
  Interval far = coarse_interval(map, point);
  const Voxel found = find_voxel(map, point);
  if (!found.in_grid) return signed_interval(far, false);
  if (map.field == Field::layers) {
    if (has_layer(map, found)) return layer_interval(map, found, far);
    return signed_interval(far, map.brick_index[found.brick] == kNoBrickInside);
  }
  const bool inside = cell.entry == kFarInside;
  // There are no samples because the voxel's centre lies beyond the band.
  if (cell.in_grid) far.low = std::max(far.low, (inside ? map.band_inner : map.band_outer) - length(found.to_centre));
  return signed_interval(far, inside);
}

/// Interval of the true V at any point: docs/internals/bounds.md. In the certified band it comes from the certificate.
/// [m]
inline Interval penetration_interval(const VoxelmapView& map, Vec3 point) noexcept {
  return within_far_grid(map, point, interval_of_field(map, point));
}

}  // namespace vps::detail
