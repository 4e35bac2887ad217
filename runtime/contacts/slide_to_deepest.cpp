// SPDX-License-Identifier: Zlib
// Newton steps on the gap between two bodies, fitted on a ring.
#include "runtime/contacts/slide_to_deepest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>

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
constexpr float kOff = 0.05F;  // from the shell's surface, at the end of a step
constexpr int kNewtonSteps = 2;

// The place around which a function is looked up.
struct Neighbourhood {
  Vec3 at;
  Tangents plane;
  float ring;  // [m]

  void push_ring(Places& places) const {
    for (std::size_t i = 0; i < kRing; ++i) places.push(at + ring * (kCosine[i] * plane.u + kSine[i] * plane.v));
  }
};

// Two directions across each other in the plane.
using Axes = std::array<Vec3, 2>;

// Values at the centre and along two axes: at a ring and at half a ring, to both sides. [rings]
struct Cross {
  static constexpr std::size_t kPlaces = 9;
  float centre;
  float at[2][4];  // 1, -1, 1/2, -1/2

  static void push(const Neighbourhood& near, const Axes& axes, Places& places) {
    places.push(near.at);
    for (const Vec3& axis : axes) {
      for (const float way : {1.0F, -1.0F, 0.5F, -0.5F}) places.push(near.at + way * near.ring * axis);
    }
  }
  // How much the function grows to a place on an axis: by a parabola through the values on that side.
  [[nodiscard]] float growth(std::size_t axis, float to) const {
    const float* const side = at[axis] + (to < 0 ? 1 : 0);
    const float whole = side[0] - centre;
    const float half = side[2] - centre;
    const float t = std::abs(to);
    return t * (4 * half - whole + 2 * t * (whole - 2 * half));
  }
};

// A function on the ring, fitted by least squares up to the second harmonic, and the axes of its curvature.
struct RingFit {
  Axes axes;
  float mean = 0;
  float slope[2];            // along the axes
  float spread;              // of the curvatures along the axes
  bool is_parabola = false;  // the fit holds

  RingFit() = default;
  // @param ring  values. [rings]
  RingFit(const Tangents& plane, const float* ring) {
    // The harmonics of eight values, from sums and differences of opposite ones.
    float even[kRing / 2];
    float odd[kRing / 2];
    for (std::size_t i = 0; i < kRing / 2; ++i) {
      even[i] = ring[i] + ring[i + kRing / 2];
      odd[i] = ring[i] - ring[i + kRing / 2];
    }
    const float along_u = kHalf * (odd[1] - odd[3]);
    const float along_v = kHalf * (odd[1] + odd[3]);
    const float crosswise = even[0] + even[2];
    const float diagonal = even[1] + even[3];
    mean = (crosswise + diagonal) / kRing;
    const float u = (odd[0] + along_u) / 4;
    const float v = (odd[2] + along_v) / 4;
    const float cosine2 = even[0] - even[2];
    const float sine2 = even[1] - even[3];
    // What the fit leaves: the third and the fourth.
    const float cosine3 = (odd[0] - along_u) / 4;
    const float sine3 = (along_v - odd[2]) / 4;
    const float cosine4 = (crosswise - diagonal) / kRing;
    const float squares = 4 * (cosine3 * cosine3 + sine3 * sine3) + kRing * cosine4 * cosine4;
    is_parabola = squares <= kEdge * kEdge;
    // Half of the angle of (cosine2, sine2).
    spread = std::sqrt(cosine2 * cosine2 + sine2 * sine2);
    float cosine = 1;
    float sine = 0;
    if (spread > 0) {
      const float larger = std::sqrt((1 + std::abs(cosine2) / spread) / 2);
      const float smaller = std::abs(sine2) / (2 * spread * larger);
      cosine = cosine2 < 0 ? smaller : larger;
      sine = std::copysign(cosine2 < 0 ? larger : smaller, sine2);
    }
    axes = {cosine * plane.u + sine * plane.v, cosine * plane.v - sine * plane.u};
    slope[0] = u * cosine + v * sine;
    slope[1] = v * cosine - u * sine;
  }
};

// A function along one axis.
struct Along {
  float slope = 0, curvature = 0;
  bool smooth = false;
};
using AlongBoth = std::array<Along, 2>;

