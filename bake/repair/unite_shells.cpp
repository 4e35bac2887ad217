// SPDX-License-Identifier: GPL-3.0-or-later
// Cuts the triangles in exact arithmetic (CGAL), then computes winding numbers on both sides of every patch between the
// cuts.
#include "bake/repair/unite_shells.h"

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
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <unordered_map>

#include "bake/repair/topology.h"
#include "bake/repair/winding.h"
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

using Position = PositionNumbers::Position;

// Equal exact numbers must round to equal doubles. CGAL's to_double of a lazy number depends on how it was computed.
double rounded(const Exact::FT& x) {
  const auto [low, high] = CGAL::to_interval(x);
  return low == high ? low + 0.0 : CGAL::to_double(CGAL::exact(x));  // -0 and 0 are one position
}

// The pieces of one triangle.
struct TrianglePieces {
  std::vector<Position> vertices;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> regions;  // of each piece; cuts lie between regions, none within one
};

// The pieces of all triangles, on joined vertices.
class CutMesh : public Mesh {
 public:
  explicit CutMesh(const Mesh& uncut)
      : uncut_(uncut), numbers_(uncut.vertices.size()), uncut_numbers_(uncut.vertices.size(), kNone) {
    triangles.reserve(uncut.triangles.size());
    origins.reserve(uncut.triangles.size());
  }

  void add_uncut(std::uint32_t origin) {
    Triangle t{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = uncut_.triangles[origin][k];
      std::uint32_t& number = uncut_numbers_[vertex];
      const Vector& v = uncut_.vertices[vertex];
      if (number == kNone) number = numbers_.number_of({v.x(), v.y(), v.z()});
      t[k] = number;
    }
    add(t, origin);
  }

  void add(const TrianglePieces& pieces, std::uint32_t origin) {
    new_numbers_.clear();
    for (const Position& p : pieces.vertices) new_numbers_.push_back(numbers_.number_of(p));
    last_.assign(pieces.triangles.size(), kNone);
    for (std::size_t i = 0; i < pieces.triangles.size(); ++i) {
      const auto& [a, b, c] = pieces.triangles[i];
      const Triangle t = {new_numbers_[a], new_numbers_[b], new_numbers_[c]};
      const auto piece = static_cast<std::uint32_t>(triangles.size());
      if (!add(t, origin)) continue;
      std::uint32_t& known = last_[pieces.regions[i]];
      if (known != kNone) neighbours.emplace_back(known, piece);
      known = piece;
    }
  }

  // After the last triangle.
  void take_vertices() {
    vertices.reserve(numbers_.positions().size());
    for (const auto& [x, y, z] : numbers_.positions()) vertices.emplace_back(x, y, z);
  }

  std::vector<std::uint32_t> origins;                               // the triangle that each piece was cut from
  std::vector<std::pair<std::uint32_t, std::uint32_t>> neighbours;  // pieces of one triangle between which no cut lies

 private:
  static constexpr std::uint32_t kNone = ~0U;

  bool add(const Triangle& t, std::uint32_t origin) {
    // Rounding may have made it collapse; the surface stays closed without it.
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return false;
    triangles.push_back(t);
    origins.push_back(origin);
    return true;
  }

