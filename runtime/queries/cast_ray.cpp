// SPDX-License-Identifier: Zlib
// Casts rays in a sampled field: from cube to cube of its octree, and from cell to cell in its bricks.
#include <cmath>

#include "runtime/fields/penetration.h"
#include "runtime/vps_queries.h"

namespace vps {
namespace {

using namespace detail;

// Along a line, trilinear interpolation is a cubic. In Bernstein form its values lie between its coefficients.
struct Cubic {
  double b[4];

  // The cubic with these values at 0, 1/3, 2/3 and 1.
  static Cubic through(const double (&f)[4]) noexcept {
    return {{f[0], (-5 * f[0] + 18 * f[1] - 9 * f[2] + 2 * f[3]) / 6, (2 * f[0] - 9 * f[1] + 18 * f[2] - 5 * f[3]) / 6,
             f[3]}};
  }
  [[nodiscard]] bool is_negative() const noexcept { return std::max({b[0], b[1], b[2], b[3]}) < 0; }
  // De Casteljau's halves.
  void split(Cubic& low, Cubic& high) const noexcept {
    const double ab = (b[0] + b[1]) / 2;
    const double bc = (b[1] + b[2]) / 2;
    const double cd = (b[2] + b[3]) / 2;
    const double abc = (ab + bc) / 2;
    const double bcd = (bc + cd) / 2;
    const double middle = (abc + bcd) / 2;
    low = {{b[0], ab, abc, middle}};
    high = {{middle, bcd, cd, b[3]}};
  }
};

constexpr double kNoRoot = 2;

// The first place in [from, from + width] where the cubic is not negative, or no farther than `tolerance` before it.
double first_root(const Cubic& cubic, double from, double width, double tolerance) noexcept {
  if (cubic.is_negative()) return kNoRoot;
  if (cubic.b[0] >= 0 || width <= tolerance) return from;
  Cubic low;
  Cubic high;
  cubic.split(low, high);
  const double root = first_root(low, from, width / 2, tolerance);
  return root < kNoRoot ? root : first_root(high, from + width / 2, width / 2, tolerance);
}

// A ray in voxels, from the centre of voxel (0,0,0). `way` is the distance along it.
struct GridRay {
  double origin[3];
  double direction[3];
  [[nodiscard]] double at(int axis, double way) const noexcept { return origin[axis] + way * direction[axis]; }
  // Shortens [begin, end] to the part between two planes.
  void clip(int axis, double low, double high, double& begin, double& end) const noexcept {
    if (direction[axis] == 0) {
      if (!(origin[axis] >= low && origin[axis] <= high)) end = -1;
      return;
    }
    const double to_low = (low - origin[axis]) / direction[axis];
    const double to_high = (high - origin[axis]) / direction[axis];
    begin = std::max(begin, std::min(to_low, to_high));
    end = std::min(end, std::max(to_low, to_high));
  }
};

// Steps along a ray. A step crosses one cube of the octree that has no node, or one cell of a brick.
class March {
 public:
  March(const VoxelmapView& map, const GridRay& ray, double tolerance) noexcept
      : map_(map), ray_(ray), tolerance_(tolerance) {}

  // Whether V >= 0 somewhere in this step. If so, `way` becomes that place, else the start of the next step.
  bool step(double& way, double end) const noexcept {
    // A face belongs to the cell that the ray enters.
    constexpr double kBeyond = 1e-7;
    double g[3];
    std::uint32_t index[3];
    for (int axis = 0; axis < 3; ++axis) {
      g[axis] = std::clamp(ray_.at(axis, way + kBeyond), 0.0, static_cast<double>(map_.dims[axis] - 1));
      index[axis] = std::min(static_cast<std::uint32_t>(g[axis]), map_.dims[axis] - 2);
    }
    const octree::Found found = find_entry(map_, index);
    double leave = end;
    double begin = way;
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t low = index[axis] / found.edge * found.edge;
      ray_.clip(axis, low - kBeyond, low + found.edge + kBeyond, begin, leave);
    }
    if (found.entry == kFarInside) return true;
    if (!octree::is_brick(found.entry)) {
      way = std::max(leave, way) + kBeyond;
      return false;
    }
    FieldCell cell;
    const double edge = std::ldexp(1.0, octree::level_of(found.entry));
    cell.edge = static_cast<float>(edge) * map_.voxel_size;
    double low[3];
    std::uint32_t number[3];
    for (int axis = 0; axis < 3; ++axis) {
      const double whole = std::floor(g[axis] / edge);
      low[axis] = whole * edge;
      number[axis] = static_cast<std::uint32_t>(whole) % (kFieldEdge - 1);
      ray_.clip(axis, low[axis] - kBeyond, low[axis] + edge + kBeyond, begin, leave);
    }
    cell.corners = octree::corners_of(found.entry, number);
    float corners[8];
    corner_values(map_, cell, corners);
    leave = std::max(leave, way);
    double values[4];
    for (int i = 0; i < 4; ++i) {
      double part[3];
      for (int axis = 0; axis < 3; ++axis) {
        part[axis] = (ray_.at(axis, way + (leave - way) * i / 3) - low[axis]) / edge;
      }
      values[i] = trilinear(corners, part);
    }
    const double length = leave - way;
    const double root = first_root(Cubic::through(values), 0, 1, length > tolerance_ ? tolerance_ / length : 1);
    way += root < kNoRoot ? root * length : length + kBeyond;
    return root < kNoRoot;
  }

