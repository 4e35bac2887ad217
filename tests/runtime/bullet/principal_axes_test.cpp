// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes in their principal axes: exact inertia, the same body wherever it is placed, and free rotation.
#include "runtime/bullet/principal_axes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tests/runtime/bullet/world.h"
#include "tests/support/poses.h"

namespace vps::test {
namespace {

using bullet::Axes;
using bullet::Part;
using bullet::Shape;

Eigen::Matrix3d matrix(const btMatrix3x3& m) {
  Eigen::Matrix3d out;
  for (int i = 0; i < 3; ++i) out.row(i) << double(m[i].x()), double(m[i].y()), double(m[i].z());
  return out;
}
Eigen::Vector3d vector(const btVector3& v) {
  return {double(v.x()), double(v.y()), double(v.z())};
}
btVector3 bt(const Eigen::Vector3d& v) {
  return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())};
}

Eigen::Matrix3d random_rotation(Random& random) {
  const std::array<double, 9> r = random.rotation();
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data());
}

std::array<double, 6> tensor_of(const Eigen::Matrix3d& m) {
  return {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2)};
}

TEST(PrincipalAxes, AreTheNearestToTheTensorsOwnAxes) {
  Random random(7);
  for (int i = 0; i < 200; ++i) {
    // Moments of a microscopic and of a huge body; two may be equal.
    const double size = std::pow(10, random.between(-15, 12));
    Eigen::Vector3d moments(size, size * (i % 3 == 0 ? 1 : 1.3), size * 1.7);
    const Eigen::Matrix3d turn = random_rotation(random);
    const Eigen::Matrix3d tensor = turn * moments.asDiagonal() * turn.transpose();
    const bullet::PrincipalAxes found = bullet::find_principal_axes(tensor_of(tensor));
    const Eigen::Matrix3d rotation = matrix(found.rotation);
    EXPECT_NEAR(rotation.determinant(), 1, 1e-5);
    const Eigen::Matrix3d turned = rotation.transpose() * tensor * rotation;
    for (int row = 0; row < 3; ++row) {
      EXPECT_NEAR(found.moments[std::size_t(row)], turned(row, row), 1e-6 * size) << i;
      for (int column = 0; column < row; ++column) EXPECT_NEAR(turned(row, column), 0, 2e-6 * size) << i;
    }
    // The other principal axes: 24 turns of a cube, and any turn about the third axis if two moments are equal.
    for (int other = 0; other < 24 * 36; ++other) {
      Eigen::Matrix3d axes = turn;
      if (i % 3 == 0) axes = turn * Eigen::AngleAxisd(other / 24 * M_PI / 18, Eigen::Vector3d::UnitZ());
      Eigen::Matrix3d cube = Eigen::Matrix3d::Zero();
      const int first = other % 24 % 3;
      const int second = (first + 1 + other % 24 / 3 % 2) % 3;
      cube(first, 0) = other % 24 / 6 % 2 == 0 ? 1 : -1;
      cube(second, 1) = other % 24 / 12 == 0 ? 1 : -1;
      cube.col(2) = cube.col(0).cross(cube.col(1));
      EXPECT_LE((axes * cube).trace(), rotation.trace() + 1e-5) << i;
    }
  }
}

TEST(PrincipalAxes, ATensorWithoutProductsOrOfEqualMomentsKeepsItsAxes) {
  for (const std::array<double, 6>& tensor :
       {std::array<double, 6>{3, 2, 1, 0, 0, 0}, {1, 1, 1, 0, 0, 0}, {1, 1, 1, 1e-6, -2e-6, 1e-6}, {}}) {
    const bullet::PrincipalAxes found = bullet::find_principal_axes(tensor);
    EXPECT_TRUE(found.rotation == btMatrix3x3::getIdentity());
    EXPECT_EQ(found.moments[1], tensor[1]);
  }
}

// A brick whose faces are not parallel to its mesh's axes, off the mesh's origin.
constexpr double kHalf[3] = {0.06, 0.04, 0.015};
const Eigen::Matrix3d& brick_turn() {
  static const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
  return turn;
}
const std::shared_ptr<Asset>& tilted_brick() {
  static const auto asset = [] {
    Pose pose = pose_at(0.02, 0, -0.05);
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(pose.rotation) = brick_turn();
    return baked_at(moved(pose, make_box({kHalf[0], kHalf[1], kHalf[2]})), 0.004);
  }();
  return asset;
}

