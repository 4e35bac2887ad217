// SPDX-License-Identifier: GPL-3.0-or-later
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexMaterialArray.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/bullet/world.h"

namespace vps::test {
namespace {

const std::shared_ptr<Asset>& ball() {
  static const auto asset = baked_at(make_sphere(0.05, 4), 0.003);
  return asset;
}
const std::shared_ptr<Asset>& brick() {
  static const auto asset = baked_at(make_box({0.05, 0.05, 0.05}), 0.004);
  return asset;
}
const std::shared_ptr<Asset>& torus() {
  static const auto asset = baked_at(make_torus(0.1, 0.03, 64, 32), 0.004);
  return asset;
}
// The brick, without a voxelmap.
const std::shared_ptr<Asset>& brick_shell() {
  static const auto asset = [] {
    BakeOptions options;
    options.voxel_size = 0.004;
    options.voxelmap = false;
    return baked(make_box({0.05, 0.05, 0.05}), options);
  }();
  return asset;
}

enum class Winding { up, down, mixed };
using Height = std::function<double(double, double)>;

// z = height(x, y) over a square, of 2 n^2 triangles.
TriangleMesh sheet(double half, int n, const Height& height, Winding winding = Winding::up) {
  TriangleMesh mesh;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      const double x = half * (2.0 * i / n - 1);
      const double y = half * (2.0 * j / n - 1);
      mesh.vertices.push_back({x, y, height(x, y)});
    }
  }
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const bool turn = winding == Winding::down || (winding == Winding::mixed && mesh.triangles.size() % 3 == 0);
    turn ? mesh.triangles.push_back({a, c, b}) : mesh.triangles.push_back({a, b, c});
  };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const auto a = static_cast<std::uint32_t>(j * (n + 1) + i);
      const auto b = a + static_cast<std::uint32_t>(n) + 1;
      add(a, a + 1, b);
      add(a + 1, b + 1, b);
    }
  }
  return mesh;
}
double flat(double, double) {
  return 0;
}

btTriangleMesh to_bullet(const TriangleMesh& mesh, double scale = 1) {
  btTriangleMesh out;
  const auto corner = [&](std::uint32_t v) {
    const auto& p = mesh.vertices[v];
    return btVector3(btScalar(p[0] * scale), btScalar(p[1] * scale), btScalar(p[2] * scale));
  };
  for (const auto& [a, b, c] : mesh.triangles) out.addTriangle(corner(a), corner(b), corner(c));
  return out;
}

enum class Kind { bvh, scaled, multimaterial, terrain, gimpact };

// A square ground of the height function, as a shape of any kind.
class Ground {
 public:
  Ground(Kind kind, double half, int n, const Height& height = flat, Winding winding = Winding::up)
      : triangles_(to_bullet(sheet(half, n, height, winding), kind == Kind::scaled ? 0.5 : 1)) {
    switch (kind) {
      case Kind::bvh:
        shape_ = std::make_unique<btBvhTriangleMeshShape>(&triangles_, true);
        break;
      case Kind::scaled:
        inner_ = std::make_unique<btBvhTriangleMeshShape>(&triangles_, true);
        shape_ = std::make_unique<btScaledBvhTriangleMeshShape>(inner_.get(), btVector3(2, 2, 2));
        break;
      case Kind::multimaterial:
        shape_ = std::make_unique<btMultimaterialTriangleMeshShape>(&triangles_, true);
        break;
      case Kind::terrain: {
        double least = 0;
        double most = 0;
        for (int j = 0; j <= n; ++j) {
          for (int i = 0; i <= n; ++i) {
            const double z = height(half * (2.0 * i / n - 1), half * (2.0 * j / n - 1));
            heights_.push_back(btScalar(z));
            least = std::min(least, z);
            most = std::max(most, z);
          }
        }
        // Terrain is centred on the middle of its range; PHY_FLOAT means btScalar.
        const auto range = btScalar(std::max({-least, most, 0.001}));
        auto terrain = std::make_unique<btHeightfieldTerrainShape>(n + 1, n + 1, heights_.data(), btScalar(1), -range,
                                                                   range, 2, PHY_FLOAT, winding == Winding::down);
        terrain->setLocalScaling({btScalar(2 * half / n), btScalar(2 * half / n), 1});
        shape_ = std::move(terrain);
        break;
      }
      case Kind::gimpact: {
        auto mesh = std::make_unique<btGImpactMeshShape>(&triangles_);
        mesh->updateBound();
        shape_ = std::move(mesh);
        break;
      }
    }
  }
  btConcaveShape& operator*() { return *shape_; }