  const Mesh& uncut_;
  PositionNumbers numbers_;
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
  [[nodiscard]] Position position_of(Delaunay::Vertex_handle vertex) const {
    const auto it = given_.find(vertex);
    if (it != given_.end()) return {rounded(it->second.x()), rounded(it->second.y()), rounded(it->second.z())};
    const Exact::Plane_3 plane(corners_[0], corners_[1], corners_[2]);
    const Exact::FT n[3] = {plane.a(), plane.b(), plane.c()};
    const Point2& p = vertex->point();
    Position out{};
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

// Crossings along any of the three axes. The axes are permuted cyclically until the wanted one is x.
class Crossings {
 public:
  explicit Crossings(const Mesh& mesh) : mesh_(mesh) {}

  static Vector turned(const Vector& v, int axis) { return {v[axis], v[(axis + 1) % 3], v[(axis + 2) % 3]}; }

  struct Along {
    Mesh mesh;
    Grid grid;
    std::unique_ptr<InsideTest> lines;
  };

  const Along& along(int axis) {
    Along& a = along_[static_cast<std::size_t>(axis)];
    if (a.lines) return a;
    a.mesh.triangles = mesh_.triangles;
    for (const Vector& v : mesh_.vertices) a.mesh.vertices.push_back(turned(v, axis));
    a.grid = column_grid(a.mesh);
    a.lines = std::make_unique<InsideTest>(a.mesh, a.grid);
    return a;
  }

 private:
  const Mesh& mesh_;
  std::array<Along, 3> along_;
};

enum class Verdict : std::uint8_t { keep, drop, unclear };

// Triangles that meet a triangle in its plane, in rising order.
using Coplanar = std::unordered_map<std::uint32_t, std::vector<std::uint32_t>>;

// Decides whether a piece is kept, from the winding numbers on both sides of it and the sheets that coincide with it.
class Classifier {
 public:
  Classifier(const Mesh& mesh, const Coplanar& coplanar) : crossings_(mesh), coplanar_(coplanar) {}

  Verdict judge(const Vector& point, const Vector& normal, std::uint32_t origin) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    const Crossings::Along& along = crossings_.along(axis);
    const Vector p = Crossings::turned(point, axis);
    const Point3 place = on_plane(p, along.mesh, origin);
    const auto found = coplanar_.find(origin);
    const auto is_coplanar = [&](std::uint32_t t) {
      return found != coplanar_.end() && std::binary_search(found->second.begin(), found->second.end(), t);
    };
    struct Sheet {
      std::uint32_t triangle;
      int crossing;
    };
    std::vector<Sheet> sheets;
    int far = 0;
    along.lines->for_each_crossing(p, [&](std::uint32_t t, int crossing) {
      if (t == origin || is_coplanar(t)) {
        sheets.push_back({t, crossing});
      } else if (is_beyond(place, along.mesh, t, crossing)) {
        far -= crossing;
      }
    });
    const auto self = std::find_if(sheets.begin(), sheets.end(), [&](const Sheet& s) { return s.triangle == origin; });
    if (self == sheets.end()) return Verdict::unclear;
    int near = far;
    for (const Sheet& sheet : sheets) near -= sheet.crossing;
    least_ = std::min({least_, far, near});
    if ((far > 0) == (near > 0)) return Verdict::drop;
    // Keeps one of several coincident sheets: the first that faces the right way.
    const int wanted = far > 0 ? 1 : -1;
    if (self->crossing != wanted) return Verdict::drop;
    for (const Sheet& sheet : sheets) {
      if (sheet.crossing == wanted && sheet.triangle < origin) return Verdict::drop;
    }
    return Verdict::keep;
  }

  [[nodiscard]] int least_winding() const { return least_; }

 private:
  static std::array<Point3, 3> corners(const Mesh& mesh, std::uint32_t t) {
    const auto exact = [&](int k) {
      const Vector& v = mesh.corner(t, k);
      return Point3(v.x(), v.y(), v.z());
    };
    return {exact(0), exact(1), exact(2)};
  }
  // Where the line through a point parallel to x meets a triangle's plane. Sheets may be closer to each other than a
  // rounded point is to either.
  static Point3 on_plane(const Vector& p, const Mesh& mesh, std::uint32_t t) {
    const auto [a, b, c] = corners(mesh, t);
    const Exact::Plane_3 plane(a, b, c);
    return {-(plane.d() + plane.b() * p.y() + plane.c() * p.z()) / plane.a(), p.y(), p.z()};
  }
  // Whether that line meets another triangle at a greater x.
  static bool is_beyond(const Point3& place, const Mesh& mesh, std::uint32_t t, int crossing) {
    const auto [a, b, c] = corners(mesh, t);
    const CGAL::Orientation side = CGAL::orientation(a, b, c, place);
    return side != CGAL::ZERO && (side == CGAL::POSITIVE) != (crossing < 0);
  }

  Crossings crossings_;
  const Coplanar& coplanar_;
  int least_ = 0;
};

// Whether rounding may move a piece's centre across the surface beside it.
bool is_thin(const Mesh& pieces, std::uint32_t piece) {
  const Vector a = pieces.corner(piece, 0);
  const Vector b = pieces.corner(piece, 1);
  const Vector c = pieces.corner(piece, 2);
  const double size = std::max({a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff(), c.cwiseAbs().maxCoeff()});
  const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  constexpr double kRoundings = 1024;
  const double height = pieces.area_normal(piece).norm() / longest;
  return !(height > kRoundings * std::numeric_limits<double>::epsilon() * size);
}

// Keeps the patches without a verdict that close the surface of those that are kept.
// @param verdicts  of the pieces
void close_with_thin_patches(std::span<const EdgeUse> uses, DisjointSets& sets, std::vector<Verdict>& verdicts) {
  if (std::find(verdicts.begin(), verdicts.end(), Verdict::unclear) == verdicts.end()) return;
  struct Side {
    std::uint32_t patch, edge;
    int sign;
  };
  std::vector<Side> sides;   // of patches without a verdict
  std::vector<int> balance;  // of the kept pieces at each edge
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    int sum = 0;
    for (const EdgeUse& use : edge) {
      const int sign = use.forward != 0 ? 1 : -1;
      if (verdicts[use.triangle] == Verdict::keep) sum += sign;
      if (verdicts[use.triangle] == Verdict::unclear) {
        sides.push_back({sets.find(use.triangle), static_cast<std::uint32_t>(balance.size()), sign});
      }
    }
    balance.push_back(sum);
  });
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return std::pair(a.patch, a.edge) < std::pair(b.patch, b.edge); });
  std::vector<std::uint8_t> kept(verdicts.size(), 0);
  // Each turn makes the sum of the absolute balances smaller.
  for (bool changed = true; changed;) {
    changed = false;
    for (auto first = sides.begin(); first != sides.end();) {
      const std::uint32_t patch = first->patch;
      const auto last = std::find_if(first, sides.end(), [&](const Side& side) { return side.patch != patch; });
      const int turn = kept[patch] != 0 ? -1 : 1;
      int gain = 0;
      for (auto side = first; side != last;) {
        const std::uint32_t edge = side->edge;
        int change = 0;
        for (; side != last && side->edge == edge; ++side) change += turn * side->sign;
        gain += std::abs(balance[edge]) - std::abs(balance[edge] + change);
      }
      if (gain > 0) {
        for (auto side = first; side != last; ++side) balance[side->edge] += turn * side->sign;
        kept[patch] ^= 1;
        changed = true;
      }
      first = last;
    }
  }
  for (std::uint32_t t = 0; t < verdicts.size(); ++t) {
    if (verdicts[t] == Verdict::unclear) verdicts[t] = kept[sets.find(t)] != 0 ? Verdict::keep : Verdict::drop;
  }
}

