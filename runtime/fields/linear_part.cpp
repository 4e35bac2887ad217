// SPDX-License-Identifier: Zlib
// Where a sampled field is linear: the samples of every cell of interpolation that a flat polygon meets are looked at.
// Where it shows no surface above a plane: those of every brick there. Bricks that share their samples, as below a
// polygon that is level in the grid, are looked at once.
#include "runtime/fields/linear_part.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "runtime/fields/linear_brick.h"

namespace vps::detail {
namespace {

// A flat polygon among the samples, or the part of a plane in a ball, or what is above that part. Lengths are in
// voxels, from the centre of voxel (0,0,0).
struct FlatPolygon {
  float low[3], high[3];                                             // its box
  float centre[3] = {}, radius = std::numeric_limits<float>::max();  // of the ball
  float normal[3];                                                   // unit
  float offset = 0;
  float thickness = 0;
  // V in metres = at_origin + slope . place
  float at_origin = 0;
  float slope[3];
  float tolerance = 0;  // of V. [m]
  bool is_above = false;
  bool is_level = false;  // the normal is an axis of the grid
  float floor = 0;        // V that is low enough above the plane, however high. [m]
  int halvings = 0;       // of cells of which only a part may count

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

  bool all_pass() {
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
        const auto [begin, end] = met_in_row(root, first[0], last[0]);
        for (root[0] = begin; root[0] < end; ++root[0]) {
          const std::size_t at = (std::size_t{root[2]} * map_.root_dims[1] + root[1]) * map_.root_dims[0] + root[0];
          const std::uint32_t low[3] = {kRootCells * root[0], kRootCells * root[1], kRootCells * root[2]};
          if (!check_root(octree::root_entry(map_.field_roots[at]), low)) return false;
        }
      }
    }
    return true;
  }

