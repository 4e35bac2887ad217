// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Shapes that Bullet queries, ours among them, and the clock round its narrowphase.
#pragma once

#include <btBulletCollisionCommon.h>

#include <memory>
#include <string>
#include <vector>

#include "cli/lab/hacd.h"
#include "cli/lab/pair.h"
#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::lab {

/// A collision shape and what it refers to. Frame: the origin is the body's centre of mass.
struct BulletShape {
  std::vector<std::shared_ptr<void>> parts;  // outlive the shape
  std::shared_ptr<btCollisionShape> shape;
};

/// Of the peers: a voxel. [m]
inline constexpr double kPeerMargin = 0.0005;
/// What Bullet gives convex shapes that nobody asks otherwise of. [m]
inline constexpr double kBulletMargin = 0.04;

/// Convex hull of the mesh's extreme vertices in 42 directions, by Bullet's btShapeHull.
/// @param margin  [m]
[[nodiscard]] BulletShape hull_of_42(const TriangleMesh& body, double margin);
/// @param centre  of mass, in the hulls' frame
/// @param margin  of each hull. [m]
[[nodiscard]] BulletShape compound_of(const std::vector<Hull>& hulls, const std::array<double, 3>& centre,
                                      double margin);
/// Why Bullet must not be asked of a hull or a compound of hulls, in words; empty when it may. Its EPA ends in a memory
/// fault on hulls that are flat: thinner than 1/10,000 of their length.
[[nodiscard]] std::string hull_refusal(const BulletShape& hulls);
/// @param margin  [m]
[[nodiscard]] BulletShape gimpact_of(const TriangleMesh& body, double margin = kPeerMargin);
[[nodiscard]] BulletShape ours_of(const std::shared_ptr<const Asset>& asset);

/// What a body falls on; its top lies in the plane y = 0.
struct Ground {
  BulletShape shape;
  btVector3 position{0, 0, 0};
};
[[nodiscard]] Ground box_ground(const std::array<double, 3>& half_extents);
[[nodiscard]] Ground plane_ground();
/// A box baked as a voxelmap.
[[nodiscard]] Ground baked_ground(const std::shared_ptr<const Asset>& box);

/// A drop from 0.5 m, 1 kg, 200 Hz, sleeping off.
struct DropOptions {
  double lowest = 0;      ///< y of the body's lowest point, below its centre of mass: negative. [m]
  int first_timed = 200;  ///< step
  int last_timed = 600;
};
struct DropResult {
  std::vector<double> microseconds;  ///< whole narrowphase of a step
  std::vector<double> contacts;      ///< that Bullet was left with, per step
  double height = 0;                 ///< of the centre of mass at the end. [m]
  double speed = 0;                  ///< at the end. [m/s]
};
[[nodiscard]] DropResult drop(const BulletShape& body, const Ground& ground, const DropOptions& options);

/// Two bodies of one shape; the whole narrowphase. Depth: of the deepest contact in a manifold.
[[nodiscard]] std::unique_ptr<PairPeer> bullet_pair(const BulletShape& shape);

}  // namespace vps::lab