// All triangles of a mesh, cut where others meet them.
struct CutShells {
  CutMesh pieces;
  std::vector<std::uint8_t> whole;  // per triangle: neither cut nor flat
  Coplanar coplanar;
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

CutShells cut_shells(const Mesh& mesh, const std::vector<TrianglePair>& pairs) {
  const std::vector<Triangle>& all = mesh.triangles;
  const std::vector<std::uint8_t> flat = flat_triangles(mesh);
  // Few vertices belong to triangles that meet others.
  std::unordered_map<std::uint32_t, Point3> exact;
  for (const auto& [i, j] : pairs) {
    for (const std::uint32_t t : {i, j}) {
      for (const std::uint32_t v : all[t]) {
        const Vector& p = mesh.vertices[v];
        exact.try_emplace(v, p.x(), p.y(), p.z());
      }
    }
  }
  const auto corners = [&](std::size_t t) {
    return std::array<Point3, 3>{exact.at(all[t][0]), exact.at(all[t][1]), exact.at(all[t][2])};
  };

  CutShells result{CutMesh(mesh), {}, {}};
  std::map<std::uint32_t, Cuts> cuts;
  for (const auto& [i, j] : pairs) {
    if (flat[i] != 0 || flat[j] != 0) continue;
    const auto [a, b, c] = corners(i);
    const auto [d, e, f] = corners(j);
    if (CGAL::coplanar(a, b, c, d) && CGAL::coplanar(a, b, c, e) && CGAL::coplanar(a, b, c, f)) {
      result.coplanar[i].push_back(j);
      result.coplanar[j].push_back(i);
    }
    const auto common = CGAL::intersection(Exact::Triangle_3(a, b, c), Exact::Triangle_3(d, e, f));
    if (!common) continue;
    boost::apply_visitor(CollectCuts{cuts[i]}, *common);
    boost::apply_visitor(CollectCuts{cuts[j]}, *common);
  }

  std::vector<std::uint32_t> to_cut;
  for (const auto& [t, segments] : cuts) to_cut.push_back(t);
  std::vector<TrianglePieces> cut(to_cut.size());
  tbb::parallel_for(std::size_t{0}, to_cut.size(), [&](std::size_t i) {
    const std::uint32_t t = to_cut[i];
    cut[i] = Cutter(corners(t), mesh.area_normal(t)).cut(cuts.at(t));
  });
  for (auto& [t, others] : result.coplanar) std::sort(others.begin(), others.end());
  result.whole.resize(all.size());
  std::size_t next = 0;
  for (std::uint32_t t = 0; t < all.size(); ++t) {
    if (next < to_cut.size() && to_cut[next] == t) {
      result.pieces.add(cut[next], t);
      cut[next++] = {};
      continue;
    }
    result.whole[t] = flat[t] == 0;
    result.pieces.add_uncut(t);
  }
  result.pieces.take_vertices();
  return result;
}

// The pieces of each patch, named by its first piece.
class PatchPieces {
 public:
  PatchPieces(DisjointSets& sets, std::size_t pieces) : start_(pieces + 1), pieces_(pieces) {
    for (std::uint32_t t = 0; t < pieces; ++t) ++start_[sets.find(t) + 1];
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    for (std::uint32_t t = 0; t < pieces; ++t) pieces_[next[sets.find(t)]++] = t;
  }