 private:
  btTriangleMesh triangles_;
  std::vector<btScalar> heights_;
  std::unique_ptr<btBvhTriangleMeshShape> inner_;
  std::unique_ptr<btConcaveShape> shape_;
};

// GImpact's registration takes table entries away, so ours comes after it.
struct MeshWorld : World {
  MeshWorld() {
    btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher);
    bullet::register_algorithm(dispatcher);
  }
};

struct Collect final : btCollisionWorld::ContactResultCallback {
  std::vector<btManifoldPoint> points;
  btScalar addSingleResult(btManifoldPoint& p, const btCollisionObjectWrapper*, int, int,
                           const btCollisionObjectWrapper*, int, int) override {
    points.push_back(p);
    return 0;
  }
};

std::vector<btManifoldPoint> contacts_of(World& scene, btRigidBody& first, btRigidBody& second) {
  Collect found;
  scene.world.contactPairTest(&first, &second, found);
  return found.points;
}
double deepest(const std::vector<btManifoldPoint>& points) {
  double depth = -std::numeric_limits<double>::max();
  for (const btManifoldPoint& p : points) depth = std::max(depth, -double(p.getDistance()));
  return depth;
}

btTransform turned(const btVector3& axis, double angle, const btVector3& at) {
  return btTransform(btQuaternion(axis, btScalar(angle)), at);
}

class EveryMesh : public testing::TestWithParam<std::tuple<Kind, bool>> {};
std::string mesh_name(const testing::TestParamInfo<std::tuple<Kind, bool>>& test) {
  constexpr const char* kNames[] = {"bvh", "scaled", "multimaterial", "terrain", "gimpact"};
  const auto [kind, ground_first] = test.param;
  return std::string(kNames[static_cast<std::size_t>(kind)]) + (ground_first ? "_ground_first" : "_body_first");
}
INSTANTIATE_TEST_SUITE_P(All, EveryMesh,
                         testing::Combine(testing::Values(Kind::bvh, Kind::scaled, Kind::multimaterial, Kind::terrain,
                                                          Kind::gimpact),
                                          testing::Bool()),
                         mesh_name);

TEST_P(EveryMesh, ABodyFallsOntoItAndRestsWithSoundContacts) {
  const auto [kind, ground_first] = GetParam();
  const std::shared_ptr<Asset> assets[] = {brick(), ball(), torus(), brick_shell()};
  const double rests_at[] = {0.05, 0.05, 0.03, 0.05};
  for (std::size_t k = 0; k < std::size(assets); ++k) {
    SCOPED_TRACE(k);
    MeshWorld scene;
    bullet::Shape shape(assets[k]);
    Ground ground(kind, 0.5, 20);
    btRigidBody* floor = ground_first ? &scene.add(*ground, 0, {0, 0, 0}) : nullptr;
    btRigidBody& body = scene.add(shape, 1, {btScalar(0.01), btScalar(0.02), btScalar(rests_at[k] + 0.01)});
    if (!ground_first) floor = &scene.add(*ground, 0, {0, 0, 0});
    body.setLinearVelocity({0, 0, -3});
    scene.step(240);
    EXPECT_EQ(shape.status(), Status::ok);
    EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), rests_at[k], 0.001);
    EXPECT_LT(speed(body), k == 1 ? 0.12 : 0.01);  // the ball rolls on, as it does on a plane
    int contacts = 0;
    for (int m = 0; m < scene.dispatcher.getNumManifolds(); ++m) {
      const btPersistentManifold* manifold = scene.dispatcher.getManifoldByIndexInternal(m);
      const bool body_is_first = manifold->getBody0() == &body;
      ASSERT_TRUE(body_is_first || manifold->getBody0() == floor);
      for (int i = 0; i < manifold->getNumContacts(); ++i, ++contacts) {
        const btManifoldPoint& p = manifold->getContactPoint(i);
        EXPECT_NEAR(p.m_normalWorldOnB.z(), body_is_first ? 1 : -1, 1e-3);
        EXPECT_NEAR(p.getDistance(), 0, 0.001);
        EXPECT_NEAR(p.getPositionWorldOnA().z(), 0, 0.002);
        const btVector3 gap = p.getPositionWorldOnA() - p.getPositionWorldOnB();
        EXPECT_NEAR(gap.dot(p.m_normalWorldOnB), p.getDistance(), 1e-5);
      }
    }
    EXPECT_GE(contacts, k == 1 ? 1 : 3);
  }
}

