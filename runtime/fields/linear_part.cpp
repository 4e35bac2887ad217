// SPDX-License-Identifier: Zlib
// Where a sampled field is linear: the samples of every cell of interpolation that a flat polygon meets are looked at.
#include "runtime/fields/linear_part.h"

#include <algorithm>
#include <cmath>

#include "runtime/fields/linear_brick.h"

namespace vps::detail {
namespace {

// A flat polygon among the samples. Lengths are in voxels, from the centre of voxel (0,0,0).
struct FlatPolygon {
  float low[3], high[3];  // its box
  float normal[3];        // unit
  float offset = 0;
  float thickness = 0;
  // V in metres = at_origin + slope . place
  float at_origin = 0;
  float slope[3];
  float tolerance = 0;  // of V. [m]

  [[nodiscard]] float height(const float (&p)[3]) const {
    return normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2] - offset;
  }
  // How far a cube around a place reaches along the normal.
  [[nodiscard]] float reach(float half_edge) const {
    return half_edge * (std::abs(normal[0]) + std::abs(normal[1]) + std::abs(normal[2])) + thickness;
  }
};

class SampleCheck {
 public:
  SampleCheck(const VoxelmapView& map, const FlatPolygon& sheet, std::uint32_t most)
      : map_(map), sheet_(sheet), left_(most) {}

  bool all_are_linear() {
    std::uint32_t first[3];
    std::uint32_t last[3];
    for (int axis = 0; axis < 3; ++axis) {
      if (!(sheet_.low[axis] >= 0 && sheet_.high[axis] < static_cast<float>(map_.dims[axis] - 1))) return false;
      first[axis] = static_cast<std::uint32_t>(sheet_.low[axis]) / kRootCells;
      last[axis] = static_cast<std::uint32_t>(sheet_.high[axis]) / kRootCells;
    }
    std::uint32_t root[3];
    for (root[2] = first[2]; root[2] <= last[2]; ++root[2]) {
      for (root[1] = first[1]; root[1] <= last[1]; ++root[1]) {
        for (root[0] = first[0]; root[0] <= last[0]; ++root[0]) {
          const std::size_t at = (std::size_t{root[2]} * map_.root_dims[1] + root[1]) * map_.root_dims[0] + root[0];
          const std::uint32_t low[3] = {kRootCells * root[0], kRootCells * root[1], kRootCells * root[2]};
          if (!check(octree::root_entry(map_.field_roots[at]), low, kRootCells)) return false;
        }
      }
    }
    return true;
  }

 private:
  bool check(std::uint32_t entry, const std::uint32_t (&low)[3], std::uint32_t edge) {
    float centre[3];
    for (int axis = 0; axis < 3; ++axis) {
      const auto from = static_cast<float>(low[axis]);
      if (from > sheet_.high[axis] || from + static_cast<float>(edge) < sheet_.low[axis]) return true;
      centre[axis] = from + 0.5F * static_cast<float>(edge);
    }
    if (std::abs(sheet_.height(centre)) > sheet_.reach(0.5F * static_cast<float>(edge))) return true;
    if (octree::is_brick(entry)) return check_brick(entry, low, edge);
    if (!octree::is_node(entry)) return false;  // beyond the band
    const std::uint32_t half = edge / 2;
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      const std::uint32_t at[3] = {low[0] + half * (octant & 1), low[1] + half * (octant >> 1 & 1),
                                   low[2] + half * (octant >> 2)};
      if (!check(map_.field_nodes[8 * std::size_t{octree::node_of(entry)} + octant], at, half)) return false;
    }
    return true;
  }

