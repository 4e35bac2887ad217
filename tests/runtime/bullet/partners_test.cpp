// SPDX-License-Identifier: GPL-3.0-or-later
// Contacts of baked shapes with Bullet's convex shapes, planes, compounds and other baked shapes. Each is tested as
// ground and as moving body, whichever was added first.
#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btMinkowskiSumShape.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "runtime/bullet/partners/convex_planes.h"
#include "tests/runtime/bullet/world.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

std::shared_ptr<Asset> slab() {
  return baked_at(make_box({0.4, 0.4, 0.1}), 0.01);
}
std::shared_ptr<Asset> partner_ball() {
  return baked_at(make_sphere(0.05, 5), 0.0015);
}

// A shape and the parts that it refers to.
struct Made {
  std::unique_ptr<btCollisionShape> shape;
  std::vector<std::unique_ptr<btCollisionShape>> parts;
  std::shared_ptr<btTriangleMesh> mesh;
};
using Make = std::function<Made(btScalar)>;

template <class T, class... Args>
Made make(Args... args) {
  Made out;
  out.shape = std::make_unique<T>(args...);
  return out;
}

btVector3 vec(double x, double y, double z) {
  return {static_cast<btScalar>(x), static_cast<btScalar>(y), static_cast<btScalar>(z)};
}

constexpr btScalar kMargin = btScalar(0.005);

// Corners of a box of half extents (a, a, h).
std::vector<btVector3> corners(btScalar a, btScalar h) {
  std::vector<btVector3> out;
  for (int i = 0; i < 8; ++i) out.emplace_back(i & 1 ? a : -a, i & 2 ? a : -a, i & 4 ? h : -h);
  return out;
}
Made hull(btScalar a, btScalar h) {
  const auto points = corners(a, h);
  Made out;
  out.shape = std::make_unique<btConvexHullShape>(&points[0][0], 8, int{sizeof(btVector3)});
  out.shape->setMargin(kMargin);
  return out;
}
Made convex_mesh(btScalar a, btScalar h) {
  Made out;
  out.mesh = std::make_shared<btTriangleMesh>();
  const auto p = corners(a, h);
  constexpr int kFaces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& f : kFaces) out.mesh->addTriangle(p[f[0]], p[f[1]], p[f[2]]);
  out.shape = std::make_unique<btConvexTriangleMeshShape>(out.mesh.get());
  out.shape->setMargin(kMargin);
  return out;
}
Made point_cloud(btScalar a, btScalar h) {
  static std::vector<std::vector<btVector3>> kept;
  kept.push_back(corners(a, h));
  Made out;
  out.shape = std::make_unique<btConvexPointCloudShape>(kept.back().data(), 8, btVector3(1, 1, 1));
  out.shape->setMargin(kMargin);
  return out;
}
Made child_box(btScalar a, btScalar h) {
  Made out;
  out.parts.push_back(std::make_unique<btBoxShape>(btVector3(a, a, h)));
  auto compound = std::make_unique<btCompoundShape>();
  compound->addChildShape(btTransform::getIdentity(), out.parts[0].get());
  out.shape = std::move(compound);
  return out;
}
Made cone_on_its_base(btScalar radius, btScalar height) {
  Made out = make<btConeShapeZ>(radius, height);
  out.shape->setMargin(kMargin);
  return out;
}
Made four_spheres(btScalar a, btScalar radius) {
  const btVector3 at[] = {{a, a, 0}, {-a, a, 0}, {a, -a, 0}, {-a, -a, 0}};
  const btScalar radii[] = {radius, radius, radius, radius};
  Made out;
  out.shape = std::make_unique<btMultiSphereShape>(at, radii, 4);
  return out;
}
Made scaled_box(btScalar a, btScalar h) {
  Made out;
  out.parts.push_back(std::make_unique<btBoxShape>(btVector3(a / 2, a / 2, h / 2)));
  out.shape = std::make_unique<btUniformScalingShape>(static_cast<btConvexShape*>(out.parts[0].get()), btScalar(2));
  return out;
}
Made of_asset(const std::shared_ptr<Asset>& asset) {
  Made out;
  out.shape = std::make_unique<bullet::Shape>(asset);
  return out;
}

// `to_ground`: distance from its origin down to its lowest point in its resting pose. [m]
struct Partner {
  const char* name;
  std::function<Made()> make;
  double to_ground;
  bool round = false;
};

