// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/growth/bodies.h"

#include <LinearMath/btAabbUtil2.h>
#include <btBulletCollisionCommon.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "bake/store/vps_store.h"
#include "cli/lab/ours.h"
#include "formats/mesh/mesh_import.h"
#include "sample_meshes/shapes.h"
#include "tests/support/poses.h"

namespace vps::bench {
namespace {

constexpr std::array<double, 3> kPlateHalf = {0.05, 0.05, 0.004};  // [m]
constexpr std::array<double, 3> kSlabHalf = {0.08, 0.08, 0.01};    // [m]
constexpr double kOblique = 0.4;                                   // [rad]
constexpr double kFirstVoxel = 0.005;                              // [m]
constexpr std::size_t kPoses = 64;

// Points are 1.4 voxels apart or more, and fill a face to four fifths along each axis.
double plate_voxel(double points) {
  return 2 * kPlateHalf[0] * 0.8 / std::sqrt(2 * points);
}

btTransform at_height(double z) {
  return btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(z)});
}

// The least distance in [0, most] from which on `is_apart` holds, to a hundred-thousandth.
template <class IsApart>
double first_apart(double most, const IsApart& is_apart) {
  double near = 0, far = most;
  while (far - near > 1e-5 * most) (is_apart((near + far) / 2) ? far : near) = (near + far) / 2;
  return far;
}

}  // namespace

Bodies::Bodies(const std::string& mesh, double scale, std::string work) : work_(std::move(work)) {
  ImportOptions import;
  import.unit = scale;
  bunny_ = import_mesh(mesh, import);
}

std::shared_ptr<const Asset> Bodies::bake(const TriangleMesh& mesh, double voxel, bool pointshell) const {
  bake::BakeSettings settings;
  settings.options.voxel_size = voxel;
  settings.options.pointshell = pointshell;
  return bake::load_or_bake(mesh, settings, work_).asset;
}

ShapePtr Bodies::get(const std::string& name, const TriangleMesh& mesh, double voxel, bool pointshell) {
  ShapePtr& shape = shapes_[name];
  if (shape == nullptr) shape = std::make_shared<bullet::Shape>(bake(mesh, voxel, pointshell));
  return shape;
}

ShapePtr Bodies::bunny(double points) {
  if (bunny_points_ == 0) bunny_points_ = double(bake(bunny_, kFirstVoxel, true)->info().points);
  return get(fmt::format("bunny {}", points), bunny_, kFirstVoxel * std::sqrt(bunny_points_ / points), true);
}

ShapePtr Bodies::plate(double points) {
  return get(fmt::format("plate {}", points), samples::make_box(kPlateHalf), plate_voxel(points), true);
}

ShapePtr Bodies::slab(double points, double turn) {
  return get(fmt::format("slab {} {}", points, turn),
             test::moved(test::turned_about_y(turn), samples::make_box(kSlabHalf)), 2 * plate_voxel(points), false);
}

double voxel_of(const bullet::Shape& shape) {
  return shape.info().voxel_size;
}

double radius_of(const bullet::Shape& shape) {
  btVector3 centre;
  btScalar radius = 0;
  shape.getBoundingSphere(centre, radius);
  return double(centre.length() + radius);
}

Pose pose_of(const bullet::Shape& shape, const btTransform& at) {
  Pose pose;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.rotation[3 * i + j] = double(at.getBasis()[i][j]);
    pose.translation[i] = double(at.getOrigin()[i]);
  }
  return lab::in_asset_frame(shape.asset(), pose);
}

QueryResult ask(const bullet::Shape& shape, FieldRef field, const Pose& pose, double contact_distance) {
  thread_local Scratch scratch;
  thread_local std::vector<Contact> contacts;
  contacts.resize(std::max(contacts.size(), std::size_t{shape.pointshell().points}));
  QueryOptions options;
  options.contact_distance = float(contact_distance);
  QueryResult result;
  lab::require_ok(traverse(shape.pointshell(), field, pose, options, scratch, contacts, result));
  return result;
}

Ground box_ground() {
  return {"box", std::make_shared<btBoxShape>(btVector3(1, 1, btScalar(0.1))), at_height(-0.1)};
}

