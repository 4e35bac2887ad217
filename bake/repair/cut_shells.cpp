// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's exact numbers, in a triangulation of each triangle with its cuts as constraints.
#include "bake/repair/cut_shells.h"

// CGAL warns of many constraints that cross each other. Several cuts may cross in a triangle, but seldom many.
#define CGAL_NO_CDT_2_WARNING
#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Unique_hash_map.h>
#include <CGAL/intersections.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <map>

#include "bake/repair/topology.h"
#include "formats/mesh/position_numbers.h"

namespace vps::bake {
namespace {

using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
using Point3 = Exact::Point_3;
using Point2 = Exact::Point_2;
using Delaunay = CGAL::Constrained_Delaunay_triangulation_2<Exact, CGAL::Default, CGAL::Exact_intersections_tag>;

// Intersections of a triangle with others, as segments. A single point is a segment of length 0.
using Cuts = std::vector<std::pair<Point3, Point3>>;

struct CollectCuts {
  Cuts& cuts;
  void operator()(const Point3& p) const { cuts.emplace_back(p, p); }
  void operator()(const Exact::Segment_3& s) const { cuts.emplace_back(s.source(), s.target()); }
  void operator()(const Exact::Triangle_3& t) const {
    for (int k = 0; k < 3; ++k) cuts.emplace_back(t[k], t[k + 1]);
  }
  void operator()(const std::vector<Point3>& polygon) const {
    for (std::size_t k = 0; k < polygon.size(); ++k) cuts.emplace_back(polygon[k], polygon[(k + 1) % polygon.size()]);
  }
};

// Equal exact numbers must round to equal doubles. CGAL's to_double of a lazy number depends on how it was computed.
double rounded(const Exact::FT& x) {
  const auto [low, high] = CGAL::to_interval(x);
  return low == high ? low + 0.0 : CGAL::to_double(CGAL::exact(x));  // -0 and 0 are one position
}

// The pieces of one triangle.
struct TrianglePieces {
  std::vector<Vector> vertices;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> regions;  // of each piece; cuts lie between regions, none within one
};

// Collects the pieces of all triangles and joins their vertices.
class PieceCollector {
 public:
  PieceCollector(const Mesh& uncut, CutShells& result)
      : uncut_(uncut), result_(result), numbers_(uncut.vertices.size()), uncut_numbers_(uncut.vertices.size(), kNone) {
    result_.pieces.triangles.reserve(uncut.triangles.size());
    result_.origins.reserve(uncut.triangles.size());
  }

  void add_uncut(std::uint32_t origin) {
    Triangle t{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = uncut_.triangles[origin][k];
      std::uint32_t& number = uncut_numbers_[vertex];
      if (number == kNone) number = numbers_.number_of(uncut_.vertices[vertex]);
      t[k] = number;
    }
    add(t, origin);
  }

  void add(const TrianglePieces& pieces, std::uint32_t origin) {
    new_numbers_.clear();
    for (const Vector& p : pieces.vertices) new_numbers_.push_back(numbers_.number_of(p));
    last_.assign(pieces.triangles.size(), kNone);
    for (std::size_t i = 0; i < pieces.triangles.size(); ++i) {
      const auto& [a, b, c] = pieces.triangles[i];
      const Triangle t = {new_numbers_[a], new_numbers_[b], new_numbers_[c]};
      const auto piece = static_cast<std::uint32_t>(result_.origins.size());
      if (!add(t, origin)) continue;
      std::uint32_t& known = last_[pieces.regions[i]];
      if (known != kNone) result_.neighbours.emplace_back(known, piece);
      known = piece;
    }
  }

  // After the last triangle.
  void take_vertices() { result_.pieces.vertices = std::move(numbers_).take_positions(); }

 private:
  static constexpr std::uint32_t kNone = ~0U;

  bool add(const Triangle& t, std::uint32_t origin) {
    // Rounding may have made it collapse; the surface stays closed without it.
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return false;
    result_.pieces.triangles.push_back(t);
    result_.origins.push_back(origin);
    return true;
  }