// About 10 cm large.
const Partner kMoving[] = {
    {"box", [] { return make<btBoxShape>(vec(0.05, 0.05, 0.03)); }, 0.03},
    {"sphere", [] { return make<btSphereShape>(btScalar(0.05)); }, 0.05, true},
    {"capsule", [] { return make<btCapsuleShapeX>(btScalar(0.03), btScalar(0.08)); }, 0.03, true},
    {"standing_capsule", [] { return make<btCapsuleShapeZ>(btScalar(0.05), btScalar(0.01)); }, 0.055},
    {"cylinder", [] { return make<btCylinderShapeZ>(vec(0.05, 0.05, 0.03)); }, 0.03},
    {"lying_cylinder", [] { return make<btCylinderShapeX>(vec(0.06, 0.03, 0.03)); }, 0.03, true},
    {"cone", [] { return cone_on_its_base(btScalar(0.06), btScalar(0.06)); }, 0.03 + double{kMargin}},
    {"hull", [] { return hull(btScalar(0.05), btScalar(0.03)); }, 0.03 + double{kMargin}},
    {"convex_mesh", [] { return convex_mesh(btScalar(0.05), btScalar(0.03)); }, 0.03 + double{kMargin}},
    {"point_cloud", [] { return point_cloud(btScalar(0.05), btScalar(0.03)); }, 0.03 + double{kMargin}},
    {"multi_sphere", [] { return four_spheres(btScalar(0.03), btScalar(0.03)); }, 0.03, true},
    {"scaled_box", [] { return scaled_box(btScalar(0.05), btScalar(0.03)); }, 0.03},
    {"compound", [] { return child_box(btScalar(0.05), btScalar(0.03)); }, 0.03},
    {"baked", [] { return of_asset(brick()); }, 0.05},
    {"baked_ball", [] { return of_asset(partner_ball()); }, 0.05, true},
};

// Flat top faces at `to_ground` above the origin.
const Partner kGround[] = {
    {"box", [] { return make<btBoxShape>(vec(1, 1, 0.5)); }, 0.5},
    {"plane", [] { return make<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0)); }, 0},
    {"cylinder", [] { return make<btCylinderShapeZ>(vec(1, 1, 0.5)); }, 0.5},
    {"hull", [] { return hull(1, btScalar(0.5)); }, 0.5 + double{kMargin}},
    {"convex_mesh", [] { return convex_mesh(1, btScalar(0.5)); }, 0.5 + double{kMargin}},
    {"point_cloud", [] { return point_cloud(1, btScalar(0.5)); }, 0.5 + double{kMargin}},
    {"multi_sphere", [] { return four_spheres(1, btScalar(0.5)); }, 0.5},
    {"compound", [] { return child_box(1, btScalar(0.5)); }, 0.5},
    {"baked", [] { return of_asset(slab()); }, 0.1},
};

struct PartnerCase {
  Partner partner;
  int ground_first;
};

void PrintTo(const PartnerCase& test, std::ostream* out) {
  *out << test.partner.name;
}

template <std::size_t n>
std::vector<PartnerCase> cases(const Partner (&partners)[n]) {
  std::vector<PartnerCase> out;
  for (const Partner& partner : partners) {
    for (const int ground_first : {0, 1}) out.push_back({partner, ground_first});
  }
  return out;
}
std::string case_name(const testing::TestParamInfo<PartnerCase>& test) {
  return std::string(test.param.partner.name) + (test.param.ground_first ? "_ground_first" : "_body_first");
}

// A body over a fixed ground whose top is at z = 0.
struct PartnerScene : World {
  btRigidBody* body = nullptr;
  btRigidBody* floor = nullptr;
  PartnerScene(btCollisionShape& moving, btScalar height, btCollisionShape& ground, double ground_top,
               int ground_first) {
    const btVector3 below(0, 0, static_cast<btScalar>(-ground_top));
    if (ground_first) floor = &add(ground, 0, below);
    body = &add(moving, 1, {0, 0, height});
    if (!ground_first) floor = &add(ground, 0, below);
  }
  double height() const { return double(body->getWorldTransform().getOrigin().z()); }

  // The normal lies on the second body and points to the first; the two positions agree with it.
  void expect_sound_contacts() {
    int contacts = 0;
    for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
      const btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(m);
      const bool body_is_first = manifold->getBody0() == body;
      ASSERT_TRUE(body_is_first || manifold->getBody0() == floor);
      for (int i = 0; i < manifold->getNumContacts(); ++i, ++contacts) {
        const btManifoldPoint& p = manifold->getContactPoint(i);
        EXPECT_NEAR(p.m_normalWorldOnB.z(), body_is_first ? 1 : -1, 0.05);
        EXPECT_NEAR(p.m_normalWorldOnB.length(), 1, 1e-4);
        EXPECT_NEAR(p.getDistance(), 0, 0.002);
        const btVector3 gap = p.getPositionWorldOnA() - p.getPositionWorldOnB();
        EXPECT_NEAR(gap.dot(p.m_normalWorldOnB), p.getDistance(), 1e-5);
        EXPECT_NEAR(p.getPositionWorldOnA().z(), 0, 0.008);
        EXPECT_LE(manifold->getContactBreakingThreshold(), 0.0011);
      }
    }
    EXPECT_GE(contacts, 1);
  }
};

