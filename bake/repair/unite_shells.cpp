// SPDX-License-Identifier: GPL-3.0-or-later
// Computes winding numbers on both sides of every patch between the cuts.
#include "bake/repair/unite_shells.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "bake/repair/cut_shells.h"
#include "bake/repair/topology.h"
#include "bake/repair/winding.h"

namespace vps::bake {
namespace {

using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
using Point3 = Exact::Point_3;

// Crossings along any of the three axes. The axes are permuted cyclically until the wanted one is x.
class Crossings {
 public:
  explicit Crossings(const Mesh& mesh) : mesh_(mesh) {}

  static Vector turned(const Vector& v, int axis) { return {v[axis], v[(axis + 1) % 3], v[(axis + 2) % 3]}; }
  [[nodiscard]] std::array<Vector, 3> corners(std::uint32_t t, int axis) const {
    return {turned(mesh_.corner(t, 0), axis), turned(mesh_.corner(t, 1), axis), turned(mesh_.corner(t, 2), axis)};
  }

  // Calls visit(triangle, crossing) for each triangle that the line through `point` parallel to x crosses.
  // @param point  turned
  template <class Visit>
  void for_each(const Vector& point, int axis, Visit visit) {
    if (lines_ >= kFewLines) return along(axis).lines->for_each_crossing(point, visit);
    ++lines_;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      const auto [a, b, c] = corners(t, axis);
      const int crossing = line_crossing(point.y(), point.z(), a, b, c);
      if (crossing != 0) visit(t, crossing);
    }
  }

 private:
  // So many lines are compared with all triangles sooner than the triangles are sorted into columns.
  static constexpr int kFewLines = 64;

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

  const Mesh& mesh_;
  int lines_ = 0;
  std::array<Along, 3> along_;
};

enum class Verdict : std::uint8_t { keep, drop, unclear };

// Decides whether a piece is kept, from the winding numbers on both sides of it and the sheets that coincide with it.
class Classifier {
 public:
  Classifier(const Mesh& mesh, const Coplanar& coplanar) : crossings_(mesh), coplanar_(coplanar) {}

  Verdict judge(const Vector& point, const Vector& normal, std::uint32_t origin) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    const Vector p = Crossings::turned(point, axis);
    const Point3 place = on_plane(p, corners(origin, axis));
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
    crossings_.for_each(p, axis, [&](std::uint32_t t, int crossing) {
      if (t == origin || is_coplanar(t)) {
        sheets.push_back({t, crossing});
      } else if (is_beyond(place, corners(t, axis), crossing)) {
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
  [[nodiscard]] std::array<Point3, 3> corners(std::uint32_t t, int axis) const {
    const auto exact = [](const Vector& v) { return Point3(v.x(), v.y(), v.z()); };
    const auto [a, b, c] = crossings_.corners(t, axis);
    return {exact(a), exact(b), exact(c)};
  }
  // Where the line through a point parallel to x meets a triangle's plane. Sheets may be closer to each other than a
  // rounded point is to either.
  static Point3 on_plane(const Vector& p, const std::array<Point3, 3>& triangle) {
    const auto& [a, b, c] = triangle;
    const Exact::Plane_3 plane(a, b, c);
    return {-(plane.d() + plane.b() * p.y() + plane.c() * p.z()) / plane.a(), p.y(), p.z()};
  }
  // Whether that line meets another triangle at a greater x.
  static bool is_beyond(const Point3& place, const std::array<Point3, 3>& triangle, int crossing) {
    const auto& [a, b, c] = triangle;
    const CGAL::Orientation side = CGAL::orientation(a, b, c, place);
    return side != CGAL::ZERO && (side == CGAL::POSITIVE) != (crossing < 0);
  }

  Crossings crossings_;
  const Coplanar& coplanar_;
  int least_ = 0;
};

// Whether rounding may move a piece's centre across the surface beside it.
bool is_thin(const Mesh& pieces, std::uint32_t piece) {
  const Vector& a = pieces.corner(piece, 0);
  const Vector& b = pieces.corner(piece, 1);
  const Vector& c = pieces.corner(piece, 2);
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
  const Mesh& pieces = cut.pieces;
  // A patch is kept or dropped as a whole. Within a triangle it ends at cuts; across an edge it goes on where a whole
  // triangle ends, as no cut lies on the edge then. Equal positions elsewhere may be due to rounding.
  DisjointSets sets(pieces.triangles.size());
  for (const auto& [a, b] : cut.neighbours) sets.join(a, b);
  const UnsetVector<EdgeUse> uses = sorted_edges(pieces.triangles);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    const auto is_whole = [&](const EdgeUse& use) { return cut.whole[cut.origins[use.triangle]] != 0; };
    if (edge.size() == 2 && (is_whole(edge[0]) || is_whole(edge[1]))) sets.join(edge[0].triangle, edge[1].triangle);
  });
  Classifier classifier(mesh, cut.coplanar);
  std::vector<Verdict> verdicts(pieces.triangles.size(), Verdict::unclear);
  const auto judge = [&](std::uint32_t t) {
    const Vector centre = (pieces.corner(t, 0) + pieces.corner(t, 1) + pieces.corner(t, 2)) / 3;
    return classifier.judge(centre, mesh.area_normal(cut.origins[t]), cut.origins[t]);
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
  boundary.triangles.reserve(verdicts.size());
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
  for (std::uint32_t piece = 0; piece < cut.origins.size(); ++piece) {
    Triangle& t = cut.pieces.triangles[piece];
    if (inward[cut.origins[piece]] != 0) std::swap(t[1], t[2]);
  }
  return {outer_boundary(righted, cut, least), true};
}

}  // namespace vps::bake
