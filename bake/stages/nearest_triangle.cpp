// SPDX-License-Identifier: GPL-3.0-or-later
// Candidate lists carried down from a brick to its octants and to blocks of 2x2x2 points, eight cubes or points at
// once. Compiled once per instruction set by Highway, chosen at run time.
#include "bake/stages/nearest_triangle.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "bake/unset_vector.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/stages/nearest_triangle.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#ifndef VPS_NEAREST_TRIANGLE_ONCE
#define VPS_NEAREST_TRIANGLE_ONCE
namespace vps::bake::detail {

struct Vector3 {
  double x, y, z;
};

// Data for the distance to a triangle. Corners are relative to the lattice's first point.
struct Facet {
  Vector3 corner[3];
  Vector3 edge[3];
  Vector3 outward[3];  // in the triangle's plane, normal to the edge
  double inverse_squared[3];
  Vector3 normal;  // unit
  double number;   // of the triangle
  double low[2];   // least y and z of points within the band
  double high[2];  // and the largest
  double middle;   // height of the middle of rows along x, without its y and z parts
  double reach;    // and its largest value for rows within the band
  double sure;     // squared distance up to which a row needs no test
  bool sliver;     // too thin for its distances to be trusted
};

// Eight points or centres of cubes, x fastest, relative to the lattice's first point.
struct Eight {
  alignas(64) double x[8], y[8], z[8];
};

// Candidates of each of a cube's eight parts.
struct Parts {
  UnsetVector<std::array<double, 8>> squared;  // distances of the cube's candidates from the parts' centres
  UnsetVector<std::uint32_t> numbers;          // of facets; each part has room for all of the cube's candidates
  std::array<std::size_t, 8> count{};

  explicit Parts(std::size_t most) : squared(most), numbers(8 * most) {}
};

// A candidate's distance from a centre is at most the least one and `more`, and at most `most`.
struct SiftLimits {
  double more, most, slack;
};

}  // namespace vps::bake::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<double, 8> lanes_of_8;
using Lanes = hn::Vec<decltype(lanes_of_8)>;

HWY_INLINE Lanes set(double value) {
  return hn::Set(lanes_of_8, value);
}

struct PlaceLanes {
  Lanes x, y, z;
};

// Takes the distance to the triangle's plane over its face, and elsewhere the distance to its nearest edge.
HWY_INLINE Lanes squared_distance(const Facet& f, const PlaceLanes& p) {
  Lanes nearest = set(std::numeric_limits<double>::infinity());
  Lanes farthest_out = set(-std::numeric_limits<double>::infinity());
  for (int k = 0; k < 3; ++k) {
    const Lanes dx = hn::Sub(p.x, set(f.corner[k].x));
    const Lanes dy = hn::Sub(p.y, set(f.corner[k].y));
    const Lanes dz = hn::Sub(p.z, set(f.corner[k].z));
    const auto dot = [&](const Vector3& v) {
      return hn::Add(hn::Mul(dx, set(v.x)), hn::Add(hn::Mul(dy, set(v.y)), hn::Mul(dz, set(v.z))));
    };
    const Lanes along = hn::Mul(dot(f.edge[k]), set(f.inverse_squared[k]));
    const Lanes at = hn::Min(hn::Max(along, hn::Zero(lanes_of_8)), set(1.0));
    const Lanes ex = hn::Sub(dx, hn::Mul(at, set(f.edge[k].x)));
    const Lanes ey = hn::Sub(dy, hn::Mul(at, set(f.edge[k].y)));
    const Lanes ez = hn::Sub(dz, hn::Mul(at, set(f.edge[k].z)));
    nearest = hn::Min(nearest, hn::Add(hn::Add(hn::Mul(ex, ex), hn::Mul(ey, ey)), hn::Mul(ez, ez)));
    farthest_out = hn::Max(farthest_out, dot(f.outward[k]));
  }
  const Lanes y = hn::Mul(hn::Sub(p.y, set(f.corner[0].y)), set(f.normal.y));
  const Lanes z = hn::Mul(hn::Sub(p.z, set(f.corner[0].z)), set(f.normal.z));
  const Lanes height = hn::Add(hn::Mul(hn::Sub(p.x, set(f.corner[0].x)), set(f.normal.x)), hn::Add(y, z));
  return hn::IfThenElse(hn::Lt(farthest_out, hn::Zero(lanes_of_8)), hn::Mul(height, height), nearest);
}

