// SPDX-License-Identifier: GPL-3.0-or-later
// Cases on very small, very large and very distant bodies.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/lab/hacd.h"
#include "cli/lab/random.h"
#include "cli/lab/stress/world.h"

namespace vps::stress {
namespace {

constexpr double kUlp = 0x1p-52;  // spacing of doubles at 1
constexpr int kPosesOfSize = 32;

struct ScaledParts {
  PointshellView shell;
  VoxelmapView map;
  explicit ScaledParts(const Asset& asset)
      : good(asset.pointshell(shell) == Status::ok && asset.voxelmap(map) == Status::ok) {}
  bool good;
};

// Random poses of a body of length 1 in another, from the seed: moved by at most 0.5 along each axis.
std::vector<Pose> poses_of(const Subject& subject, int count) {
  lab::Random random(subject.seed);
  std::vector<Pose> poses(static_cast<std::size_t>(count));
  for (Pose& pose : poses) {
    const auto rotation = random.rotation();
    std::copy(rotation.begin(), rotation.end(), pose.rotation);
    for (double& t : pose.translation) t = random.between(-0.5, 0.5);
  }
  return poses;
}

Pose scaled(Pose pose, double scale) {
  for (double& t : pose.translation) t *= scale;
  return pose;
}

Status ask(const ScaledParts& parts, const Pose& pose, std::vector<Contact>& contacts, QueryResult& result) {
  thread_local Scratch scratch;
  contacts.resize(parts.shell.points);
  const Status status = traverse(parts.shell, parts.map, pose, QueryOptions{}, scratch, contacts, result);
  contacts.resize(std::min<std::size_t>(result.contacts, contacts.size()));
  return status;
}

// Moves both bodies far from the origin: the contacts must stay the same.
Trial far_queries(const Subject& subject, double distance) {
  const ScaledParts parts(*subject.asset);
  double worst = 0;
  std::size_t contacts = 0;
  std::size_t lost = 0;
  for (const Pose& relative : poses_of(subject, kPosesOfSize)) {
    Pose first;
    first.translation[0] = distance;
    first.translation[1] = -distance;
    first.translation[2] = distance;
    Pose second = scaled(relative, subject.size);
    std::vector<Contact> near;
    std::vector<Contact> far;
    QueryResult result;
    if (const Status status = ask(parts, second, near, result); status != Status::ok)
      return skipped(vps::describe(status));
    for (int axis = 0; axis < 3; ++axis) second.translation[axis] += first.translation[axis];
    if (ask(parts, relative_pose(first, second), far, result) != Status::ok) {
      Trial trial;
      trial.remark = "the query was refused";
      judge(trial, std::numeric_limits<double>::quiet_NaN(), 0);
      return trial;
    }
    contacts += near.size();
    const auto is_before = [](const Contact& a, const Contact& b) { return a.point < b.point; };
    for (const Contact& contact : near) {
      // Contacts are in the order of the tree, in which points are numbered.
      const auto found = std::lower_bound(far.begin(), far.end(), contact, is_before);
      if (found == far.end() || found->point != contact.point) {
        keep_largest(worst, double(contact.penetration));
        ++lost;
      } else {
        keep_largest(worst, std::abs(double(found->penetration) - double(contact.penetration)));
      }
    }
  }
  Trial trial;
  trial.remark = fmt::format("{} contacts in {} poses, {} only near the origin", contacts, kPosesOfSize, lost);
  judge(trial, worst / subject.voxel, 1e-3 + 8 * kUlp * distance / subject.voxel);
  return trial;
}

// Sets a body down on a slab far from the origin, in float.
Trial far_world(const Subject& subject, const Column& column, double distance) {
  if (column.triangles > kMostTriangles) return skipped(kTooManyTriangles);
  Arena arena(subject, {column.detection});
  const btVector3 half(btScalar(subject.size), btScalar(subject.size), btScalar(0.5 * subject.size));
  const btVector3 origin{btScalar(distance), btScalar(distance), 0};
  arena.add(subject.props->box(column, half, Props::Role::still), 0,
            btTransform(btQuaternion::getIdentity(), origin - btVector3(0, 0, half.z())));
  btTransform at = standing(column.corners, 2 * subject.voxel);
  at.getOrigin() += origin;
  btRigidBody& body = arena.add(column.body, subject.mass, at);
  double most = 0;
  for (int i = 0; i < 480; ++i) {
    if (!arena.step(1.0 / 240)) return broken(arena);
    keep_largest(most, kinetic_energy(body));
  }
  // Spacing of floats at that distance.
  const double grain = distance * 0x1p-23;
  Trial trial;
  trial.remark = fmt::format("floats are {:.2g} m apart there", grain);
  judge(trial, most / (subject.mass * kGravity * std::max(subject.size, grain)), 1);
  return trial;
}

// At most 100 voxels along a body: four more fine bakes of a large asset would take longer than all other cases. [m]
double voxel_at(const Subject& subject, double size) {
  return std::max(subject.voxel / subject.size, 0.01) * size;
}

std::shared_ptr<const Asset> resized(const Subject& subject, double size) {
  TriangleMesh mesh = *subject.mesh;
  for (auto& v : mesh.vertices) {
    for (double& x : v) x *= size / subject.size;
  }
  return subject.props->baked(mesh, voxel_at(subject, size), Props::Role::mixed);
}

// Moves the body in from outside along the pose's translation until its deepest point is half a voxel deep. This is in
// the band, where depths are distances. @return false when a query is refused
bool bring_near(const ScaledParts& parts, double voxel, Pose& pose) {
  const double* const t = pose.translation;
  const double length = std::sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
  const Pose direction = scaled(pose, 1 / std::max(length, 1e-3));
  double outside = 2;
  double inside = 0;
  std::vector<Contact> contacts;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (outside + inside);
    QueryResult result;
    if (ask(parts, scaled(direction, middle), contacts, result) != Status::ok) return false;
    (result.contacts > 0 && result.delta > 0.5 * voxel ? inside : outside) = middle;
  }
  pose = scaled(direction, inside);
  return true;
}

// Compares queries at another size with those at 1 m, relative to the size.
Trial size_queries(const Subject& subject, double size) {
  const auto usual = resized(subject, 1);
  const auto other = resized(subject, size);
  const ScaledParts a(*usual);
  const ScaledParts b(*other);
  if (!a.good || !b.good) return skipped("the resized asset cannot be read");
  Trial trial;
  double worst = 0;
  for (Pose pose : poses_of(subject, kPosesOfSize)) {
    std::vector<Contact> contacts;
    QueryResult at_one;
    QueryResult at_size;
    if (!bring_near(a, usual->info().voxel_size, pose) || ask(a, pose, contacts, at_one) != Status::ok ||
        ask(b, scaled(pose, size), contacts, at_size) != Status::ok) {
      trial.remark = "the query was refused";
      judge(trial, std::numeric_limits<double>::quiet_NaN(), 0);
      return trial;
    }
    keep_largest(worst, std::abs(at_size.delta / size - at_one.delta));
  }
  judge(trial, worst / usual->info().voxel_size,
        (double(a.map.error) + double(b.map.error) / size) / usual->info().voxel_size);
  return trial;
}

// A drop at another size with gravity in proportion: the same motion, except for constants in metres.
Trial size_world(const Subject& subject, const Column& column, double size) {
  const double shrunk = size / subject.size;
  double voxel = voxel_at(subject, size);
  lab::BulletShape body;
  std::vector<btVector3> corners;
  if (column.ours) {
    const auto asset = resized(subject, size);
    body = lab::ours_of(asset);
    corners = shell_corners(*asset);
    voxel = asset->info().voxel_size;
  } else {
    body = column.resized(shrunk, 0.1 * voxel);
    for (const btVector3& corner : column.corners) corners.push_back(corner * btScalar(shrunk));
  }
  const double mass = subject.mass * shrunk * shrunk * shrunk;
  // Distance of the lowest point from the plane at the end; NaN when a value is not finite.
  std::string failure;
  const auto rest = [&](const lab::BulletShape& shape, const std::vector<btVector3>& feet) {
    Arena arena(subject, {column.detection, kGravity * shrunk, 10, voxel});
    arena.add_plane();
    const btRigidBody& falling = arena.add(shape, mass, standing(feet, size / 4));
    double off = 0;
    for (int i = 0; i < 12 * 240; ++i) {
      if (!arena.step(1.0 / 240)) {
        failure = arena.failure();
        return std::numeric_limits<double>::quiet_NaN();
      }
      if (i >= 9 * 240) keep_largest(off, std::abs(lowest(falling, feet)));
    }
    return off;
  };
  const btVector3 half(btScalar(size / 2), btScalar(size / 2), btScalar(size / 2));
  const double of_box = rest(lab::BulletShape{{}, std::make_shared<btBoxShape>(half)}, {half, -half}) / voxel;
  failure.clear();
  Trial trial;
  const double off = rest(body, corners) / voxel;
  trial.remark = failure;
  judge_beside(trial, std::isfinite(off) ? std::min(off, 1e6) : off, 2, of_box);
  return trial;
}

}  // namespace

