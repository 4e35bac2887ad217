// SPDX-License-Identifier: GPL-3.0-or-later
// Cases on bodies that should come to rest and stay still.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/lab/stress/world.h"

namespace vps::stress {
namespace {

// A voxel, and the part of a step's fall that Bullet's solver leaves: with 10 iterations about a hundredth.
double rest_limit_vx(const Subject& subject, double dt) {
  return 1 + 0.01 * kGravity * dt * dt / subject.voxel;
}

// Runs the world and measures one body in the last quarter of the time.
template <class Height>
Rest settle(Arena& arena, const btRigidBody& body, double rate, double seconds, const Height& height) {
  Rest out;
  const long steps = std::lround(seconds * rate);
  Trace trace(steps);
  for (long i = 0; i < steps; ++i) {
    if (!arena.step(1 / rate)) break;
    const double h = height();
    trace.add(h);
    if (i < 3 * steps / 4) continue;
    keep_largest(out.off, std::abs(h));
    keep_largest(out.kinetic, kinetic_energy(body));
  }
  out.trace = trace.values;
  out.failure = arena.failure();
  return out;
}

// Makes a trial that is still to be judged; it is broken where the run ended in NaN.
Trial trial_of(const Rest& rest, double voxel) {
  Trial trial;
  if (!rest.failure.empty()) {
    trial.verdict = Verdict::broken;
    trial.remark = rest.failure;
    return trial;
  }
  for (const double height : rest.trace) trial.trace.push_back(height / voxel);
  return trial;
}

// Runs a drop once for the two cases that judge it.
const Rest& rest_on_plane(const Subject& subject, const Column& column, double rate) {
  const auto [found, is_new] = subject.rests->try_emplace({column.name, rate});
  if (!is_new) return found->second;
  Arena arena(subject, {column.detection});
  arena.add_plane();
  const btRigidBody& body = arena.add(column.body, subject.mass, standing(column.corners, subject.size / 4));
  found->second = settle(arena, body, rate, 12, [&] { return lowest(body, column.corners); });
  return found->second;
}

Trial rest_depth(const Subject& subject, const Column& column, double rate) {
  const Rest& rest = rest_on_plane(subject, column, rate);
  Trial trial = trial_of(rest, subject.voxel);
  if (rest.failure.empty()) judge(trial, rest.off / subject.voxel, rest_limit_vx(subject, 1 / rate));
  return trial;
}

constexpr double kMostJitter = 0.1;  // [m g vx]

// Kinetic energy over the energy that lifts the body by a voxel; NaN where the run ended in one.
double jitter(const Subject& subject, const Rest& rest) {
  if (!rest.failure.empty()) return std::numeric_limits<double>::quiet_NaN();
  return rest.kinetic / (subject.mass * kGravity * subject.voxel);
}

Trial rest_jitter(const Subject& subject, const Column& column, double rate) {
  const Rest& rest = rest_on_plane(subject, column, rate);
  Trial trial = trial_of(rest, subject.voxel);
  if (!rest.failure.empty()) return trial;
  judge(trial, jitter(subject, rest), kMostJitter);
  if (trial.verdict == Verdict::held || !has_control(subject, column)) return trial;
  const double of_hull = jitter(subject, rest_on_plane(subject, subject.hull, rate));
  judge_beside(trial, trial.value, kMostJitter, of_hull);
  trial.remark = fmt::format("Bullet's hull {:.3g} m g vx", of_hull);
  return trial;
}

// Drops the body into a V of two slabs at 45 degrees.
Trial rest_in_wedge(const Subject& subject, const Column& column, double rate) {
  if (column.triangles > kMostTriangles) return skipped(kTooManyTriangles);
  Arena arena(subject, {column.detection});
  const double half = subject.size;
  const double thick = std::max(0.1 * subject.size, 4 * subject.voxel);
  const auto slab = subject.props->box(column, {btScalar(half), btScalar(half), btScalar(thick)}, Props::Role::still);
  for (const double side : {-1.0, 1.0}) {
    const btQuaternion lean(btVector3(0, 1, 0), btScalar(-side * SIMD_PI / 4));
    const btVector3 up = quatRotate(lean, btVector3(0, 0, 1));
    const btVector3 along = quatRotate(lean, btVector3(1, 0, 0)) * btScalar(side);
    arena.add(slab, 0, btTransform(lean, btScalar(half) * along - btScalar(thick) * up));
  }
  btRigidBody& body = arena.add(column.body, subject.mass, standing(column.corners, 0.6 * subject.size));
  const auto depth = [&] {
    // Distance of the lowest corner from the nearer face; negative below it.
    double low = 1e30;
    for (const btVector3& corner : column.corners) {
      const btVector3 p = body.getWorldTransform() * corner;
      low = std::min(low, double(p.z() - std::abs(p.x())) * SIMDSQRT12);
    }
    return low;
  };
  const Rest rest = settle(arena, body, rate, 12, depth);
  Trial trial = trial_of(rest, subject.voxel);
  if (!rest.failure.empty()) return trial;
  trial.remark = fmt::format("{:.2g} voxels from the faces", rest.off / subject.voxel);
  judge(trial, jitter(subject, rest), kMostJitter);
  if (rest.off > 2 * subject.voxel) trial.verdict = Verdict::broken;
  return trial;
}

// Drops a needle that is kept upright onto its tip.
Trial rest_on_tip(const Subject& subject, const Column& column, double rate) {
  std::vector<btVector3> corners;
  const double height = 50 * subject.voxel;
  const auto needle = subject.props->needle(column, 5 * subject.voxel, height, corners);
  Arena arena(subject, {column.detection});
  arena.add_plane();
  btRigidBody& body = arena.add(needle, subject.mass, standing(corners, 10 * subject.voxel));
  body.setAngularFactor(0);
  const Rest rest = settle(arena, body, rate, 8, [&] { return lowest(body, corners); });
  Trial trial = trial_of(rest, subject.voxel);
  if (!rest.failure.empty()) return trial;
  trial.remark =
      fmt::format("kinetic energy {:.2g} m g voxel", rest.kinetic / (subject.mass * kGravity * subject.voxel));
  judge(trial, rest.off / subject.voxel, rest_limit_vx(subject, 1 / rate));
  return trial;
}

}  // namespace

void add_rest_cases(std::vector<Case>& cases) {
  const Axis rates{"rate", "Hz", {1000, 500, 240, 120, 60, 30, 15, 10, 5}, {1000, 60, 10}};
  cases.push_back({
      .name = "rest_depth",
      .family = "rest",
      .question = "Does it stay on the ground?",
      .setup = "Dropped on a plane from a quarter of its length.",
      .measured = "lowest point from the plane, above or below, in the last 3 of 12 s",
      .quantity = "off the plane",
      .unit = "vx",
      .limit = "1 vx and a hundredth of a step's fall, g dt^2",
      .limit_from =
          "Contacts are made within a voxel; with 10 iterations the solver leaves about a hundredth of a step's fall.",
      .axes = {rates},
      .trace = "lowest point above the ground, in voxels",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return rest_depth(subject, column, at[0]); },
  });
  cases.push_back({
      .name = "rest_jitter",
      .family = "rest",
      .question = "Does it lie still on the ground?",
      .setup = "Dropped on a plane from a quarter of its length.",
      .measured = "largest kinetic energy in the last 3 of 12 s, over what lifts the body by a voxel",
      .quantity = "kinetic energy",
      .unit = "m g vx",
      .limit = "0.1 m g vx",
      .limit_from =
          "A body that jitters visibly hops by a voxel, for which it needs m g vx; a tenth of it is a tolerance. " +
          std::string(kHullControl),
      .axes = {rates},
      .trace = "lowest point above the ground, in voxels",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return rest_jitter(subject, column, at[0]); },
  });
  cases.push_back({
      .name = "wedge",
      .family = "rest",
      .question = "Does it lie still in a V?",
      .setup = "Dropped between two boxes that lean by 45 degrees.",
      .measured = "largest kinetic energy in the last 3 of 12 s, over what lifts the body by a voxel",
      .quantity = "kinetic energy",
      .unit = "m g vx",
      .limit = "0.1 m g vx, and no more than 2 vx from the faces",
      .limit_from =
          "The energy as for rest_jitter. Contacts are made within a voxel of a face; twice that is a tolerance.",
      .axes = {{"rate", "Hz", {1000, 240, 60}, {240}}},
      .trace = "lowest point above the ground, in voxels",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return rest_in_wedge(subject, column, at[0]); },
  });
  cases.push_back({
      .name = "tip",
      .family = "rest",
      .question = "Does a needle stand on its tip?",
      .setup = "50 voxels long and kept upright.",
      .measured = "tip from the plane, above or below, in the last 2 of 8 s",
      .quantity = "off the plane",
      .unit = "vx",
      .limit = "1 vx and a hundredth of a step's fall",
      .limit_from = "As for rest_depth.",
      .axes = {{"rate", "Hz", {1000, 240, 60}, {240}}},
      .trace = "lowest point above the ground, in voxels",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return rest_on_tip(subject, column, at[0]); },
  });
}

}  // namespace vps::stress