HWY_INLINE PlaceLanes places_at(const Eight& points, std::size_t i) {
  return {hn::Load(lanes_of_8, points.x + i), hn::Load(lanes_of_8, points.y + i), hn::Load(lanes_of_8, points.z + i)};
}

// Keeps for each of eight cubes with these centres the chosen facets that are near enough. Slivers always are.
void sift(const Facet* facets, std::span<const std::uint32_t> chosen, const Eight& centres, const SiftLimits& limits,
          Parts& parts) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  alignas(64) double limit_squared[8];
  for (std::size_t i = 0; i < 8; i += hn::Lanes(lanes_of_8)) {
    const PlaceLanes p = places_at(centres, i);
    Lanes least = set(kInfinity);
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      const Facet& f = facets[chosen[n]];
      const Lanes squared = squared_distance(f, p);
      least = hn::Min(least, f.sliver ? set(kInfinity) : squared);
      hn::StoreU(f.sliver ? set(-1) : squared, lanes_of_8, parts.squared[n].data() + i);
    }
    const Lanes limit =
        hn::Add(hn::Min(hn::Add(hn::Sqrt(least), set(limits.more)), set(limits.most)), set(limits.slack));
    hn::Store(hn::Mul(limit, limit), lanes_of_8, limit_squared + i);
  }
  const std::size_t room = parts.numbers.size() / 8;
  parts.count = {};
  for (std::size_t n = 0; n < chosen.size(); ++n) {
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < 8; i += hn::Lanes(lanes_of_8)) {
      std::uint8_t mask[8] = {};
      const Lanes squared = hn::LoadU(lanes_of_8, parts.squared[n].data() + i);
      hn::StoreMaskBits(lanes_of_8, hn::Le(squared, hn::Load(lanes_of_8, limit_squared + i)), mask);
      bits |= std::uint32_t{mask[0]} << i;
    }
    for (; bits != 0; bits &= bits - 1) {
      const auto part = static_cast<std::size_t>(std::countr_zero(bits));
      parts.numbers[part * room + parts.count[part]++] = chosen[n];
    }
  }
}

// Points in rows along x that may be within the band. Other points have no say in what a row offers.
HWY_INLINE hn::Mask<decltype(lanes_of_8)> in_rows(const Facet& f, const PlaceLanes& p, double step) {
  const auto within = [&](const Lanes& at, double low, double high) {
    const Lanes row = hn::Round(hn::Div(at, set(step)));
    return hn::And(hn::Ge(row, hn::Ceil(hn::Div(set(low), set(step)))),
                   hn::Le(row, hn::Floor(hn::Div(set(high), set(step)))));
  };
  const Lanes y = hn::Mul(hn::Sub(p.y, set(f.corner[0].y)), set(f.normal.y));
  const Lanes z = hn::Mul(hn::Sub(p.z, set(f.corner[0].z)), set(f.normal.z));
  const Lanes middle = hn::Abs(hn::Add(hn::Add(set(f.middle), y), z));
  return hn::And(hn::Le(middle, set(f.reach)),
                 hn::And(within(p.y, f.low[0], f.high[0]), within(p.z, f.low[1], f.high[1])));
}

