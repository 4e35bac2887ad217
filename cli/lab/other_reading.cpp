// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/other_reading.h"

#include <cmath>
#include <stdexcept>

#include "cli/lab/ours.h"
#include "cli/lab/patches.h"
#include "runtime/fields/penetration.h"

namespace vps::lab {
namespace {

double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Point rotated(const Pose& pose, const Point& v) {
  Pose turn = pose;
  for (double& t : turn.translation) t = 0;
  return moved(turn, v);
}

// Eqs. (4) and (5) from the nearest corner of the point's cell.
double from_nearest(const VoxelmapView& map, const detail::FieldCell& cell, const Point& inward_normal) {
  std::size_t nearest = 0;
  Point to_sample;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double corner = cell.part[axis] >= 0.5F ? 1 : 0;
    if (corner > 0) nearest |= std::size_t{1} << axis;
    to_sample[axis] = (corner - double(cell.part[axis])) * double(cell.edge);
  }
  const std::size_t at = cell.corners.number(nearest);
  const double value = double(detail::sample_value(map, cell, at));
  if (map.gradients == nullptr) return dot(inward_normal, to_sample) + value;
  const float* const g = map.gradients + 3 * at;
  return value - dot({double(g[0]), double(g[1]), double(g[2])}, to_sample) / double(map.voxel_size);
}

// Interpolates layers between voxel centres. Returns false where a voxel's layer is not stored.
bool between_centres(const VoxelmapView& map, const Point& p, double& out) {
  std::array<std::uint32_t, 3> low;
  Point part;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = (p[axis] - map.origin[axis]) / double(map.voxel_size) - 0.5;
    if (!(at >= 0 && at < double(map.dims[axis] - 1))) return false;
    low[axis] = std::uint32_t(at);
    part[axis] = at - double(low[axis]);
  }
  out = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    double weight = double(map.voxel_size);
    Vec3 centre;
    float* const coordinates[3] = {&centre.x, &centre.y, &centre.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t up = corner >> axis & 1;
      weight *= up != 0 ? part[axis] : 1 - part[axis];
      *coordinates[axis] = float(map.origin[axis] + (double(low[axis] + up) + 0.5) * double(map.voxel_size));
    }
    const detail::Voxel voxel = detail::find_voxel(map, centre);
    if (!detail::has_layer(map, voxel)) return false;
    out += weight * double(detail::layer_of(map, voxel));
  }
  return true;
}

class OtherReading final : public PairPeer {
 public:
  OtherReading(std::shared_ptr<const Asset> asset, Reading reading) : asset_(std::move(asset)), reading_(reading) {
    require_ok(asset_->pointshell(shell_));
    require_ok(asset_->voxelmap(map_));
  }
  PairAnswer query(const Pose& first_in_second) override {
    const Pose pose = in_asset_frame(*asset_, first_in_second);
    const auto& c = shell_.centre_of_mass;
    const Point centre = moved(pose, {double(c[0]), double(c[1]), double(c[2])});
    PairAnswer answer;
    answer.microseconds = kNotTold;
    answer.depth = -std::numeric_limits<double>::infinity();
    answer.force = answer.torque = {};
    for (std::uint32_t i = 0; i < shell_.points; ++i) {
      const Vec3 p = point_position(shell_, i);
      const Vec3 n = point_inward_normal(shell_, i);
      const Point at = moved(pose, {double(p.x), double(p.y), double(p.z)});
      const Point inward = rotated(pose, {double(n.x), double(n.y), double(n.z)});
      const double v = read_penetration(map_, reading_, {float(at[0]), float(at[1]), float(at[2])},
                                        {float(inward[0]), float(inward[1]), float(inward[2])});
      if (v > answer.depth) answer.depth = v;
      if (v < 0) continue;
      ++answer.contacts;
      const double weight = v * double(point_area(shell_, i));
      const Point arm = {at[0] - centre[0], at[1] - centre[1], at[2] - centre[2]};
      const Point moment = cross(arm, inward);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        answer.force[axis] += weight * inward[axis];
        answer.torque[axis] += weight * moment[axis];
      }
    }
    return answer;
  }

 private:
  std::shared_ptr<const Asset> asset_;
  const Reading reading_;
  PointshellView shell_;
  VoxelmapView map_;
};

}  // namespace

double read_penetration(const VoxelmapView& map, Reading reading, Vec3 point, Vec3 inward_normal) {
  if (reading == Reading::nearest && map.field != Field::layers) {
    const detail::FieldCell cell = detail::find_cell(map, point);
    const Point n = {double(inward_normal.x), double(inward_normal.y), double(inward_normal.z)};
    if (octree::is_brick(cell.entry)) return from_nearest(map, cell, n);
  }
  if (reading == Reading::trilinear && map.field == Field::layers) {
    double v = 0;
    if (between_centres(map, {double(point.x), double(point.y), double(point.z)}, v)) return v;
  }
  return double(penetration(map, point, inward_normal));
}

std::unique_ptr<PairPeer> read_otherwise(std::shared_ptr<const Asset> asset, Reading reading) {
  return std::make_unique<OtherReading>(std::move(asset), reading);
}

}  // namespace vps::lab