  // Checks the samples of a brick in a cube: the corners of cells that the sheet may meet.
  bool check_brick(std::uint32_t entry, const std::uint32_t (&cube)[3], std::uint32_t edge) {
    // As much as to test some points.
    constexpr std::uint32_t kCost = 16;
    if (left_ < kCost) return false;
    left_ -= kCost;
    constexpr std::uint32_t kCells = kFieldEdge - 1;
    constexpr float kSteps[] = {0.25F, 0.5F, 1, 2};
    const auto level = static_cast<std::size_t>(octree::level_of(entry) - kFinestLevel);
    const float h = kSteps[level];
    const auto cells = static_cast<std::uint32_t>(h * kCells);
    float origin[3];
    for (int axis = 0; axis < 3; ++axis) origin[axis] = static_cast<float>(cube[axis] & ~(cells - 1));
    if (is_linear_brick(map_, entry, test_of(level, h), linear_at(origin), sheet_.height(origin))) return true;
    // Only some of the samples near the sheet may count.
    std::uint32_t first[3];
    std::uint32_t last[3];
    for (int axis = 0; axis < 3; ++axis) {
      const auto from = static_cast<float>(cube[axis]);
      const float low = std::max(sheet_.low[axis], from);
      const float high = std::min(sheet_.high[axis], from + static_cast<float>(edge));
      first[axis] = std::min(static_cast<std::uint32_t>((low - origin[axis]) / h), kCells - 1);
      last[axis] = std::min(static_cast<std::uint32_t>((high - origin[axis]) / h), kCells - 1);
    }
    const float reach = sheet_.reach(0.5F * h);
    const float step = tests_[level].step;
    bool checked[kFieldSamples] = {};  // corners are shared
    for (std::uint32_t z = first[2]; z <= last[2]; ++z) {
      for (std::uint32_t y = first[1]; y <= last[1]; ++y) {
        for (std::uint32_t x = first[0]; x <= last[0]; ++x) {
          const float low[3] = {origin[0] + h * static_cast<float>(x), origin[1] + h * static_cast<float>(y),
                                origin[2] + h * static_cast<float>(z)};
          const float centre[3] = {low[0] + 0.5F * h, low[1] + 0.5F * h, low[2] + 0.5F * h};
          if (std::abs(sheet_.height(centre)) > reach) continue;
          for (std::uint32_t corner = 0; corner < 8; ++corner) {
            const std::uint32_t sample[3] = {x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)};
            const std::uint32_t at = (sample[2] * kFieldEdge + sample[1]) * kFieldEdge + sample[0];
            if (checked[at]) continue;
            checked[at] = true;
            const float place[3] = {low[0] + h * static_cast<float>(corner & 1),
                                    low[1] + h * static_cast<float>(corner >> 1 & 1),
                                    low[2] + h * static_cast<float>(corner >> 2)};
            const auto stored = static_cast<float>(code(octree::corners_of(entry, sample).first));
            if (!(std::abs(step * stored - linear_at(place)) <= sheet_.tolerance)) return false;
          }
        }
      }
    }
    return true;
  }
  BrickTest& test_of(std::size_t level, float h) {
    BrickTest& test = tests_[level];
    if (test.step > 0) return test;
    test.step = h > 1 ? 2 * map_.lambda : map_.lambda;
    test.tolerance = sheet_.tolerance;
    test.near = 1.001F * sheet_.reach(h);  // the corners of all cells that the sheet may meet
    for (int axis = 0; axis < 3; ++axis) {
      test.wanted[axis] = h * sheet_.slope[axis];
      test.height[axis] = h * sheet_.normal[axis];
    }
    return test;
  }
  [[nodiscard]] float linear_at(const float (&p)[3]) const {
    return sheet_.at_origin + sheet_.slope[0] * p[0] + sheet_.slope[1] * p[1] + sheet_.slope[2] * p[2];
  }
  [[nodiscard]] int code(std::size_t sample) const {
    return map_.element == ElementType::i8 ? static_cast<const std::int8_t*>(map_.values)[sample]
                                           : static_cast<const std::int16_t*>(map_.values)[sample];
  }

  const VoxelmapView& map_;
  const FlatPolygon& sheet_;
  std::uint32_t left_;                                  // tests of points that may be spent
  BrickTest tests_[kCoarsestLevel - kFinestLevel + 1];  // by level
};

