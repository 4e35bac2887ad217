// SPDX-License-Identifier: GPL-3.0-or-later
// Cases on piles of bodies, and on bodies on springs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/lab/stress/rest_poses.h"
#include "cli/lab/stress/world.h"

namespace vps::stress {
namespace {

// A body in the pose in which it stands on another or on a plane.
struct Standing {
  lab::BulletShape shape;
  std::vector<btVector3> corners;
  btMatrix3x3 rotation;
};

// Bullet's box with the bounds of the standing body.
Standing box_of(const Standing& body) {
  btVector3 low(1e30F, 1e30F, 1e30F);
  btVector3 high(-low);
  for (const btVector3& corner : body.corners) {
    const btVector3 turned = body.rotation * corner;
    low.setMin(turned);
    high.setMax(turned);
  }
  const btVector3 half = (high - low) / 2;
  Standing box{{{}, std::make_shared<btBoxShape>(half)}, {}, btMatrix3x3::getIdentity()};
  box.shape.shape->setMargin(std::min(box.shape.shape->getMargin(), btScalar(0.1) * half[half.minAxis()]));
  for (int i = 0; i < 8; ++i) {
    box.corners.emplace_back((i & 1) != 0 ? half.x() : -half.x(), (i & 2) != 0 ? half.y() : -half.y(),
                             (i & 4) != 0 ? half.z() : -half.z());
  }
  return box;
}

struct Pile {
  double between = 0, below = 0;  // largest gap or overlap in the second half. [m]
  bool left = false;              // the body moved off the slab
  std::vector<double> trace;
};

struct PileOptions {
  double upper_mass = 1, lower_mass = 1;  // [kg]
  btVector3 half;                         // of the slab. [m]
  double start = 0;                       // initial height of the body above the slab. [m]
  double seconds = 10;
};

// One body on a free slab on a plane. @return false when a value is not finite
bool pile(Arena& arena, const Standing& upper, const lab::BulletShape& slab_shape, const PileOptions& options,
          Pile& out) {
  constexpr double kPileRate = 240;
  const btVector3& half = options.half;
  arena.add_plane();
  const btRigidBody& slab =
      arena.add(slab_shape, options.lower_mass, btTransform(btQuaternion::getIdentity(), btVector3(0, 0, half.z())));
  btTransform at(upper.rotation);
  at.getOrigin().setZ(btScalar(2 * half.z()) + btScalar(options.start) - btScalar(lowest(at, upper.corners)));
  const btRigidBody& body = arena.add(upper.shape, options.upper_mass, at);
  const std::vector<btVector3> feet{{half.x(), half.y(), -half.z()},
                                    {-half.x(), half.y(), -half.z()},
                                    {half.x(), -half.y(), -half.z()},
                                    {-half.x(), -half.y(), -half.z()}};
  const long steps = std::lround(options.seconds * kPileRate);
  Trace trace(steps);
  for (long i = 0; i < steps; ++i) {
    if (!arena.step(1 / kPileRate)) return false;
    const btTransform in_slab = slab.getWorldTransform().inverse() * body.getWorldTransform();
    const double gap = lowest(in_slab, upper.corners) - double(half.z());
    trace.add(gap);
    if (i < steps / 2) continue;
    keep_largest(out.between, std::abs(gap));
    keep_largest(out.below, std::abs(lowest(slab, feet)));
    const btVector3& place = in_slab.getOrigin();
    out.left = out.left || std::abs(place.x()) > half.x() || std::abs(place.y()) > half.y();
  }
  out.trace = trace.values;
  return true;
}

// ratio: the upper's mass over the lower's.
Trial mass_ratio(const Subject& subject, const Column& column, double ratio, double seconds) {
  if (column.triangles > kMostTriangles) return skipped(kTooManyTriangles);
  const auto poses = rest_poses(subject.corners, 0.5 * subject.voxel, 1);
  if (poses.empty()) return skipped("no pose in which the asset stands");
  // Wide enough for the body in any rotation, and for some sliding.
  btScalar radius = 0;
  for (const btVector3& corner : subject.corners) radius = std::max(radius, corner.length());
  PileOptions options;
  options.half = {btScalar(1.3) * radius, btScalar(1.3) * radius,
                  btScalar(std::max(0.1 * subject.size, 4 * subject.voxel))};
  // The lighter of the two has the wanted mass.
  options.upper_mass = ratio >= 1 ? subject.mass * ratio : subject.mass;
  options.lower_mass = ratio >= 1 ? subject.mass : subject.mass / ratio;
  options.start = subject.voxel;
  options.seconds = seconds;
  const Standing body{column.body, column.corners, poses[0].rotation};
  const auto slab_of = [&](const Column& one) { return subject.props->box(one, options.half, Props::Role::mixed); };
  Column bullets = column;
  bullets.ours = false;
  Pile boxes;
  Arena control(subject, {});
  const bool finite = pile(control, box_of(body), slab_of(bullets), options, boxes);
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto worst = [&](const Pile& one) { return std::max(one.between, one.below) / subject.voxel; };
  const double of_boxes = finite ? worst(boxes) : kNone;
  Pile measured;
  Arena arena(subject, {column.detection});
  if (!pile(arena, body, slab_of(column), options, measured)) return broken(arena);
  Trial trial;
  trial.trace = measured.trace;
  for (double& gap : trial.trace) gap /= subject.voxel;
  trial.remark = fmt::format("between the two {:.2g}, slab and plane {:.2g}; Bullet's boxes {:.2g} vx",
                             measured.between / subject.voxel, measured.below / subject.voxel, of_boxes);
  if (measured.left) trial.remark = "walks off the slab; " + trial.remark;
  constexpr double kLimit = 1;  // [vx]
  judge_beside(trial, worst(measured), kLimit, of_boxes);
  if (trial.verdict != Verdict::broken || !has_control(subject, column)) return trial;
  // A box may hold where the body's own hull does not, as one that rolls.
  const Standing as_hull{subject.hull.body, subject.hull.corners, body.rotation};
  Pile hull;
  Arena beside(subject, {});
  const double of_hull = pile(beside, as_hull, slab_of(bullets), options, hull) ? worst(hull) : kNone;
  trial.remark += fmt::format(", its hull {:.2g} vx", of_hull);
  judge_beside(trial, worst(measured), kLimit, of_hull);
  return trial;
}

struct Fall {
  double seconds = 0;  // until a body was a quarter of its height from its place, or until the end
  std::vector<double> trace;
};

constexpr double kFallen = 0.25;

// A stack of ten equal bodies. @return false when a value is not finite
bool topple(Arena& arena, const StackBody& part, double mass, double rate, double seconds, Fall& out) {
  constexpr int kBodies = 10;
  arena.add_plane();
  std::vector<btRigidBody*> bodies;
  std::vector<btVector3> places;
  for (int i = 0; i < kBodies; ++i) {
    btTransform at = part.at;
    at.getOrigin().setZ(at.getOrigin().z() + btScalar(i * part.height));
    places.push_back(at.getOrigin());
    bodies.push_back(&arena.add(part.shape, mass, at));
  }
  const long steps = std::lround(seconds * rate);
  Trace trace(steps);
  for (long i = 0; i < steps; ++i) {
    if (!arena.step(1 / rate)) return false;
    double off = 0;  // largest distance from its place, over the height
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const btVector3 moved = bodies[b]->getWorldTransform().getOrigin() - places[b];
      off = std::max(off, double(moved.length()) / part.height);
    }
    trace.add(off);
    if (!(off <= kFallen)) break;
    out.seconds = i + 1 == steps ? seconds : double(i + 1) / rate;
  }
  out.trace = trace.values;
  return true;
}

struct StackOptions {
  double rate = 240;
  int iterations = 10;
  double seconds = 60;
};

// Stacks ten bodies of `stack_body`, and Bullet's boxes of the same size to compare.
Trial stack(const Subject& subject, const Column& column, const StackOptions& options) {
  if (column.triangles > kMostTriangles) return skipped(kTooManyTriangles);
  const StackBody part = stack_body(subject, column);
  StackBody box = part;
  const Standing as_box = box_of({part.shape, part.corners, part.at.getBasis()});
  box.shape = as_box.shape;
  box.at.setBasis(as_box.rotation);
  box.at.getOrigin().setZ(btScalar(0.5 * part.height));
  Fall boxes;
  Arena control(subject, {Detection::discrete, kGravity, options.iterations});
  (void)topple(control, box, subject.mass, options.rate, options.seconds, boxes);
  Fall fall;
  Arena arena(subject, {column.detection, kGravity, options.iterations});
  if (!topple(arena, part, subject.mass, options.rate, options.seconds, fall)) return broken(arena);
  Trial trial;
  trial.trace = fall.trace;
  trial.remark =
      fmt::format("stands for {:.2g} s, Bullet's boxes for {:.2g} s; {}", fall.seconds, boxes.seconds, part.what);
  judge_standing(trial, fall.seconds, options.seconds, boxes.seconds);
  return trial;
}

// Contacts as springs of Bullet's solver, also stiffer than is stable with explicit steps.
Trial foundation(const Subject& subject, const Column& column, double rate, double share) {
  if (!column.ours) return skipped("no springs by area");
  const auto poses = rest_poses(subject.corners, 0.5 * subject.voxel, 1);
  if (poses.empty()) return skipped("no pose in which the asset stands");
  Arena arena(subject, {column.detection});
  arena.world().getSolverInfo().m_splitImpulse = 0;
  arena.add_plane();
  const auto shape = std::make_shared<bullet::Shape>(subject.asset);
  // The bound of an explicit loop for the area of the face: k dt^2 = 4 m.
  const double area = SIMD_PI * poses[0].flat * poses[0].flat;
  const double stiffness = share * 4 * subject.mass * rate * rate / area;
  (void)shape->set_foundation({stiffness, 0.1 * stiffness / rate});
  btTransform at(poses[0].rotation);
  at.getOrigin().setZ(btScalar(subject.voxel - lowest(at, column.corners)));
  btRigidBody& body = arena.add({{}, shape}, subject.mass, at);
  const double first = arena.energy();
  const long steps = std::lround(4 * rate);
  Trace trace(steps);
  double gained = 0;
  for (long i = 0; i < steps; ++i) {
    if (!arena.step(1 / rate)) return broken(arena);
    const double gain = (arena.energy() - first) / (subject.mass * kGravity * subject.voxel);
    keep_largest(gained, gain);
    trace.add(gain);
  }
  Trial trial;
  trial.trace = trace.values;
  trial.remark = fmt::format("{:.3g} N/m^3; ends {:.2g} vx from the plane", stiffness,
                             lowest(body, column.corners) / subject.voxel);
  const double way = std::sqrt(2 * kGravity * subject.voxel) / rate;
  judge(trial, gained, 0.1 + way / subject.voxel);
  return trial;
}

}  // namespace

