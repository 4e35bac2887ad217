// SPDX-License-Identifier: GPL-3.0-or-later
// Cases on the energy that contacts add to a body.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/lab/stress/world.h"

namespace vps::stress {
namespace {

// Largest energy above the initial one, as a share of `scale`.
struct Gain {
  double most = 0;
  std::vector<double> trace;
};

template <class EachStep>
bool run(Arena& arena, double rate, double seconds, double scale, Gain& out, const EachStep& each_step) {
  const long steps = std::lround(seconds * rate);
  Trace trace(steps);
  const double first = arena.energy();
  for (long i = 0; i < steps; ++i) {
    if (!arena.step(1 / rate)) return false;
    each_step();
    const double gain = (arena.energy() - first) / scale;
    trace.add(gain);
    keep_largest(out.most, gain);
  }
  out.trace = trace.values;
  return true;
}

Trial of_gain(const Gain& gain, double limit) {
  Trial trial;
  trial.trace = gain.trace;
  judge(trial, 100 * gain.most, 100 * limit);
  return trial;
}

// Bounces on a plane with restitution 1, for 2 s.
Trial bounce(const Subject& subject, const Column& column, double rate) {
  constexpr double kSeconds = 2;
  Arena arena(subject, {column.detection});
  arena.add_plane().setRestitution(1);
  const double height = subject.size;
  btRigidBody& body = arena.add(column.body, subject.mass, standing(column.corners, height));
  body.setRestitution(1);
  body.setFriction(0);
  Gain gain;
  const double scale = subject.mass * kGravity * height;
  int bounces = 0;
  bool falls = true;
  const auto count = [&] {
    const bool now = body.getLinearVelocity().z() < 0;
    bounces += falls && !now ? 1 : 0;
    falls = now;
  };
  if (!run(arena, rate, kSeconds, scale, gain, count)) return broken(arena);
  const int expected = bounces_of_a_ball(height, kSeconds);
  Trial trial = of_gain(gain, expected * gain_of_a_late_bounce(height, rate));
  trial.remark =
      fmt::format("{:+.3g} % at the end, {} bounces of {} expected", 100 * gain.trace.back(), bounces, expected);
  return trial;
}

// Slides on a plane at 1 m/s.
Trial slide(const Subject& subject, const Column& column, double rate, double friction) {
  Arena arena(subject, {column.detection});
  arena.add_plane().setFriction(1);
  btRigidBody& body = arena.add(column.body, subject.mass, standing(column.corners, 0));
  body.setFriction(btScalar(friction));
  body.setLinearVelocity({1, 0, 0});
  Gain gain;
  if (!run(arena, rate, 5, 0.5 * subject.mass, gain, [] {})) return broken(arena);
  Trial trial = of_gain(gain, 0.05);
  trial.remark = fmt::format("{:+.3g} % at the end", 100 * gain.trace.back());
  return trial;
}

constexpr double kSpin = 2 * SIMD_PI * 100;  // [rad/s]

// Spins at 100 revolutions a second about one of the body's axes and falls on a plane.
Trial spin(const Subject& subject, const Column& column, double rate, int axis) {
  Arena arena(subject, {column.detection});
  arena.add_plane();
  btRigidBody& body = arena.add(column.body, subject.mass, standing(column.corners, subject.size / 2));
  btVector3 spin(0, 0, 0);
  spin[axis] = btScalar(kSpin);
  body.setAngularVelocity(spin);
  Gain gain;
  if (!run(arena, rate, 5, kinetic_energy(body), gain, [] {})) return broken(arena);
  Trial trial = of_gain(gain, 0.05);
  trial.remark = fmt::format("ends {:.2g} voxels from the plane, at {:.3g} m/s",
                             lowest(body, column.corners) / subject.voxel, double(body.getLinearVelocity().length()));
  return trial;
}

// A body with one moment of inertia far below the others, whatever its shape.
Trial near_singular(const Subject& subject, const Column& column, bool plate, double ratio) {
  Arena arena(subject, {column.detection});
  arena.add_plane();
  const double large = 0.1 * subject.mass * subject.size * subject.size;
  btVector3 inertia{btScalar(large), btScalar(large), btScalar(large / ratio)};
  // No moment of a body exceeds the sum of the other two, so two moments are large here as well.
  if (plate) inertia = {btScalar(large / ratio), btScalar(large), btScalar(large)};
  btRigidBody& body = arena.add(column.body, subject.mass, standing(column.corners, subject.size / 2), inertia);
  body.setAngularVelocity({1, 2, 3});
  Gain gain;
  if (!run(arena, 240, 8, subject.mass * kGravity * subject.size / 2, gain, [] {})) return broken(arena);
  Trial trial = of_gain(gain, 0.05);
  trial.remark = fmt::format("ends {:.2g} voxels from the plane, kinetic energy {:.2g} J",
                             lowest(body, column.corners) / subject.voxel, kinetic_energy(body));
  return trial;
}

}  // namespace

int bounces_of_a_ball(double height, double seconds) {
  const double fall = std::sqrt(2 * height / kGravity);
  return 1 + int(std::max(0.0, (seconds - fall) / (2 * fall)));
}

double gain_of_a_late_bounce(double height, double rate) {
  const double speed = std::sqrt(2 * kGravity * height);
  return speed / rate / height;
}

void add_energy_cases(std::vector<Case>& cases) {
  cases.push_back({
      .name = "restitution",
      .family = "energy",
      .question = "Does it bounce without gaining energy?",
      .setup = "Restitution 1, dropped from its own height, for 2 s.",
      .measured = "most energy above the first",
      .quantity = "energy gained",
      .unit = "%",
      .limit = "a step's way at the bounce, as height, for each bounce that a ball makes in 2 s",
      .limit_from =
          "A bounce is seen up to a step late: the body is up to v dt deep then, and lifted by that: m g v dt. From a "
          "height "
          "h a ball falls for t = sqrt(2 h / g) and bounces every 2 t from then on: 1 + floor((2 s - t) / (2 t)) "
          "times.",
      .axes = {{"rate", "Hz", {1000, 240, 60}, {240}}},
      .trace = "energy gained, as a share",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return bounce(subject, column, at[0]); },
  });
  cases.push_back({
      .name = "slide",
      .family = "energy",
      .question = "Does it slide without gaining energy?",
      .setup = "At 1 m/s on a plane, for 5 s.",
      .measured = "most energy above the first",
      .quantity = "energy gained",
      .unit = "%",
      .limit = "5 %",
      .limit_from = "Friction only takes; 5 % is a tolerance.",
      .axes = {{"rate", "Hz", {1000, 240, 60}, {240}}, {"friction", "", {0, 0.5}, {0.5}}},
      .trace = "energy gained, as a share",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return slide(subject, column, at[0], at[1]); },
  });
  cases.push_back({
      .name = "spin",
      .family = "energy",
      .question = "Does it land spinning without gaining energy?",
      .setup = "Falls on a plane at 100 revolutions a second.",
      .measured = "most energy above the first, of its spin",
      .quantity = "energy gained",
      .unit = "%",
      .limit = "5 %",
      .limit_from = "Contacts only take; 5 % is a tolerance. Bullet limits a body to a quarter of a turn a step: 240 "
                    "Hz slows it.",
      .axes = {{"rate", "Hz", {1000, 240}, {1000}}, {"axis", "", {0, 1, 2}, {0}, {"x", "y", "z"}}},
      .trace = "energy gained, as a share",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return spin(subject, column, at[0], int(at[1])); },
  });
  cases.push_back({
      .name = "near_singular_inertia",
      .family = "energy",
      .question = "Does it fall without gaining energy when its moments of inertia are very unequal?",
      .setup = "Falls on a plane, with one moment far below the others.",
      .measured = "most energy above the first, of its fall",
      .quantity = "energy gained",
      .unit = "%",
      .limit = "5 %",
      .limit_from = "As for spin.",
      .axes = {{"moments", "", {100, 1e4}, {1e4}}, {"along", "", {0, 1}, {}, {"z small", "x small"}}},
      .trace = "energy gained, as a share",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return near_singular(subject, column, at[1] > 0, at[0]); },
  });
}

}  // namespace vps::stress