// @param fit  averages more values than the cross, and is used where it holds; null: none
AlongBoth along(const Cross& cross, const RingFit* fit) {
  const bool has_fit = fit != nullptr && fit->is_parabola;
  AlongBoth both;
  for (std::size_t i = 0; i < both.size(); ++i) {
    const float* const at = cross.at[i];
    Along& a = both[i];
    if (has_fit) {
      a.slope = fit->slope[i];
      a.curvature = 2 * (fit->mean - cross.centre) + (i == 0 ? 0.5F : -0.5F) * fit->spread;
    } else {
      a.slope = (at[0] - at[1]) / 2;
      a.curvature = at[0] + at[1] - 2 * cross.centre;
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
  float way[2] = {};    // along the axes. [rings]
  bool slopes[2] = {};  // whether the gap has a slope along the other axes

  [[nodiscard]] float length() const { return std::sqrt(way[0] * way[0] + way[1] * way[1]); }
};

Step newton(const AlongBoth& gap) {
  Step step;
  for (std::size_t i = 0; i < gap.size(); ++i) {
    const Along& one = gap[i];
    if (one.curvature > kSharp) continue;
    const bool is_parabola = one.smooth && one.curvature > 0;
    if ((!is_parabola || one.curvature < kFlat) && std::abs(one.slope) > kSlope) step.slopes[i] = true;
    if (!is_parabola) continue;
    const float flat = (kFlat / one.curvature) * (kFlat / one.curvature);
    step.way[i] = -one.slope / (one.curvature * (1 + flat * flat));
  }
  return step;
}

// Whether a body is round where it is cut by the plane of one of the axes and the contact's normal. Its own tangent
// there shows it also where it is steep.
// @param out       of the body: 1 along the normal, or -1
// @param distance  from the body, at the place and along the axes
bool is_round(const FieldAtPlaces& body, const Neighbourhood& near, Vec3 normal, float out, const Axes& axes,
              const Cross& distance, std::size_t axis) {
  const auto slope = [&](std::size_t i) { return distance.at[i][2] - distance.at[i][3]; };
  const float up = 1 - slope(0) * slope(0) - slope(1) * slope(1);
  if (!(up > 0)) return false;
  const Vec3 tangent = std::sqrt(up) * axes[axis] - out * slope(axis) * normal;
  const float size = length(tangent);
  Places places;
  for (const float way : {0.0F, 1.0F, -1.0F, 0.5F, -0.5F}) places.push(near.at + (way * near.ring / size) * tangent);
  Values v;
  body.penetrations(places, v);
  const float curvature = (2 * v[0] - v[1] - v[2]) / near.ring;
  const float half = (2 * v[0] - v[3] - v[4]) / near.ring;
  return curvature > kFlat && std::abs(curvature / 4 - half) < kBend + 0.25F * half;
}

// A place, and the distances from both bodies there and along the axes. The gap is their sum.
struct Around {
  Neighbourhood near;
  Cross shell, field;

  [[nodiscard]] float gap() const { return shell.centre + field.centre; }
  [[nodiscard]] Cross gaps() const {
    Cross sum{gap(), {}};
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::size_t k = 0; k < 4; ++k) sum.at[i][k] = shell.at[i][k] + field.at[i][k];
    }
    return sum;
  }
};

// A contact on its way.
struct Way {
  Slider* slider;
  Vec3 start, normal;
  RingFit fit;          // of the gap at the start
  Around here, beyond;  // where it is, and where the next step leads
  float start_field, off_shell;
  Step step;
  bool is_capped, is_least;  // least: the contact's own place, against the fit

  // By how much a place is too far from the shell's body. Along the normal the gap does not change.
  [[nodiscard]] float too_far(const Around& place) const { return place.shell.centre - off_shell; }
};

// Ways that are looked up together: the same number of places for each, in their order.
class Group {
 public:
  static constexpr std::size_t kMost = Places::kMost / Cross::kPlaces;

