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
  Plane() = default;
  explicit Plane(Vec3 normal) {
    const Vec3 other = std::abs(normal.x) < 0.6F ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
    u = cross(normal, other);
    u = (1 / length(u)) * u;
    v = cross(normal, u);
  }
};

// The place around which a function is looked up.
struct Neighbourhood {
  Vec3 at;
  Plane plane;
  float ring;  // [m]

  void push_centre_and_ring(Places& places) const {
    places.push(at);
    for (std::size_t i = 0; i < kRing; ++i) places.push(at + ring * (kCosine[i] * plane.u + kSine[i] * plane.v));
  }
};

// Values at the centre and on the ring, or along two axes. [rings]
using Row = std::array<float, kRing + 1>;

// A quadratic in a plane, fitted by least squares to its values at the centre and on the ring.
struct Quadratic {
  float u = 0, v = 0;            // slope
  float uu = 0, uv = 0, vv = 0;  // second derivatives
  float residual = 0;            // root of the sum of squares, on the ring

  explicit Quadratic(const Row& values) {
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
struct Axes {
  std::array<Along, 2> both;
  float centre = 0;
  bool is_parabola = false;  // the quadratic fits

  Axes() = default;
  // @param values  at the centre and on the ring
  Axes(const Neighbourhood& near, const Row& values) : centre(values[0]) {
    const Quadratic q(values);
    is_parabola = q.residual <= kEdge;
    // Half of the angle of (d, uv).
    const float d = (q.uu - q.vv) / 2;
    const float size = std::sqrt(d * d + q.uv * q.uv);
    float cosine = 1;
    float sine = 0;
    if (size > 0) {
      const float larger = std::sqrt((1 + std::abs(d) / size) / 2);
      const float smaller = std::abs(q.uv) / (2 * size * larger);
      cosine = d < 0 ? smaller : larger;
      sine = std::copysign(d < 0 ? larger : smaller, q.uv);
    }
    const float axes[2][2] = {{cosine, sine}, {-sine, cosine}};
    for (std::size_t i = 0; i < 2; ++i) {
      const auto [u, v] = axes[i];
      both[i].axis = u * near.plane.u + v * near.plane.v;
      both[i].slope = q.u * u + q.v * v;
      both[i].curvature = q.uu * u * u + 2 * q.uv * u * v + q.vv * v * v;
    }
  }

  static constexpr std::size_t kPlaces = 8;
  void push_places(const Neighbourhood& near, Places& places) const {
    for (const Along& a : both) {
      for (const float way : {1.0F, -1.0F, 0.5F, -0.5F}) places.push(near.at + way * near.ring * a.axis);
    }
  }
  // @param along  values at these places
  void finish(const float* along) {
    for (std::size_t i = 0; i < 2; ++i) {
      Along& a = both[i];
      const float* const at = along + 4 * i;
      // An edge that the ring crosses along one axis spoils the fit along the other.
      if (!is_parabola) {
        a.slope = (at[0] - at[1]) / 2;
        a.curvature = at[0] + at[1] - 2 * centre;
      }
      // An edge between half the ring and the ring changes the slope.
      const float half = at[2] - at[3];
      a.smooth = std::abs(a.slope - half) < kBend + 0.25F * std::abs(half);
      if (!a.smooth) a.slope = half;
    }
  }
};

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

// Whether a body is round where it is cut by the plane of a direction across the contact and the contact's normal.
// Its own tangent there shows it also where it is steep.
bool is_round(const FieldAtPlaces& body, const Neighbourhood& near, Vec3 normal, Vec3 across) {
  const Vec3 out = body.outward_normal(near.at);
  const Vec3 tangent = dot(out, normal) * across - dot(out, across) * normal;
  const float size = length(tangent);
  if (!(size > 0)) return false;
  Places places;
  for (const float way : {0.0F, 1.0F, -1.0F, 0.5F, -0.5F}) places.push(near.at + (way * near.ring / size) * tangent);
  Values v;
  body.penetrations(places, v);
  const float curvature = (2 * v[0] - v[1] - v[2]) / near.ring;
  const float half = (2 * v[0] - v[3] - v[4]) / near.ring;
  return curvature > kFlat && std::abs(curvature / 4 - half) < kBend + 0.25F * half;
}

// A place, and the distances from both bodies around it. [rings]
struct Around {
  Neighbourhood near;
  Row shell, field, gap;  // gap: the sum of both
};

// A contact on its way.
struct Way {
  Slider* slider;
  Vec3 start, normal;
  Around here, beyond;  // where it is, and where the next step leads
  float start_field, off_shell;
  Step step;
  bool is_capped, is_least;  // least: the contact's own place, against the fit
};

// Ways that are looked up together: the same number of places for each, in their order.
class Group {
 public:
  static constexpr std::size_t kMost = Places::kMost / (kRing + 1);

  explicit Group(const TouchingBodies& bodies) : b_(&bodies) {}
  void push(Way& way) { ways_[count_++] = &way; }
  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] Way* const* begin() const { return ways_.data(); }
  [[nodiscard]] Way* const* end() const { return ways_.data() + count_; }

  // Distances of the places from the shell's body. [rings]
  void shell(const Places& places, Values& out) const {
    b_->shell.penetrations(places, out);
    float* v = out.data();
    for (const Way* const way : *this) {
      const float scale = -1 / way->slider->reach.ring;
      for (float* const last = v + places.count / count_; v < last; ++v) *v *= scale;
    }
  }
  // From the other body; for a contact ahead, from the plane where it arrives. [rings]
  void field(const Places& places, Values& out) const {
    const auto is_ahead = [](const Way* way) { return way->slider->reach.arrival != nullptr; };
    if (!std::all_of(begin(), end(), is_ahead)) b_->field.penetrations(places, out);
    std::size_t i = 0;
    for (const Way* const way : *this) {
      const auto& [ring, plane] = way->slider->reach;
      for (const std::size_t last = i + places.count / count_; i < last; ++i) {
        out[i] = (plane == nullptr ? -out[i] : dot(plane->outward_normal, places[i]) - plane->offset) / ring;
      }
    }
  }

  // Fills one of the ways' surroundings.
  void look_around(Around Way::*where) const {
    Places places;
    for (const Way* const way : *this) (way->*where).near.push_centre_and_ring(places);
    Values of_shell;
    Values of_field;
    shell(places, of_shell);
    field(places, of_field);
    std::size_t from = 0;
    for (Way* const way : *this) {
      Around& around = way->*where;
      for (std::size_t i = 0; i <= kRing; ++i, ++from) {
        around.shell[i] = of_shell[from];
        around.field[i] = of_field[from];
        around.gap[i] = of_shell[from] + of_field[from];
      }
    }
  }

 private:
  const TouchingBodies* b_;
  std::array<Way*, kMost> ways_{};
  std::size_t count_ = 0;
};

using AxesOfAll = std::array<Axes, Group::kMost>;

// @param of       what is known around the ways
// @param look_up  writes the same at places. [rings]
template <class LookUp>
AxesOfAll principal_axes(const Group& ways, Row Around::*of, const LookUp& look_up) {
  AxesOfAll all;
  Places places;
  std::size_t i = 0;
  for (const Way* const way : ways) {
    all[i] = Axes(way->here.near, way->here.*of);
    all[i++].push_places(way->here.near, places);
  }
  Values values;
  look_up(places, values);
  for (std::size_t k = 0; k < i; ++k) all[k].finish(values.data() + k * Axes::kPlaces);
  return all;
}

// Finds the step of each way. @return the ways whose step is worth taking
Group find_steps(const TouchingBodies& bodies, const Group& ways, bool is_first) {
  const AxesOfAll axes = principal_axes(ways, &Around::gap, [&](const Places& places, Values& out) {
    Values of_field;
    ways.shell(places, out);
    ways.field(places, of_field);
    for (std::uint32_t i = 0; i < places.count; ++i) out[i] += of_field[i];
  });
  Group going(bodies);
  std::size_t i = 0;
  for (Way* const way : ways) {
    const std::array<Along, 2>& both = axes[i++].both;
    way->step = newton(both);
    // Fields round edges off. Elsewhere the depth must not depend on the sample.
    const auto is_sharp = [](const Along& along) { return along.curvature > kSharp; };
    if (is_first && std::any_of(both.begin(), both.end(), is_sharp)) way->off_shell = way->here.shell[0];
    if (length(way->step.way) >= kMoved) going.push(*way);
  }
  return going;
}

// Takes the steps. @return the ways on which the gap did not grow
Group take_steps(const TouchingBodies& bodies, const Group& ways, bool is_first) {
  for (Way* const way : ways) {
    const Neighbourhood& from = way->here.near;
    Vec3 next = from.at + from.ring * way->step.way;
    const float whole = length(next - way->start);
    way->is_capped = whole > from.ring;
    if (way->is_capped) next = way->start + (from.ring / whole) * (next - way->start);
    way->beyond.near = {next, from.plane, from.ring};
  }
  // Back to the shell's surface.
  for (int k = 0; k < 2; ++k) {
    Places places;
    for (const Way* const way : ways) places.push(way->beyond.near.at);
    Values apart;
    ways.shell(places, apart);
    std::size_t i = 0;
    for (Way* const way : ways) {
      Neighbourhood& near = way->beyond.near;
      near.at = near.at + near.ring * (apart[i++] - way->off_shell) * way->normal;
    }
  }
  Group near(bodies);
  for (Way* const way : ways) {
    if (length(way->beyond.near.at - way->start) < 2 * way->beyond.near.ring) near.push(*way);
  }
  if (near.empty()) return near;
  near.look_around(&Way::beyond);
  Group going(bodies);
  for (Way* const way : near) {
    if (way->beyond.gap[0] <= way->here.gap[0] + kWorse) {
      way->here = way->beyond;
      going.push(*way);
    } else {
      way->is_least = is_first;
    }
  }
  return going;
}

// Sets the results of the ways.
void arrive(const TouchingBodies& bodies, const Group& ways) {
  Group moved(bodies);
  for (Way* const way : ways) {
    const Neighbourhood& near = way->here.near;
    Slide& slide = *way->slider->slide;
    slide = Slide::stayed;
    if (!is_finite(way->step.way)) continue;
    bool is_sloping = !way->is_least && (way->is_capped || length(way->step.way) > kLeft);
    // Where one of the bodies is round, they do not meet at a place that slopes, but farther on.
    for (const Vec3& across : way->step.slopes) {
      is_sloping = is_sloping || (dot(across, across) > 0 && (is_round(bodies.shell, near, way->normal, across) ||
                                                              is_round(bodies.field, near, way->normal, across)));
    }
    if (!(length(near.at - way->start) > kMoved * near.ring)) {
      if (is_sloping) slide = Slide::sloping;
      continue;
    }
    const float gain = near.ring * (way->start_field - way->here.field[0]);
    // The shell's own distances are too rough there.
    if (gain < -kWorst_vx * bodies.voxel_size) continue;
    slide = is_sloping ? Slide::sloping : Slide::arrived;
    way->slider->contact->penetration += gain;
    way->slider->contact->position = near.at;
    moved.push(*way);
  }
  if (moved.empty()) return;
  const AxesOfAll axes =
      principal_axes(moved, &Around::field, [&](const Places& places, Values& out) { moved.field(places, out); });
  std::size_t i = 0;
  for (const Way* const way : moved) {
    Vec3& normal = way->slider->contact->inward_normal;
    for (const Along& along : axes[i++].both) {
      if (along.smooth && std::abs(along.curvature) < kSharp) normal = normal - along.slope * along.axis;
    }
    normal = (1 / length(normal)) * normal;
  }
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
      way.here.near = {way.start, Plane(way.normal), some[i].reach.ring};
      way.off_shell = 0;
      way.is_capped = way.is_least = false;
      all.push(way);
    }
    all.look_around(&Way::here);
    for (Way* const way : all) way->start_field = way->here.field[0];
    Group going = find_steps(bodies, all, true);
    for (int i = 0; i < kNewtonSteps && !going.empty(); ++i) {
      going = take_steps(bodies, going, i == 0);
      if (!going.empty()) going = find_steps(bodies, going, false);
    }
    arrive(bodies, all);
  }
}

bool is_steep(const TouchingBodies& bodies, const Contact& contact) noexcept {
  // In the band, also where the shell is steep.
  const Neighbourhood near{contact.position, Plane(contact.inward_normal), 1.25F * bodies.voxel_size};
  const auto look_up = [&](const Places& places, Values& out) {
    bodies.shell.penetrations(places, out);
    for (std::uint32_t i = 0; i < places.count; ++i) out[i] /= -near.ring;
  };
  Places around;
  near.push_centre_and_ring(around);
  Values values;
  look_up(around, values);
  Row row;
  std::copy_n(values.begin(), row.size(), row.begin());
  Axes axes(near, row);
  Places places;
  axes.push_places(near, places);
  look_up(places, values);
  axes.finish(values.data());
  return std::any_of(axes.both.begin(), axes.both.end(),
                     [](const Along& along) { return along.curvature < kSharp && std::abs(along.slope) > kSteep; });
}

}  // namespace vps::detail