TEST_P(EveryMesh, ItsDepthsAreThoseOfAPlaneWhateverTheWinding) {
  const auto [kind, ground_first] = GetParam();
  for (const Winding winding : {Winding::up, Winding::down, Winding::mixed}) {
    MeshWorld scene;
    bullet::Shape shape(brick());
    Ground ground(kind, 0.5, 17, flat, winding);
    btStaticPlaneShape plane({0, 0, 1}, 0);
    btRigidBody& floor = scene.add(*ground, 0, {0, 0, 0});
    btRigidBody& exact = scene.add(plane, 0, {0, 0, 0});
    for (const double angle : {0.0, 0.1, 0.5, 0.9}) {
      for (const double depth : {-0.0003, 0.001, 0.004, 0.012, 0.02}) {
        const double half = 0.05 * (std::cos(angle) + std::sin(angle));
        btRigidBody& body = scene.add(shape, 1, turned({0, 1, 0}, angle, {0, 0, btScalar(half - depth)}));
        const auto found = ground_first ? contacts_of(scene, floor, body) : contacts_of(scene, body, floor);
        const auto wanted = contacts_of(scene, body, exact);
        EXPECT_NEAR(deepest(found), deepest(wanted), 2e-5) << angle << " " << depth;
        for (const btManifoldPoint& p : found)
          EXPECT_NEAR(std::abs(p.m_normalWorldOnB.z()), 1, 1e-3) << angle << " " << depth;
        scene.world.removeRigidBody(&body);
        scene.bodies.pop_back();
      }
    }
  }
}

TEST_P(EveryMesh, ABrickSlidesOverItWithoutAKick) {
  const auto [kind, ground_first] = GetParam();
  MeshWorld scene;
  bullet::Shape shape(brick());
  Ground ground(kind, 1, 100);
  if (ground_first) scene.add(*ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, turned({0, 0, 1}, 0.3, {btScalar(-0.4), btScalar(0.003), btScalar(0.0505)}));
  if (!ground_first) scene.add(*ground, 0, {0, 0, 0});
  scene.step(60);
  const double friction = 0.25;  // of the product
  body.setLinearVelocity({btScalar(1.5), 0, 0});
  btVector3 last = body.getLinearVelocity();
  for (int i = 0; i < 120; ++i) {
    scene.step(1);
    const btVector3 now = body.getLinearVelocity();
    EXPECT_NEAR(now.x() - last.x(), -friction * 9.81 / 240, 0.5 * friction * 9.81 / 240) << i;
    EXPECT_NEAR(now.y(), 0, 0.03);
    EXPECT_NEAR(now.z(), 0, 0.03);
    EXPECT_LT(body.getAngularVelocity().length(), 0.5);
    last = now;
  }
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
}