btTransform random_transform(Random& random, double distance) {
  const Eigen::Matrix3d r = random_rotation(random);
  const auto at = [&](int i, int j) { return btScalar(r(i, j)); };
  return btTransform(
      btMatrix3x3(at(0, 0), at(0, 1), at(0, 2), at(1, 0), at(1, 1), at(1, 2), at(2, 0), at(2, 1), at(2, 2)),
      {btScalar(random.between(-distance, distance)), btScalar(random.between(-distance, distance)), 0});
}

double difference(const btTransform& a, const btTransform& b) {
  return (matrix(a.getBasis()) - matrix(b.getBasis())).norm() + double((a.getOrigin() - b.getOrigin()).length());
}

TEST(Shape, PrincipalAxesGiveTheExactMoments) {
  const Shape shape(tilted_brick(), Part::mixed, Axes::principal);
  btVector3 inertia;
  shape.calculateLocalInertia(3, inertia);
  for (int i = 0; i < 3; ++i) {
    const double a = 2 * kHalf[(i + 1) % 3];
    const double b = 2 * kHalf[(i + 2) % 3];
    EXPECT_NEAR(double(inertia[i]), 3 * (a * a + b * b) / 12, 2e-8);
  }
  EXPECT_EQ(shape.lost_inertia(), 0);
  EXPECT_GT(Shape(tilted_brick()).lost_inertia(), 0.2);
  EXPECT_LT((matrix(shape.asset_frame().getBasis()) - brick_turn().transpose()).norm(), 1e-5);
  // In a compound, Bullet turns the child's moments.
  btCompoundShape compound;
  compound.addChildShape(shape.body_pose(btTransform::getIdentity()), const_cast<Shape*>(&shape));
  btTransform principal;
  const btScalar mass = 3;
  btVector3 again;
  compound.calculatePrincipalAxisTransform(&mass, principal, again);
  const double volume = tilted_brick()->info().volume;
  const Eigen::Matrix3d turn = matrix(principal.getBasis());
  const Eigen::Matrix3d tensor = turn * vector(again).asDiagonal() * turn.transpose() * (volume / 3);
  const std::array<double, 6>& expected = tilted_brick()->info().inertia;
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(tensor_of(tensor)[i], expected[i], 1e-4 * expected[0]) << i;
}

TEST(Shape, PosesOfMeshAndBodyConvertBothWays) {
  Random random(3);
  for (const Axes axes : {Axes::of_asset, Axes::principal}) {
    const Shape shape(tilted_brick(), Part::mixed, axes);
    const btTransform mesh = random_transform(random, 1);
    EXPECT_LT(difference(shape.mesh_pose(shape.body_pose(mesh)), mesh), 1e-5);
    EXPECT_LT((shape.body_pose(mesh).getOrigin() - mesh * shape.centre_of_mass()).length(), 1e-6);
    EXPECT_LT((shape.asset_frame() * shape.centre_of_mass()).length(), 1e-7);
  }
}

// What the world sees of a mesh at a pose.
struct Seen {
  btVector3 low, high, hit, normal;
  btScalar swept;  // fraction
  explicit Seen(Axes axes, const btTransform& mesh) {
    World scene;
    Shape shape(tilted_brick(), Part::mixed, axes);
    const btTransform at = shape.body_pose(mesh);
    scene.add(shape, 0, at);
    shape.getAabb(at, low, high);
    btVector3 centre;
    btScalar radius = 0;
    shape.getBoundingSphere(centre, radius);
    EXPECT_LT((at * centre - (low + high) / 2).length(), 1e-5);
    const btVector3& to = at.getOrigin();
    const btVector3 from = to + btVector3(btScalar(0.3), btScalar(0.2), btScalar(0.5));
    btCollisionWorld::ClosestRayResultCallback ray(from, to);
    scene.world.rayTest(from, to, ray);
    EXPECT_TRUE(ray.hasHit());
    hit = ray.m_hitPointWorld;
    normal = ray.m_hitNormalWorld;
    const btSphereShape sphere(btScalar(0.01));
    const auto here = [](const btVector3& p) { return btTransform(btQuaternion::getIdentity(), p); };
    btCollisionWorld::ClosestConvexResultCallback sweep(from, to);
    scene.world.convexSweepTest(&sphere, here(from), here(to), sweep);
    EXPECT_TRUE(sweep.hasHit());
    swept = sweep.m_closestHitFraction;
  }
};