class MovingPartner : public testing::TestWithParam<PartnerCase> {};

TEST_P(MovingPartner, RestsOnOurGround) {
  const Made made = GetParam().partner.make();
  bullet::Shape ground(slab());
  const double rest = GetParam().partner.to_ground;
  PartnerScene scene(*made.shape, btScalar(rest + 0.01), ground, 0.1, GetParam().ground_first);
  double fastest = 0;
  for (int i = 0; i < 480; ++i) {
    scene.step(1);
    fastest = std::max(fastest, speed(*scene.body));
  }
  EXPECT_EQ(ground.status(), Status::ok);
  EXPECT_NEAR(scene.height(), rest, 0.002);
  // Round bodies may roll away.
  EXPECT_LT(speed(*scene.body), GetParam().partner.round ? 0.35 : 0.02);
  EXPECT_LT(fastest, 0.6);
  scene.expect_sound_contacts();
}

TEST_P(MovingPartner, DoesNotFallThroughAt3MetresPerSecond) {
  const Made made = GetParam().partner.make();
  bullet::Shape ground(slab());
  const double rest = GetParam().partner.to_ground;
  PartnerScene scene(*made.shape, btScalar(rest + 0.05), ground, 0.1, GetParam().ground_first);
  scene.body->setLinearVelocity({0, 0, -3});
  double lowest = 1;
  double fastest = 0;
  for (int i = 0; i < 240; ++i) {
    scene.step(1);
    lowest = std::min(lowest, scene.height());
    fastest = std::max(fastest, speed(*scene.body));
  }
  EXPECT_GT(lowest, rest - 0.02);
  EXPECT_LT(fastest, 4);
}

INSTANTIATE_TEST_SUITE_P(All, MovingPartner, testing::ValuesIn(cases(kMoving)), case_name);

class GroundPartner : public testing::TestWithParam<PartnerCase> {};

TEST_P(GroundPartner, CarriesOurBrick) {
  const Made made = GetParam().partner.make();
  bullet::Shape shape(brick());
  PartnerScene scene(shape, btScalar(0.06), *made.shape, GetParam().partner.to_ground, GetParam().ground_first);
  scene.step(480);
  EXPECT_EQ(shape.status(), Status::ok);
  EXPECT_NEAR(scene.height(), 0.05, 0.001);
  EXPECT_LT(speed(*scene.body), 0.005);
  scene.expect_sound_contacts();
}

TEST_P(GroundPartner, LetsOurBrickSlideAsFarAsFrictionSays) {
  const Made made = GetParam().partner.make();
  bullet::Shape shape(brick());
  PartnerScene scene(shape, btScalar(0.0501), *made.shape, GetParam().partner.to_ground, GetParam().ground_first);
  scene.body->setFriction(btScalar(0.4));
  scene.floor->setFriction(1);
  scene.step(24);
  const btScalar from = scene.body->getWorldTransform().getOrigin().x();
  scene.body->setLinearVelocity({1, 0, 0});
  scene.step(240);
  // v^2 / (2 mu g).
  EXPECT_NEAR(scene.body->getWorldTransform().getOrigin().x() - from, 1 / (2 * 0.4 * 9.81), 0.02);
  EXPECT_NEAR(scene.body->getWorldTransform().getOrigin().y(), 0, 0.01);
  EXPECT_NEAR(scene.height(), 0.05, 0.001);
  EXPECT_LT(speed(*scene.body), 0.005);
}

TEST_P(GroundPartner, LetsOurBallRoll) {
  const Made made = GetParam().partner.make();
  bullet::Shape shape(partner_ball());
  PartnerScene scene(shape, btScalar(0.0501), *made.shape, GetParam().partner.to_ground, GetParam().ground_first);
  scene.step(24);
  scene.body->setLinearVelocity({btScalar(0.25), 0, 0});
  scene.body->setAngularVelocity({0, btScalar(0.25 / 0.05), 0});
  const btScalar from = scene.body->getWorldTransform().getOrigin().x();
  scene.step(240);
  // The mesh's faces are 2 mm large: a polyhedron loses speed on its edges.
  EXPECT_NEAR(scene.body->getWorldTransform().getOrigin().x() - from, 0.23, 0.03);
  EXPECT_NEAR(scene.height(), 0.05, 0.001);
  EXPECT_GT(scene.body->getLinearVelocity().x(), 0.15);
  EXPECT_NEAR(scene.body->getLinearVelocity().x(), 0.05 * scene.body->getAngularVelocity().y(), 0.02);
}

