// SPDX-License-Identifier: Zlib
// Newton steps on the gap between two bodies, fitted on a ring.
#include "runtime/contacts/slide_to_deepest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace vps::detail {
namespace {

constexpr std::size_t kRing = 8;
constexpr float kHalf = 0.70710678F;  // cosine of 45 degrees
constexpr float kCosine[kRing] = {1, kHalf, 0, -kHalf, -1, -kHalf, 0, kHalf};
constexpr float kSine[kRing] = {0, kHalf, 1, kHalf, 0, -kHalf, -1, -kHalf};

// All lengths are in rings.
constexpr float kFlat = 0.015F;     // a curvature that the fields' rounding hides
constexpr float kSharp = 0.5F;      // the curvature of an edge
constexpr float kEdge = 0.02F;      // residual of a fit across an edge
constexpr float kBend = 0.01F;      // difference of slopes by the fields' rounding. [-]
constexpr float kSlope = 0.05F;     // of surfaces that do not touch there but farther on. [-]
constexpr float kSteep = 0.15F;     // of a surface that meets the other body only after it has turned by as much. [-]
constexpr float kLeft = 0.2F;       // way that may be left after the last step
constexpr float kWorse = 0.01F;     // by so much the gap may grow in a step
constexpr float kWorst_vx = 0.05F;  // by so much a contact may become shallower
constexpr float kMoved = 0.02F;
constexpr int kSteps = 2;

// Directions across a contact's normal.
struct Plane {
  Vec3 u, v;
  explicit Plane(Vec3 normal) {
    const Vec3 other = std::abs(normal.x) < 0.6F ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    u = cross(normal, other);
    u = (1 / length(u)) * u;
    v = cross(normal, u);
  }
};

// A quadratic in a plane, fitted by least squares to its values at the centre and on the ring.
struct Quadratic {
  float u = 0, v = 0;            // slope
  float uu = 0, uv = 0, vv = 0;  // second derivatives
  float residual = 0;            // root of the sum of squares, on the ring

  Quadratic(float centre, const std::array<float, kRing>& ring) {
    float mean = 0;
    float cosine2 = 0;
    float sine2 = 0;
    for (std::size_t i = 0; i < kRing; ++i) {
      mean += ring[i] / kRing;
      u += ring[i] * kCosine[i] / 4;
      v += ring[i] * kSine[i] / 4;
      cosine2 += ring[i] * (kCosine[i] * kCosine[i] - kSine[i] * kSine[i]);
      sine2 += ring[i] * 2 * kCosine[i] * kSine[i];
    }
    const float trace = 4 * (mean - centre);
    uu = (trace + cosine2) / 2;
    vv = (trace - cosine2) / 2;
    uv = sine2 / 2;
    float squares = 0;
    for (std::size_t i = 0; i < kRing; ++i) {
      const float c = kCosine[i];
      const float s = kSine[i];
      const float off = mean + u * c + v * s + cosine2 / 4 * (c * c - s * s) + sine2 / 2 * c * s - ring[i];
      squares += off * off;
    }
    residual = std::sqrt(squares);
  }
};

// A function along one axis of the plane.
struct Along {
  Vec3 axis;
  float slope = 0, curvature = 0;
  bool smooth = false;
};

// A function along the principal axes of its curvature.
// @param value  at a place, divided by the ring
template <class Value>
std::array<Along, 2> along_principal_axes(Vec3 at, const Plane& plane, float ring, const Value& value) {
  std::array<float, kRing> values{};
  for (std::size_t i = 0; i < kRing; ++i) values[i] = value(at + ring * (kCosine[i] * plane.u + kSine[i] * plane.v));
  const float centre = value(at);
  const Quadratic q(centre, values);
  const float angle = 0.5F * std::atan2(q.uv, (q.uu - q.vv) / 2);
  const float axes[2][2] = {{std::cos(angle), std::sin(angle)}, {-std::sin(angle), std::cos(angle)}};
  std::array<Along, 2> both;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto [u, v] = axes[i];
    Along& a = both[i];
    a.axis = u * plane.u + v * plane.v;
    a.slope = q.u * u + q.v * v;
    a.curvature = q.uu * u * u + 2 * q.uv * u * v + q.vv * v * v;
  }
  for (Along& a : both) {
    // An edge that the ring crosses along one axis spoils the fit along the other.
    if (q.residual > kEdge) {
      const float ahead = value(at + ring * a.axis);
      const float behind = value(at - ring * a.axis);
      a.slope = (ahead - behind) / 2;
      a.curvature = ahead + behind - 2 * centre;
    }
    // An edge between half the ring and the ring changes the slope.
    const Vec3 half = 0.5F * ring * a.axis;
    const float near = value(at + half) - value(at - half);
    a.smooth = std::abs(a.slope - near) < kBend + 0.25F * std::abs(near);
    if (!a.smooth) a.slope = near;
  }
  return both;
}

// Step to the least gap along the axes on which it is a parabola, and the slope of the others.
struct Step {
  Vec3 way;
  std::array<Vec3, 2> slopes{};  // along the other axes, if the gap has a slope there
};

Step newton(const std::array<Along, 2>& gap) {
  Step step;
  for (std::size_t i = 0; i < gap.size(); ++i) {
    const Along& along = gap[i];
    if (along.curvature > kSharp) continue;
    const bool is_parabola = along.smooth && along.curvature > 0;
    if ((!is_parabola || along.curvature < kFlat) && std::abs(along.slope) > kSlope) step.slopes[i] = along.axis;
    if (!is_parabola) continue;
    const float flat = (kFlat / along.curvature) * (kFlat / along.curvature);
    step.way = step.way - along.slope / (along.curvature * (1 + flat * flat)) * along.axis;
  }
  return step;
}

