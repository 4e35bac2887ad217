// SPDX-License-Identifier: Zlib
// Finds planes from the feet of places, and fits them to samples.
#include "runtime/contacts/fit_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

namespace vps::detail {
namespace {

constexpr float kSquare = 0.7071F;  // half an edge of a square in a circle of radius 1

// The nearest place of a surface, by steps along the field's normals. Nothing where it is farther than `most`. [m]
struct Foot {
  Vec3 place, normal;
};
std::optional<Foot> foot_of(const VoxelmapView& map, Vec3 from, float most) {
  constexpr int kSteps = 8;
  Foot foot{from, {}};
  for (int i = 0; i < kSteps; ++i) {
    const float v = voxelmap_penetration(map, foot.place, {});
    const Vec3 normal = normal_at(map, foot.place);
    if (!(std::abs(v) <= most) || !(dot(normal, normal) > 0)) return {};
    foot = {foot.place + v * normal, normal};
    if (std::abs(v) < kFlat_vx * map.voxel_size) return foot;
  }
  return {};
}

// Ground that is level in the grid of its samples stays so: their rounding tilts a plane by less.
constexpr float kNoise = 4e-4F;        // [rad]
constexpr float kNoiseOfTops = 1e-3F;  // of fewer places
Vec3 without_noise(Vec3 normal, float noise) {
  for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
    const Vec3 aside = cross(normal, axis);
    if (dot(aside, aside) < noise * noise) return dot(normal, axis) > 0 ? axis : -1.0F * axis;
  }
  return normal;
}

// The plane through a surface around a foot: that of the least squares, of places in a square, whose V are rounded.
// Nothing where they are in no plane.
std::optional<HalfSpaceField> plane_around(const VoxelmapView& map, Foot foot, float half_edge) {
  constexpr int kAlong[] = {2, 2, 8};  // places along an edge, in steps that come closer
  const float most = kFlat_vx * map.voxel_size;
  for (const int along : kAlong) {
    const Tangents across(foot.normal);
    const Vec3 u = half_edge * across.u;
    const Vec3 v = half_edge * across.v;
    float mean = 0;  // of the heights above the plane so far. [m]
    float rise_u = 0;
    float rise_v = 0;
    float squares = 0;
    for (int i = 0; i < along * along; ++i) {
      const auto at = [=](int k) { return 2 * static_cast<float>(k) / static_cast<float>(along - 1) - 1; };
      const float a = at(i % along);
      const float b = at(i / along);
      const float height = voxelmap_penetration(map, foot.place + a * u + b * v, {});
      if (along > 2 && !(std::abs(height) <= most)) return {};
      mean += height;
      rise_u += a * height;
      rise_v += b * height;
      squares += a * a;
    }
    mean /= static_cast<float>(along * along);
    // Curved ground is below the tangent plane at all four corners.
    if (!(std::abs(mean) <= most)) return {};
    const float by = 1 / (squares * half_edge * half_edge);
    const Vec3 normal = foot.normal - by * (rise_u * u + rise_v * v);
    foot.place = foot.place + mean * foot.normal;
    foot.normal = (1 / length(normal)) * normal;
  }
  const Vec3 normal = without_noise(foot.normal, kNoise);
  return HalfSpaceField{normal, dot(normal, foot.place)};
}

// Feet of a centre and of the corners of two cubes around it. @return their number
constexpr std::size_t kFeet = 17;
std::size_t feet_around(const VoxelmapView& map, Vec3 centre, float radius, std::array<Foot, kFeet>& feet) {
  std::size_t count = 0;
  const auto add = [&](Vec3 from) {
    if (const std::optional<Foot> foot = foot_of(map, from, radius)) feet[count++] = *foot;
  };
  add(centre);
  for (const float half : {0.3F * radius, 0.5F * radius}) {
    for (int i = 0; i < 8; ++i) {
      add(centre + Vec3{(i & 1) != 0 ? half : -half, (i & 2) != 0 ? half : -half, (i & 4) != 0 ? half : -half});
    }
  }
  return count;
}

// The foot whose plane has most of the others, and none above it. Null: none has two.
const Foot* most_common(std::span<const Foot> feet, float unit) {
  constexpr float kSame = 0.9995F;
  const Foot* best = nullptr;
  std::ptrdiff_t most = 2;
  for (const Foot& foot : feet) {
    const auto height = [&](const Foot& other) { return dot(foot.normal, other.place - foot.place); };
    const auto is_above = [&](const Foot& other) { return height(other) > kTop_vx * unit; };
    if (std::any_of(feet.begin(), feet.end(), is_above)) continue;
    const auto votes = std::count_if(feet.begin(), feet.end(), [&](const Foot& other) {
      return dot(foot.normal, other.normal) > kSame && std::abs(height(other)) < kTop_vx * unit;
    });
    if (votes > most) {
      most = votes;
      best = &foot;
    }
  }
  return best;
}

// The least squares of z = x0 + x1 a + x2 b.
class LeastSquares {
 public:
  void add(double a, double b, double z) {
    const double row[4] = {1, a, b, z};
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 4; ++k) m_[i][k] += row[i] * row[k];
    }
  }
  // @return false: the places are too few, or on a line
  bool solve(double (&x)[3]) {
    constexpr double kEnough = 16;
    constexpr double kLeast = 1e-3;  // of a place's share
    if (!(m_[0][0] >= kEnough)) return false;
    for (int i = 0; i < 3; ++i) {
      if (!(m_[i][i] > kLeast)) return false;
      for (int below = i + 1; below < 3; ++below) {
        const double by = m_[below][i] / m_[i][i];
        for (int k = i; k < 4; ++k) m_[below][k] -= by * m_[i][k];
      }
    }
    for (int i = 2; i >= 0; --i) {
      x[i] = m_[i][3];
      for (int k = i + 1; k < 3; ++k) x[i] -= m_[i][k] * x[k];
      x[i] /= m_[i][i];
    }
    return true;
  }

 private:
  double m_[3][4] = {};  // normal equations
};

}  // namespace

