// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/stress/rest_poses.h"

#include <LinearMath/btConvexHullComputer.h>
#include <LinearMath/btQuaternion.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace vps::stress {
namespace {

// Outward normal, by Newell's sum over the face's corners.
btVector3 normal_of(const btConvexHullComputer& hull, int face) {
  btVector3 sum(0, 0, 0);
  const auto* const first = &hull.edges[hull.faces[face]];
  const auto* edge = first;
  do {
    sum += hull.vertices[edge->getSourceVertex()].cross(hull.vertices[edge->getTargetVertex()]);
    edge = edge->getNextEdgeOfFace();
  } while (edge != first);
  return sum;
}

// Distance of the foot of the centre of mass from the nearest side of the support polygon: negative outside.
double inside(const std::vector<btVector3>& carrying, const btVector3& foot, const btVector3& normal) {
  btVector3 u;
  btVector3 v;
  btPlaneSpace1(normal, u, v);
  constexpr int kDirections = 64;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * std::numbers::pi * i / kDirections;
    const btVector3 direction = btScalar(std::cos(angle)) * u + btScalar(std::sin(angle)) * v;
    double reach = -std::numeric_limits<double>::infinity();
    for (const btVector3& corner : carrying) reach = std::max(reach, double(direction.dot(corner - foot)));
    least = std::min(least, reach);
  }
  return least;
}

}  // namespace

std::vector<RestPose> rest_poses(const std::vector<btVector3>& corners, double tolerance, std::size_t count) {
  if (corners.size() < 4) return {};
  btConvexHullComputer hull;
  hull.compute(&corners[0].x(), sizeof(btVector3), int(corners.size()), 0, 0);
  std::vector<RestPose> poses;
  for (int face = 0; face < hull.faces.size(); ++face) {
    btVector3 normal = normal_of(hull, face);
    if (!(normal.length() > 0)) continue;
    normal.normalize();
    const btScalar height = normal.dot(hull.vertices[hull.edges[hull.faces[face]].getSourceVertex()]);
    if (height < 0) continue;
    std::vector<btVector3> carrying;
    std::copy_if(corners.begin(), corners.end(), std::back_inserter(carrying),
                 [&](const btVector3& c) { return double(height - normal.dot(c)) <= tolerance; });
    const double flat = inside(carrying, height * normal, normal);
    if (flat <= 0) continue;
    btVector3 down(0, 0, -1);
    poses.push_back(
        {btMatrix3x3(shortestArcQuatNormalize2(normal, down)), std::atan2(flat, double(height)), double(height), flat});
  }
  std::stable_sort(poses.begin(), poses.end(), [](const RestPose& a, const RestPose& b) { return a.tilt > b.tilt; });
  std::vector<RestPose> out;
  for (const RestPose& pose : poses) {
    const auto alike = [&](const RestPose& one) {
      return one.rotation[2].dot(pose.rotation[2]) > btScalar(0.9998);  // a degree
    };
    if (out.size() < count && std::none_of(out.begin(), out.end(), alike)) out.push_back(pose);
  }
  return out;
}

}  // namespace vps::stress
