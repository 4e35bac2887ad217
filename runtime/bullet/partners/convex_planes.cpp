// SPDX-License-Identifier: Zlib
// Builds the planes and triangles of a convex shape, and finds the nearest place on them.
#include "runtime/bullet/partners/convex_planes.h"

#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStridingMeshInterface.h>
#include <BulletCollision/CollisionShapes/btTriangleCallback.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>

#include "runtime/bullet/convert.h"
#include "runtime/contacts/corner_contacts.h"
#include "runtime/contacts/refine_contact.h"
#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/penetration.h"

namespace vps::bullet {
namespace {

// Corners of the mesh of a btConvexTriangleMeshShape, which gives no other access to them.
struct MeshCorners final : btInternalTriangleIndexCallback {
  explicit MeshCorners(std::vector<btVector3>& out) : corners(out) {}
  void internalProcessTriangleIndex(btVector3* triangle, int, int) override {
    corners.insert(corners.end(), triangle, triangle + 3);
  }
  std::vector<btVector3>& corners;
};

std::vector<btVector3> corners_of(const btConvexShape& shape) {
  std::vector<btVector3> corners;
  if (const auto* mesh = dynamic_cast<const btConvexTriangleMeshShape*>(&shape)) {
    MeshCorners collect(corners);
    const btVector3 far(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
    mesh->getMeshInterface()->InternalProcessAllTriangles(&collect, -far, far);
    for (btVector3& corner : corners) corner *= mesh->getLocalScaling();
  } else if (const auto* polyhedron = dynamic_cast<const btPolyhedralConvexShape*>(&shape)) {
    corners.resize(static_cast<std::size_t>(polyhedron->getNumVertices()));
    for (int i = 0; i < polyhedron->getNumVertices(); ++i) {
      polyhedron->getVertex(i, corners[static_cast<std::size_t>(i)]);
    }
  }
  return corners;
}

// Changes when the corners do. For shapes whose corners cannot change in place it is only their number.
std::uint64_t fingerprint(const btConvexShape& shape) {
  const auto hash = [](const btVector3* points, int count) {
    return hash_bytes(std::as_bytes(std::span(points, static_cast<std::size_t>(count))));
  };
  if (shape.getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE) {
    const auto& hull = static_cast<const btConvexHullShape&>(shape);
    return hull.getNumPoints() > 0 ? hash(hull.getUnscaledPoints(), hull.getNumPoints()) : 0;
  }
  if (const auto* const spheres = dynamic_cast<const btMultiSphereShape*>(&shape)) {
    std::uint64_t sum = 0;
    for (int i = 0; i < spheres->getSphereCount(); ++i) {
      btVector3 sphere = spheres->getSpherePosition(i);
      sphere.setW(spheres->getSphereRadius(i));
      sum = 31 * sum + hash(&sphere, 1);
    }
    return sum;
  }
  if (shape.getShapeType() == CONVEX_POINT_CLOUD_SHAPE_PROXYTYPE) {
    const auto& cloud = static_cast<const btConvexPointCloudShape&>(shape);
    return hash(cloud.getUnscaledPoints(), cloud.getNumPoints());
  }
  const auto* const polyhedron = dynamic_cast<const btPolyhedralConvexShape*>(&shape);
  return polyhedron != nullptr ? static_cast<std::uint64_t>(polyhedron->getNumVertices()) : 0;
}

// Fibonacci's spiral. With 162 directions, the error of the planes round a ball is at most 2 % of its radius.
btVector3 direction(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count;
  const double r = std::sqrt(1 - z * z);
  const double angle = 2.399963229728653 * i;
  return {static_cast<btScalar>(r * std::cos(angle)), static_cast<btScalar>(r * std::sin(angle)),
          static_cast<btScalar>(z)};
}

// Bullet's default margin of 4 cm is more than the radius of small spheres: GJK would use an inverted core.
// @return copy with a margin no larger than any sphere; null if the shape's own margin is not larger
std::unique_ptr<btMultiSphereShape> with_core(const btMultiSphereShape& shape) {
  std::vector<btVector3> centres;
  std::vector<btScalar> radii;
  btScalar least = shape.getMargin();
  for (int i = 0; i < shape.getSphereCount(); ++i) {
    centres.push_back(shape.getSpherePosition(i));
    radii.push_back(shape.getSphereRadius(i));
    least = btMin(least, radii.back() * shape.getLocalScaling().x());
  }
  if (!(least < shape.getMargin())) return nullptr;
  auto copy = std::make_unique<btMultiSphereShape>(centres.data(), radii.data(), shape.getSphereCount());
  copy->setLocalScaling(shape.getLocalScaling());
  copy->setMargin(least);
  return copy;
}

// Visits the edges of a hull's face, in order. btConvexHullComputer rounds its copies of the corners to a grid of 1e-4
// of the hull, so the original corners are used.
template <class Visit>
void for_each_edge(const btConvexHullComputer& hull, int face, const std::vector<btVector3>& corners,
                   const Visit& visit) {
  const auto corner = [&](int vertex) { return corners[static_cast<std::size_t>(hull.original_vertex_index[vertex])]; };
  const btConvexHullComputer::Edge* const first = &hull.edges[hull.faces[face]];
  const btConvexHullComputer::Edge* edge = first;
  const btVector3 base = corner(first->getSourceVertex());
  do {
    visit(base, corner(edge->getSourceVertex()), corner(edge->getTargetVertex()));
    edge = edge->getNextEdgeOfFace();
  } while (edge != first);
}

// By Newell's sum over the corners, which is robust against slivers. False for a face without area.
bool face_normal(const btConvexHullComputer& hull, int face, const std::vector<btVector3>& corners, btVector3& normal) {
  normal.setZero();
  for_each_edge(hull, face, corners, [&](const btVector3& base, const btVector3& from, const btVector3& to) {
    normal += (from - base).cross(to - base);
  });
  const btScalar size = normal.length();
  if (!(size > 0)) return false;
  normal /= size;
  return true;
}

// Covers a face with a fan of triangles. Those without area are left out: their neighbours cover them.
void add_triangles(const btConvexHullComputer& hull, int face, const std::vector<btVector3>& corners,
                   std::vector<Triangle>& triangles) {
  for_each_edge(hull, face, corners, [&](const btVector3& base, const btVector3& from, const btVector3& to) {
    double p[3][3];
    for (int axis = 0; axis < 3; ++axis) {
      p[0][axis] = static_cast<double>(base[axis]);
      p[1][axis] = static_cast<double>(from[axis]);
      p[2][axis] = static_cast<double>(to[axis]);
    }
    Triangle triangle;
    if (triangle.set(p)) triangles.push_back(triangle);
  });
}

// The corners of a convex body where its faces turn so much that the corner may slip in between the points of a shell.
// At one of a cube the mean of the faces' normals, weighted by their angles there, is 0.58 long, at the rim of a prism
// of many sides 0.7, on round bodies nearly 1.
std::vector<Vec3> sharp_corners_of(const std::vector<Triangle>& triangles) {
  using detail::operator+;
  using detail::operator-;
  using detail::operator*;
  constexpr float kSharp = 0.62F;
  struct AtCorner {
    Vec3 place, normals;
    float angles;
    [[nodiscard]] float mean() const { return detail::length(normals) / angles; }
  };
  std::vector<AtCorner> corners;
  for (const Triangle& triangle : triangles) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 one = triangle.corners[(k + 1) % 3] - triangle.corners[k];
      const Vec3 other = triangle.corners[(k + 2) % 3] - triangle.corners[k];
      const float angle = std::atan2(detail::length(detail::cross(one, other)), detail::dot(one, other));
      corners.push_back({triangle.corners[k], angle * triangle.normal, angle});
    }
  }
  const auto place = [](const AtCorner& at) { return std::tie(at.place.x, at.place.y, at.place.z); };
  std::stable_sort(corners.begin(), corners.end(),
                   [&](const AtCorner& a, const AtCorner& b) { return place(a) < place(b); });
  std::size_t count = 0;
  for (const AtCorner& at : corners) {
    if (count > 0 && place(corners[count - 1]) == place(at)) {
      corners[count - 1].normals = corners[count - 1].normals + at.normals;
      corners[count - 1].angles += at.angles;
    } else {
      corners[count++] = at;
    }
  }
  corners.resize(count);
  std::erase_if(corners, [](const AtCorner& at) { return !(at.mean() < kSharp); });
  std::stable_sort(corners.begin(), corners.end(),
                   [](const AtCorner& a, const AtCorner& b) { return a.mean() < b.mean(); });
  std::vector<Vec3> places;
  for (const AtCorner& at : corners) {
    if (places.size() < detail::kMostCorners) places.push_back(at.place);
  }
  return places;
}

// Supporting plane of a shape, its margin included.
HalfSpaceField touching(const btConvexShape& shape, Vec3 outward_normal) {
  const btVector3 normal = to_bt(outward_normal);
  const btScalar offset = normal.dot(shape.localGetSupportingVertexWithoutMargin(normal)) + shape.getMargin();
  return {outward_normal, static_cast<float>(offset)};
}

}  // namespace