TEST(Shape, AxesChangeNeitherBoundsNorRaysNorSweeps) {
  Random random(11);
  for (int i = 0; i < 20; ++i) {
    const btTransform mesh = random_transform(random, 1);
    const Seen plain(Axes::of_asset, mesh);
    const Seen turned(Axes::principal, mesh);
    EXPECT_LT((plain.low - turned.low).length() + (plain.high - turned.high).length(), 1e-5) << i;
    EXPECT_LT((plain.hit - turned.hit).length(), 2e-5) << i;
    EXPECT_LT((plain.normal - turned.normal).length(), 1e-2) << i;
    EXPECT_NEAR(double(plain.swept), double(turned.swept), 0.02) << i;  // surfels, within three voxels
  }
}

// The contacts of one step, of a mesh that lies a little inside a partner.
std::vector<btManifoldPoint> contacts_with(btCollisionShape& partner, const btTransform& at, Axes axes,
                                           const btTransform& mesh) {
  World scene;
  scene.world.setGravity({0, 0, 0});
  Shape shape(tilted_brick(), Part::mixed, axes);
  scene.add(partner, 0, at);
  scene.add(shape, 1, shape.body_pose(mesh));
  scene.world.performDiscreteCollisionDetection();
  std::vector<btManifoldPoint> points = scene.points();
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.m_partId0 < b.m_partId0; });
  return points;
}

TEST(Shape, AxesDoNotChangeContacts) {
  // The brick's own frame, turned from the asset's, lies a tenth of a millimetre deep in what is below z = 0.
  const Eigen::Matrix3d back = brick_turn().transpose();
  btTransform mesh;
  for (int i = 0; i < 3; ++i) mesh.getBasis()[i] = bt(back.row(i));
  mesh.setOrigin(btVector3(0, 0, btScalar(kHalf[2] - 1e-4)) - mesh.getBasis() * Shape(tilted_brick()).centre_of_mass());
  btStaticPlaneShape plane({0, 0, 1}, 0);
  btBoxShape box({btScalar(0.03), 1, btScalar(0.5)});
  btSphereShape sphere(btScalar(0.04));
  Shape block(brick());
  Shape turned(tilted_brick(), Part::mixed, Axes::principal);
  btTriangleMesh triangles;
  triangles.addTriangle({-1, -1, 0}, {1, -1, 0}, {0, 1, 0});
  btBvhTriangleMeshShape sheet(&triangles, true);
  const auto at = [](double z) { return btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(z)}); };
  const std::pair<btCollisionShape*, btTransform> partners[] = {{&plane, at(0)},          {&box, at(-0.5)},
                                                                {&sphere, at(-0.04)},     {&block, at(-0.05)},
                                                                {&turned, at(-kHalf[2])}, {&sheet, at(0)}};
  for (const auto& [partner, place] : partners) {
    const auto plain = contacts_with(*partner, place, Axes::of_asset, mesh);
    const auto other = contacts_with(*partner, place, Axes::principal, mesh);
    ASSERT_FALSE(plain.empty()) << partner->getName();
    ASSERT_EQ(plain.size(), other.size()) << partner->getName();
    for (std::size_t i = 0; i < plain.size(); ++i) {
      EXPECT_LT((plain[i].getPositionWorldOnB() - other[i].getPositionWorldOnB()).length(), 1e-4) << partner->getName();
      EXPECT_LT((plain[i].m_normalWorldOnB - other[i].m_normalWorldOnB).length(), 1e-3) << partner->getName();
      EXPECT_NEAR(double(plain[i].getDistance()), double(other[i].getDistance()), 1e-6) << partner->getName();
    }
  }
}

// A body that turns freely, and the same by Euler's equations.
struct Turning {
  Eigen::Matrix3d inertia;                                       // in the body's frame
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // body to world
  Eigen::Vector3d momentum;                                      // in the world