// Unit normal of places in a plane; zero if they lie on a line.
Vec3 normal_of(std::span<const Vec3> places) noexcept {
  Vec3 along;
  for (const Vec3& p : places) {
    const Vec3 way = p - places[0];
    if (dot(way, way) > dot(along, along)) along = way;
  }
  Vec3 normal;
  for (const Vec3& p : places) {
    const Vec3 n = cross(along, p - places[0]);
    if (dot(n, n) > dot(normal, normal)) normal = n;
  }
  const float size = length(normal);
  return size > 0 ? (1 / size) * normal : Vec3{};
}

}  // namespace

LinearPart linear_part(const VoxelmapView& map, Vec3 place, float v) noexcept {
  const FieldCell cell = find_cell(map, place);
  if (!octree::is_brick(cell.entry)) return {place, {}, v};
  float corners[8];
  corner_values(map, cell, corners);
  const auto slope = [&](std::size_t axis) {
    const std::size_t a = axis == 0 ? 1 : 0;
    const std::size_t b = axis == 2 ? 1 : 2;
    const auto at = [&](std::size_t i, std::size_t j) {
      const std::size_t low = (i << a) + (j << b);
      return corners[low + (std::size_t{1} << axis)] - corners[low];
    };
    return mix(mix(at(0, 0), at(1, 0), cell.part[a]), mix(at(0, 1), at(1, 1), cell.part[a]), cell.part[b]) / cell.edge;
  };
  return {place, {slope(0), slope(1), slope(2)}, v};
}

bool is_linear_between(const PolytopeField& solid, const LinearPart& part, std::span<const Vec3> places,
                       float tolerance, std::uint32_t) noexcept {
  // A face of the core, the body without its rounding, is convex: the feet of all places between lie on it.
  return !(solid.rounding > 0) || std::all_of(places.begin(), places.end(), [&](Vec3 p) {
    const Vec3 foot = p + (solid.rounding - part.at(p)) * part.slope;
    return value_at(solid, foot) >= solid.rounding - tolerance;
  });
}

bool is_linear_between(const VoxelmapView& map, const LinearPart& part, std::span<const Vec3> places, float tolerance,
                       std::uint32_t most) noexcept {
  const Vec3 normal = normal_of(places);
  if (!(dot(normal, normal) > 0)) return false;
  FlatPolygon sheet;
  const auto in_grid = [&](Vec3 p, float(&out)[3]) {
    const float at[3] = {p.x, p.y, p.z};
    for (int axis = 0; axis < 3; ++axis) {
      out[axis] = static_cast<float>(at[axis] - map.origin[axis]) / map.voxel_size - 0.5F;
    }
  };
  float place[3];
  in_grid(part.place, place);
  const float slope[3] = {part.slope.x, part.slope.y, part.slope.z};
  const float across[3] = {normal.x, normal.y, normal.z};
  sheet.at_origin = part.v;
  for (int axis = 0; axis < 3; ++axis) {
    sheet.low[axis] = sheet.high[axis] = place[axis];
    sheet.normal[axis] = across[axis];
    sheet.offset += across[axis] * place[axis];
    sheet.slope[axis] = map.voxel_size * slope[axis];
    sheet.at_origin -= sheet.slope[axis] * place[axis];
  }
  const float end_inner = end_of_band(map.band_inner, map.voxel_size);
  const float end_outer = end_of_band(map.band_outer, map.voxel_size);
  for (const Vec3& p : places) {
    // Farther out V is not that of the samples.
    const float v = part.at(p);
    if (!(v > -end_outer && v < end_inner)) return false;
    in_grid(p, place);
    for (int axis = 0; axis < 3; ++axis) {
      sheet.low[axis] = std::min(sheet.low[axis], place[axis]);
      sheet.high[axis] = std::max(sheet.high[axis], place[axis]);
    }
  }
  sheet.thickness = 4 * tolerance / map.voxel_size;  // the places are not quite in a plane
  for (int axis = 0; axis < 3; ++axis) {
    sheet.low[axis] -= sheet.thickness;
    sheet.high[axis] += sheet.thickness;
  }
  sheet.tolerance = tolerance;
  return SampleCheck(map, sheet, most).all_are_linear();
}

}  // namespace vps::detail
