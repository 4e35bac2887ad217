// SPDX-License-Identifier: Zlib
// Static virtual coupling with contacts as constraints: a small quadratic program, by Gauss-Seidel on its dual.
#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/contacts/six.h"
#include "runtime/fields/place_field.h"
#include "runtime/vps_haptics.h"
#include "runtime/vps_queries.h"

namespace vps {
namespace {

using namespace detail;

// Rotation vector of a matrix, at most pi long.
void rotation_vector(const double (&r)[9], double* out) noexcept {
  const double axis[3] = {r[7] - r[5], r[2] - r[6], r[3] - r[1]};  // 2 sin(angle) times the axis
  const double sine = 0.5 * std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  const double cosine = std::clamp(0.5 * (r[0] + r[4] + r[8] - 1), -1.0, 1.0);
  const double angle = std::atan2(sine, cosine);
  if (sine > 1e-8) {
    for (int i = 0; i < 3; ++i) out[i] = 0.5 * axis[i] * angle / sine;
    return;
  }
  if (cosine > 0) {
    for (int i = 0; i < 3; ++i) out[i] = 0.5 * axis[i];
    return;
  }
  // Half a turn: r = 2 a a^T - 1.
  const int most = r[0] > r[4] ? (r[0] > r[8] ? 0 : 2) : (r[4] > r[8] ? 1 : 2);
  const double a = std::sqrt(std::max(0.5 * (r[4 * most] + 1), 0.25));
  for (int i = 0; i < 3; ++i) {
    out[i] = angle * (i == most ? a : 0.25 * (r[3 * most + i] + r[3 * i + most]) / a);
  }
}

// The motion from `from` to `to`: translation, then rotation about the centre of mass.
Six difference(const PointshellView& tool, const Pose& from, const Pose& to) noexcept {
  Six out{};
  double turn[9];
  for (int i = 0; i < 3; ++i) {
    out[static_cast<std::size_t>(i)] = to.translation[i] - from.translation[i];
    for (int j = 0; j < 3; ++j) {
      out[static_cast<std::size_t>(i)] += (to.rotation[3 * i + j] - from.rotation[3 * i + j]) * tool.centre_of_mass[j];
      turn[3 * i + j] = 0;
      for (int k = 0; k < 3; ++k) turn[3 * i + j] += to.rotation[3 * i + k] * from.rotation[3 * j + k];
    }
  }
  rotation_vector(turn, out.data() + 3);
  return out;
}

Pose moved(const PointshellView& tool, const Pose& pose, const Six& by) noexcept {
  Sweep sweep;
  sweep.start = pose;
  std::copy_n(by.begin(), 3, sweep.velocity);
  std::copy_n(by.begin() + 3, 3, sweep.angular_velocity);
  return pose_at(tool, sweep, 1);
}

double length_of(const double* v) noexcept {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// Upper bound of the points' distance from the centre of mass, which need not be near the root sphere's centre. [m]
double turning_radius(const PointshellView& tool) noexcept {
  const float* const c = tool.centre_of_mass;
  const Vec3 root = sphere_centre(tool, 0);
  const double apart[3] = {double{root.x} - double{c[0]}, double{root.y} - double{c[1]}, double{root.z} - double{c[2]}};
  return length_of(apart) + double{sphere_radius(tool, 0)};
}

Status check(const CouplingOptions& options) noexcept {
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  const bool good = positive(options.linear_stiffness) && positive(options.angular_stiffness) &&
                    positive(options.max_force) && options.max_iterations > 0 && options.max_microseconds >= 0;
  return good ? Status::ok : Status::bad_argument;
}

}  // namespace

VirtualTool::VirtualTool(const PointshellView& tool, const VoxelmapView& map, const Pose& start,
                         const CouplingOptions& options)
    : tool_(&tool), map_(&map), options_(options), pose_(start), contacts_(tool.points) {
  scratch_.reserve(tool);
  constraints_.reserve(tool.points);
}

Status VirtualTool::find_constraints(HapticCycle& cycle, double& free_way) noexcept {
  QueryOptions query;
  // Finds all contacts that one iteration may reach.
  query.contact_distance = map_->voxel_size;
  query.max_microseconds = options_.max_microseconds;
  query.cache = options_.max_microseconds > 0 ? nullptr : &cache_;
  QueryResult result;
  const Status status = traverse(*tool_, *map_, pose_, query, scratch_, contacts_, result);
  if (status != Status::ok) return status;
  cycle.penetration = result.delta;
  cycle.complete = cycle.complete && result.complete;
  free_way = std::max<double>(map_->voxel_size, -result.delta_bound);
  const float* const c = tool_->centre_of_mass;
  const Vec3 centre = Transform(pose_).apply({c[0], c[1], c[2]});
  constraints_.clear();
  for (const Contact& contact : std::span(contacts_.data(), result.contacts)) {
    // At edges the shell's normals point between the faces; the map's are right there.
    Vec3 out = normal_at(*map_, contact.position);
    if (!(detail::dot(out, out) > 0)) out = contact.inward_normal;
    const Vec3 turn = cross(contact.position - centre, out);
    constraints_.push_back({{out.x, out.y, out.z, turn.x, turn.y, turn.z}, double{contact.penetration}, 0});
  }
  return status;
}

// The move nearest to `wish`, measured by the spring's energy, that keeps V <= 0 at each contact to first order.
VirtualTool::Vector6 VirtualTool::constrained(const Six& wish, HapticCycle& cycle) noexcept {
  const double stiffness[2] = {options_.linear_stiffness, options_.angular_stiffness};
  Six move = wish;
  constexpr int kSweeps = 64;
  const double fine = 1e-3 * double{map_->voxel_size};
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double worst = 0;
    for (Constraint& c : constraints_) {
      const double excess = c.penetration - dot(c.out, move);
      double mobility = 0;
      for (std::size_t i = 0; i < 6; ++i) mobility += c.out[i] * c.out[i] / stiffness[i / 3];
      const double pressed = std::max(0.0, c.force + excess / mobility);
      const double change = pressed - c.force;
      if (change == 0) continue;
      c.force = pressed;
      for (std::size_t i = 0; i < 6; ++i) move[i] += change * c.out[i] / stiffness[i / 3];
      worst = std::max(worst, std::abs(change) * mobility);
    }
    if (worst < fine) break;
  }
  // Sweeps may end before they converge if rotation is far softer than translation. The move is then shortened so that
  // no contact gets deeper.
  double share = 1;
  for (const Constraint& c : constraints_) {
    const double deeper = -dot(c.out, move);
    const double room = std::max(10 * fine - c.penetration, 0.0);
    if (deeper > room) share = std::min(share, room / deeper);
  }
  for (double& x : move) x *= share;
  cycle.contacts = static_cast<std::uint32_t>(
      std::count_if(constraints_.begin(), constraints_.end(), [](const Constraint& c) { return c.force > 0; }));
  return move;
}

Status VirtualTool::step(const Pose& device, HapticCycle& cycle) noexcept {
  cycle = {};
  cycle.tool = pose_;
  if (const Status status = check(options_); status != Status::ok) return status;
  if (const Status status = check_pose(device); status != Status::ok) return status;
  const Pose before = pose_;
  for (;; ++cycle.iterations) {
    double free_way = 0;
    if (const Status status = find_constraints(cycle, free_way); status != Status::ok) {
      pose_ = cycle.tool = before;
      return status;
    }
    if (cycle.iterations == options_.max_iterations) break;
    Six move = constrained(difference(*tool_, pose_, device), cycle);
    // Not beyond the distance in which contacts were searched.
    const double way = length_of(move.data()) + length_of(move.data() + 3) * turning_radius(*tool_);
    if (way > free_way) {
      for (double& x : move) x *= free_way / way;
    }
    pose_ = moved(*tool_, pose_, move);
    if (way < 1e-3 * double{map_->voxel_size}) break;
  }
  cycle.tool = pose_;
  const double stiffness[2] = {options_.linear_stiffness, options_.angular_stiffness};
  Six spring = difference(*tool_, device, pose_);
  for (std::size_t i = 0; i < 6; ++i) spring[i] *= stiffness[i / 3];
  const double force = length_of(spring.data());
  const double scale = force > options_.max_force ? options_.max_force / force : 1;
  for (std::size_t i = 0; i < 3; ++i) {
    cycle.felt.force[i] = scale * spring[i];
    cycle.felt.torque[i] = scale * spring[3 + i];
  }
  return Status::ok;
}

}  // namespace vps
