// SPDX-License-Identifier: GPL-3.0-or-later
// Contacts of shapes with Bullet's triangle meshes.
#include <algorithm>
#include <cstring>
#include <numbers>
#include <numeric>

#include "runtime/bullet/partners/leaf_at_sheet.h"
#include "tests/runtime/bullet/found_contacts.h"
#include "tests/runtime/bullet/mesh_ground.h"

namespace vps::test {
namespace {

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

TEST(TriangleContacts, CornersHaveFeaturesOfTheirOwnAndPointsAreTheShells) {
  const bullet::Shape shape(brick());
  btTriangleMesh triangles = to_bullet(pyramid(0.001, 0.02));
  btBvhTriangleMeshShape mesh(&triangles, true);
  const btCollisionObject object;
  const auto at = [](double z) { return btTransform(btQuaternion::getIdentity(), {btScalar(0.0017), 0, btScalar(z)}); };
  PairSearch search;
  const std::uint32_t points = shape.pointshell().points;
  std::vector<std::uint32_t> before;
  for (const double depth : {0.002, 0.00201, 0.00202}) {
    const btTransform place = at(0.05 - depth);
    const bullet::Pair pair = bullet::assign_roles(bullet::PairBody(&shape, &object, place),
                                                   bullet::PairBody(&mesh, &object, btTransform::getIdentity()));
    QueryOptions options;
    options.contact_distance = 1e-4F;
    ASSERT_EQ(search.find(pair, options), Status::ok);
    const detail::FoundContacts& found = search.found;
    ASSERT_EQ(found.features.size(), found.contacts.size());
    std::vector<std::uint32_t> corners;
    for (std::size_t i = 0; i < found.contacts.size(); ++i) {
      EXPECT_LT(found.contacts[i].point, points);
      const std::uint32_t feature = detail::feature_of(found.contacts, found.features, i);
      if (feature >= points) corners.push_back(feature);
    }
    EXPECT_FALSE(corners.empty()) << depth;
    EXPECT_TRUE(before.empty() || corners == before) << depth;
    before = corners;
    std::sort(corners.begin(), corners.end());
    EXPECT_EQ(std::adjacent_find(corners.begin(), corners.end()), corners.end()) << depth;
  }
}

TEST(TriangleContacts, ASpikeOnFlatGroundIsFelt) {
  // The flat ground is nearer to the body's points than the spike between them.
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
    EXPECT_NEAR(deepest(found), 0.0001, 0.02 * 0.004) << k;  // within the rounding of samples
  }
}

TEST(TriangleContacts, APlateIsNotPulledThroughByItsFarSide) {
  MeshWorld scene;
  const double half = 0.002;  // half a voxel: each side also finds the triangles that touch the other
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

TEST(TriangleContacts, TrianglesWithoutAreaOrNumbersAreLeftOut) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  TriangleMesh mesh = sheet(0.5, 10, flat);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{0, 0, 0.1}, {nan, 0, 0}, {0, 1e30, 0}});
  mesh.triangles.insert(mesh.triangles.end(),
                        {{base, base, base}, {0, 1, 2}, {base, base + 1, 3}, {0, 5, base + 1}, {0, base + 2, 7}});
  // Passes the triangles one by one, without a tree: Bullet's quantized trees and GImpact's boxes are not tested here.
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
    PairSearch search;
    const auto found_with = [&](PairSearch& with) {
      const bullet::Pair pair =
          bullet::assign_roles(bullet::PairBody(&shape, &body, body.getWorldTransform()),
                               bullet::PairBody(floor.getCollisionShape(), &floor, floor.getWorldTransform()));
      QueryOptions options;
      options.contact_distance = bullet::in_step(pair).touching();
      options.segment_level = shape.segment_level();
      EXPECT_EQ(with.find(pair, options), Status::ok);
      const detail::FoundContacts& found = with.found;
      // Copied, as the thread's next query overwrites this memory.
      return std::pair(std::vector<Contact>(found.contacts.begin(), found.contacts.end()),
                       std::vector<std::uint32_t>(found.features.begin(), found.features.end()));
    };
    int compared = 0;
    int used = 0;
    for (int i = 0; i < 240; ++i) {
      scene.step(1);
      const Pose reference = search.partner.triangles().reference;
      const auto [remembered, old_features] = found_with(search);
      used += std::memcmp(&reference, &search.partner.triangles().reference, sizeof reference) == 0;
      PairSearch none;
      const auto [fresh, features] = found_with(none);
      ASSERT_EQ(old_features, features) << i;
      for (std::size_t k = 0; k < fresh.size(); ++k) {
        ASSERT_EQ(remembered[k].penetration, fresh[k].penetration) << i;
        ASSERT_EQ(remembered[k].node, fresh[k].node) << i;
      }
      compared += !fresh.empty();
    }
    EXPECT_GT(compared, 100);
    EXPECT_GT(used, 50);
  }
}