TEST_P(EveryMesh, ABodyGlidesDownASlopeAsGravityWants) {
  const auto [kind, ground_first] = GetParam();
  const double rise = 0.5;
  MeshWorld scene;
  bullet::Shape shape(brick());
  Ground ground(kind, 1, 40, [&](double x, double) { return -rise * x; });
  if (ground_first) scene.add(*ground, 0, {0, 0, 0}).setFriction(0);
  const double angle = std::atan(rise);
  const btTransform start =
      turned({0, 1, 0}, angle, {btScalar(0.0501 * std::sin(angle)), 0, btScalar(0.0501 * std::cos(angle))});
  btRigidBody& body = scene.add(shape, 1, start);
  if (!ground_first) scene.add(*ground, 0, {0, 0, 0}).setFriction(0);
  scene.step(120);
  const double along = 9.81 * std::sin(angle) * 0.5;
  EXPECT_NEAR(body.getLinearVelocity().x(), along * std::cos(angle), 0.03 * along);
  EXPECT_NEAR(body.getLinearVelocity().z(), -along * std::sin(angle), 0.03 * along);
  EXPECT_LT(body.getAngularVelocity().length(), 0.2);
}

TEST_P(EveryMesh, ChildrenOfCompoundsRestOnIt) {
  const auto [kind, ground_first] = GetParam();
  MeshWorld scene;
  bullet::Shape shape(ball());
  btCompoundShape dumbbell;
  dumbbell.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(-0.1), 0, 0}), &shape);
  dumbbell.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(0.1), 0, 0}), &shape);
  Ground ground(kind, 0.5, 20);
  btCompoundShape floor;
  floor.addChildShape(btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(-0.1)}), &*ground);
  const btVector3 at(0, 0, btScalar(0.1));
  if (ground_first) scene.add(floor, 0, at);
  btRigidBody& body = scene.add(dumbbell, 1, {0, 0, btScalar(0.06)});
  if (!ground_first) scene.add(floor, 0, at);
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_LT(speed(body), 0.05);
}

TEST(TriangleContacts, ACompoundRestsOnAMeshThatIsNoChild) {
  for (const Kind kind : {Kind::bvh, Kind::terrain, Kind::gimpact}) {
    MeshWorld scene;
    bullet::Shape shape(brick());
    btCompoundShape compound;
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(0.1), 0, 0}), &shape);
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(-0.1), 0, 0}), &shape);
    Ground ground(kind, 0.5, 20);
    scene.add(*ground, 0, {0, 0, 0});
    btRigidBody& body = scene.add(compound, 1, {0, 0, btScalar(0.06)});
    scene.step(240);
    EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001) << static_cast<int>(kind);
  }
}

TEST(TriangleContacts, TwoTrianglesAreGroundEnough) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  Ground ground(Kind::bvh, 1000, 1);
  scene.add(*ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {btScalar(3.003), btScalar(2.9), btScalar(0.06)});
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_LT(speed(body), 0.005);
}

TEST(TriangleContacts, DepthsOnASphereOfTrianglesAreThoseOfTheSphere) {
  MeshWorld scene;
  bullet::Shape shape(ball());
  btTriangleMesh triangles = to_bullet(make_sphere(0.2, 6));
  btBvhTriangleMeshShape mesh(&triangles, true);
  btSphereShape sphere(btScalar(0.2));
  btRigidBody& field = scene.add(mesh, 0, {0, 0, 0});
  btRigidBody& exact = scene.add(sphere, 0, {0, 0, 0});
  for (const double depth : {0.0, 0.001, 0.005, 0.02}) {
    const btVector3 way = btVector3(1, 2, 3).normalized();
    btRigidBody& body = scene.add(shape, 1, way * btScalar(0.25 - depth));
    const auto found = contacts_of(scene, body, field);
    ASSERT_FALSE(found.empty()) << depth;
    EXPECT_NEAR(deepest(found), deepest(contacts_of(scene, body, exact)), 1e-4) << depth;
    for (const btManifoldPoint& p : found) EXPECT_GT(p.m_normalWorldOnB.dot(way), 0.85) << depth;
    scene.world.removeRigidBody(&body);
    scene.bodies.pop_back();
  }
}

// A pyramid with a square base, tip at the origin, point up.
TriangleMesh pyramid(double half_width, double height) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}};
  for (const auto& [x, y] : {std::pair{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}) {
    mesh.vertices.push_back({x * half_width, y * half_width, -height});
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}};
  return mesh;
}