  const Mesh& uncut_;
  CutShells& result_;
  PositionNumbers<Vector> numbers_;
  std::vector<std::uint32_t> uncut_numbers_;  // of the mesh's vertices
  // Kept from call to call for their memory.
  std::vector<std::uint32_t> new_numbers_;  // of the vertices of the triangle that is added
  std::vector<std::uint32_t> last_;         // piece of each of its regions
};

// Cuts one triangle in the coordinate plane that it faces most.
class Cutter {
 public:
  Cutter(const std::array<Point3, 3>& corners, const Vector& normal) : corners_(corners) {
    normal.cwiseAbs().maxCoeff(&drop_);
    // (u, v, drop) is right-handed: a triangle is counter-clockwise in (u, v) where its normal's component is positive.
    u_ = (drop_ + 1) % 3;
    v_ = (drop_ + 2) % 3;
    flip_ = normal[drop_] < 0;
  }

  [[nodiscard]] TrianglePieces cut(const Cuts& cuts) {
    for (std::size_t k = 0; k < 3; ++k) add(corners_[k], corners_[(k + 1) % 3]);
    for (const auto& [a, b] : cuts) add(a, b);
    CGAL::Unique_hash_map<Delaunay::Face_handle, std::uint32_t> number;
    std::uint32_t count = 0;
    for (const Delaunay::Face_handle face : cells_.finite_face_handles()) number[face] = count++;
    DisjointSets regions(count);
    for (const Delaunay::Edge& edge : cells_.finite_edges()) {
      const Delaunay::Face_handle other = edge.first->neighbor(edge.second);
      if (!cells_.is_constrained(edge) && !cells_.is_infinite(edge.first) && !cells_.is_infinite(other)) {
        regions.join(number[edge.first], number[other]);
      }
    }
    TrianglePieces pieces;
    std::unordered_map<Delaunay::Vertex_handle, std::uint32_t, CGAL::Handle_hash_function> vertex_number;
    for (const Delaunay::Face_handle face : cells_.finite_face_handles()) {
      std::array<Delaunay::Vertex_handle, 3> corners = {face->vertex(0), face->vertex(1), face->vertex(2)};
      if (flip_) std::swap(corners[1], corners[2]);
      Triangle& t = pieces.triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const auto next = static_cast<std::uint32_t>(pieces.vertices.size());
        const auto [it, fresh] = vertex_number.try_emplace(corners[k], next);
        if (fresh) pieces.vertices.push_back(position_of(corners[k]));
        t[k] = it->second;
      }
      pieces.regions.push_back(regions.find(number[face]));
    }
    return pieces;
  }

 private:
  void add(const Point3& a, const Point3& b) {
    const Delaunay::Vertex_handle from = add(a);
    const Delaunay::Vertex_handle to = add(b);
    if (from != to) cells_.insert_constraint(from, to);
  }

  Delaunay::Vertex_handle add(const Point3& p) {
    const Delaunay::Vertex_handle vertex = cells_.insert({p[u_], p[v_]});
    given_.insert({vertex, p});
    return vertex;
  }

  // Points that were given are evaluated once for all triangles that they cut. Where cuts cross, the plane decides.
  [[nodiscard]] Vector position_of(Delaunay::Vertex_handle vertex) const {
    const auto it = given_.find(vertex);
    if (it != given_.end()) return {rounded(it->second.x()), rounded(it->second.y()), rounded(it->second.z())};
    const Exact::Plane_3 plane(corners_[0], corners_[1], corners_[2]);
    const Exact::FT n[3] = {plane.a(), plane.b(), plane.c()};
    const Point2& p = vertex->point();
    Vector out;
    out[static_cast<std::size_t>(u_)] = rounded(p.x());
    out[static_cast<std::size_t>(v_)] = rounded(p.y());
    out[static_cast<std::size_t>(drop_)] = rounded(-(plane.d() + n[u_] * p.x() + n[v_] * p.y()) / n[drop_]);
    return out;
  }