PolytopeField ConvexPlanes::of(const btConvexShape& shape, const btVector3& from) {
  if (shape_ != &shape || scaling_ != shape.getLocalScaling() || margin_ != shape.getMargin() ||
      corners_ != fingerprint(shape)) {
    build(shape);
  }
  if (has_faces()) return {planes_, static_cast<float>(margin_)};
  Contact nearest;
  nearest.position = to_vec3(from);
  if (find_nearest(nearest)) planes_.back() = touching(shape, nearest.inward_normal);
  return {planes_};
}

void ConvexPlanes::build(const btConvexShape& shape) {
  shape_ = &shape;
  scaling_ = shape.getLocalScaling();
  margin_ = shape.getMargin();
  corners_ = fingerprint(shape);
  thinner_.reset();
  sphere_centres_.clear();
  sphere_radii_.clear();
  if (const auto* spheres = dynamic_cast<const btMultiSphereShape*>(&shape)) {
    thinner_ = with_core(*spheres);
    const btVector3& scaling = spheres->getLocalScaling();
    for (int i = 0; i < spheres->getSphereCount(); ++i) {
      sphere_centres_.push_back(to_vec3(spheres->getSpherePosition(i) * scaling));
      sphere_radii_.push_back(static_cast<float>(spheres->getSphereRadius(i) * scaling[scaling.minAxis()]));
    }
  }
  planes_.clear();
  triangles_.clear();
  const std::vector<btVector3> corners = corners_of(shape);
  constexpr std::size_t kMostOfHull = 1024;
  hull_points_.clear();
  if (shape.getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE && corners.size() <= kMostOfHull) {
    for (const btVector3& corner : corners) hull_points_.push_back(to_vec3(corner));
  }
  if (corners.size() >= 4) {
    btConvexHullComputer hull;
    hull.compute(&corners[0][0], sizeof(btVector3), static_cast<int>(corners.size()), 0, 0);
    btVector3 normal;
    for (int face = 0; face < hull.faces.size(); ++face) {
      if (face_normal(hull, face, corners, normal)) planes_.push_back(touching(shape, to_vec3(normal)));
      add_triangles(hull, face, corners, triangles_);
    }
  }
  faces_ = planes_.size();
  sharp_ = sharp_corners_of(triangles_);
  // At edges and corners the faces' planes alone extend far beyond the body. Round bodies have only the planes added
  // here.
  const int more = has_faces() ? 42 : 162;
  for (int i = 0; i < more; ++i) planes_.push_back(touching(shape, to_vec3(direction(i, more))));
  if (!has_faces()) planes_.push_back(planes_.back());  // replaced in each call of `of`
}