TEST(TriangleContacts, ASpikeBetweenThePointsIsFelt) {
  for (const double width : {0.001, 0.004, 0.02}) {
    for (const double x : {0.0, 0.0017, 0.0231}) {
      MeshWorld scene;
      bullet::Shape shape(brick());
      btTriangleMesh triangles = to_bullet(pyramid(width, 0.02));
      btBvhTriangleMeshShape mesh(&triangles, true);
      btRigidBody& spike = scene.add(mesh, 0, {btScalar(x), btScalar(0.0009), 0});
      for (const double depth : {0.0005, 0.002, 0.006}) {
        btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.05 - depth)});
        const auto found = contacts_of(scene, body, spike);
        ASSERT_FALSE(found.empty()) << width << " " << x << " " << depth;
        EXPECT_NEAR(deepest(found), depth, 0.0002) << width << " " << x << " " << depth;
        const btManifoldPoint* most = &found[0];
        for (const btManifoldPoint& p : found) {
          if (p.getDistance() < most->getDistance()) most = &p;
        }
        EXPECT_GT(most->m_normalWorldOnB.z(), 0.99) << width << " " << x << " " << depth;
        scene.world.removeRigidBody(&body);
        scene.bodies.pop_back();
      }
    }
  }
}

TEST(TriangleContacts, ASpikeOnFlatGroundIsFelt) {
  // The ground is nearer to the points than the spike between them.
  for (int k = 0; k < 8; ++k) {
    MeshWorld scene;
    bullet::Shape shape(brick());
    TriangleMesh spike = pyramid(0.0001, 0.0006);
    for (auto& v : spike.vertices) v[0] += 0.0007 * k;
    btTriangleMesh triangles = to_bullet(joined(spike, sheet(0.5, 1, [](double, double) { return -0.0006; })));
    btBvhTriangleMeshShape mesh(&triangles, true);
    btRigidBody& ground = scene.add(mesh, 0, {0, 0, 0});
    btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.0499)});
    const auto found = contacts_of(scene, body, ground);
    ASSERT_FALSE(found.empty()) << k;
    EXPECT_NEAR(deepest(found), 0.0001, 0.02 * 0.004) << k;  // but for the rounding of samples
  }
}

TEST(TriangleContacts, ABodyRestsOnABedOfSpikes) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  TriangleMesh bed;
  for (int i = -4; i <= 4; ++i) {
    for (int j = -4; j <= 4; ++j) {
      TriangleMesh spike = pyramid(0.0006, 0.01);
      for (auto& v : spike.vertices) {
        v[0] += 0.0207 * i;
        v[1] += 0.0207 * j;
      }
      bed = joined(bed, spike);
    }
  }
  btTriangleMesh triangles = to_bullet(bed);
  btBvhTriangleMeshShape mesh(&triangles, true);
  scene.add(mesh, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.055)});
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_LT(speed(body), 0.01);
}

TEST(TriangleContacts, ABrickRestsAcrossARidge) {
  // A long wall whose edge is sharper than the points' spacing tells, and two of them: the brick lies on both.
  MeshWorld scene;
  bullet::Shape shape(brick());
  TriangleMesh walls;
  for (const double x : {-0.0313, 0.0291}) {
    TriangleMesh wall;
    wall.vertices = {
        {x, -1, 0},           {x, 1, 0}, {x - 0.004, -1, -0.05}, {x - 0.004, 1, -0.05}, {x + 0.004, -1, -0.05},
        {x + 0.004, 1, -0.05}};
    wall.triangles = {{0, 1, 2}, {1, 3, 2}, {0, 4, 1}, {1, 4, 5}};
    walls = joined(walls, wall);
  }
  btTriangleMesh triangles = to_bullet(walls);
  btBvhTriangleMeshShape mesh(&triangles, true);
  scene.add(mesh, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.055)});
  scene.step(480);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().x(), 0, 0.002);
  EXPECT_LT(speed(body), 0.01);
}