  std::array<Point3, 3> corners_;
  int drop_ = 0, u_ = 1, v_ = 2;
  bool flip_ = false;
  Delaunay cells_;
  std::unordered_map<Delaunay::Vertex_handle, Point3, CGAL::Handle_hash_function> given_;
};

// One byte per triangle: 1 for one without area. It has no plane to be cut in, and bounds nothing.
std::vector<std::uint8_t> flat_triangles(const Mesh& mesh) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  std::vector<std::uint8_t> flat(mesh.triangles.size());
  tbb::parallel_for(std::size_t{0}, flat.size(), [&](std::size_t t) {
    const auto corner = [&](int k) {
      const Vector& v = mesh.corner(t, k);
      return Kernel::Point_3(v.x(), v.y(), v.z());
    };
    flat[t] = CGAL::collinear(corner(0), corner(1), corner(2)) || mesh.area_normal(t).isZero(0) ? 1 : 0;
  });
  return flat;
}

// Exact corners of the triangles that meet others. Few vertices belong to such triangles.
class ExactCorners {
 public:
  ExactCorners(const Mesh& mesh, const std::vector<TrianglePair>& pairs) : triangles_(mesh.triangles) {
    for (const auto& [i, j] : pairs) {
      for (const std::uint32_t t : {i, j}) {
        for (const std::uint32_t v : triangles_[t]) {
          const Vector& p = mesh.vertices[v];
          points_.try_emplace(v, p.x(), p.y(), p.z());
        }
      }
    }
  }

  [[nodiscard]] std::array<Point3, 3> of(std::uint32_t t) const {
    const auto& [a, b, c] = triangles_[t];
    return {points_.at(a), points_.at(b), points_.at(c)};
  }

 private:
  const std::vector<Triangle>& triangles_;
  std::unordered_map<std::uint32_t, Point3> points_;  // by vertex
};

// @return the cuts of each triangle that meets another
// @param coplanar  gets the triangles that meet in a plane
std::map<std::uint32_t, Cuts> find_cuts(const std::vector<TrianglePair>& pairs, const std::vector<std::uint8_t>& flat,
                                        const ExactCorners& corners, Coplanar& coplanar) {
  std::map<std::uint32_t, Cuts> cuts;
  for (const auto& [i, j] : pairs) {
    if (flat[i] != 0 || flat[j] != 0) continue;
    const auto [a, b, c] = corners.of(i);
    const auto [d, e, f] = corners.of(j);
    if (CGAL::coplanar(a, b, c, d) && CGAL::coplanar(a, b, c, e) && CGAL::coplanar(a, b, c, f)) {
      coplanar[i].push_back(j);
      coplanar[j].push_back(i);
    }
    const auto common = CGAL::intersection(Exact::Triangle_3(a, b, c), Exact::Triangle_3(d, e, f));
    if (!common) continue;
    boost::apply_visitor(CollectCuts{cuts[i]}, *common);
    boost::apply_visitor(CollectCuts{cuts[j]}, *common);
  }
  for (auto& [t, others] : coplanar) std::sort(others.begin(), others.end());
  return cuts;
}

}  // namespace

CutShells cut_shells(const Mesh& mesh, const std::vector<TrianglePair>& pairs) {
  CutShells result;
  const std::vector<std::uint8_t> flat = flat_triangles(mesh);
  const ExactCorners corners(mesh, pairs);
  const std::map<std::uint32_t, Cuts> cuts = find_cuts(pairs, flat, corners, result.coplanar);
  std::vector<std::uint32_t> to_cut;
  for (const auto& [t, segments] : cuts) to_cut.push_back(t);
  std::vector<TrianglePieces> cut(to_cut.size());
  tbb::parallel_for(std::size_t{0}, to_cut.size(), [&](std::size_t i) {
    const std::uint32_t t = to_cut[i];
    cut[i] = Cutter(corners.of(t), mesh.area_normal(t)).cut(cuts.at(t));
  });

  result.whole.resize(mesh.triangles.size());
  PieceCollector collector(mesh, result);
  std::size_t next = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (next < to_cut.size() && to_cut[next] == t) {
      collector.add(cut[next], t);
      cut[next++] = {};
      continue;
    }
    result.whole[t] = flat[t] == 0;
    collector.add_uncut(t);
  }
  collector.take_vertices();
  return result;
}

}  // namespace vps::bake