// Offers the chosen facets to eight points.
void offer_to_points(const Facet* facets, std::span<const std::uint32_t> chosen, const Eight& points, double step,
                     double* squared, double* triangle) {
  for (std::size_t i = 0; i < 8; i += hn::Lanes(lanes_of_8)) {
    const PlaceLanes p = places_at(points, i);
    Lanes least = hn::Load(lanes_of_8, squared + i);
    Lanes winner = hn::Load(lanes_of_8, triangle + i);
    for (const std::uint32_t n : chosen) {
      const Facet& f = facets[n];
      const Lanes distance = squared_distance(f, p);
      auto nearer = hn::Lt(distance, least);
      if (!hn::AllFalse(lanes_of_8, hn::And(nearer, hn::Gt(distance, set(f.sure))))) {
        nearer = hn::And(nearer, in_rows(f, p, step));
      }
      least = hn::IfThenElse(nearer, distance, least);
      winner = hn::IfThenElse(nearer, set(f.number), winner);
    }
    hn::Store(least, lanes_of_8, squared + i);
    hn::Store(winner, lanes_of_8, triangle + i);
  }
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(sift);
HWY_EXPORT(offer_to_points);

// With a height of at least this part of the longest edge, the unit normal is accurate to 1e-11, and so is a distance
// relative to the coordinates. These are below 1e6 steps. So a distance is accurate to 1e-5 steps, and kEquallyNear is
// more than twice that.
constexpr double kSliver = 1e-4;

void set_facet(const Surface& surface, std::size_t t, const PointLattice& points, double band, Facet& facet) {
  const Vector& a = surface.corner(t, 0);
  const Vector& b = surface.corner(t, 1);
  const Vector& c = surface.corner(t, 2);
  const auto plain = [](const Vector& v) { return Vector3{v.x(), v.y(), v.z()}; };
  for (int k = 0; k < 3; ++k) facet.corner[k] = plain(surface.corner(t, k) - points.first);
  const Vector edge[3] = {b - a, c - b, a - c};
  double longest = 0;
  for (int k = 0; k < 3; ++k) {
    const double squared = edge[k].squaredNorm();
    facet.edge[k] = plain(edge[k]);
    facet.outward[k] = plain(edge[k].cross(surface.normals[t]));
    facet.inverse_squared[k] = 1 / squared;
    longest = std::max(longest, squared);
  }
  facet.normal = plain(surface.normals[t]);
  facet.number = static_cast<double>(t);
  const Vector low = a.cwiseMin(b).cwiseMin(c) - points.first;
  const Vector high = a.cwiseMax(b).cwiseMax(c) - points.first;
  for (int k = 0; k < 2; ++k) {
    facet.low[k] = low[k + 1] - band;
    facet.high[k] = high[k + 1] + band;
  }
  constexpr double kMiddle = (kBrickEdge - 1) / 2.0;
  facet.middle = (kMiddle * points.step - facet.corner[0].x) * facet.normal.x;
  facet.reach = (band + std::abs(facet.normal.x) * kMiddle * points.step) * (1 + 1e-9);
  facet.sliver = !(edge[0].cross(edge[1]).squaredNorm() > kSliver * kSliver * longest * longest);
  const double sure = band - kEquallyNear * points.step;
  facet.sure = facet.sliver || sure < 0 ? -1 : sure * sure;
}

// The search in one lattice.
class Search {
 public:
  Search(std::span<const Facet> facets, const PointLattice& points, double band, NearestTriangles& nearest)
      : facets_(facets), points_(points), band_(band), nearest_(nearest) {}

  void offer_all() {
    std::vector<std::uint32_t> all(facets_.size());
    std::iota(all.begin(), all.end(), 0U);
    offer(all, {0, 0, 0}, kBrickEdge);
  }

 private:
  // Offers facets to the points of a cube. @param first  its lowest point. @param edge  points along an axis
  void offer(std::span<const std::uint32_t> facets, const std::array<int, 3>& first, int edge);
  void sift(std::span<const std::uint32_t> from, const std::array<int, 3>& first, int half, Parts& parts) const;
  void offer_to_block(std::span<const std::uint32_t> facets, const std::array<int, 3>& first);
  // The eight points or centres at `first` and `first` + spacing along each axis.
  [[nodiscard]] Eight eight_at(const std::array<double, 3>& first, double spacing) const;

  std::span<const Facet> facets_;
  const PointLattice& points_;
  const double band_;
  NearestTriangles& nearest_;
  Parts octants_{facets_.size()};
  Parts blocks_{facets_.size()};
};

Eight Search::eight_at(const std::array<double, 3>& first, double spacing) const {
  Eight out;
  for (std::size_t n = 0; n < 8; ++n) {
    out.x[n] = (first[0] + spacing * static_cast<double>(n & 1)) * points_.step;
    out.y[n] = (first[1] + spacing * static_cast<double>(n >> 1 & 1)) * points_.step;
    out.z[n] = (first[2] + spacing * static_cast<double>(n >> 2)) * points_.step;
  }
  return out;
}

// Keeps for each of eight cubes the facets that can be nearest to one of its points: those whose distance to its centre
// is at most the least one and the cube's diameter, and at most the band and its radius.
void Search::sift(std::span<const std::uint32_t> from, const std::array<int, 3>& first, int half, Parts& parts) const {
  const double middle = (half - 1) / 2.0;
  const double radius = std::sqrt(3.0) * middle * points_.step;
  HWY_DYNAMIC_DISPATCH(sift)
  (facets_.data(), from, eight_at({first[0] + middle, first[1] + middle, first[2] + middle}, half),
   {2 * radius, band_ + radius, kEquallyNear * points_.step}, parts);
}

void Search::offer_to_block(std::span<const std::uint32_t> facets, const std::array<int, 3>& first) {
  const Eight points = eight_at({double(first[0]), double(first[1]), double(first[2])}, 1);
  alignas(64) double squared[8];
  alignas(64) double triangle[8];
  const auto number = [&](int n) {
    constexpr auto kRow = static_cast<int>(kBrickEdge);
    return static_cast<std::size_t>(((first[2] + (n >> 2)) * kRow + first[1] + (n >> 1 & 1)) * kRow + first[0] +
                                    (n & 1));
  };
  for (int n = 0; n < 8; ++n) {
    squared[n] = nearest_.squared[number(n)];
    triangle[n] = nearest_.triangle[number(n)];
  }
  HWY_DYNAMIC_DISPATCH(offer_to_points)(facets_.data(), facets, points, points_.step, squared, triangle);
  for (int n = 0; n < 8; ++n) {
    nearest_.squared[number(n)] = squared[n];
    nearest_.triangle[number(n)] = triangle[n];
  }
}

void Search::offer(std::span<const std::uint32_t> facets, const std::array<int, 3>& first, int edge) {
  if (facets.empty()) return;
  if (edge == 2) return offer_to_block(facets, first);
  const int half = edge / 2;
  Parts& parts = edge == kBrickEdge ? octants_ : blocks_;
  sift(facets, first, half, parts);
  for (int part = 0; part < 8; ++part) {
    const std::array<int, 3> at = {first[0] + half * (part & 1), first[1] + half * (part >> 1 & 1),
                                   first[2] + half * (part >> 2)};
    const auto n = static_cast<std::size_t>(part);
    offer({parts.numbers.data() + n * facets_.size(), parts.count[n]}, at, half);
  }
}
}  // namespace detail