TEST(TriangleContacts, APlateIsNotPulledThroughByItsFarSide) {
  MeshWorld scene;
  const double half = 0.002;  // half a voxel: either side sees what the other touches
  bullet::Shape shape(baked_at(make_box({0.05, 0.05, half}), 0.004));
  Ground ground(Kind::bvh, 0.5, 20);
  btRigidBody& floor = scene.add(*ground, 0, {0, 0, 0});
  for (const double depth : {0.0, 0.0005, 0.001, 0.0015}) {
    btRigidBody& deep = scene.add(shape, 1, {0, 0, btScalar(half - depth)});
    const auto found = contacts_of(scene, deep, floor);
    EXPECT_EQ(found.size(), 4U) << depth;
    for (const btManifoldPoint& p : found) {
      EXPECT_NEAR(p.getDistance(), -depth, 1e-5);
      EXPECT_GT(p.m_normalWorldOnB.z(), 0.999);
    }
    scene.world.removeRigidBody(&deep);
    scene.bodies.pop_back();
  }
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(half + 0.005)});
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), half, 0.0005);
  EXPECT_LT(speed(body), 0.005);
}

TEST(TriangleContacts, MovingGImpactMeshesFallOnAShapeAndAShapeOnThem) {
  btTriangleMesh triangles = to_bullet(make_box({0.1, 0.1, 0.05}));
  for (const bool shape_moves : {false, true}) {
    MeshWorld scene;
    btGImpactMeshShape mesh(&triangles);
    mesh.updateBound();
    bullet::Shape small(brick());
    bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
    btCollisionShape& below = shape_moves ? static_cast<btCollisionShape&>(mesh) : slab;
    btCollisionShape& above = shape_moves ? static_cast<btCollisionShape&>(small) : mesh;
    scene.add(below, 0, {0, 0, btScalar(shape_moves ? -0.05 : -0.1)});
    btRigidBody& body = scene.add(above, 1, {0, 0, btScalar(0.06)});
    scene.step(480);
    EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001) << shape_moves;
    EXPECT_LT(speed(body), 0.02) << shape_moves;
  }
}

TEST(TriangleContacts, SegmentsKeepTheirDeepestContactEach) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  shape.set_segments(16);
  Ground ground(Kind::bvh, 0.5, 20);
  scene.add(*ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.052)});
  scene.step(480);
  int manifolds = 0;
  for (int m = 0; m < scene.dispatcher.getNumManifolds(); ++m) {
    const int contacts = scene.dispatcher.getManifoldByIndexInternal(m)->getNumContacts();
    EXPECT_LE(contacts, 1);
    manifolds += contacts;
  }
  EXPECT_GE(manifolds, 3);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_LT(speed(body), 0.01);
}

TEST(TriangleContacts, MarginsThickenBoth) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  shape.setMargin(btScalar(0.003));
  Ground ground(Kind::bvh, 0.5, 20);
  (*ground).setMargin(btScalar(0.004));
  scene.add(*ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.06)});
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.057, 0.0005);
}

TEST(TriangleContacts, TrianglesWithoutAreaOrNumbersAreLeftOut) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  TriangleMesh mesh = sheet(0.5, 10, flat);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{0, 0, 0.1}, {nan, 0, 0}, {0, 1e30, 0}});
  mesh.triangles.insert(mesh.triangles.end(),
                        {{base, base, base}, {0, 1, 2}, {base, base + 1, 3}, {0, 5, base + 1}, {0, base + 2, 7}});
  // GImpact's boxes and quantized trees are their own affair: the triangles come one by one.
  struct Soup final : btTriangleMeshShape {
    explicit Soup(btStridingMeshInterface* mesh) : btTriangleMeshShape(mesh) {
      m_shapeType = TRIANGLE_MESH_SHAPE_PROXYTYPE;
      m_localAabbMin = {-1, -1, -1};
      m_localAabbMax = {1, 1, 1};
    }
    void processAllTriangles(btTriangleCallback* callback, const btVector3&, const btVector3&) const override {
      const btVector3 far(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
      struct Each final : btInternalTriangleIndexCallback {
        btTriangleCallback* to = nullptr;
        void internalProcessTriangleIndex(btVector3* corners, int part, int index) override {
          to->processTriangle(corners, part, index);
        }
      } each;
      each.to = callback;
      m_meshInterface->InternalProcessAllTriangles(&each, -far, far);
    }
  };
  btTriangleMesh triangles = to_bullet(mesh);
  Soup soup(&triangles);
  btRigidBody& floor = scene.add(soup, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.049)});
  const auto found = contacts_of(scene, body, floor);
  ASSERT_GE(found.size(), 3U);
  for (const btManifoldPoint& p : found) EXPECT_NEAR(p.getDistance(), -0.001, 1e-5);
}