  // None where no patch has this name.
  [[nodiscard]] std::span<std::uint32_t> of(std::uint32_t patch) {
    return std::span(pieces_).subspan(start_[patch], start_[patch + 1] - start_[patch]);
  }

 private:
  std::vector<std::uint32_t> start_, pieces_;
};

// Boundary of the points with a winding number above 0.
// @param least  set to the least winding number beside a piece
Mesh outer_boundary(const Mesh& mesh, const CutShells& cut, int& least) {
  const CutMesh& pieces = cut.pieces;
  // A patch is kept or dropped as a whole. Within a triangle it ends at cuts; across an edge it goes on where a whole
  // triangle ends, as no cut lies on the edge then. Equal positions elsewhere may be due to rounding.
  DisjointSets sets(pieces.triangles.size());
  for (const auto& [a, b] : pieces.neighbours) sets.join(a, b);
  const std::vector<EdgeUse> uses = sorted_edges(pieces.triangles);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    const auto is_whole = [&](const EdgeUse& use) { return cut.whole[pieces.origins[use.triangle]] != 0; };
    if (edge.size() == 2 && (is_whole(edge[0]) || is_whole(edge[1]))) sets.join(edge[0].triangle, edge[1].triangle);
  });
  Classifier classifier(mesh, cut.coplanar);
  std::vector<Verdict> verdicts(pieces.triangles.size(), Verdict::unclear);
  const auto judge = [&](std::uint32_t t) {
    const Vector centre = (pieces.corner(t, 0) + pieces.corner(t, 1) + pieces.corner(t, 2)) / 3;
    return classifier.judge(centre, mesh.area_normal(pieces.origins[t]), pieces.origins[t]);
  };
  // A patch is judged at the centre of its largest piece, where the centre's rounding matters least; where that is
  // unclear, at the next.
  std::vector<double> area(verdicts.size());
  tbb::parallel_for(std::size_t{0}, area.size(), [&](std::size_t t) { area[t] = pieces.area_normal(t).squaredNorm(); });
  const auto is_smaller = [&](std::uint32_t a, std::uint32_t b) {
    return area[a] != area[b] ? area[a] < area[b] : a > b;
  };
  PatchPieces patches(sets, verdicts.size());
  for (std::uint32_t patch = 0; patch < verdicts.size(); ++patch) {
    const std::span<std::uint32_t> of_patch = patches.of(patch);
    std::make_heap(of_patch.begin(), of_patch.end(), is_smaller);
    for (auto end = of_patch.end(); end != of_patch.begin() && verdicts[patch] == Verdict::unclear; --end) {
      std::pop_heap(of_patch.begin(), end, is_smaller);
      if (const std::uint32_t t = end[-1]; !is_thin(pieces, t)) verdicts[patch] = judge(t);
    }
  }
  for (std::uint32_t t = 0; t < verdicts.size(); ++t) verdicts[t] = verdicts[sets.find(t)];
  close_with_thin_patches(uses, sets, verdicts);

  least = classifier.least_winding();
  Mesh boundary;
  for (std::uint32_t t = 0; t < pieces.triangles.size(); ++t) {
    if (verdicts[t] == Verdict::keep) boundary.triangles.push_back(pieces.triangles[t]);
  }
  boundary.vertices = pieces.vertices;
  drop_unused_vertices(boundary);
  return boundary;
}

}  // namespace

UnitedShells unite_shells(const Mesh& mesh, const std::vector<TrianglePair>& pairs,
                          const std::vector<std::uint8_t>& inward) {
  CutShells cut = cut_shells(mesh, pairs);
  int least = 0;
  if (std::find(inward.begin(), inward.end(), 0) != inward.end()) {
    Mesh boundary = outer_boundary(mesh, cut, least);
    // If no winding number is negative, an inward shell is a cavity that touches the wall around it.
    if (least >= 0 || std::find(inward.begin(), inward.end(), 1) == inward.end()) return {std::move(boundary), false};
  }
  Mesh righted = mesh;
  for (std::uint32_t t = 0; t < inward.size(); ++t) {
    if (inward[t] != 0) std::swap(righted.triangles[t][1], righted.triangles[t][2]);
  }
  for (std::uint32_t piece = 0; piece < cut.pieces.origins.size(); ++piece) {
    Triangle& t = cut.pieces.triangles[piece];
    if (inward[cut.pieces.origins[piece]] != 0) std::swap(t[1], t[2]);
  }
  return {outer_boundary(righted, cut, least), true};
}

}  // namespace vps::bake