 private:
  // The roots of a row along x that the sheet may meet: the first one, and the end.
  [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> met_in_row(const std::uint32_t (&root)[3], std::uint32_t first,
                                                                   std::uint32_t last) const {
    constexpr float kHalfRoot = 0.5F * kRootCells;
    constexpr float kClimbs = 0.1F;
    const float climb = kRootCells * sheet_.normal[0];  // from root to root
    if (std::abs(climb) < kClimbs) return {first, last + 1};
    const float middle[3] = {kHalfRoot, kHalfRoot + static_cast<float>(kRootCells * root[1]),
                             kHalfRoot + static_cast<float>(kRootCells * root[2])};
    const float height = sheet_.height(middle);  // over the row's first root
    const float reach = 1.01F * sheet_.reach(kHalfRoot);
    const float low = (-reach - height) / climb;
    const float high =
        sheet_.is_above ? std::copysign(std::numeric_limits<float>::max(), climb) : (reach - height) / climb;
    const auto least = std::max(static_cast<float>(first), std::floor(std::min(low, high)));
    const auto most = std::min(static_cast<float>(last), std::ceil(std::max(low, high)));
    if (!(least <= most)) return {first, first};
    return {static_cast<std::uint32_t>(least), static_cast<std::uint32_t>(most) + 1};
  }
  // A root with the bricks of one that passed, as high above the polygon, passes too.
  bool check_root(std::uint32_t entry, const std::uint32_t (&low)[3]) {
    if (!sheet_.is_level || !octree::is_node(entry)) return check(entry, low, kRootCells);
    const float from[3] = {static_cast<float>(low[0]), static_cast<float>(low[1]), static_cast<float>(low[2])};
    const std::uint32_t* const octants = map_.field_nodes + 8 * std::size_t{octree::node_of(entry)};
    const float wanted = linear_at(from);
    const float height = sheet_.height(from);
    if (passed_ != nullptr && wanted == passed_wanted_ && height == passed_height_ &&
        std::equal(octants, octants + 8, passed_)) {
      return true;
    }
    if (!check(entry, low, kRootCells)) return false;
    if (!is_amid(from)) return true;
    passed_ = octants;
    passed_wanted_ = wanted;
    passed_height_ = height;
    return true;
  }
  // Whether all of a root counts, but for what lies above or below.
  [[nodiscard]] bool is_amid(const float (&low)[3]) const {
    constexpr float kRoot = kRootCells;
    float squared = 0;  // of the way from the ball's centre to the root's farthest corner
    for (int axis = 0; axis < 3; ++axis) {
      const float far = std::max(low[axis] + kRoot - sheet_.centre[axis], sheet_.centre[axis] - low[axis]);
      squared += far * far;
      if (sheet_.normal[axis] == 0 && (low[axis] < sheet_.low[axis] || low[axis] + kRoot > sheet_.high[axis])) {
        return false;
      }
    }
    return squared <= sheet_.radius * sheet_.radius;
  }

  bool check(std::uint32_t entry, const std::uint32_t (&low)[3], std::uint32_t edge) {
    float from[3];
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = static_cast<float>(low[axis]);
      if (from[axis] > sheet_.high[axis] || from[axis] + static_cast<float>(edge) < sheet_.low[axis]) return true;
    }
    if (!is_met(from, static_cast<float>(edge))) return true;
    if (octree::is_brick(entry)) return check_brick(entry, low, edge);
    if (!octree::is_node(entry)) return sheet_.is_above && entry == kFarOutside;  // beyond the band
    // Nodes of a damaged file may go on.
    if (edge == 1) return false;
    const std::uint32_t half = edge / 2;
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      const std::uint32_t at[3] = {low[0] + half * (octant & 1), low[1] + half * (octant >> 1 & 1),
                                   low[2] + half * (octant >> 2)};
      if (!check(map_.field_nodes[8 * std::size_t{octree::node_of(entry)} + octant], at, half)) return false;
    }
    return true;
  }

  // Takes the cost of some tests of points.
  bool spend(std::uint32_t tests) {
    if (left_ < tests) return false;
    left_ -= tests;
    return true;
  }

  // Checks the cells of a brick in a cube that the sheet may meet.
  bool check_brick(std::uint32_t entry, const std::uint32_t (&cube)[3], std::uint32_t edge) {
    constexpr std::uint32_t kCost = 16;
    if (!spend(kCost)) return false;
    constexpr std::uint32_t kCells = kFieldEdge - 1;
    constexpr float kSteps[] = {0.25F, 0.5F, 1, 2};
    const auto level = static_cast<std::size_t>(octree::level_of(entry) - kFinestLevel);
    const float h = kSteps[level];
    const auto cells = static_cast<std::uint32_t>(h * kCells);
    float origin[3];
    for (int axis = 0; axis < 3; ++axis) origin[axis] = static_cast<float>(cube[axis] & ~(cells - 1));
    BrickTest& test = test_of(level, h);
    if (sheet_.is_above ? is_brick_below(map_, entry, test, linear_at(origin), sheet_.floor)
                        : is_linear_brick(map_, entry, test, linear_at(origin), sheet_.height(origin))) {
      return true;
    }
    // Only some of the cells may count.
    std::uint32_t first[3];
    std::uint32_t last[3];
    for (int axis = 0; axis < 3; ++axis) {
      const auto from = static_cast<float>(cube[axis]);
      const float low = std::max(sheet_.low[axis], from);
      const float high = std::min(sheet_.high[axis], from + static_cast<float>(edge));
      first[axis] = std::min(static_cast<std::uint32_t>((low - origin[axis]) / h), kCells - 1);
      // Beyond the cube another entry may lead to other samples.
      const float end = std::ceil((from + static_cast<float>(edge) - origin[axis]) / h) - 1;
      last[axis] = std::min(
          {static_cast<std::uint32_t>((high - origin[axis]) / h), static_cast<std::uint32_t>(end), kCells - 1});
    }
    std::uint32_t cell[3];
    for (cell[2] = first[2]; cell[2] <= last[2]; ++cell[2]) {
      for (cell[1] = first[1]; cell[1] <= last[1]; ++cell[1]) {
        for (cell[0] = first[0]; cell[0] <= last[0]; ++cell[0]) {
          Cell at{{}, h, {}};
          for (int axis = 0; axis < 3; ++axis) at.low[axis] = origin[axis] + h * static_cast<float>(cell[axis]);
          if (!is_met(at.low, h)) continue;
          const octree::Corners corners = octree::corners_of(entry, cell);
          for (std::uint32_t i = 0; i < 8; ++i) at.v[i] = test.step * static_cast<float>(code(corners.number(i)));
          if (!check_cell(at, sheet_.halvings)) return false;
        }
      }
    }
    return true;
  }

  // A cell of interpolation, or a part of one.
  struct Cell {
    float low[3];
    float edge = 0;  // [vx]
    float v[8];      // at its corners. [m]
  };
  // Whether the sheet may meet a cube.
  [[nodiscard]] bool is_met(const float (&low)[3], float edge) const {
    const float half = 0.5F * edge;
    const float middle[3] = {low[0] + half, low[1] + half, low[2] + half};
    const float height = sheet_.height(middle);
    const float off[3] = {middle[0] - sheet_.centre[0], middle[1] - sheet_.centre[1], middle[2] - sheet_.centre[2]};
    const float farthest = sheet_.radius + 1.7321F * half;
    return (sheet_.is_above ? -height : std::abs(height)) <= sheet_.reach(half) &&
           off[0] * off[0] + off[1] * off[1] + off[2] * off[2] <= farthest * farthest;
  }

  bool check_cell(const Cell& cell, int halvings) {
    bool passes = true;
    for (std::uint32_t i = 0; i < 8; ++i) {
      const float place[3] = {cell.low[0] + cell.edge * static_cast<float>(i & 1),
                              cell.low[1] + cell.edge * static_cast<float>(i >> 1 & 1),
                              cell.low[2] + cell.edge * static_cast<float>(i >> 2)};
      const float wanted = linear_at(place);
      const float off = sheet_.is_above ? cell.v[i] - std::max(wanted, sheet_.floor) : std::abs(cell.v[i] - wanted);
      passes = passes && off <= sheet_.tolerance;
    }
    if (passes || halvings == 0) return passes;
    if (!spend(8)) return false;
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      const float from[3] = {0.5F * static_cast<float>(octant & 1), 0.5F * static_cast<float>(octant >> 1 & 1),
                             0.5F * static_cast<float>(octant >> 2)};
      Cell part{{}, 0.5F * cell.edge, {}};
      for (int axis = 0; axis < 3; ++axis) part.low[axis] = cell.low[axis] + cell.edge * from[axis];
      if (!is_met(part.low, part.edge)) continue;
      for (std::uint32_t i = 0; i < 8; ++i) {
        part.v[i] = trilinear(
            cell.v, {from[0] + 0.5F * static_cast<float>(i & 1), from[1] + 0.5F * static_cast<float>(i >> 1 & 1),
                     from[2] + 0.5F * static_cast<float>(i >> 2)});
      }
      if (!check_cell(part, halvings - 1)) return false;
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
  const std::uint32_t* passed_ = nullptr;               // octants of a root
  float passed_wanted_ = 0, passed_height_ = 0;         // at its lowest corner
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

// A place in the grid of samples. [vx]
std::array<float, 3> in_grid(const VoxelmapView& map, Vec3 p) noexcept {
  const float at[3] = {p.x, p.y, p.z};
  std::array<float, 3> out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out[axis] = static_cast<float>(at[axis] - map.origin[axis]) / map.voxel_size - 0.5F;
  }
  return out;
}