  explicit Group(const TouchingBodies& bodies) : b_(&bodies) {}
  void push(Way& way) { ways_[count_++] = &way; }
  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] Way* const* begin() const { return ways_.data(); }
  [[nodiscard]] Way* const* end() const { return ways_.data() + count_; }

  // Fits the gap on the ring of each way.
  void fit_rings() const {
    Places places;
    for (const Way* const way : *this) way->here.near.push_ring(places);
    Values gap;
    Values of_field;
    distances(places, gap, of_field);
    for (std::uint32_t i = 0; i < places.count; ++i) gap[i] += of_field[i];
    const float* ring = gap.data();
    for (Way* const way : *this) {
      way->fit = RingFit(way->here.near.plane, ring);
      ring += kRing;
    }
  }

  // Looks along the axes at one of the ways' places.
  void look_around(Around Way::*where) const {
    Places places;
    for (const Way* const way : *this) Cross::push((way->*where).near, way->fit.axes, places);
    Values of_shell;
    Values of_field;
    distances(places, of_shell, of_field);
    static_assert(sizeof(Cross) == Cross::kPlaces * sizeof(float));
    std::size_t from = 0;
    for (Way* const way : *this) {
      std::memcpy(&(way->*where).shell, &of_shell[from], sizeof(Cross));
      std::memcpy(&(way->*where).field, &of_field[from], sizeof(Cross));
      from += Cross::kPlaces;
    }
  }

 private:
  // Distances of the places from both bodies; from the plane where a contact ahead arrives. [rings]
  void distances(const Places& places, Values& of_shell, Values& of_field) const {
    const auto is_ahead = [](const Way* way) { return way->slider->reach.arrival != nullptr; };
    if (std::all_of(begin(), end(), is_ahead)) {
      b_->shell.penetrations(places, of_shell);
    } else {
      b_->field.penetrations_beside(b_->shell, places, of_field, of_shell);
    }
    std::size_t i = 0;
    for (const Way* const way : *this) {
      const auto& [ring, plane] = way->slider->reach;
      const float scale = -1 / ring;
      for (const std::size_t last = i + places.count / count_; i < last; ++i) {
        of_shell[i] *= scale;
        of_field[i] = (plane == nullptr ? -of_field[i] : dot(plane->outward_normal, places[i]) - plane->offset) / ring;
      }
    }
  }

  const TouchingBodies* b_;
  std::array<Way*, kMost> ways_{};
  std::size_t count_ = 0;
};

// Finds the step of each way. @return the ways whose step is worth taking
Group find_steps(const TouchingBodies& bodies, const Group& ways, bool is_first) {
  Group going(bodies);
  for (Way* const way : ways) {
    const AlongBoth gap = along(way->here.gaps(), is_first ? &way->fit : nullptr);
    way->step = newton(gap);
    // Fields round edges off. Elsewhere the depth must not depend on the sample.
    const auto is_sharp = [](const Along& along) { return along.curvature > kSharp; };
    if (is_first && std::any_of(gap.begin(), gap.end(), is_sharp)) way->off_shell = way->here.shell.centre;
    if (way->step.length() >= kMoved) going.push(*way);
  }
  return going;
}

// Where a step leads: along the axes, at most a ring from the start, and back to the shell's surface.
Vec3 end_of_step(Way& way) {
  const auto& [at, plane, ring] = way.here.near;
  const Axes& axes = way.fit.axes;
  Vec3 to = at + ring * (way.step.way[0] * axes[0] + way.step.way[1] * axes[1]);
  const float whole = length(to - way.start);
  way.is_capped = whole > ring;
  if (way.is_capped) to = way.start + (ring / whole) * (to - way.start);
  float too_far = way.too_far(way.here);
  for (std::size_t i = 0; i < axes.size(); ++i) too_far += way.here.shell.growth(i, dot(to - at, axes[i]) / ring);
  return to + ring * too_far * way.normal;
}

// Takes the steps. @return the ways on which the gap did not grow
Group take_steps(const TouchingBodies& bodies, const Group& ways, bool is_first) {
  Group near(bodies);
  for (Way* const way : ways) {
    way->beyond.near = way->here.near;
    way->beyond.near.at = end_of_step(*way);
    if (length(way->beyond.near.at - way->start) < 2 * way->beyond.near.ring) near.push(*way);
  }
  if (near.empty()) return near;
  near.look_around(&Way::beyond);
  const auto is_off = [](const Way& way) { return !(std::abs(way.too_far(way.beyond)) <= kOff); };
  Group again(bodies);
  for (Way* const way : near) {
    if (!is_off(*way)) continue;
    Neighbourhood& beyond = way->beyond.near;
    beyond.at = beyond.at + beyond.ring * way->too_far(way->beyond) * way->normal;
    again.push(*way);
  }
  if (!again.empty()) again.look_around(&Way::beyond);
  Group going(bodies);
  for (Way* const way : near) {
    if (way->beyond.gap() <= way->here.gap() + kWorse && !is_off(*way)) {
      way->here = way->beyond;
      going.push(*way);
    } else {
      way->is_least = is_first;
    }
  }
  return going;
}

