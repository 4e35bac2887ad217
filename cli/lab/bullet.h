// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Collision shapes for Bullet, the plug-in's among them, and timing of Bullet's narrowphase.
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

/// A collision shape, with the objects that it refers to. Frame: the origin is the body's centre of mass.
struct BulletShape {
  std::vector<std::shared_ptr<void>> parts;  // outlive the shape
  std::shared_ptr<btCollisionShape> shape;
};

/// Default margin of the shapes to compare with: one voxel. [m]
inline constexpr double kPeerMargin = 0.0005;
/// Bullet's default margin of convex shapes. [m]
inline constexpr double kBulletMargin = 0.04;

/// Convex hull of the mesh's extreme vertices in 42 directions, by Bullet's btShapeHull.
/// @param margin  [m]
[[nodiscard]] BulletShape hull_of_42(const TriangleMesh& body, double margin);
/// @param centre  centre of mass, in the hulls' frame. [m]
/// @param margin  of each hull. [m]
[[nodiscard]] BulletShape compound_of(const std::vector<Hull>& hulls, const std::array<double, 3>& centre,
                                      double margin);
/// Why Bullet must not query a hull or a compound of hulls, in words; empty when it may. Bullet's EPA ends in a memory
/// fault on flat hulls: thinner than 1/10,000 of their length.
[[nodiscard]] std::string hull_refusal(const BulletShape& hulls);
/// @param margin  [m]
[[nodiscard]] BulletShape gimpact_of(const TriangleMesh& body, double margin = kPeerMargin);
[[nodiscard]] BulletShape ours_of(const std::shared_ptr<const Asset>& asset);

/// The ground under a falling body. Its top lies in the plane y = 0.
struct Ground {
  BulletShape shape;
  btVector3 position{0, 0, 0};
};
[[nodiscard]] Ground box_ground(const std::array<double, 3>& half_extents);
[[nodiscard]] Ground plane_ground();
/// A box baked as a voxelmap.
[[nodiscard]] Ground baked_ground(const std::shared_ptr<const Asset>& box);

/// A body of 1 kg falls from 0.5 m at 200 Hz and never sleeps.
struct DropOptions {
  double voxel = 0.02;    ///< of the finest asset that is compared: split impulses start at twice this. [m]
  double lowest = 0;      ///< y of the body's lowest point, from its centre of mass; negative. [m]
  int first_timed = 200;  ///< first step that is timed
  int last_timed = 600;   ///< last step of the simulation
};
struct DropResult {
  std::vector<double> microseconds;  ///< time of the whole narrowphase, per timed step
  std::vector<double> contacts;      ///< number of contacts in all manifolds, per timed step
  double height = 0;                 ///< of the centre of mass at the end. [m]
  double speed = 0;                  ///< at the end. [m/s]
};
[[nodiscard]] DropResult drop(const BulletShape& body, const Ground& ground, const DropOptions& options);

/// Queries two bodies of one shape and times the whole narrowphase. The depth is that of the deepest contact in a
/// manifold.
[[nodiscard]] std::unique_ptr<PairPeer> bullet_pair(const BulletShape& shape);

}  // namespace vps::lab