  [[nodiscard]] Eigen::Vector3d spin(const Eigen::Quaterniond& at) const {
    return at * (inertia.inverse() * (at.conjugate() * momentum));
  }
  // Runge-Kutta, fourth order.
  void advance(double time, int steps) {
    const double h = time / steps;
    const auto slope = [&](const Eigen::Quaterniond& at) -> Eigen::Vector4d {
      const Eigen::Vector3d w = spin(at.normalized());
      return 0.5 * (Eigen::Quaterniond(0, w.x(), w.y(), w.z()) * at).coeffs();
    };
    const auto moved = [&](const Eigen::Vector4d& by) { return Eigen::Quaterniond(rotation.coeffs() + by); };
    for (int i = 0; i < steps; ++i) {
      const Eigen::Vector4d a = slope(rotation);
      const Eigen::Vector4d b = slope(moved(h / 2 * a));
      const Eigen::Vector4d c = slope(moved(h / 2 * b));
      const Eigen::Vector4d d = slope(moved(h * c));
      rotation = moved(h / 6 * (a + 2 * b + 2 * c + d)).normalized();
    }
  }
};

struct Flight {
  double angle;     // between the mesh in Bullet and by Euler's equations. [rad]
  double energy;    // share gained
  double momentum;  // relative change of the angular momentum in the world
};

// The tilted brick turns for a second, nearly about its middle axis: it turns over.
// @param flags  btRigidBodyFlags
Flight fly(btCollisionShape& shape, const btTransform& mesh_in_body, double step, double mass, int flags) {
  World scene;
  scene.world.setGravity({0, 0, 0});
  btRigidBody& body = scene.add(shape, btScalar(mass), mesh_in_body.inverse());
  body.setFlags(flags);
  const Eigen::Vector3d spin = 12 * (brick_turn() * Eigen::Vector3d(0.05, 1, 0.02));
  body.setAngularVelocity(bt(spin));
  const std::array<double, 6>& i = tilted_brick()->info().inertia;
  Turning truth;
  truth.inertia << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
  truth.inertia *= mass / tilted_brick()->info().volume;
  truth.momentum = truth.inertia * spin;
  const double energy = 0.5 * spin.dot(truth.momentum);
  const double seconds = 1;
  scene.step(int(std::lround(seconds / step)), btScalar(step));
  truth.advance(seconds, 20000);
  EXPECT_NEAR(0.5 * truth.momentum.dot(truth.spin(truth.rotation)) / energy, 1, 1e-9);
  const Eigen::Matrix3d now = matrix((body.getWorldTransform() * mesh_in_body).getBasis());
  const Eigen::Vector3d w = vector(body.getAngularVelocity());
  const Eigen::Vector3d momentum = now * truth.inertia * now.transpose() * w;
  return {Eigen::AngleAxisd(truth.rotation.toRotationMatrix().transpose() * now).angle(),
          0.5 * w.dot(momentum) / energy - 1, (momentum - truth.momentum).norm() / truth.momentum.norm()};
}

TEST(FreeRotation, InPrincipalAxesIsThatOfEulersEquations) {
  Shape shape(tilted_brick(), Part::mixed, Axes::principal);
  btBoxShape box({btScalar(kHalf[0]), btScalar(kHalf[1]), btScalar(kHalf[2])});
  const btTransform mesh = shape.asset_frame();
  constexpr int kDefault = BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY;
  for (const double step : {1 / 240.0, 1 / 1000.0, 1 / 8000.0}) {
    const Flight flight = fly(shape, mesh, step, 200, kDefault);
    // Bullet's integrator is of first order.
    EXPECT_LT(flight.angle, 20 * step);
    EXPECT_LT(std::abs(flight.energy), 14 * step);
    EXPECT_LT(flight.momentum, 8 * step);
    const Flight by_box = fly(box, mesh, step, 200, kDefault);
    EXPECT_NEAR(flight.angle, by_box.angle, 1e-4);
    EXPECT_NEAR(flight.energy, by_box.energy, 1e-4);
    EXPECT_NEAR(flight.momentum, by_box.momentum, 1e-4);
    // In single precision Bullet's default leaves out the gyroscopic moments of bodies as small as 3 kg.
    EXPECT_LT(fly(shape, mesh, step, 3, BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT).angle, 20 * step);
  }
}

TEST(FreeRotation, WithoutProductsOfInertiaIsWrongForAnyStep) {
  Shape shape(tilted_brick());
  for (const double step : {1 / 240.0, 1 / 8000.0}) {
    const Flight flight = fly(shape, shape.asset_frame(), step, 200, BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY);
    EXPECT_GT(flight.angle, 1.5);
    EXPECT_GT(flight.momentum, 0.25);
  }
}

}  // namespace
}  // namespace vps::test