// They are looked up together, and again where that is too coarse.
TEST(TriangleContacts, SidesOfALeafsPointsAreThoseOfEachPoint) {
  bake::BakeOptions layers;
  layers.voxel_size = 0.004;
  layers.scaled = false;
  layers.layers = true;
  const auto waves = [](double x, double y) { return 0.01 + 0.01 * std::sin(30 * x) * std::cos(25 * y); };
  Ground ground(Kind::bvh, 0.2, 20, waves);
  bullet::Sheets sheets;
  bullet::gather(*ground, {-9, -9, -9}, {9, 9, 9}, sheets);
  bullet::place(Pose(), {{-9, -9, -9}, {9, 9, 9}}, sheets);
  std::vector<std::uint32_t> all(sheets.triangles.size());
  std::iota(all.begin(), all.end(), 0U);
  for (const std::shared_ptr<Asset>& asset : {torus(), baked(make_torus(0.1, 0.03, 64, 32), layers)}) {
    const bullet::Shape shape(asset);
    const PointshellView& shell = shape.pointshell();
    const bullet::SolidBody body{shell, shape.voxelmap(), static_cast<float>(asset->info().voxel_size)};
    const bullet::SheetPart part{sheets, all, 0.05F};
    int found[3] = {};
    for (std::uint32_t node = shell.level_offsets[shell.levels - 1]; node < shell.nodes; ++node) {
      const bullet::LeafAtSheet leaf(body, part, node, 0);
      const IndexRange points = children_of(shell, node);
      bullet::LeafPoints seen;
      leaf.look_at({points.begin, std::min(points.end, points.begin + detail::Spheres::kMost)}, 0.05F, -1, seen);
      for (const bullet::PointOverFace& one : std::span(seen.all).first(seen.count)) {
        if (one.face == nullptr) continue;
        ASSERT_EQ(one.side, body.side_of(*one.face, one.at, one.along)) << one.point;
        ++found[static_cast<int>(one.side) + 1];
      }
    }
    for (const int count : found) EXPECT_GT(count, 20);
  }
}

// A search of segments leaves out leaves that cannot beat the segment's contact; one that remembers places does not.
TEST(TriangleContacts, LeavesThatAreLeftOutGiveNoDeeperContact) {
  const auto bumps = [](double x, double y) { return 0.01 * std::sin(30 * x) * std::cos(25 * y); };
  const auto spikes = [](double x, double y) { return 0.012 * std::abs(std::sin(900 * x + 1700 * y)); };
  constexpr float kDistance = 0.02F;
  std::size_t compared = 0;
  for (const std::shared_ptr<Asset>& asset :
       {baked_at(make_torus(0.1, 0.03, 64, 32), 0.0025), brick(), baked_at(make_sphere(0.05, 5), 0.0015)}) {
    for (const Height& height : {Height(flat), Height(bumps), Height(spikes)}) {
      MeshWorld scene;
      bullet::Shape shape(asset);
      shape.set_segments(16);
      Ground ground(Kind::bvh, 0.5, 40, height);
      btRigidBody& floor = scene.add(*ground, 0, {0, 0, 0});
      btRigidBody& body = scene.add(shape, 1, {0, 0, 1});
      for (int i = 0; i < 10; ++i) {
        const btVector3 axis(btScalar(i % 3), 1, btScalar(i % 5 - 2));
        body.setWorldTransform(
            turned(axis.normalized(), 0.4 * i, {btScalar(0.1 + 0.002 * i), 0, btScalar(0.025 + 0.006 * i)}));
        const bullet::Pair pair =
            bullet::assign_roles(bullet::PairBody(&shape, &body, body.getWorldTransform()),
                                 bullet::PairBody(floor.getCollisionShape(), &floor, floor.getWorldTransform()));
        QueryOptions options;
        options.segment_level = shape.segment_level();
        PairSearch moved;
        const auto find_with = [&](PairSearch& search, float distance) {
          options.contact_distance = distance;
          EXPECT_EQ(search.find(pair, options), Status::ok);
          std::vector<Contact> found;
          std::copy_if(search.found.contacts.begin(), search.found.contacts.end(), std::back_inserter(found),
                       [](const Contact& contact) { return contact.penetration >= -kDistance; });
          return found;
        };
        find_with(moved, kDistance);
        ASSERT_EQ(moved.partner.triangles().room, 0);
        const std::vector<Contact> all = find_with(moved, kDistance);
        const double room = moved.partner.triangles().room;
        ASSERT_GT(room, 0);
        PairSearch fresh;
        const std::vector<Contact> found = find_with(fresh, kDistance + static_cast<float>(room));
        ASSERT_EQ(found.size(), all.size()) << i;
        for (std::size_t k = 0; k < found.size(); ++k) {
          ASSERT_EQ(found[k].penetration, all[k].penetration) << i;
          ASSERT_EQ(found[k].node, all[k].node) << i;
        }
        compared += found.size();
      }
    }
  }
  EXPECT_GT(compared, 500U);
}

