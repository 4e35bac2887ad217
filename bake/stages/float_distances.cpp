// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled once per instruction set by Highway, chosen at run time. Results differ between instruction sets, but only
// within the error bound.
#include "bake/stages/float_distances.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/stages/float_distances.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<float, 16> float_lanes;
using FloatLanes = hn::Vec<decltype(float_lanes)>;

struct PlaceLanes {
  FloatLanes x, y, z;
};

HWY_INLINE FloatLanes value(const FloatTriangle::Linear& f, const PlaceLanes& p) {
  const FloatLanes cz = hn::MulAdd(hn::Set(float_lanes, f.c), p.z, hn::Set(float_lanes, f.d));
  const FloatLanes by = hn::MulAdd(hn::Set(float_lanes, f.b), p.y, cz);
  return hn::MulAdd(hn::Set(float_lanes, f.a), p.x, by);
}

// Takes the distance to the triangle's plane over its face, and elsewhere the distance to its nearest edge.
HWY_INLINE FloatLanes squared_distance(const FloatTriangle& f, const PlaceLanes& p) {
  const FloatLanes zero = hn::Zero(float_lanes);
  FloatLanes nearest = hn::Set(float_lanes, std::numeric_limits<float>::infinity());
  FloatLanes farthest_out = hn::Set(float_lanes, -std::numeric_limits<float>::infinity());
  for (int k = 0; k < 3; ++k) {
    const FloatLanes along = value(f.along[k], p);
    const FloatLanes out = value(f.outward[k], p);
    const FloatLanes beyond = hn::Sub(along, hn::Min(hn::Max(along, zero), hn::Set(float_lanes, f.length[k])));
    nearest = hn::Min(nearest, hn::MulAdd(beyond, beyond, hn::Mul(out, out)));
    farthest_out = hn::Max(farthest_out, out);
  }
  const FloatLanes height = value(f.height, p);
  const FloatLanes beside = hn::IfThenZeroElse(hn::Lt(farthest_out, zero), nearest);
  return hn::MulAdd(height, height, beside);
}

template <std::size_t kCount>
HWY_INLINE PlaceLanes lanes_at(const FloatPlaces<kCount>& places, std::size_t i) {
  return {hn::Load(float_lanes, places.x.data() + i), hn::Load(float_lanes, places.y.data() + i),
          hn::Load(float_lanes, places.z.data() + i)};
}

void all_distances(const FloatTriangle* triangles, std::span<const std::uint32_t> chosen, const Places16& places,
                   std::array<float, 16>* distances) {
  for (std::size_t i = 0; i < 16; i += hn::Lanes(float_lanes)) {
    const PlaceLanes p = lanes_at(places, i);
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      hn::StoreU(hn::Sqrt(squared_distance(triangles[chosen[n]], p)), float_lanes, distances[n].data() + i);
    }
  }
}

void least_distances(const FloatTriangle* triangles, std::span<const std::uint32_t> chosen, const Places128& places,
                     std::array<float, 128>& distances) {
  for (std::size_t i = 0; i < 128; i += hn::Lanes(float_lanes)) {
    const PlaceLanes p = lanes_at(places, i);
    FloatLanes least = hn::Set(float_lanes, std::numeric_limits<float>::infinity());
    for (const std::uint32_t n : chosen) least = hn::Min(least, squared_distance(triangles[n], p));
    hn::StoreU(hn::Sqrt(least), float_lanes, distances.data() + i);
  }
}

void where_nearest(const FloatTriangle* triangles, std::span<const std::uint32_t> chosen, const Places128& places,
                   float more, std::array<float, 16>* squared, PlaceBits* bits) {
  for (std::size_t i = 0; i < 128; i += hn::Lanes(float_lanes)) {
    const PlaceLanes p = lanes_at(places, i);
    FloatLanes least = hn::Set(float_lanes, std::numeric_limits<float>::infinity());
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      const FloatLanes found = squared_distance(triangles[chosen[n]], p);
      hn::StoreU(found, float_lanes, squared[n].data());
      least = hn::Min(least, found);
    }
    const FloatLanes limit = hn::Add(hn::Sqrt(least), hn::Set(float_lanes, more));
    const FloatLanes limit_squared = hn::Mul(hn::Mul(limit, limit), hn::Set(float_lanes, 1 + 1e-5F));
    for (std::size_t n = 0; n < chosen.size(); ++n) {
      std::uint8_t mask[8] = {};
      const FloatLanes found = hn::LoadU(float_lanes, squared[n].data());
      const std::size_t bytes = hn::StoreMaskBits(float_lanes, hn::Le(found, limit_squared), mask);
      for (std::size_t byte = 0; byte < bytes; ++byte) {
        std::uint8_t& to = bits[n][i / 8 + byte];
        to = static_cast<std::uint8_t>(to | mask[byte] << i % 8);
      }
    }
  }
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(all_distances);
HWY_EXPORT(least_distances);
HWY_EXPORT(where_nearest);

// The linear function with a slope that is `more` at a place.
FloatTriangle::Linear linear_from(const Vector& place, const Vector& slope, double more) {
  return {static_cast<float>(slope.x()), static_cast<float>(slope.y()), static_cast<float>(slope.z()),
          static_cast<float>(more - slope.dot(place))};
}
}  // namespace detail