std::optional<HalfSpaceField> fit_plane(const VoxelmapView& map, Vec3 centre, float radius) {
  const std::optional<Foot> foot = foot_of(map, centre, radius);
  return foot ? plane_around(map, *foot, kSquare * radius) : std::nullopt;
}

std::optional<HalfSpaceField> fit_top(const VoxelmapView& map, Vec3 centre, float radius) {
  std::array<Foot, kFeet> feet;
  const std::size_t count = feet_around(map, centre, radius, feet);
  const Foot* const best = most_common({feet.data(), count}, map.voxel_size);
  if (best == nullptr) return {};
  constexpr int kAlong = 12;
  Foot foot{centre - dot(best->normal, centre - best->place) * best->normal, best->normal};
  // Places beside edges tilt the first plane.
  for (const float most_vx : {kTop_vx, kFlat_vx}) {
    const Vec3 n = foot.normal;
    const Tangents across(n);
    const Vec3 u = kSquare * radius * across.u;
    const Vec3 v = kSquare * radius * across.v;
    std::array<float, kAlong * kAlong> heights;
    const auto at = [](int k) { return 2 * static_cast<float>(k) / static_cast<float>(kAlong - 1) - 1; };
    for (int i = 0; i < kAlong * kAlong; ++i) {
      heights[i] = voxelmap_penetration(map, foot.place + at(i % kAlong) * u + at(i / kAlong) * v, {});
    }
    const auto is_in = [&](int a, int b) { return std::abs(heights[b * kAlong + a]) <= most_vx * map.voxel_size; };
    // Beside an edge the surface is rounded off by as much as tilts the plane.
    const auto is_inside = [&](int a, int b) {
      const auto near = [](int k, int by) { return std::clamp(k + by, 0, kAlong - 1); };
      return is_in(near(a, -1), b) && is_in(near(a, 1), b) && is_in(a, near(b, -1)) && is_in(a, near(b, 1));
    };
    LeastSquares all;
    LeastSquares inside;
    for (int i = 0; i < kAlong * kAlong; ++i) {
      const int a = i % kAlong;
      const int b = i / kAlong;
      if (!is_in(a, b)) continue;
      all.add(double{at(a)}, double{at(b)}, double{heights[i]});
      if (is_inside(a, b)) inside.add(double{at(a)}, double{at(b)}, double{heights[i]});
    }
    double x[3];
    if (!inside.solve(x) && !all.solve(x)) return {};
    const Vec3 rise = (1 / dot(u, u)) * (static_cast<float>(x[1]) * u + static_cast<float>(x[2]) * v);
    const Vec3 tilted = n - rise;
    foot = {foot.place + static_cast<float>(x[0]) * n, (1 / length(tilted)) * tilted};
  }
  const Vec3 normal = without_noise(foot.normal, kNoiseOfTops);
  return HalfSpaceField{normal, dot(normal, foot.place)};
}

}  // namespace vps::detail