// Whether a body is round where it is cut by the plane of a direction across the contact and the contact's normal. Its
// own tangent there shows it also where it is steep.
// @param out  of the body
// @param gap  distance from the body, divided by the ring
template <class Gap>
bool is_round(Vec3 at, Vec3 out, Vec3 normal, Vec3 across, float ring, const Gap& gap) {
  const Vec3 tangent = dot(out, normal) * across - dot(out, across) * normal;
  const float size = length(tangent);
  if (!(size > 0)) return false;
  const Vec3 way = (ring / size) * tangent;
  const float centre = gap(at);
  const float curvature = gap(at + way) + gap(at - way) - 2 * centre;
  const float half = gap(at + 0.5F * way) + gap(at - 0.5F * way) - 2 * centre;
  return curvature > kFlat && std::abs(curvature / 4 - half) < kBend + 0.25F * half;
}

// Distances from both bodies, and the gap between them, in rings.
class Gap {
 public:
  explicit Gap(const TouchingBodies& bodies) : b_(bodies) {}
  [[nodiscard]] float shell(Vec3 p) const {
    return -voxelmap_penetration(b_.shell, b_.field_to_shell.apply(p), {}) / b_.ring;
  }
  // Of the plane, for a contact ahead.
  [[nodiscard]] float field(Vec3 p) const {
    if (b_.arrival == nullptr) return -penetration(b_.field, p) / b_.ring;
    return (dot(b_.arrival->outward_normal, p) - b_.arrival->offset) / b_.ring;
  }
  [[nodiscard]] float operator()(Vec3 p) const { return shell(p) + field(p); }

  // Whether one of the bodies is round in a direction: then they do not meet at a place that slopes, but farther on.
  [[nodiscard]] bool is_round(Vec3 at, Vec3 normal, Vec3 across) const {
    const Vec3 out = b_.field_to_shell.rotate_back(outward_normal(b_.shell, b_.field_to_shell.apply(at)));
    if (detail::is_round(at, out, normal, across, b_.ring, [this](Vec3 p) { return shell(p); })) return true;
    return detail::is_round(at, outward_normal(b_.field, at), normal, across, b_.ring,
                            [this](Vec3 p) { return -penetration(b_.field, p) / b_.ring; });
  }

 private:
  const TouchingBodies& b_;
};

}  // namespace

Slide slide_to_deepest(const TouchingBodies& bodies, Contact& contact) noexcept {
  const float ring = bodies.ring;
  const Gap gap(bodies);
  const Vec3 start = contact.position;
  const Vec3 normal = contact.inward_normal;
  const Plane plane(normal);
  float off_shell = 0;
  Vec3 at = start;
  float least = gap(at);
  Step step;
  bool is_capped = false;
  for (int i = 0;; ++i) {
    const std::array<Along, 2> axes = along_principal_axes(at, plane, ring, gap);
    step = newton(axes);
    // Fields round edges off. Elsewhere the depth must not depend on the sample.
    const auto is_sharp = [](const Along& along) { return along.curvature > kSharp; };
    if (i == 0 && std::any_of(axes.begin(), axes.end(), is_sharp)) off_shell = gap.shell(start);
    if (!is_finite(step.way)) return Slide::stayed;
    if (i == kSteps || length(step.way) < kMoved) break;
    Vec3 next = at + ring * step.way;
    const float whole = length(next - start);
    is_capped = whole > ring;
    if (is_capped) next = start + (ring / whole) * (next - start);
    // Back to the shell's surface.
    for (int k = 0; k < 2; ++k) next = next + ring * (gap.shell(next) - off_shell) * normal;
    const float there = gap(next);
    if (!(there <= least + kWorse) || !(length(next - start) < 2 * ring)) break;
    at = next;
    least = there;
  }
  bool is_sloping = is_capped || length(step.way) > kLeft;
  for (const Vec3& across : step.slopes) {
    is_sloping = is_sloping || (dot(across, across) > 0 && gap.is_round(at, normal, across));
  }
  if (!(length(at - start) > kMoved * ring)) return is_sloping ? Slide::sloping : Slide::stayed;
  const float gain = ring * (gap.field(start) - gap.field(at));
  // The shell's own distances are too rough there.
  if (gain < -kWorst_vx * bodies.shell.voxel_size) return Slide::stayed;
  contact.penetration += gain;
  contact.position = at;
  const auto field = [&](Vec3 p) { return -gap.field(p); };
  for (const Along& along : along_principal_axes(at, plane, ring, field)) {
    if (!along.smooth || !(std::abs(along.curvature) < kSharp)) continue;
    contact.inward_normal = contact.inward_normal - along.slope * along.axis;
  }
  contact.inward_normal = (1 / length(contact.inward_normal)) * contact.inward_normal;
  return is_sloping ? Slide::sloping : Slide::arrived;
}

bool is_steep(const TouchingBodies& bodies, const Contact& contact) noexcept {
  const Gap gap(bodies);
  const float ring = 1.25F * bodies.shell.voxel_size;  // in the band, also where the shell is steep
  const float size = bodies.ring / ring;
  const auto apart = [&](Vec3 p) { return size * gap.shell(p); };
  const auto both = along_principal_axes(contact.position, Plane(contact.inward_normal), ring, apart);
  return std::any_of(both.begin(), both.end(),
                     [&](const Along& along) { return along.curvature < kSharp && std::abs(along.slope) > kSteep; });
}

}  // namespace vps::detail
