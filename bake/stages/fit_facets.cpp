// SPDX-License-Identifier: GPL-3.0-or-later
// A cell is divided into sides by its normals. The convex hull of a side in its plane is reduced to four corners, then
// moved and scaled, so that the integral of any linear function over a facet is that over the side.
#include "bake/stages/fit_facets.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vps::bake {
namespace {

using Point2 = Eigen::Vector2d;

// Parts belong to one side if the cosine between their normals is above this (25 degrees).
constexpr double kOneSide = 0.906;

struct CellSide {
  Vector seed;                       // normal of its largest part
  Vector area = Vector::Zero();      // vector area, outward. [m^2]
  Vector moment = Vector::Zero();    // sum of centroids times areas. [m^3]
  double whole = 0;                  // sum of areas. [m^2]
  std::vector<Vector> corners = {};  // of all parts
};

Vector vector_area(const std::vector<Vector>& corners, Vector& moment) {
  Vector sum = Vector::Zero();
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const Vector area = (corners[i - 1] - corners[0]).cross(corners[i] - corners[0]) / 2;
    moment += area.norm() * (corners[0] + corners[i - 1] + corners[i]) / 3;
    sum += area;
  }
  return sum;
}

std::vector<CellSide> sides_of(std::vector<CellPart>& cell) {
  struct Sized {
    Vector area, moment;
    const CellPart* part;
  };
  std::vector<Sized> parts;
  for (const CellPart& part : cell) {
    Vector moment = Vector::Zero();
    const Vector area = vector_area(part.corners, moment);
    parts.push_back({area, moment, &part});
  }
  std::stable_sort(parts.begin(), parts.end(),
                   [](const Sized& a, const Sized& b) { return a.area.squaredNorm() > b.area.squaredNorm(); });
  std::vector<CellSide> sides;
  for (const Sized& sized : parts) {
    auto side = std::find_if(sides.begin(), sides.end(),
                             [&](const CellSide& s) { return s.seed.dot(sized.part->normal) > kOneSide; });
    if (side == sides.end()) side = sides.insert(side, CellSide{sized.part->normal});
    side->area += sized.area;
    side->moment += sized.moment;
    side->whole += sized.area.norm();
    side->corners.insert(side->corners.end(), sized.part->corners.begin(), sized.part->corners.end());
  }
  return sides;
}

double twice_area(const Point2& a, const Point2& b, const Point2& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

// Counter-clockwise, by Andrew's monotone chain.
std::vector<Point2> convex_hull(std::vector<Point2> points) {
  std::sort(points.begin(), points.end(),
            [](const Point2& a, const Point2& b) { return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y()); });
  std::vector<Point2> hull;
  for (int half = 0; half < 2; ++half) {
    const std::size_t start = hull.size();
    for (const Point2& p : points) {
      while (hull.size() >= start + 2 && twice_area(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

// Drops the corners that cut off least.
void reduce_to_four(std::vector<Point2>& hull) {
  while (hull.size() > 4) {
    const std::size_t n = hull.size();
    std::size_t least = 0;
    const auto cut = [&](std::size_t i) { return twice_area(hull[(i + n - 1) % n], hull[i], hull[(i + 1) % n]); };
    for (std::size_t i = 1; i < n; ++i) {
      if (cut(i) < cut(least)) least = i;
    }
    hull.erase(hull.begin() + static_cast<std::ptrdiff_t>(least));
  }
}

}  // namespace

std::vector<Facet> fit_facets(std::vector<CellPart> cell) {
  std::vector<Facet> facets;
  for (const CellSide& side : sides_of(cell)) {
    const double area = side.area.norm();
    if (!(area > 0)) continue;
    const Vector normal = side.area / area;
    const Vector centre = side.moment / side.whole;
    const Vector u = normal.unitOrthogonal();
    const Vector v = normal.cross(u);
    std::vector<Point2> flat;
    for (const Vector& corner : side.corners) flat.emplace_back(u.dot(corner - centre), v.dot(corner - centre));
    std::vector<Point2> hull = convex_hull(std::move(flat));
    if (hull.size() < 3) continue;
    reduce_to_four(hull);
    double found = 0;
    Point2 middle = Point2::Zero();
    for (std::size_t i = 2; i < hull.size(); ++i) {
      const double twice = twice_area(hull[0], hull[i - 1], hull[i]);
      found += twice / 2;
      middle += twice / 6 * (hull[0] + hull[i - 1] + hull[i]);
    }
    if (!(found > 0)) continue;
    middle /= found;
    const double scale = std::sqrt(area / found);
    Facet facet;
    for (std::size_t i = 0; i < 4; ++i) {
      const Point2 p = scale * (hull[std::min(i, hull.size() - 1)] - middle);
      facet[i] = centre + p.x() * u + p.y() * v;
    }
    facets.push_back(facet);
  }
  return facets;
}

}  // namespace vps::bake
