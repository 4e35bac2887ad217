// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Grounds as every kind of Bullet's triangle shapes, and bodies for them.
#pragma once

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexMaterialArray.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/runtime/bullet/world.h"

namespace vps::test {

// The brick, without a voxelmap.
inline std::shared_ptr<Asset> brick_shell() {
  bake::BakeOptions options;
  options.voxel_size = 0.004;
  options.voxelmap = false;
  return baked(make_box({0.05, 0.05, 0.05}), options);
}

enum class Winding { up, down, mixed };
using Height = std::function<double(double, double)>;

// z = height(x, y) over a square, of 2 n^2 triangles.
inline TriangleMesh sheet(double half, int n, const Height& height, Winding winding = Winding::up) {
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
inline double flat(double, double) {
  return 0;
}

inline btTriangleMesh to_bullet(const TriangleMesh& mesh, double scale = 1) {
  btTriangleMesh out;
  const auto corner = [&](std::uint32_t v) {
    const auto& p = mesh.vertices[v];
    return btVector3(btScalar(p[0] * scale), btScalar(p[1] * scale), btScalar(p[2] * scale));
  };
  for (const auto& [a, b, c] : mesh.triangles) out.addTriangle(corner(a), corner(b), corner(c));
  return out;
}

enum class Kind { bvh, scaled, multimaterial, terrain, gimpact };

// A square ground with heights from a function, as a triangle shape of any kind.
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

// GImpact's registration replaces table entries, so register_algorithm() is called after it.
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

inline std::vector<btManifoldPoint> contacts_of(World& scene, btRigidBody& first, btRigidBody& second) {
  Collect found;
  scene.world.contactPairTest(&first, &second, found);
  return found.points;
}
inline double deepest(const std::vector<btManifoldPoint>& points) {
  double depth = -std::numeric_limits<double>::max();
  for (const btManifoldPoint& p : points) depth = std::max(depth, -double(p.getDistance()));
  return depth;
}

inline btTransform turned(const btVector3& axis, double angle, const btVector3& at) {
  return btTransform(btQuaternion(axis, btScalar(angle)), at);
}

// A pyramid with a square base, tip at the origin, point up.
inline TriangleMesh pyramid(double half_width, double height) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}};
  for (const auto& [x, y] : {std::pair{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}) {
    mesh.vertices.push_back({x * half_width, y * half_width, -height});
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}};
  return mesh;
}

/// Every kind, added to the world before or after the body.
class EveryMesh : public testing::TestWithParam<std::tuple<Kind, bool>> {};

}  // namespace vps::test