// A polygon that is the place of a linear function alone.
FlatPolygon polygon_at(const VoxelmapView& map, const LinearPart& part, Vec3 normal, float tolerance) noexcept {
  FlatPolygon sheet;
  const std::array<float, 3> place = in_grid(map, part.place);
  const float slope[3] = {part.slope.x, part.slope.y, part.slope.z};
  const float across[3] = {normal.x, normal.y, normal.z};
  sheet.at_origin = part.v;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sheet.low[axis] = sheet.high[axis] = place[axis];
    sheet.normal[axis] = across[axis];
    sheet.offset += across[axis] * place[axis];
    sheet.slope[axis] = map.voxel_size * slope[axis];
    sheet.at_origin -= sheet.slope[axis] * place[axis];
  }
  sheet.tolerance = tolerance;
  return sheet;
}

// Makes a polygon that is nearly level in the grid a level one, thick enough to hold it.
void make_level(FlatPolygon& sheet) noexcept {
  constexpr float kLevel_vx = 0.25F;
  for (int axis = 0; axis < 3; ++axis) {
    const float half = 0.5F * (sheet.high[axis] - sheet.low[axis]);
    if (!(half <= kLevel_vx) || !(std::abs(sheet.normal[axis]) > 0.9F)) continue;
    std::fill_n(sheet.normal, 3, 0.0F);
    sheet.normal[axis] = 1;
    sheet.offset = sheet.low[axis] + half;
    sheet.thickness += half;
    sheet.is_level = true;
    return;
  }
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

float rounding_of(const VoxelmapView& map) noexcept {
  return map.field == Field::scaled ? map.lambda : 0;  // half a step in the coarsest bricks
}

LinearPart fit_linear(const VoxelmapView&, const LinearPart& part, std::span<const Vec3> places,
                      std::span<const float> v, float unit) noexcept {
  const Vec3 normal = normal_of(places);
  if (!(dot(normal, normal) > 0)) return part;
  const auto count = static_cast<float>(places.size());
  Vec3 middle;
  float mean = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    middle = middle + (1 / count) * places[i];
    mean += v[i] / count;
  }
  const auto [along, across] = Tangents(normal);
  float aa = 0, ab = 0, bb = 0, av = 0, bv = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const float a = dot(along, places[i] - middle);
    const float b = dot(across, places[i] - middle);
    aa += a * a;
    ab += a * b;
    bb += b * b;
    av += a * (v[i] - mean);
    bv += b * (v[i] - mean);
  }
  const float determinant = aa * bb - ab * ab;
  constexpr float kOnLine = 1e-4F;  // of the places, where they are nearly on a line
  if (!(determinant > kOnLine * (aa + bb) * (aa + bb))) return part;
  const float by = unit / determinant;
  const Vec3 slope = by * (av * bb - bv * ab) * along + by * (bv * aa - av * ab) * across;
  const float rise = std::sqrt(std::max(1 - dot(slope, slope), 0.0F));
  return {middle, slope + (dot(part.slope, normal) < 0 ? -rise : rise) * normal, unit * mean};
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
  FlatPolygon sheet = polygon_at(map, part, normal, tolerance);
  const float end_inner = end_of_band(map.band_inner, map.voxel_size);
  const float end_outer = end_of_band(map.band_outer, map.voxel_size);
  for (const Vec3& p : places) {
    // Farther out V is not that of the samples.
    const float v = part.at(p);
    if (!(v > -end_outer && v < end_inner)) return false;
    const std::array<float, 3> place = in_grid(map, p);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sheet.low[axis] = std::min(sheet.low[axis], place[axis]);
      sheet.high[axis] = std::max(sheet.high[axis], place[axis]);
    }
  }
  sheet.thickness = 4 * tolerance / map.voxel_size;  // the places are not quite in a plane
  make_level(sheet);
  for (int axis = 0; axis < 3; ++axis) {
    sheet.low[axis] -= sheet.thickness;
    sheet.high[axis] += sheet.thickness;
  }
  return SampleCheck(map, sheet, most).all_pass();
}