StackBody stack_body(const Subject& subject, const Column& column) {
  // A face with a flat face opposite and parallel to it.
  for (const RestPose& rest : rest_poses(subject.corners, 0.1 * subject.voxel, 12)) {
    std::vector<btVector3> turned;
    for (const btVector3& corner : subject.corners) turned.push_back(rest.rotation * corner);
    const auto low = std::min_element(turned.begin(), turned.end(),
                                      [](const btVector3& a, const btVector3& b) { return a.z() < b.z(); });
    const auto high = std::max_element(turned.begin(), turned.end(),
                                       [](const btVector3& a, const btVector3& b) { return a.z() < b.z(); });
    const double height = double(high->z() - low->z());
    // How far the top face reaches from the axis through the centre of mass, as the least of eight directions.
    double flat = std::numeric_limits<double>::infinity();
    for (int d = 0; d < 8; ++d) {
      const double angle = double(SIMD_PI) / 4 * d;
      double reach = -1;
      for (const btVector3& p : turned) {
        if (double(high->z() - p.z()) > 0.1 * subject.voxel) continue;
        reach = std::max(reach, std::cos(angle) * double(p.x()) + std::sin(angle) * double(p.y()));
      }
      flat = std::min(flat, reach);
    }
    if (flat < 0.1 * height || rest.flat < 0.1 * height) continue;
    btTransform at(rest.rotation);
    at.getOrigin().setZ(btScalar(rest.height));
    return {column.body, column.corners, at, height, "ten of the asset"};
  }
  const double half = 20 * subject.voxel;
  const auto cube = subject.props->box(column, {btScalar(half), btScalar(half), btScalar(half)}, Props::Role::mixed);
  btTransform at = btTransform::getIdentity();
  at.getOrigin().setZ(btScalar(half));
  std::vector<btVector3> corners{{btScalar(half), btScalar(half), btScalar(half)},
                                 {-btScalar(half), -btScalar(half), -btScalar(half)}};
  const char* const what = column.ours ? "ten baked cubes of 40 voxels: the asset has no two flat faces opposite"
                                       : "ten of Bullet's boxes of 40 voxels: the asset has no two flat faces opposite";
  return {cube, corners, at, 2 * half, what};
}