std::vector<bullet::Triangle> joined_triangles(const TriangleMesh& mesh) {
  btTriangleMesh triangles = to_bullet(mesh);
  btBvhTriangleMeshShape shape(&triangles, true);
  bullet::Sheets sheets;
  bullet::gather(shape, {-9, -9, -9}, {9, 9, 9}, sheets);
  bullet::place(Pose(), {{-9, -9, -9}, {9, 9, 9}}, sheets);
  bullet::join(sheets);
  return sheets.triangles;
}

TEST(TriangleContacts, ASheetGoesOnAcrossEdgesThatBendALittle) {
  for (const double degrees : {0.0, 10.0, -10.0, 20.0, -20.0}) {
    const double slope = std::tan(degrees * std::numbers::pi / 180);
    const auto roof = [&](double x, double) { return slope * std::max(x, 0.0); };
    for (const Winding winding : {Winding::up, Winding::down, Winding::mixed}) {
      const std::vector<bullet::Triangle> found = joined_triangles(sheet(0.5, 4, roof, winding));
      ASSERT_EQ(found.size(), 32U);
      for (const bullet::Triangle& t : found) {
        for (int k = 0; k < 3; ++k) {
          const Vec3 a = t.corners[k];
          const Vec3 b = t.corners[(k + 1) % 3];
          const bool on_rim = (std::abs(a.x) == 0.5F && a.x == b.x) || (std::abs(a.y) == 0.5F && a.y == b.y);
          const bool on_ridge = a.x == 0 && b.x == 0;
          EXPECT_EQ(t.goes_on[k], !on_rim && !(on_ridge && std::abs(degrees) > 15)) << degrees;
        }
      }
    }
  }
}

// Three triangles at an edge are no sheet: every place where a doubled sheet bends counts.
TEST(TriangleContacts, WhereASheetGoesOnNothingIsMissed) {
  bullet::Shape shape(brick());
  // Ends under the body, has ridges in one half, and bends a little in the other.
  const auto ridges = [](double, double y) {
    return 0.001 * std::sin(30 * y) + (y > 0 && std::lround(y / 0.00625) % 2 == 1 ? 0.003 : 0);
  };
  TriangleMesh once = sheet(0.1, 32, ridges);
  for (auto& vertex : once.vertices) vertex[0] *= 20;  // few corners lie under the body
  btTriangleMesh triangles[2] = {to_bullet(once), to_bullet(joined(once, once))};
  const std::vector<bullet::Triangle> smooth = joined_triangles(once);
  const auto goes_on = [](const bullet::Triangle& t) { return t.goes_on[0] && t.goes_on[1] && t.goes_on[2]; };
  EXPECT_GT(std::count_if(smooth.begin(), smooth.end(), goes_on), 800);
  int found = 0;
  for (int i = 0; i < 60; ++i) {
    std::vector<btManifoldPoint> points[2];
    for (int k = 0; k < 2; ++k) {
      MeshWorld scene;
      btBvhTriangleMeshShape mesh(&triangles[k], true);
      btRigidBody& ground = scene.add(mesh, 0, {0, 0, 0});
      const btTransform at = turned({1, 1, 0}, 0.002 * i, {btScalar(0.002 * i), btScalar(0.03), btScalar(0.0525)});
      points[k] = contacts_of(scene, scene.add(shape, 1, at), ground);
      found += !points[k].empty();
    }
    ASSERT_EQ(points[0].size(), points[1].size()) << i;
    for (std::size_t k = 0; k < points[0].size(); ++k) {
      EXPECT_LT((points[0][k].getPositionWorldOnA() - points[1][k].getPositionWorldOnA()).length(), 1e-6) << i;
    }
  }
  EXPECT_GT(found, 60);
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

}  // namespace
}  // namespace vps::test