bool ConvexPlanes::find_nearest(Contact& contact) const {
  if (has_faces()) return find_nearest_of_faces(contact);
  btSphereShape point(0);
  btVoronoiSimplexSolver simplex;
  btGjkPairDetector gjk(&point, thinner_ != nullptr ? thinner_.get() : shape_, &simplex, nullptr);
  btGjkPairDetector::ClosestPointInput input;
  input.m_transformA.setIdentity();
  input.m_transformA.setOrigin(to_bt(contact.position));
  input.m_transformB.setIdentity();
  btPointCollector found;
  gjk.getClosestPoints(input, found, nullptr);
  if (!found.m_hasResult) return false;
  contact.inward_normal = to_vec3(found.m_normalOnBInWorld);
  contact.penetration = static_cast<float>(-found.m_distance);
  return true;
}

// Exact for any size. Bullet's GJK stops too early on bodies of millimetres (docs/internals/decisions.md).
bool ConvexPlanes::find_nearest_of_faces(Contact& contact) const {
  using detail::operator-;
  using detail::operator*;
  const Vec3 p = contact.position;
  NearestPlace nearest;
  for (const Triangle& triangle : triangles_) {
    if (!(triangle.least_squared(p) < nearest.squared)) continue;
    const NearestPlace place = triangle.nearest(p);
    if (place.squared < nearest.squared) nearest = place;
  }
  const float distance = std::sqrt(nearest.squared);
  if (triangles_.empty() || !(distance > 0)) return false;
  contact.inward_normal = (1 / distance) * (p - nearest.at);
  contact.penetration = static_cast<float>(margin_) - distance;
  return true;
}

bool ConvexPlanes::is_exact(const Contact& contact, Vec3 out) const {
  using detail::operator+;
  using detail::operator*;
  if (!has_faces()) return false;  // the planes give only a bound
  const auto margin = static_cast<float>(margin_);
  const float to_core = contact.penetration - margin;
  if (to_core >= 0) return true;
  const Vec3 below = contact.position + to_core * out;
  return detail::value_at(PolytopeField{planes_}, below) >= margin + 1e-5F * to_core;  // on a face
}

float ConvexPlanes::penetration(Vec3 place, float bound) const {
  Contact contact;
  contact.position = place;
  contact.penetration = bound;
  if (!is_exact(contact, detail::normal_at(PolytopeField{planes_}, place))) (void)find_nearest(contact);
  return contact.penetration;
}

void ConvexPlanes::finish(Contact& contact, float alike) const {
  const Vec3 out = detail::normal_at(PolytopeField{planes_}, contact.position);
  if (!is_exact(contact, out) && find_nearest(contact)) return;
  if (contact.penetration >= static_cast<float>(margin_) &&
      detail::face_shell({planes_.data(), faces_}, alike, contact))
    return;
  contact.inward_normal = out;
}

}  // namespace vps::bullet