// The same box as a hull, rounded by Bullet's default margin.
Ground hull_ground() {
  auto hull = std::make_shared<btConvexHullShape>();
  for (int i = 0; i < 8; ++i)
    hull->addPoint({btScalar(i & 1 ? 1 : -1), btScalar(i & 2 ? 1 : -1), btScalar(i & 4 ? 0 : -1)});
  return {"hull", hull, at_height(-double(hull->getMargin()))};
}

std::vector<Ground> grounds_of(Bodies& bodies, double points) {
  return {box_ground(),
          hull_ground(),
          {"plane", std::make_shared<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0))},
          {"baked slab", bodies.slab(points), at_height(-kSlabHalf[2])},
          {"oblique slab", bodies.slab(points, kOblique),
           btTransform(btQuaternion({0, 1, 0}, btScalar(-kOblique)), {0, 0, btScalar(-kSlabHalf[2])})}};
}

btTransform standing(const bullet::Shape& shape) {
  btTransform at(btQuaternion(btVector3(1, 0, 0), btScalar(std::numbers::pi / 2)));
  btVector3 low, high;
  shape.getAabb(at, low, high);
  at.setOrigin({0, 0, -low.z()});
  return at;
}

btTransform lying(const bullet::Shape& plate, double x) {
  return btTransform(btQuaternion::getIdentity(), {btScalar(x), 0, btScalar(kPlateHalf[2] - 0.05 * voxel_of(plate))});
}

QueryResult face_of(const bullet::Shape& plate) {
  return ask(plate, HalfSpaceField{}, pose_of(plate, lying(plate, 0)), 0.1 * voxel_of(plate));
}

std::vector<btTransform> jittered(const bullet::Shape& shape, const btTransform& at) {
  lab::Random random;
  std::vector<btTransform> poses(24, at);
  for (btTransform& pose : poses) {
    pose.getOrigin() += btScalar(voxel_of(shape)) * btVector3(btScalar(random.next()), btScalar(random.next()), 0);
  }
  return poses;
}

btMatrix3x3 rotation(lab::Random& random) {
  const std::array<double, 9> r = random.rotation();
  return {btScalar(r[0]), btScalar(r[1]), btScalar(r[2]), btScalar(r[3]), btScalar(r[4]),
          btScalar(r[5]), btScalar(r[6]), btScalar(r[7]), btScalar(r[8])};
}

btVector3 direction(lab::Random& random) {
  return rotation(random).getColumn(0);
}

btTransform touching(const bullet::Shape& shape, const btMatrix3x3& basis, const btVector3& along, double depth) {
  const auto at = [&](double way) { return btTransform(basis, btScalar(way) * along); };
  return at(first_apart(2 * radius_of(shape), [&](double way) {
    return ask(shape, shape.voxelmap(), pose_of(shape, at(way)), 0).delta < depth;
  }));
}

std::vector<btTransform> pair_poses(const bullet::Shape& shape) {
  lab::Random random;
  std::vector<btTransform> poses;
  while (poses.size() < kPoses) {
    const btMatrix3x3 basis = rotation(random);
    poses.push_back(touching(shape, basis, direction(random), 0.5 * voxel_of(shape)));
  }
  return poses;
}

std::vector<Places> apart_places(const bullet::Shape& shape, double least_vx) {
  lab::Random random;
  std::vector<Places> places;
  while (places.size() < kPoses) {
    const btTransform first(rotation(random));
    const btMatrix3x3 basis = rotation(random);
    const btVector3 along = direction(random);
    const auto at = [&](double way) { return first * btTransform(basis, btScalar(way) * along); };
    const double nearest = double(touching(shape, basis, along, -least_vx * voxel_of(shape)).getOrigin().length());
    btVector3 low, high, other_low, other_high;
    shape.getAabb(first, low, high);
    const double farthest = first_apart(2 * radius_of(shape), [&](double way) {
      shape.getAabb(at(way + voxel_of(shape)), other_low, other_high);
      return !TestAabbAgainstAabb2(low, high, other_low, other_high);
    });
    if (farthest > nearest) places.push_back({first, at(random.between(nearest, farthest))});
  }
  return places;
}

}  // namespace vps::bench