namespace {

constexpr float kBeside_vx = 1;  // so far above the plane V has to be linear

// The regions to check: the slab over a plane in a ball, and the part of the ball above it.
struct PlaneInBall {
  FlatPolygon slab, above;
};
std::optional<PlaneInBall> plane_in_ball(const VoxelmapView& map, const HalfSpaceField& plane, Vec3 centre,
                                         float radius, float tolerance) {
  constexpr float kInBand_vx = 0.3F;   // the floor is so far from the band's end
  constexpr float kCell_vx = 3.4642F;  // diagonal of the largest cells
  const float unit = map.voxel_size;
  const float floor = std::min(map.band_outer / unit - kInBand_vx, kCell_vx + kBeside_vx);
  const float beyond = kCell_vx - floor - kBeside_vx;
  const float shown = (floor * kBeside_vx - 0.25F * beyond * beyond) / kCell_vx;
  if (end_of_band(map.band_outer, unit) < kBeside_vx * unit) return {};
  if (tolerance + field_error(map) >= shown * unit) return {};
  const Vec3 n = plane.outward_normal;
  const LinearPart part{plane.offset * n, -1.0F * n, 0};
  FlatPolygon slab = polygon_at(map, part, n, tolerance);
  const std::array<float, 3> middle = in_grid(map, centre);
  std::copy(middle.begin(), middle.end(), slab.centre);
  slab.radius = radius / unit;
  const float height = slab.height(slab.centre);
  if (!(std::abs(height) < slab.radius)) return {};
  slab.offset += 0.5F * kBeside_vx;
  slab.thickness = 0.5F * kBeside_vx;
  slab.halvings = 2;  // corners of cells can be far from the plane, near an edge
  slab.is_level = std::count(slab.normal, slab.normal + 3, 0.0F) == 2;
  FlatPolygon above = slab;
  const std::array<float, 3> mesh_low = in_grid(map, {map.bounds_min[0], map.bounds_min[1], map.bounds_min[2]});
  const std::array<float, 3> mesh_high = in_grid(map, {map.bounds_max[0], map.bounds_max[1], map.bounds_max[2]});
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float foot = middle[axis] - height * slab.normal[axis];
    const float most_aside = slab.radius * std::sqrt(std::max(1 - slab.normal[axis] * slab.normal[axis], 0.0F));
    slab.low[axis] = foot - most_aside - kBeside_vx;
    slab.high[axis] = foot + most_aside + kBeside_vx;
    // All of the surface lies in the bounds of the mesh.
    above.low[axis] = std::max(middle[axis] - slab.radius, mesh_low[axis]);
    above.high[axis] = std::min(middle[axis] + slab.radius, mesh_high[axis]);
    // Nothing below a level plane counts.
    if (slab.is_level && slab.normal[axis] > 0) above.low[axis] = std::max(above.low[axis], foot - kBeside_vx);
    if (slab.is_level && slab.normal[axis] < 0) above.high[axis] = std::min(above.high[axis], foot + kBeside_vx);
    if (!(above.low[axis] <= above.high[axis])) return {};
  }
  above.is_above = true;
  above.floor = -floor * unit;
  return PlaneInBall{slab, above};
}

}  // namespace

bool is_plane_within(const VoxelmapView& map, const HalfSpaceField& plane, Vec3 centre, float radius, float tolerance,
                     std::uint32_t most) noexcept {
  const std::optional<PlaneInBall> in = plane_in_ball(map, plane, centre, radius, tolerance);
  return in && SampleCheck(map, in->slab, most).all_pass() && SampleCheck(map, in->above, most).all_pass();
}

bool is_all_below(const VoxelmapView& map, const HalfSpaceField& plane, Vec3 centre, float radius, float tolerance,
                  std::uint32_t most) noexcept {
  const std::optional<PlaneInBall> in = plane_in_ball(map, plane, centre, radius, tolerance);
  return in && SampleCheck(map, in->above, most).all_pass();
}

}  // namespace vps::detail
