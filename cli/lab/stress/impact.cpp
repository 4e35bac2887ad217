// SPDX-License-Identifier: GPL-3.0-or-later
// Cases on fast impacts, and on bodies that start in an overlap.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/lab/stress/world.h"

namespace vps::stress {
namespace {

constexpr double kRate = 240;  // [Hz]

enum class Wall : std::uint8_t { baked, bullet };

struct Throw {
  Wall wall = Wall::baked;
  double speed = 1;  // [m/s]
  double thickness_vx = 1;
  double restitution = 0;
};

// Throws a body at right angles to a wall, from distances spread over one step's travel.
Trial throw_at(const Subject& subject, const Column& column, const Throw& how) {
  if (column.triangles > kMostTriangles) return skipped(kTooManyTriangles);
  constexpr int kPhases = 4;
  const btVector3 half(btScalar(subject.size), btScalar(subject.size),
                       btScalar(0.5 * how.thickness_vx * subject.voxel));
  Column bullets = column;
  if (how.wall == Wall::bullet) bullets.ours = false;
  const lab::BulletShape wall = subject.props->box(bullets, half, Props::Role::still);
  double worst = -std::numeric_limits<double>::infinity();
  int through = 0;
  for (int phase = 0; phase < kPhases; ++phase) {
    Arena arena(subject, {column.detection, 0});
    arena.add(wall, 0, btTransform::getIdentity()).setRestitution(btScalar(how.restitution));
    const double way = how.speed / kRate;
    const double before = half.z() + 2 * subject.voxel + way * (1 + (phase + 0.5) / kPhases);
    btRigidBody& body = arena.add(column.body, subject.mass, standing(column.corners, before));
    body.setRestitution(btScalar(how.restitution));
    body.setLinearVelocity({0, 0, -btScalar(how.speed)});
    for (int i = 0; i < 60; ++i) {
      if (!arena.step(1 / kRate)) return broken(arena);
    }
    // Distance of the leading point beyond the wall's back.
    const double beyond = -double(half.z()) - lowest(body, column.corners);
    keep_largest(worst, beyond);
    through += beyond > subject.voxel ? 1 : 0;
  }
  Trial trial;
  if (through > 0) trial.remark = fmt::format("through in {} of {} throws", through, kPhases);
  // At most the body's length counts: beyond it the distance only shows the speed.
  judge(trial, std::min(worst, subject.size) / subject.voxel, 1);
  return trial;
}

struct Emergence {
  double gained = 0;  // most energy above the first. [m g depth]
  double left = 0;    // depth at the end. [vx]
  std::vector<double> trace;
};

// Starts a body of the column in a slab. @return false when a value is not finite
bool emerge(Arena& arena, const Subject& subject, const Column& column, double depth, Emergence& out) {
  const btVector3 half(btScalar(subject.size), btScalar(subject.size), btScalar(0.5 * subject.size));
  arena.add(subject.props->box(column, half, Props::Role::still), 0,
            btTransform(btQuaternion::getIdentity(), btVector3(0, 0, -half.z())));
  btRigidBody& body = arena.add(column.body, subject.mass, standing(column.corners, -depth));
  constexpr long kSteps = 10 * long(kRate);
  Trace trace(kSteps);
  const double first = arena.energy();
  for (long i = 0; i < kSteps; ++i) {
    if (!arena.step(1 / kRate)) return false;
    keep_largest(out.gained, (arena.energy() - first) / (subject.mass * kGravity * depth));
    trace.add(lowest(body, column.corners) / subject.voxel);
  }
  out.left = -lowest(body, column.corners) / subject.voxel;
  out.trace = trace.values;
  return true;
}

Trial deep_overlap(const Subject& subject, const Column& column, double share) {
  if (column.triangles > kMostTriangles) return skipped(kTooManyTriangles);
  constexpr double kMostGained = 2;  // [m g depth]
  constexpr double kMostLeft = 2;    // [vx]
  const double depth = share * subject.size;
  Emergence measured;
  Arena arena(subject, {column.detection});
  if (!emerge(arena, subject, column, depth, measured)) return broken(arena);
  Trial trial;
  trial.trace = measured.trace;
  trial.remark = fmt::format("starts {:.3g} voxels deep, ends {:.2g}", depth / subject.voxel, measured.left);
  judge(trial, measured.gained, kMostGained);
  const bool stays = measured.left > kMostLeft;
  if (stays) {
    trial.verdict = Verdict::broken;
    trial.remark += ": does not leave";
  }
  if (trial.verdict == Verdict::held || !has_control(subject, column)) return trial;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  Emergence hull;
  Arena control(subject, {});
  if (!emerge(control, subject, subject.hull, depth, hull)) hull.gained = hull.left = kNone;
  trial.remark +=
      fmt::format("; Bullet's hull gains {:.3g} m g depth and ends {:.2g} voxels deep", hull.gained, hull.left);
  // Each limit that is broken has to be broken by the hull, too.
  const bool gain_as_hull = measured.gained <= kMostGained || is_as_bullets(measured.gained, kMostGained, hull.gained);
  if (gain_as_hull && (!stays || is_as_bullets(measured.left, kMostLeft, hull.left))) trial.verdict = Verdict::solver;
  return trial;
}

// Two bodies of the asset at one pose, or slightly apart.
Trial coincident(const Subject& subject, const Column& column, double offset_vx) {
  if (column.triangles > kMostTriangles) return skipped(kTooManyTriangles);
  Arena arena(subject, {column.detection, 0});
  arena.add(column.body, subject.mass, btTransform::getIdentity());
  btRigidBody& other =
      arena.add(column.body, subject.mass,
                btTransform(btQuaternion::getIdentity(), btVector3(btScalar(offset_vx * subject.voxel), 0, 0)));
  constexpr long kSteps = 5 * long(kRate);
  Trace trace(kSteps);
  double gained = 0;
  for (long i = 0; i < kSteps; ++i) {
    if (!arena.step(1 / kRate)) return broken(arena);
    keep_largest(gained, arena.kinetic_energy());
    trace.add(arena.kinetic_energy());
  }
  Trial trial;
  trial.trace = trace.values;
  trial.remark = fmt::format("{:.3g} lengths apart after 5 s",
                             double(other.getWorldTransform().getOrigin().length()) / subject.size);
  judge(trial, gained / (subject.mass * kGravity * subject.size), 1);
  return trial;
}

}  // namespace

void add_impact_cases(std::vector<Case>& cases) {
  const std::string measured =
      "leading point beyond the wall's back after 0.25 s, no more than the body's length; worst of 4 throws";
  const std::string reason =
      "A body that was stopped is in front of the wall; contacts are made within a voxel. Stated with "
      "ContinuousMotion: "
      "without it, as bodies are by default, the README promises nothing about thin walls.";
  const std::vector<Axis> axes{{"speed", "m/s", {1, 3, 10, 30, 100}, {1, 10, 100}},
                               {"wall", "vx", {0.5, 1, 2, 4}, {0.5, 4}}};
  cases.push_back({
      .name = "impact_baked",
      .family = "impact",
      .question = "Does a thin baked wall stop it?",
      .setup = "Thrown at the wall at 240 Hz, without restitution.",
      .measured = measured,
      .quantity = "beyond the wall's back",
      .below_zero = "before the wall's back",
      .unit = "vx",
      .limit = "1 vx",
      .limit_from = reason,
      .axes = axes,
      .needs_continuous = true,
      .run =
          [](const Subject& subject, const Column& column, std::span<const double> at) {
            return throw_at(subject, column, {Wall::baked, at[0], at[1]});
          },
  });
  cases.push_back({
      .name = "impact_box",
      .family = "impact",
      .question = "Does a thin box of Bullet's own stop it?",
      .setup = "Thrown at the box at 240 Hz, without restitution.",
      .measured = measured,
      .quantity = "beyond the wall's back",
      .below_zero = "before the wall's back",
      .unit = "vx",
      .limit = "1 vx",
      .limit_from = reason,
      .axes = axes,
      .needs_continuous = true,
      .run =
          [](const Subject& subject, const Column& column, std::span<const double> at) {
            return throw_at(subject, column, {Wall::bullet, at[0], at[1]});
          },
  });
  cases.push_back({
      .name = "impact_bouncing",
      .family = "impact",
      .question = "Does a thin baked wall stop it when it bounces?",
      .setup = "Thrown at the wall at 240 Hz with restitution 0.5, which gets no speculative contacts.",
      .measured = measured,
      .quantity = "beyond the wall's back",
      .below_zero = "before the wall's back",
      .unit = "vx",
      .limit = "1 vx",
      .limit_from = reason,
      .axes = {{"speed", "m/s", {1, 10, 100}, {10}}, {"wall", "vx", {0.5, 4}, {4}}},
      .needs_continuous = true,
      .run =
          [](const Subject& subject, const Column& column, std::span<const double> at) {
            return throw_at(subject, column, {Wall::baked, at[0], at[1], 0.5});
          },
  });
  cases.push_back({
      .name = "deep_overlap",
      .family = "impact",
      .question = "Does it come out of a slab without being shot off?",
      .setup = "It starts in the slab by a part of its length.",
      .measured = "most energy above the first in 10 s, over what lifts the body by the overlap",
      .quantity = "energy gained",
      .unit = "m g depth",
      .limit = "2 m g depth, and out to 2 vx in the end",
      .limit_from = "Lifting the body out takes m g depth; as much again would throw it up by the overlap. " +
                    std::string(kHullControl),
      .axes = {{"overlap", "of the length", {0.01, 0.03, 0.1, 0.3}, {0.03, 0.3}}},
      .trace = "lowest point above the slab, in voxels",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return deep_overlap(subject, column, at[0]); },
  });
  cases.push_back({
      .name = "coincident",
      .family = "impact",
      .question = "Do two at the same place stay calm?",
      .setup = "Two of the asset at the same pose, without gravity.",
      .measured = "largest kinetic energy in 5 s, over what lifts the body by its length",
      .quantity = "kinetic energy",
      .unit = "m g length",
      .limit = "1 m g length",
      .limit_from =
          "What a fall from its own height would give is a tolerance; where there is no way out, to stay is right.",
      .axes = {{"offset", "vx", {0, 0.01, 1}, {0}}},
      .needs = Requirement::both,
      .trace = "kinetic energy, J",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return coincident(subject, column, at[0]); },
  });
}

}  // namespace vps::stress
