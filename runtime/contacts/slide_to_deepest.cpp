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
constexpr int kNewtonSteps = 2;

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

// The place around which a function is looked up: there, and on the ring.
struct Neighbourhood {
  Vec3 at;
  Plane plane;
  float ring;  // [m]

  [[nodiscard]] Places centre_and_ring() const {
    Places places;
    places.push(at);
    for (std::size_t i = 0; i < kRing; ++i) places.push(at + ring * (kCosine[i] * plane.u + kSine[i] * plane.v));
    return places;
  }
};

// A quadratic in a plane, fitted by least squares to its values at the centre and on the ring.
struct Quadratic {
  float u = 0, v = 0;            // slope
  float uu = 0, uv = 0, vv = 0;  // second derivatives
  float residual = 0;            // root of the sum of squares, on the ring

  explicit Quadratic(const Values& values) {
    const float* const ring = values.data() + 1;
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
    const float trace = 4 * (mean - values[0]);
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
// @param values   at the centre and on the ring. [rings]
// @param look_up  writes the function's values at places. [rings]
template <class LookUp>
std::array<Along, 2> along_principal_axes(const Neighbourhood& near, const Values& values, const LookUp& look_up) {
  const Quadratic q(values);
  const float angle = 0.5F * std::atan2(q.uv, (q.uu - q.vv) / 2);
  const float axes[2][2] = {{std::cos(angle), std::sin(angle)}, {-std::sin(angle), std::cos(angle)}};
  std::array<Along, 2> both;
  Places places;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto [u, v] = axes[i];
    Along& a = both[i];
    a.axis = u * near.plane.u + v * near.plane.v;
    a.slope = q.u * u + q.v * v;
    a.curvature = q.uu * u * u + 2 * q.uv * u * v + q.vv * v * v;
    for (const float way : {1.0F, -1.0F, 0.5F, -0.5F}) places.push(near.at + way * near.ring * a.axis);
  }
  Values along;
  look_up(places, along);
  for (std::size_t i = 0; i < 2; ++i) {
    Along& a = both[i];
    const float* const at = along.data() + 4 * i;
    // An edge that the ring crosses along one axis spoils the fit along the other.
    if (q.residual > kEdge) {
      a.slope = (at[0] - at[1]) / 2;
      a.curvature = at[0] + at[1] - 2 * values[0];
    }
    // An edge between half the ring and the ring changes the slope.
    const float half = at[2] - at[3];
    a.smooth = std::abs(a.slope - half) < kBend + 0.25F * std::abs(half);
    if (!a.smooth) a.slope = half;
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

// Distances from both bodies, and the gap between them, in rings.
class Gap {
 public:
  Gap(const TouchingBodies& bodies, const Reach& reach) : b_(bodies), reach_(reach), per_ring_(1 / reach.ring) {}

  void shell(const Places& places, Values& out) const {
    b_.shell.penetrations(places, out);
    for (std::size_t i = 0; i < places.count; ++i) out[i] *= -per_ring_;
  }
  [[nodiscard]] float shell(Vec3 p) const { return -b_.shell.penetration(p) * per_ring_; }
  // Of the plane, for a contact ahead.
  void field(const Places& places, Values& out) const {
    if (reach_.arrival == nullptr) {
      b_.field.penetrations(places, out);
      for (std::size_t i = 0; i < places.count; ++i) out[i] *= -per_ring_;
      return;
    }
    const auto& [normal, offset] = *reach_.arrival;
    for (std::size_t i = 0; i < places.count; ++i) out[i] = (dot(normal, places[i]) - offset) * per_ring_;
  }

  // Whether one of the bodies is round in a direction: then they do not meet at a place that slopes, but farther on.
  [[nodiscard]] bool is_round(const Neighbourhood& near, Vec3 normal, Vec3 across) const {
    return is_round(b_.shell, near, normal, across) || is_round(b_.field, near, normal, across);
  }

 private:
  // Whether a body is round where it is cut by the plane of a direction across the contact and the contact's normal.
  // Its own tangent there shows it also where it is steep.
  static bool is_round(const FieldAtPlaces& body, const Neighbourhood& near, Vec3 normal, Vec3 across) {
    const Vec3 out = body.outward_normal(near.at);
    const Vec3 tangent = dot(out, normal) * across - dot(out, across) * normal;
    const float size = length(tangent);
    if (!(size > 0)) return false;
    Places places;
    for (const float way : {0.0F, 1.0F, -1.0F, 0.5F, -0.5F}) {
      places.push(near.at + (way * near.ring / size) * tangent);
    }
    Values v;
    body.penetrations(places, v);
    const float curvature = (2 * v[0] - v[1] - v[2]) / near.ring;
    const float half = (2 * v[0] - v[3] - v[4]) / near.ring;
    return curvature > kFlat && std::abs(curvature / 4 - half) < kBend + 0.25F * half;
  }

  const TouchingBodies& b_;
  const Reach& reach_;
  const float per_ring_;
};

// Distances from both bodies at a place and on the ring around it, and their sum, in rings.
struct Around {
  Values shell, field, gap;
  Around(const Gap& of, const Neighbourhood& near) {
    const Places places = near.centre_and_ring();
    of.shell(places, shell);
    of.field(places, field);
    for (std::size_t i = 0; i < places.count; ++i) gap[i] = shell[i] + field[i];
  }
};

}  // namespace

Slide slide_to_deepest(const TouchingBodies& bodies, const Reach& reach, Contact& contact) noexcept {
  const float ring = reach.ring;
  const Gap gap(bodies, reach);
  const Vec3 start = contact.position;
  const Vec3 normal = contact.inward_normal;
  const auto gap_at = [&](const Places& places, Values& out) {
    Values of_field;
    gap.shell(places, out);
    gap.field(places, of_field);
    for (std::size_t i = 0; i < places.count; ++i) out[i] += of_field[i];
  };
  Neighbourhood near{start, Plane(normal), ring};
  Around here(gap, near);
  const float start_field = here.field[0];
  float off_shell = 0;
  Step step;
  bool is_capped = false;
  bool is_least = false;  // the contact's own place, against the fit
  for (int i = 0;; ++i) {
    const std::array<Along, 2> axes = along_principal_axes(near, here.gap, gap_at);
    step = newton(axes);
    // Fields round edges off. Elsewhere the depth must not depend on the sample.
    const auto is_sharp = [](const Along& along) { return along.curvature > kSharp; };
    if (i == 0 && std::any_of(axes.begin(), axes.end(), is_sharp)) off_shell = here.shell[0];
    if (!is_finite(step.way)) return Slide::stayed;
    if (i == kNewtonSteps || length(step.way) < kMoved) break;
    Vec3 next = near.at + ring * step.way;
    const float whole = length(next - start);
    is_capped = whole > ring;
    if (is_capped) next = start + (ring / whole) * (next - start);
    // Back to the shell's surface.
    for (int k = 0; k < 2; ++k) next = next + ring * (gap.shell(next) - off_shell) * normal;
    if (!(length(next - start) < 2 * ring)) break;
    const Neighbourhood beyond{next, near.plane, ring};
    const Around there(gap, beyond);
    if (!(there.gap[0] <= here.gap[0] + kWorse)) {
      is_least = i == 0;
      break;
    }
    near = beyond;
    here = there;
  }
  bool is_sloping = !is_least && (is_capped || length(step.way) > kLeft);
  for (const Vec3& across : step.slopes) {
    is_sloping = is_sloping || (dot(across, across) > 0 && gap.is_round(near, normal, across));
  }
  if (!(length(near.at - start) > kMoved * ring)) return is_sloping ? Slide::sloping : Slide::stayed;
  const float gain = ring * (start_field - here.field[0]);
  // The shell's own distances are too rough there.
  if (gain < -kWorst_vx * bodies.voxel_size) return Slide::stayed;
  contact.penetration += gain;
  contact.position = near.at;
  const auto field_at = [&](const Places& places, Values& out) { gap.field(places, out); };
  for (const Along& along : along_principal_axes(near, here.field, field_at)) {
    if (!along.smooth || !(std::abs(along.curvature) < kSharp)) continue;
    contact.inward_normal = contact.inward_normal - along.slope * along.axis;
  }
  contact.inward_normal = (1 / length(contact.inward_normal)) * contact.inward_normal;
  return is_sloping ? Slide::sloping : Slide::arrived;
}

bool is_steep(const TouchingBodies& bodies, const Contact& contact) noexcept {
  const Reach reach{1.25F * bodies.voxel_size, nullptr};  // in the band, also where the shell is steep
  const Gap gap(bodies, reach);
  const Neighbourhood near{contact.position, Plane(contact.inward_normal), reach.ring};
  const auto apart = [&](const Places& places, Values& out) { gap.shell(places, out); };
  Values values;
  apart(near.centre_and_ring(), values);
  const auto both = along_principal_axes(near, values, apart);
  return std::any_of(both.begin(), both.end(),
                     [&](const Along& along) { return along.curvature < kSharp && std::abs(along.slope) > kSteep; });
}

}  // namespace vps::detail