TEST_P(GroundPartner, StopsOurBrickAt3MetresPerSecond) {
  const Made made = GetParam().partner.make();
  bullet::Shape shape(brick());
  PartnerScene scene(shape, btScalar(0.1), *made.shape, GetParam().partner.to_ground, GetParam().ground_first);
  scene.body->setLinearVelocity({0, 0, -3});
  double lowest = 1;
  double fastest = 0;
  for (int i = 0; i < 240; ++i) {
    scene.step(1);
    lowest = std::min(lowest, scene.height());
    fastest = std::max(fastest, speed(*scene.body));
  }
  EXPECT_GT(lowest, 0.03);
  EXPECT_LT(fastest, 4);
  EXPECT_NEAR(scene.height(), 0.05, 0.001);
}

INSTANTIATE_TEST_SUITE_P(All, GroundPartner, testing::ValuesIn(cases(kGround)), case_name);

// The rounding of the planes of its faces must not grow with the size of the hull.
TEST(Partners, ALargeTurnedHullIsAsHighAsItsCorners) {
  const btMatrix3x3 turn(btQuaternion(btVector3(1, btScalar(0.7), btScalar(0.3)).normalized(), btScalar(0.6)));
  btConvexHullShape ground;
  for (int i = 0; i < 8; ++i) ground.addPoint(turn * vec(i & 1 ? 25 : -25, i & 2 ? 25 : -25, i & 4 ? 0 : -0.2));
  ground.setMargin(0);
  World scene;
  scene.add(ground, 0, btTransform(turn.transpose()));
  bullet::Shape shape(brick());
  const btRigidBody& body = scene.add(shape, 1, vec(7, 5, 0.0501));
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 1e-4);
}

// Depths of the contacts of a box that falls at 2 m/s, in its first step.
std::vector<double> depths_of_falling(btBoxShape& box, const std::array<double, 9>& rotation, double deep, int flags) {
  constexpr double kTop = 0.05;
  static bullet::Shape ground(baked_at(make_box({0.4, 0.4, kTop}), 0.005));
  btTransform at = btTransform::getIdentity();
  for (int i = 0; i < 9; ++i) at.getBasis()[i / 3][i % 3] = btScalar(rotation[static_cast<std::size_t>(i)]);
  btScalar lowest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    btVector3 place;
    box.getVertex(corner, place);
    lowest = std::min(lowest, (at * place).z());
  }
  at.getOrigin().setZ(btScalar(kTop - deep) - lowest);
  World scene;
  scene.add(ground, 0, ground.asset_frame().inverse());
  btRigidBody& body = scene.add(box, 1, at);
  body.setLinearVelocity(vec(0, 0, -2));
  body.setCollisionFlags(body.getCollisionFlags() | flags);
  scene.step(1, btScalar(1.0 / 60));
  std::vector<double> depths;
  for (const btManifoldPoint& point : scene.points()) depths.push_back(-double(point.getDistance()));
  return depths;
}

// The way of a step is longer than the edge between a deep corner and a shallow one above it.
TEST(Partners, AFastBoxHasAContactAtItsLowestCorner) {
  btBoxShape box(vec(0.04, 0.03, 0.01));
  btBoxShape cube(vec(0.006, 0.006, 0.006));
  Random random;
  for (int start = 0; start < 50; ++start) {
    const std::array<double, 9> rotation = random.rotation();
    for (btBoxShape* const shape : {&box, &cube}) {
      for (const int flags : {0, int{btCollisionObject::CF_HAS_FRICTION_ANCHOR}}) {
        for (const double deep : {0.001, -0.01}) {
          const std::vector<double> depths = depths_of_falling(*shape, rotation, deep, flags);
          ASSERT_FALSE(depths.empty());
          EXPECT_NEAR(*std::max_element(depths.begin(), depths.end()), deep, 2e-4) << start << ", flags " << flags;
        }
      }
    }
  }
}

// All of its corners are closer together than the way of the step.
TEST(Partners, ASmallFastCubeHasAContactAtEachLowCorner) {
  btBoxShape cube(vec(0.006, 0.006, 0.006));
  const std::vector<double> depths = depths_of_falling(cube, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 0.0002, 0);
  EXPECT_EQ(std::count_if(depths.begin(), depths.end(), [](double depth) { return std::abs(depth - 0.0002) < 1e-4; }),
            4);
}