void add_pile_cases(std::vector<Case>& cases) {
  const std::string solver =
      "Where a box of Bullet's own, of the same size, or its hull of the body breaks it too and is less than 1.5 times "
      "better, the verdict is `solver`.";
  cases.push_back({
      .name = "mass_ratio",
      .family = "piles",
      .question = "Can it lie on a much lighter or heavier slab?",
      .setup = "On a free slab on a plane, with masses of 1:10,000 to 10,000:1.",
      .measured = "farthest of body and slab, slab and plane from touching, in the second half of 10 s at 240 Hz "
                  "(--quick: 4 s)",
      .quantity = "off from touching",
      .unit = "vx",
      .limit = "1 vx",
      .limit_from = "Contacts are made within a voxel. " + solver,
      .axes = {{"upper over lower mass", "", {1e-4, 1e-3, 1e-2, 0.1, 1, 10, 100, 1e3, 1e4}, {1e-4, 1, 1e4}},
               {"time", "s", {10}, {4}}},
      .trace = "lowest point above the slab, in voxels",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return mass_ratio(subject, column, at[0], at[1]); },
  });
  cases.push_back({
      .name = "stack",
      .family = "piles",
      .question = "Does a stack of ten stand?",
      .setup = "For 60 s without sleeping (--quick: 10 s).",
      .measured = "time until a body is a quarter of its height from its place",
      .quantity = "time that it stands",
      .unit = "s",
      .limit = "the time asked for, at least",
      .limit_from =
          "A body that has moved by a quarter of its height has left the stack. The verdict is `solver` where boxes of "
          "Bullet's own, of the same size, do not stand either, and less than 1.5 times as long.",
      .axes = {{"rate", "Hz", {240, 1000}, {240}}, {"iterations", "", {10, 50}, {50}}, {"time", "s", {60}, {10}}},
      .needs = Requirement::both,
      .trace = "farthest from its place, over height",
      .run =
          [](const Subject& subject, const Column& column, std::span<const double> at) {
            return stack(subject, column, {at[0], int(at[1]), at[2]});
          },
  });
  cases.push_back({
      .name = "foundation",
      .family = "piles",
      .question = "Are contacts as springs stable at any stiffness?",
      .setup = "Set down with set_foundation; an explicit loop is unstable above the bound.",
      .measured = "most energy above the first, set down from a voxel high, over what lifts the body by a voxel",
      .quantity = "energy gained",
      .unit = "m g vx",
      .limit = "0.1 m g vx, and a step's way at the end of the fall",
      .limit_from = "The solver's springs are implicit: stable at any stiffness. ContinuousMotion puts a body back by "
                    "up to a step's "
                    "way. "
                    "The bound is k dt^2 = 4 m for the face the body stands on.",
      .axes = {{"rate", "Hz", {1000, 240, 60}, {240}},
               {"stiffness", "of the bound", {0.01, 0.1, 1, 10, 100}, {0.1, 10}}},
      .trace = "energy above the first, in m g vx",
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return foundation(subject, column, at[0], at[1]); },
  });
}

}  // namespace vps::stress