// With R = the farthest corner's distance from the centre, B = R + sqrt(3) reach and e = 2^-24, for places within
// reach:
// - A linear function has a unit slope and |d| <= R. Rounding its four numbers adds at most e B, three products e B,
//   and three sums 3 e B: below 6 e B.
// - `outward` is 8 e B too large on purpose. So a place that is over the face by the test is truly over it, and the
//   error of `outward` is below 14 e B.
// - `beyond` depends on `along` and `length` with slopes of 1; with its own rounding its error is at most
//   6 e B + 2 e B + e B = 9 e B.
// - The error of a length is at most that of its vector: sqrt(6^2 + 9^2 + 14^2) e B < 18 e B. Squares, sums and the
//   root add 3 e B: below 21 e B for the distance to each edge, and below 9 e B for that to the plane.
// - A place that is over the face and not by the test is at most 14 e B inside of an edge, in the plane. Its foot on
//   the nearest edge is not beyond that edge's ends. The two errors of that edge's vector are within 9 e B and 14 e B
//   of its distance to the plane as before: below 21 e B.
// Edges are rounded once, so the normal of a triangle whose height is at least 1e-4 of its longest edge is accurate to
// 1e-11: negligible, as is rounding in double. The points of a sliver, with a smaller height, are at most that height
// from its longest edge, which stands for it: once in each direction, so that no place is over a face.
FloatTriangle float_triangle(const Mesh& mesh, std::size_t triangle, const Vector& centre, double unit, double reach) {
  Vector corner[3];
  Vector edge[3];
  double length[3];
  const double per_unit = 1 / unit;
  double far = 0;
  std::size_t longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector& here = mesh.corner(triangle, static_cast<int>(k));
    corner[k] = (here - centre) * per_unit;
    edge[k] = mesh.corner(triangle, static_cast<int>((k + 1) % 3)) - here;
    length[k] = edge[k].norm();
    far = std::max(far, corner[k].squaredNorm());
    if (length[k] > length[longest]) longest = k;
  }
  constexpr double kUlp = 1.0 / (1 << 24);
  const double ulps = kUlp * (std::sqrt(far) + std::sqrt(3.0) * reach);
  Vector up = edge[0].cross(edge[1]);
  const double height = up.norm() / length[longest];
  constexpr double kSliver = 1e-4;
  const bool sliver = !(height > kSliver * length[longest]);
  up = sliver ? edge[longest].unitOrthogonal() : Vector(up.normalized());
  FloatTriangle out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t n = sliver ? longest : k;
    const bool reversed = sliver && k > 0;
    const Vector direction = edge[n] * ((reversed ? -1 : 1) / length[n]);
    const Vector& start = corner[reversed ? (n + 1) % 3 : n];
    out.along[k] = detail::linear_from(start, direction, 0);
    out.outward[k] = detail::linear_from(start, direction.cross(up), 8 * ulps);
    out.length[k] = static_cast<float>(length[n] * per_unit);
  }
  out.height = detail::linear_from(corner[longest], up, 0);
  out.error = static_cast<float>(24 * ulps + (sliver ? height / unit : 0));
  return out;
}

ProofTriangle proof_triangle(const FloatTriangle& distances, const Mesh& mesh, std::size_t triangle,
                             const Vector& centre, double unit) {
  ProofTriangle out{distances, {}, {}};
  Vector corner[3];
  for (int k = 0; k < 3; ++k) {
    corner[k] = (mesh.corner(triangle, k) - centre) / unit;
    for (int axis = 0; axis < 3; ++axis) out.corner[k][axis] = static_cast<float>(corner[k][axis]);
  }
  const Vector a = mesh.corner(triangle, 1) - mesh.corner(triangle, 0);
  const Vector b = mesh.corner(triangle, 2) - mesh.corner(triangle, 1);
  const Vector up = a.cross(b);
  const double longest_squared = std::max({a.squaredNorm(), b.squaredNorm(), (a + b).squaredNorm()});
  constexpr double kThinnest = 1e-8;  // the normal is accurate to 1e-16 of the inverse
  if (up.norm() > kThinnest * longest_squared) out.plane = detail::linear_from(corner[0], up.normalized(), 0);
  return out;
}

void triangle_distances(std::span<const FloatTriangle> triangles, std::span<const std::uint32_t> chosen,
                        const Places16& places, std::span<std::array<float, 16>> distances) {
  using namespace detail;  // Highway's macros take names without a namespace
  HWY_DYNAMIC_DISPATCH(all_distances)(triangles.data(), chosen, places, distances.data());
}

void nearest_distances(std::span<const FloatTriangle> triangles, std::span<const std::uint32_t> chosen,
                       const Places128& places, std::array<float, 128>& distances) {
  using namespace detail;
  HWY_DYNAMIC_DISPATCH(least_distances)(triangles.data(), chosen, places, distances);
}

void find_where_nearest(std::span<const FloatTriangle> triangles, std::span<const std::uint32_t> chosen,
                        const Places128& places, float slack, std::span<PlaceBits> bits) {
  using namespace detail;
  // The nearest one may seem farther by its error, and another one nearer by its own.
  float error = 0;
  for (const std::uint32_t n : chosen) error = std::max(error, triangles[n].error);
  std::vector<std::array<float, 16>> squared(chosen.size());
  std::fill(bits.begin(), bits.end(), PlaceBits{});
  HWY_DYNAMIC_DISPATCH(where_nearest)
  (triangles.data(), chosen, places, 2 * error + slack, squared.data(), bits.data());
}

}  // namespace vps::bake
#endif