TEST(TriangleContacts, ACompoundOfGImpactsSaysThatItHasNoTriangles) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  btGImpactCompoundShape compound;
  compound.addChildShape(btTransform::getIdentity(), &box);
  compound.updateBound();
  scene.add(compound, 0, {0, 0, btScalar(-0.5)});
  scene.add(shape, 1, {0, 0, btScalar(0.04)});
  scene.step(1);
  EXPECT_EQ(shape.status(), Status::missing_part);
}

TEST(TriangleContacts, WhatAPairRemembersDoesNotChangeItsContacts) {
  for (const std::uint32_t segments : {0U, 16U}) {
    MeshWorld scene;
    bullet::Shape shape(torus());
    shape.set_segments(segments);
    const auto bumps = [](double x, double y) { return 0.01 * std::sin(30 * x) * std::cos(25 * y); };
    Ground ground(Kind::bvh, 0.5, 40, bumps);
    btRigidBody& floor = scene.add(*ground, 0, {0, 0, 0});
    btRigidBody& body = scene.add(shape, 1, turned({1, 0, 0}, 0.3, {0, 0, btScalar(0.06)}));
    // Steps look for contacts ahead where there is no restitution, tests do not.
    floor.setRestitution(btScalar(0.01));
    body.setRestitution(btScalar(0.01));
    int compared = 0;
    for (int i = 0; i < 240; ++i) {
      scene.step(1);
      scene.world.performDiscreteCollisionDetection();
      const auto fresh = contacts_of(scene, body, floor);
      const auto remembered = scene.points();
      ASSERT_EQ(fresh.empty(), remembered.empty()) << i;
      if (fresh.empty()) continue;
      // Of few contacts those of the step before are kept while they are alike in depth.
      EXPECT_NEAR(deepest(fresh), deepest(remembered), segments == 0 ? 0.021 * 0.004 : 1e-6) << i;
      EXPECT_TRUE(segments == 0 || fresh.size() == remembered.size()) << i;
      ++compared;
    }
    EXPECT_GT(compared, 100);
  }
}

TEST(TriangleContacts, AMeshThatChangesUnderABodyAtRestIsNoticed) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  std::vector<btScalar> heights(41 * 41, 0);
  const auto lift = [&](std::size_t half, double height) {
    for (std::size_t i = 20 - half; i <= 20 + half; ++i)
      std::fill_n(&heights[41 * i + 20 - half], 2 * half + 1, btScalar(height));
  };
  lift(3, -0.02);  // the body rests on the rim of a pit
  btHeightfieldTerrainShape terrain(41, 41, heights.data(), 1, -1, 1, 2, PHY_FLOAT, false);
  terrain.setLocalScaling({btScalar(0.01), btScalar(0.01), 1});
  scene.add(terrain, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.0501)});
  scene.step(240);
  ASSERT_LT(deepest(scene.points()), 0.0005);
  lift(1, 0.002);
  scene.world.performDiscreteCollisionDetection();
  EXPECT_NEAR(deepest(scene.points()), 0.002, 0.0005);
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.052, 0.0005);
}

TEST(TriangleContacts, TheSameStepsGiveTheSameBits) {
  btVector3 ends[2];
  for (btVector3& end : ends) {
    MeshWorld scene;
    bullet::Shape shape(torus());
    Ground ground(Kind::gimpact, 0.5, 30,
                  [](double x, double y) { return 0.02 * std::sin(20 * x) * std::cos(17 * y); });
    scene.add(*ground, 0, {0, 0, 0});
    btRigidBody& body = scene.add(shape, 1, turned({1, 0, 0}, 0.7, {0, 0, btScalar(0.2)}));
    scene.step(240);
    end = body.getWorldTransform().getOrigin();
  }
  EXPECT_EQ(ends[0], ends[1]);
}

}  // namespace
}  // namespace vps::test