// Sets the result of a way.
void arrive(const TouchingBodies& bodies, const Way& way) {
  const Neighbourhood& near = way.here.near;
  Slide& slide = *way.slider->slide;
  slide = Slide::stayed;
  if (!std::isfinite(way.step.length())) return;
  bool is_sloping = !way.is_least && (way.is_capped || way.step.length() > kLeft);
  // Where one of the bodies is round, they do not meet at a place that slopes, but farther on.
  const Axes& axes = way.fit.axes;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    is_sloping =
        is_sloping || (way.step.slopes[i] && (is_round(bodies.shell, near, way.normal, -1, axes, way.here.shell, i) ||
                                              is_round(bodies.field, near, way.normal, 1, axes, way.here.field, i)));
  }
  if (!(length(near.at - way.start) > kMoved * near.ring)) {
    if (is_sloping) slide = Slide::sloping;
    return;
  }
  const float gain = near.ring * (way.start_field - (way.here.gap() - way.off_shell));
  // The shell's own distances are too rough there.
  if (gain < -kWorst_vx * bodies.voxel_size) return;
  slide = is_sloping ? Slide::sloping : Slide::arrived;
  Contact& contact = *way.slider->contact;
  contact.penetration += gain;
  contact.position = near.at + near.ring * way.too_far(way.here) * way.normal;
  const AlongBoth field = along(way.here.field, nullptr);
  for (std::size_t i = 0; i < field.size(); ++i) {
    if (!field[i].smooth || std::abs(field[i].curvature) >= kSharp) continue;
    contact.inward_normal = contact.inward_normal - field[i].slope * way.fit.axes[i];
  }
  contact.inward_normal = (1 / length(contact.inward_normal)) * contact.inward_normal;
}

}  // namespace

void slide_to_deepest(const TouchingBodies& bodies, std::span<Slider> sliders) noexcept {
  while (!sliders.empty()) {
    const std::span<Slider> some = sliders.first(std::min(sliders.size(), Group::kMost));
    sliders = sliders.subspan(some.size());
    std::array<Way, Group::kMost> ways;
    Group all(bodies);
    for (std::size_t i = 0; i < some.size(); ++i) {
      Way& way = ways[i];
      way.slider = &some[i];
      way.start = some[i].contact->position;
      way.normal = some[i].contact->inward_normal;
      way.here.near = {way.start, Tangents(way.normal), some[i].reach.ring};
      way.off_shell = 0;
      way.is_capped = way.is_least = false;
      all.push(way);
    }
    all.fit_rings();
    all.look_around(&Way::here);
    for (Way* const way : all) way->start_field = way->here.field.centre;
    Group going = find_steps(bodies, all, true);
    for (int i = 0; i < kNewtonSteps && !going.empty(); ++i) {
      going = take_steps(bodies, going, i == 0);
      if (!going.empty()) going = find_steps(bodies, going, false);
    }
    for (const Way* const way : all) arrive(bodies, *way);
  }
}

bool is_steep(const TouchingBodies& bodies, const Contact& contact) noexcept {
  // In the band, also where the shell is steep.
  const Neighbourhood near{contact.position, Tangents(contact.inward_normal), 1.25F * bodies.voxel_size};
  const auto look_up = [&](const Places& places, Values& out) {
    bodies.shell.penetrations(places, out);
    for (std::uint32_t i = 0; i < places.count; ++i) out[i] /= -near.ring;
  };
  Values values;
  Places ring;
  near.push_ring(ring);
  look_up(ring, values);
  const RingFit fit(near.plane, values.data());
  Places places;
  Cross::push(near, fit.axes, places);
  look_up(places, values);
  Cross cross;
  std::memcpy(&cross, values.data(), sizeof(cross));
  const AlongBoth both = along(cross, &fit);
  return std::any_of(both.begin(), both.end(),
                     [](const Along& one) { return one.curvature < kSharp && std::abs(one.slope) > kSteep; });
}

}  // namespace vps::detail
