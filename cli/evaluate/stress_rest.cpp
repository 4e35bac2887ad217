// SPDX-License-Identifier: GPL-3.0-or-later
// Bodies that should come to rest, and stay there.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/evaluate/stress_world.h"

namespace vps::stress {
namespace {

constexpr double kGravity = 9.81;  // [m/s^2]

// What Bullet's solver leaves of a step's fall: with 10 iterations about a hundredth.
double rest_limit_vx(const Subject& subject, double dt) {
  return 1 + 0.01 * kGravity * dt * dt / subject.voxel;
}

struct Rest {
  double off = 0;      // lowest point from the ground, either way, in the last part. [m]
  double kinetic = 0;  // largest in the last part. [J]
  std::vector<double> trace;
};

// Runs the world and watches one body for the last quarter. @return false for NaN
template <class Height>
bool settle(Arena& arena, const btRigidBody& body, double rate, double seconds, const Height& height, Rest& out) {
  const long steps = std::lround(seconds * rate);
  Trace trace(steps);
  for (long i = 0; i < steps; ++i) {
    if (!arena.step(1 / rate)) return false;
    const double h = height();
    trace.add(h);
    if (i < 3 * steps / 4) continue;
    out.off = std::max(out.off, std::abs(h));
    out.kinetic = std::max(out.kinetic, kinetic_energy(body));
  }
  out.trace = trace.values;
  return true;
}

enum class Watched : std::uint8_t { depth, jitter };

Trial rest_on_plane(const Subject& subject, const Column& column, double rate, Watched watched) {
  Arena arena({column.motion});
  arena.add_plane();
  btRigidBody& body = arena.add(column.body, subject.mass, standing(column.corners, subject.size / 4));
  Rest rest;
  if (!settle(
          arena, body, rate, 12, [&] { return lowest(body, column.corners); }, rest))
    return broken(arena);
  Trial trial;
  for (double& height : rest.trace) height /= subject.voxel;
  trial.trace = rest.trace;
  if (watched == Watched::depth) {
    judge(trial, rest.off / subject.voxel, rest_limit_vx(subject, 1 / rate));
  } else {
    judge(trial, rest.kinetic / (subject.mass * kGravity * subject.voxel), 0.1);
  }
  return trial;
}

// A V of two slabs whose tops lean by 45 degrees.
Trial rest_in_wedge(const Subject& subject, const Column& column, double rate) {
  if (column.triangles > kMostTriangles) return skipped(kTooManyTriangles);
  Arena arena({column.motion});
  const double half = subject.size;
  const double thick = std::max(0.1 * subject.size, 4 * subject.voxel);
  const auto slab = subject.props->box(column, {btScalar(half), btScalar(half), btScalar(thick)}, Props::Part::still);
  for (const double side : {-1.0, 1.0}) {
    const btQuaternion lean(btVector3(0, 1, 0), btScalar(-side * SIMD_PI / 4));
    const btVector3 up = quatRotate(lean, btVector3(0, 0, 1));
    const btVector3 along = quatRotate(lean, btVector3(1, 0, 0)) * btScalar(side);
    arena.add(slab, 0, btTransform(lean, btScalar(half) * along - btScalar(thick) * up));
  }
  btRigidBody& body = arena.add(column.body, subject.mass, standing(column.corners, 0.6 * subject.size));
  const auto depth = [&] {
    // Below either face.
    double low = 1e30;
    for (const btVector3& corner : column.corners) {
      const btVector3 p = body.getWorldTransform() * corner;
      low = std::min(low, double(p.z() - std::abs(p.x())) * SIMDSQRT12);
    }
    return low;
  };
  Rest rest;
  if (!settle(arena, body, rate, 12, depth, rest)) return broken(arena);
  Trial trial;
  for (double& height : rest.trace) height /= subject.voxel;
  trial.trace = rest.trace;
  trial.remark = fmt::format("{:.2g} voxels from the faces", rest.off / subject.voxel);
  judge(trial, rest.kinetic / (subject.mass * kGravity * subject.voxel), 0.1);
  if (rest.off > 2 * subject.voxel) trial.verdict = Verdict::broken;
  return trial;
}

// A needle that is kept upright stands on its tip.
Trial rest_on_tip(const Subject& subject, const Column& column, double rate) {
  std::vector<btVector3> corners;
  const double height = 50 * subject.voxel;
  const auto needle = subject.props->needle(column, 5 * subject.voxel, height, corners);
  Arena arena({column.motion});
  arena.add_plane();
  btRigidBody& body = arena.add(needle, subject.mass, standing(corners, 10 * subject.voxel));
  body.setAngularFactor(0);
  Rest rest;
  if (!settle(
          arena, body, rate, 8, [&] { return lowest(body, corners); }, rest))
    return broken(arena);
  Trial trial;
  for (double& h : rest.trace) h /= subject.voxel;
  trial.trace = rest.trace;
  trial.remark =
      fmt::format("kinetic energy {:.2g} m g voxel", rest.kinetic / (subject.mass * kGravity * subject.voxel));
  judge(trial, rest.off / subject.voxel, rest_limit_vx(subject, 1 / rate));
  return trial;
}

}  // namespace

void add_rest_cases(std::vector<Case>& cases) {
  const Axis rates{"rate", "Hz", {1000, 500, 240, 120, 60, 30, 15, 10, 5}, {1000, 60, 10}};
  Case one;
  one.family = "rest";
  one.axes = {rates};
  one.trace = "lowest point above the ground, in voxels";

  one.name = "rest_depth";
  one.question = "Dropped from a quarter of its length, does the body come to rest on a plane at any step?";
  one.measured = "lowest point from the plane, above or below, in the last 3 of 12 s";
  one.unit = "vx";
  one.limit = "1 vx and a hundredth of a step's fall, g dt^2";
  one.limit_from =
      "Contacts are made within a voxel; with 10 iterations the solver leaves about a hundredth of a step's fall.";
  one.run = [](const Subject& subject, const Column& column, std::span<const double> at) {
    return rest_on_plane(subject, column, at[0], Watched::depth);
  };
  cases.push_back(one);

  one.name = "rest_jitter";
  one.question = "And does it stay still there?";
  one.measured = "largest kinetic energy in the last 3 of 12 s, over what lifts the body by a voxel";
  one.unit = "m g vx";
  one.limit = "0.1 m g vx";
  one.limit_from =
      "A body that jitters visibly hops by a voxel, for which it needs m g vx; a tenth of it is a tolerance.";
  one.run = [](const Subject& subject, const Column& column, std::span<const double> at) {
    return rest_on_plane(subject, column, at[0], Watched::jitter);
  };
  cases.push_back(one);

  one.name = "wedge";
  one.question = "Dropped into a V of two boxes that lean by 45 degrees, does it stay still there?";
  one.limit = "0.1 m g vx, and no more than 2 vx from the faces";
  one.axes = {{"rate", "Hz", {1000, 240, 60}, {240}}};
  one.run = [](const Subject& subject, const Column& column, std::span<const double> at) {
    return rest_in_wedge(subject, column, at[0]);
  };
  cases.push_back(one);

  one.name = "tip";
  one.question = "Does a needle, 50 voxels long and kept upright, stand on its tip?";
  one.measured = "tip from the plane, above or below, in the last 2 of 8 s";
  one.unit = "vx";
  one.limit = "1 vx and a hundredth of a step's fall";
  one.limit_from = "As for rest_depth.";
  one.run = [](const Subject& subject, const Column& column, std::span<const double> at) {
    return rest_on_tip(subject, column, at[0]);
  };
  cases.push_back(one);
}

}  // namespace vps::stress