void offer_triangles(const Surface& surface, std::span<const std::uint32_t> triangles, const PointLattice& points,
                     double band, NearestTriangles& nearest) {
  UnsetVector<detail::Facet> facets(triangles.size());
  for (std::size_t n = 0; n < triangles.size(); ++n) detail::set_facet(surface, triangles[n], points, band, facets[n]);
  detail::Search(facets, points, band, nearest).offer_all();
}

void offer_triangles(const Surface& surface, std::span<const std::uint32_t> triangles, std::span<const PlaceBits> bits,
                     const PointLattice& points, double band, NearestToSamples& nearest) {
  using namespace detail;
  UnsetVector<Facet> facets;
  std::vector<PlaceBits> places;
  for (std::size_t n = 0; n < triangles.size(); ++n) {
    if (bits[n] == PlaceBits{}) continue;
    set_facet(surface, triangles[n], points, band, facets.emplace_back());
    places.push_back(bits[n]);
  }
  std::vector<std::uint32_t> chosen;
  for (std::size_t first = 0; first < nearest.squared.size(); first += 8) {
    Eight eight;
    for (std::size_t n = 0; n < 8; ++n) {
      const std::size_t at[3] = {(first + n) % 5, (first + n) / 5 % 5, (first + n) / 25};
      eight.x[n] = static_cast<double>(at[0]) * points.step;
      eight.y[n] = static_cast<double>(at[1]) * points.step;
      eight.z[n] = static_cast<double>(at[2]) * points.step;
    }
    chosen.clear();
    for (std::uint32_t n = 0; n < facets.size(); ++n) {
      if (places[n][first / 8] != 0) chosen.push_back(n);
    }
    HWY_DYNAMIC_DISPATCH(offer_to_points)
    (facets.data(), chosen, eight, points.step, nearest.squared.data() + first, nearest.triangle.data() + first);
  }
}

}  // namespace vps::bake
#endif
