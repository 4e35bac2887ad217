// SPDX-License-Identifier: GPL-3.0-or-later
#include <BulletCollision/CollisionShapes/btShapeHull.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "bake/quantity_text.h"
#include "cli/lab/bullet.h"
#include "runtime/bullet/vps_bullet.h"

namespace vps::lab {
namespace {

btVector3 vector3(const std::array<double, 3>& v) {
  return {btScalar(v[0]), btScalar(v[1]), btScalar(v[2])};
}

std::shared_ptr<btConvexHullShape> empty_hull(double margin) {
  auto hull = std::make_shared<btConvexHullShape>();
  hull->setMargin(btScalar(margin));
  return hull;
}

std::string refusal_of(const btConvexHullShape& hull) {
  Eigen::Matrix3Xd points(3, hull.getNumPoints());
  for (int i = 0; i < hull.getNumPoints(); ++i) {
    const btVector3& p = hull.getUnscaledPoints()[i];
    points.col(i) << double(p.x()), double(p.y()), double(p.z());
  }
  if (points.cols() < 4) return fmt::format("a hull has {} vertices and no volume", points.cols());
  points.colwise() -= points.rowwise().mean().eval();
  // The extents along the principal axes of the vertices.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(points * points.transpose());
  const Eigen::Matrix3Xd turned = axes.eigenvectors().transpose() * points;
  const Eigen::Vector3d extent = turned.rowwise().maxCoeff() - turned.rowwise().minCoeff();
  constexpr double kFlat = 1e-4;
  if (extent.minCoeff() > kFlat * extent.maxCoeff()) return "";
  return fmt::format("a hull is flat, {} thick and {} long: Bullet's EPA fails on it",
                     bake::format_length(extent.minCoeff()), bake::format_length(extent.maxCoeff()));
}

}  // namespace

std::string hull_refusal(const BulletShape& hulls) {
  if (!hulls.shape->isCompound()) return refusal_of(static_cast<const btConvexHullShape&>(*hulls.shape));
  const auto& compound = static_cast<const btCompoundShape&>(*hulls.shape);
  if (compound.getNumChildShapes() == 0) return "there is no hull";
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    const auto& hull = static_cast<const btConvexHullShape&>(*compound.getChildShape(i));
    if (std::string why = refusal_of(hull); !why.empty()) return why;
  }
  return "";
}

BulletShape hull_of_42(const TriangleMesh& body, double margin) {
  btConvexHullShape all;
  all.setMargin(0);  // the reduced hull's vertices would include a margin
  for (const auto& v : body.vertices) all.addPoint(vector3(v), false);
  all.recalcLocalAabb();
  btShapeHull reduced(&all);
  reduced.buildHull(0);
  const auto hull = empty_hull(margin);
  for (int i = 0; i < reduced.numVertices(); ++i) hull->addPoint(reduced.getVertexPointer()[i], false);
  hull->recalcLocalAabb();
  return {{}, hull};
}

BulletShape compound_of(const std::vector<Hull>& hulls, const std::array<double, 3>& centre, double margin) {
  BulletShape out;
  const auto compound = std::make_shared<btCompoundShape>();
  for (const Hull& points : hulls) {
    const auto hull = empty_hull(margin);
    for (const auto& p : points) hull->addPoint(vector3(p) - vector3(centre), false);
    hull->recalcLocalAabb();
    compound->addChildShape(btTransform::getIdentity(), hull.get());
    out.parts.push_back(hull);
  }
  out.shape = compound;
  return out;
}

BulletShape gimpact_of(const TriangleMesh& body, double margin) {
  const auto mesh = std::make_shared<btTriangleMesh>();
  mesh->preallocateVertices(int(body.vertices.size()));
  mesh->preallocateIndices(int(3 * body.triangles.size()));
  for (const auto& v : body.vertices) mesh->findOrAddVertex(vector3(v), false);
  for (const auto& t : body.triangles) mesh->addTriangleIndices(int(t[0]), int(t[1]), int(t[2]));
  const auto shape = std::make_shared<btGImpactMeshShape>(mesh.get());
  // With its default of 1 cm a query of two bunnies takes 1.6 s.
  shape->setMargin(btScalar(margin));
  shape->updateBound();
  return {{mesh}, shape};
}

BulletShape ours_of(const std::shared_ptr<const Asset>& asset) {
  return {{}, std::make_shared<bullet::Shape>(asset)};
}

Ground box_ground(const std::array<double, 3>& half_extents) {
  return {{{}, std::make_shared<btBoxShape>(vector3(half_extents))}, {0, btScalar(-half_extents[1]), 0}};
}

Ground plane_ground() {
  return {{{}, std::make_shared<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0))}, {0, 0, 0}};
}

Ground baked_ground(const std::shared_ptr<const Asset>& box) {
  return {ours_of(box), {0, btScalar(box->info().centre_of_mass[1] - box->info().bounds_max[1]), 0}};
}

}  // namespace vps::lab