// If it turned any of them might land in the step.
TEST(Partners, AFastBoxHasContactsAheadAtAllCorners) {
  bullet::Shape ground(baked_at(make_box({0.4, 0.4, 0.05}), 0.005));
  btBoxShape box(vec(0.04, 0.03, 0.01));
  World scene;
  scene.add(ground, 0, ground.asset_frame().inverse());
  btRigidBody& body = scene.add(box, 1, vec(0, 0, 0.061));
  body.setLinearVelocity(vec(0, 0, -2));
  scene.step(1, btScalar(1.0 / 60));
  EXPECT_EQ(scene.points().size(), 8U);
}

TEST(Partners, AHullWhosePointsMoveIsNoticed) {
  std::vector<btVector3> points = corners(btScalar(0.3), btScalar(0.1));
  btConvexPointCloudShape cloud(points.data(), 8, btVector3(1, 1, 1));
  cloud.setMargin(0);
  bullet::Shape shape(brick());
  World scene;
  scene.add(cloud, 0, {0, 0, btScalar(-0.1)});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.055)});
  scene.step(120);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  for (btVector3& point : points) point.setZ(point.z() - btScalar(0.05));
  cloud.recalcLocalAabb();
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0, 0.001);
}

// Points beside the sharp rim of a lens of 2 mm. Its faces are so flat that the rim is nearest to any point outside it.
TEST(Partners, SmallFlatHullsAreAsFarAsTheyAre) {
  const double half = 0.001;
  const double height = 0.02 * half;
  btConvexHullShape lens;
  for (const double x : {-half, half}) {
    for (const double y : {-half, half}) lens.addPoint({btScalar(x), btScalar(y), 0});
  }
  for (const double z : {-height, height}) lens.addPoint({0, 0, btScalar(z)});
  lens.setMargin(btScalar(0.0001));
  bullet::ConvexPlanes planes;
  const PolytopeField field = planes.of(lens, btVector3(0, 0, 0));
  Random random;
  for (int n = 0; n < 2000; ++n) {
    const double beyond = half * random.between(0.02, 0.6);
    const double up = half * random.between(-0.5, 0.5);
    Contact contact;
    contact.position = {static_cast<float>(half + beyond), static_cast<float>(half * random.between(-0.9, 0.9)),
                        static_cast<float>(up)};
    contact.penetration = penetration(field, contact.position);
    planes.finish(contact, 0);
    ASSERT_NEAR(contact.penetration, 0.0001 - std::hypot(beyond, up), 1e-5 * half) << n;
    ASSERT_NEAR(contact.inward_normal.z, up / std::hypot(beyond, up), 1e-3) << n;
  }
}

// Points beside the edges and tips of a needle, where GJK ends too early.
TEST(Partners, NeedlesAreAsFarAsTheyAre) {
  const std::vector<btVector3> points = corners(btScalar(0.001), btScalar(0.1));
  btConvexHullShape needle(&points[0][0], 8, int{sizeof(btVector3)});
  needle.setMargin(btScalar(0.04));
  bullet::ConvexPlanes planes;
  const PolytopeField field = planes.of(needle, btVector3(0, 0, 0));
  const BoxField box{{0.001F, 0.001F, 0.1F}};
  Random random;
  for (int n = 0; n < 2000; ++n) {
    Contact contact;
    contact.position = {static_cast<float>(random.between(-0.05, 0.05)),
                        static_cast<float>(random.between(-0.05, 0.05)),
                        static_cast<float>(random.between(-0.15, 0.15))};
    const float exact = penetration(box, contact.position) + 0.04F;
    if (exact > 0.039F) continue;
    contact.penetration = penetration(field, contact.position);
    planes.finish(contact, 0);
    ASSERT_NEAR(contact.penetration, exact, 5e-5) << n;
  }
}

// A set of spheres made where another one was, as in a program that replaces a body's shape.
TEST(Partners, SpheresInTheMemoryOfOthersHaveTheirOwnPlanes) {
  bullet::ConvexPlanes planes;
  std::optional<btMultiSphereShape> spheres;
  for (const float radius : {0.1F, 0.2F}) {
    for (const float z : {0.0F, 0.05F}) {
      const btVector3 centre(0, 0, z);
      const btScalar radii[] = {radius};
      spheres.emplace(&centre, radii, 1);
      const PolytopeField field = planes.of(*spheres, btVector3(0, 0, 1));
      EXPECT_NEAR(penetration(field, {0, 0, 1}), radius + z - 1, 1e-4F) << radius << ' ' << z;
    }
  }
}

}  // namespace
}  // namespace vps::test