void add_scale_cases(std::vector<Case>& cases) {
  const Axis sizes{"length", "m", {1e-5, 1e-3, 1, 100, 1e4}, {1e-5, 1e4}};
  cases.push_back({
      .name = "far_queries",
      .family = "scale",
      .question = "Are contacts the same far from the origin?",
      .setup = "The runtime's contacts, with both bodies far away.",
      .measured = "largest change of a contact's depth, in 32 poses of the asset in itself",
      .quantity = "change of depth",
      .unit = "vx",
      .limit = "0.001 vx, and 8 units in the last place of the distance",
      .limit_from = "Poses are double: their difference is exact to a few units in the last place of the distance.",
      .axes = {{"distance", "m", {1e3, 1e6}, {1e6}}},
      .needs = Requirement::both,
      .alone = "runtime",
      .run = [](const Subject& subject, const Column&,
                std::span<const double> at) { return far_queries(subject, at[0]); },
  });
  cases.push_back({
      .name = "far_world",
      .family = "scale",
      .question = "Does it stay in place far from the origin in Bullet?",
      .setup = "Set down on a slab far away, in Bullet's floats.",
      .measured = "largest kinetic energy in 2 s, over what lifts the body by its length, or by what floats are apart",
      .quantity = "kinetic energy",
      .unit = "m g length",
      .limit = "1 m g length",
      .limit_from = "At 10^6 m floats are 0.06 m apart: rest cannot be asked for, only that nothing is shot off.",
      .axes = {{"distance", "m", {1e3, 1e6}, {1e6}}},
      .needs = Requirement::pointshell,
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return far_world(subject, column, at[0]); },
  });
  cases.push_back({
      .name = "size_queries",
      .family = "scale",
      .question = "Are contacts the same at any size?",
      .setup = "The runtime's contacts, baked from 10 um to 10 km long.",
      .measured = "largest change of depth over size, in 32 poses of the asset half a voxel in itself",
      .quantity = "change of depth",
      .unit = "vx",
      .limit = "the two fields' errors",
      .limit_from = "Either field is as far from the true distance as its certificate says.",
      .axes = {sizes},
      .needs = Requirement::mesh,
      .alone = "runtime",
      .run = [](const Subject& subject, const Column&,
                std::span<const double> at) { return size_queries(subject, at[0]); },
  });
  cases.push_back({
      .name = "size_world",
      .family = "scale",
      .question = "Does it stay on the ground at any size?",
      .setup = "From 10 um to 10 km long, of the same density and gravity in proportion.",
      .measured = "lowest point from the plane in the last 3 of 12 s at 240 Hz",
      .quantity = "off the plane",
      .unit = "vx",
      .limit = "2 vx",
      .limit_from = "In proportion the motion is that at 1 m; Bullet's margins and slops are metres, and its floats "
                    "end at 10^38. "
                    "The verdict "
                    "is `solver` where a box of Bullet's own breaks it too.",
      .axes = {sizes},
      .needs = Requirement::mesh,
      .run = [](const Subject& subject, const Column& column,
                std::span<const double> at) { return size_world(subject, column, at[0]); },
  });
}

}  // namespace vps::stress
