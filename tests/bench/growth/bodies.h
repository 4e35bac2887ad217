// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bodies at growing resolution, and the places where they touch. Frame of a place: the body's centre of mass.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "cli/lab/random.h"
#include "formats/triangle_mesh.h"
#include "runtime/bullet/vps_bullet.h"

namespace vps::bench {

using ShapePtr = std::shared_ptr<bullet::Shape>;

/// Bakes each body once.
class Bodies {
 public:
  /// @param work  folder for assets that the next run finds again; empty: none
  Bodies(const std::string& mesh, double scale, std::string work);
  /// With about this many points.
  ShapePtr bunny(double points);
  /// 100 x 100 x 8 mm, with about this many points on its face.
  ShapePtr plate(double points);
  /// Under that plate, 160 x 160 x 20 mm, with voxels twice as large.
  /// @param turn  about y, of the slab in its grid. [rad]
  ShapePtr slab(double points, double turn = 0);

 private:
  [[nodiscard]] std::shared_ptr<const Asset> bake(const TriangleMesh& mesh, double voxel, bool pointshell) const;
  ShapePtr get(const std::string& name, const TriangleMesh& mesh, double voxel, bool pointshell);
  std::string work_;
  TriangleMesh bunny_;
  double bunny_points_ = 0;  // with voxels of kFirstVoxel
  std::map<std::string, ShapePtr> shapes_;
};

[[nodiscard]] double voxel_of(const bullet::Shape& shape);  ///< [m]
/// Radius about the centre of mass. [m]
[[nodiscard]] double radius_of(const bullet::Shape& shape);

/// Where the body is in that place, to `traverse`.
[[nodiscard]] Pose pose_of(const bullet::Shape& shape, const btTransform& at);
/// A query of the library, with working memory of the thread.
QueryResult ask(const bullet::Shape& shape, FieldRef field, const Pose& pose, double contact_distance);

/// What lies under a body, its top at z = 0.
struct Ground {
  std::string name;
  std::shared_ptr<btCollisionShape> shape;
  btTransform at = btTransform::getIdentity();
};
[[nodiscard]] Ground box_ground();
/// Bullet's box and hull, a plane, and slabs under the plate with these points: level in the grid, and oblique.
[[nodiscard]] std::vector<Ground> grounds_of(Bodies& bodies, double points);

/// On z = 0, the mesh's y axis up.
[[nodiscard]] btTransform standing(const bullet::Shape& shape);
/// On z = 0, a twentieth of a voxel deep.
[[nodiscard]] btTransform lying(const bullet::Shape& plate, double x);
/// Points of the plate that touch where it lies.
[[nodiscard]] QueryResult face_of(const bullet::Shape& plate);
/// The same place, shifted along x and y by less than a voxel.
[[nodiscard]] std::vector<btTransform> jittered(const bullet::Shape& shape, const btTransform& at);

[[nodiscard]] btMatrix3x3 rotation(lab::Random& random);
[[nodiscard]] btVector3 direction(lab::Random& random);
/// Where a body that comes from afar is first `depth` deep in its copy. [m]
[[nodiscard]] btTransform touching(const bullet::Shape& shape, const btMatrix3x3& basis, const btVector3& along,
                                   double depth);
/// In its copy, half a voxel deep, in random rotations.
[[nodiscard]] std::vector<btTransform> pair_poses(const bullet::Shape& shape);

struct Places {
  btTransform first, second;
};
/// A body and its copy. Their boxes overlap, and they are at least so far apart: anywhere between.
[[nodiscard]] std::vector<Places> apart_places(const bullet::Shape& shape, double least_vx = 2);

}  // namespace vps::bench