 private:
  static double trilinear(const float (&v)[8], const double (&t)[3]) noexcept {
    double along_x[4];
    for (int i = 0; i < 4; ++i) along_x[i] = v[2 * i] + t[0] * (double{v[2 * i + 1]} - v[2 * i]);
    const double low = along_x[0] + t[1] * (along_x[1] - along_x[0]);
    const double high = along_x[2] + t[1] * (along_x[3] - along_x[2]);
    return low + t[2] * (high - low);
  }

  const VoxelmapView& map_;
  const GridRay& ray_;
  const double tolerance_;
};

// A ray crosses each plane between the finest cells once. Twice as many steps leave room for edges and corners.
std::uint32_t most_steps_in(const VoxelmapView& map) noexcept {
  return 8 * (map.dims[0] + map.dims[1] + map.dims[2]) + 16;
}

bool is_valid(const Ray& ray) noexcept {
  constexpr float kFarthest = 1e6F;
  constexpr float kOffUnit = 1e-3F;
  return is_within(ray.origin, kFarthest) && std::abs(length(ray.direction) - 1) <= kOffUnit && ray.max_distance >= 0;
}

}  // namespace

Status cast_ray(const VoxelmapView& map, const Ray& ray, const RayOptions& options, RayHit& result) noexcept {
  result = {};
  if (map.field == Field::none || map.field == Field::layers) return Status::missing_part;
  if (!is_valid(ray) || !(options.tolerance_vx > 0)) return Status::bad_argument;
  const double s = map.voxel_size;
  const double size = std::sqrt(double{ray.direction.x} * ray.direction.x + double{ray.direction.y} * ray.direction.y +
                                double{ray.direction.z} * ray.direction.z);
  const double origin[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
  const double direction[3] = {ray.direction.x / size, ray.direction.y / size, ray.direction.z / size};
  GridRay grid{};
  double way = 0;
  double end = ray.max_distance / s;
  for (int axis = 0; axis < 3; ++axis) {
    grid.origin[axis] = (origin[axis] - map.origin[axis]) / s - 0.5;
    grid.direction[axis] = direction[axis];
    grid.clip(axis, 0, map.dims[axis] - 1, way, end);
  }
  if (!(way <= end)) return Status::ok;
  // Distances count from where the ray enters the grid: short ones are rounded less. The place of a far ray may be
  // rounded by more than a voxel, and must lie in the grid in spite of that.
  const double before = way;
  end -= before;
  way = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double top = map.dims[axis] - 1;
    grid.origin[axis] = std::clamp(grid.at(axis, before), 0.0, top);
    grid.clip(axis, 0, top, way, end);
  }
  constexpr double kFinest = 1e-6;
  const March march(map, grid, std::max<double>(options.tolerance_vx, kFinest));
  const std::uint32_t most_steps = most_steps_in(map);
  while (way <= end && result.steps < most_steps) {
    ++result.steps;
    if (!march.step(way, end)) continue;
    result.hit = true;
    const double distance = (before + way) * s;
    result.distance = static_cast<float>(distance);
    float at[3];
    for (int axis = 0; axis < 3; ++axis) at[axis] = static_cast<float>(origin[axis] + distance * direction[axis]);
    result.position = {at[0], at[1], at[2]};
    result.outward_normal = normal_at(map, result.position);
    return Status::ok;
  }
  return Status::ok;
}

}  // namespace vps
