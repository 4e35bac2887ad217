// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Takes the triangles of Bullet's meshes for a bake. Header only: programs that include it have Bullet already.
///
///     btTriangleIndexVertexArray level = ...;
///     const auto asset = vps::bake::load_or_bake(vps::bullet::triangles_of(level), settings, cache_folder).asset;
#pragma once

#include <BulletCollision/CollisionShapes/btStridingMeshInterface.h>

#include <array>
#include <cstdint>

#include "formats/triangle_mesh.h"

namespace vps::bullet {

/// All triangles of a btTriangleMesh, btTriangleIndexVertexArray or similar, with its scaling applied. Bullet's lengths
/// are read as metres. Each triangle has three vertices of its own; a bake joins those that are equal.
[[nodiscard]] inline TriangleMesh triangles_of(const btStridingMeshInterface& mesh) {
  class Collect : public btInternalTriangleIndexCallback {
   public:
    TriangleMesh triangles;
    void internalProcessTriangleIndex(btVector3* corners, int /*part*/, int /*index*/) override {
      std::array<std::uint32_t, 3> triangle{};
      for (int k = 0; k < 3; ++k) {
        triangle[static_cast<std::size_t>(k)] = static_cast<std::uint32_t>(triangles.vertices.size());
        triangles.vertices.push_back({double(corners[k].x()), double(corners[k].y()), double(corners[k].z())});
      }
      triangles.triangles.push_back(triangle);
    }
  };
  Collect collect;
  constexpr btScalar kEverywhere = BT_LARGE_FLOAT;  // Bullet's meshes ignore this box
  mesh.InternalProcessAllTriangles(&collect, btVector3(-kEverywhere, -kEverywhere, -kEverywhere),
                                   btVector3(kEverywhere, kEverywhere, kEverywhere));
  return collect.triangles;
}

}  // namespace vps::bullet
