// SPDX-License-Identifier: Zlib
// Reduces contacts to few with the same force and torque. Pressures are weighed by areas (Eqs. 2 and 3), so the areas
// of kept contacts can compensate for dropped contacts.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/contacts/six.h"
#include "runtime/fields/penetration.h"
#include "runtime/grow.h"
#include "runtime/vps_contacts.h"

namespace vps {
namespace {

using namespace detail;

// Force and torque of a contact per unit of area.
Six wrench_of(const Contact& contact, Vec3 centre) noexcept {
  const double v = std::max(contact.penetration, 0.0F);
  const Vec3 n = contact.inward_normal;
  const Vec3 moment = cross(contact.position - centre, n);
  return {v * n.x, v * n.y, v * n.z, v * moment.x, v * moment.y, v * moment.z};
}

// Sums over contacts, and the sums of the terms' lengths.
struct Sums {
  Six wrench{};
  double force = 0, torque = 0;

  Sums(std::span<const Contact> contacts, Vec3 centre) noexcept {
    for (const Contact& contact : contacts) {
      const Six w = wrench_of(contact, centre);
      for (std::size_t i = 0; i < 6; ++i) wrench[i] += contact.area * w[i];
      force += contact.area * std::hypot(w[0], w[1], w[2]);
      torque += contact.area * std::hypot(w[3], w[4], w[5]);
    }
  }
};

// Solves the symmetric positive definite a x = b by Cholesky factors. Entries above the diagonal are not read.
Six solve(std::array<Six, 6>& a, Six b) noexcept {
  for (std::size_t j = 0; j < 6; ++j) {
    for (std::size_t k = 0; k < j; ++k) a[j][j] -= a[j][k] * a[j][k];
    a[j][j] = std::sqrt(a[j][j]);
    for (std::size_t i = j + 1; i < 6; ++i) {
      for (std::size_t k = 0; k < j; ++k) a[i][j] -= a[i][k] * a[j][k];
      a[i][j] /= a[j][j];
    }
  }
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (std::size_t i = 6; i-- > 0;) {
    for (std::size_t k = i + 1; k < 6; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
  return b;
}

// Least squares for non-negative areas by the dual problem, which has six unknowns for any number of contacts. The
// areas are a_i max(0, 1 + g_i . y), g_i is the contact's wrench, and y minimizes
//   phi(y) = sum a_i max(0, 1 + g_i . y)^2 / 2 + mu |y|^2 / 2 - wanted . y
// phi is convex and piecewise quadratic, so Newton's steps end. mu weighs the change of areas against the residual.
class Correction {
 public:
  Correction(std::span<Contact> kept, const Sums& wanted, Vec3 centre) noexcept
      : kept_(kept), centre_(centre), length_(wanted.torque > 0 ? wanted.torque / wanted.force : 1) {
    for (const Contact& contact : kept) total_ += contact.area;
    mean_penetration_ = wanted.force / total_;
    for (std::size_t i = 0; i < 6; ++i) wanted_[i] = wanted.wrench[i] / wanted.force / (i < 3 ? 1 : length_);
  }

  void run() noexcept {
    Six best{};
    // mu falls in stages. With the least mu at once, steps would go far beyond the places where contacts become active.
    for (mu_ = 1e-2; mu_ > kLeastMu; mu_ *= 1e-2) {
      Six y = best;
      constexpr int kSteps = 30;
      for (int step = 0; step < kSteps && descend(y); ++step) {
      }
      if (lost(y) < lost(best)) best = y;
    }
    for (Contact& contact : kept_) contact.area *= static_cast<float>(factor(contact, best));
  }

 private:
  static constexpr double kLeastMu = 1e-9;

  // One Newton step; false when phi cannot fall further.
  bool descend(Six& y) const noexcept {
    const Six slope = slope_at(y);
    std::array<Six, 6> curvature = curvature_at(y);
    const Six way = solve(curvature, slope);
    const double fall = dot(slope, way);
    if (!(fall > 1e-20)) return false;
    // phi is convex: it has fallen if it still falls along the step at the step's end.
    constexpr double kOvershoot = 0.1;
    for (double part = 1; part > 1e-9; part /= 2) {
      const Six next = moved(y, way, part);
      if (!(dot(slope_at(next), way) >= -kOvershoot * fall)) continue;
      y = next;
      return true;
    }
    return false;
  }

  static Six moved(const Six& y, const Six& way, double part) noexcept {
    Six out;
    for (std::size_t i = 0; i < 6; ++i) out[i] = y[i] - part * way[i];
    return out;
  }
  // The contact's wrench without units: penetrations over the mean penetration, arms over the mean arm.
  Six scaled(const Contact& contact) const noexcept {
    Six g = wrench_of(contact, centre_);
    for (std::size_t i = 0; i < 6; ++i) g[i] /= mean_penetration_ * (i < 3 ? 1 : length_);
    return g;
  }
  double factor(const Contact& contact, const Six& y) const noexcept {
    return std::max(0.0, 1 + dot(scaled(contact), y));
  }
  // The residual, squared.
  double lost(const Six& y) const noexcept {
    const Six residual = moved(slope_at(y), y, mu_);
    return dot(residual, residual);
  }
  Six slope_at(const Six& y) const noexcept {
    Six slope;
    for (std::size_t i = 0; i < 6; ++i) slope[i] = mu_ * y[i] - wanted_[i];
    for (const Contact& contact : kept_) {
      const Six g = scaled(contact);
      const double weight = contact.area / total_ * factor(contact, y);
      for (std::size_t i = 0; i < 6; ++i) slope[i] += weight * g[i];
    }
    return slope;
  }
  std::array<Six, 6> curvature_at(const Six& y) const noexcept {
    std::array<Six, 6> out{};
    for (std::size_t i = 0; i < 6; ++i) out[i][i] = mu_;
    for (const Contact& contact : kept_) {
      if (factor(contact, y) <= 0) continue;
      const Six g = scaled(contact);
      for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t k = 0; k <= i; ++k) out[i][k] += contact.area / total_ * g[i] * g[k];
      }
    }
    return out;
  }

  const std::span<Contact> kept_;
  const Vec3 centre_;
  const double length_;
  double total_ = 0;
  double mean_penetration_ = 0;
  double mu_ = 1;
  Six wanted_{};
};

// Keeps the deepest contact, then repeatedly the one with the largest product of penetration and squared distance from
// the nearest kept contact. Contacts without penetration carry no force and come last.
std::uint32_t choose(std::span<const Contact> all, std::span<Contact> kept, ReductionScratch& scratch) noexcept {
  std::uint32_t next = 0;
  for (std::uint32_t i = 1; i < all.size(); ++i) {
    if (all[i].penetration > all[next].penetration) next = i;
  }
  const float deepest = all[next].penetration;
  const float least = deepest > 0 ? 1e-3F * deepest : 1;
  std::fill_n(scratch.distances.begin(), all.size(), std::numeric_limits<float>::max());
  std::uint32_t count = 0;
  while (count < kept.size()) {
    kept[count] = all[next];
    float best = 0;
    for (std::uint32_t i = 0; i < all.size(); ++i) {
      const Vec3 apart = all[i].position - kept[count].position;
      const float distance = detail::dot(apart, apart);
      // Written so that a contact with NaN is assigned, too.
      if (!(distance >= scratch.distances[i])) {
        scratch.distances[i] = distance;
        scratch.nearest[i] = count;
      }
      const float score = scratch.distances[i] * (deepest > 0 ? std::max(all[i].penetration, least) : least);
      if (score > best) {
        best = score;
        next = i;
      }
    }
    ++count;
    if (best == 0) break;
  }
  return count;
}

}  // namespace

Status reduce_contacts(std::span<const Contact> all, Vec3 centre, std::span<Contact> kept, ReductionScratch& scratch,
                       Reduction& result) noexcept {
  result = {};
  if (kept.empty() || !is_finite(centre)) return Status::bad_argument;
  if (all.empty()) return Status::ok;
  const auto grow = [&] {
    if (scratch.distances.size() < all.size()) scratch.distances.resize(all.size());
    if (scratch.nearest.size() < all.size()) scratch.nearest.resize(all.size());
  };
  if (const Status status = try_to_grow(grow); status != Status::ok) return status;
  const Sums wanted(all, centre);
  result.kept = choose(all, kept, scratch);
  const std::span<Contact> few = kept.first(result.kept);
  for (Contact& contact : few) contact.area = 0;
  for (std::size_t i = 0; i < all.size(); ++i) few[scratch.nearest[i]].area += all[i].area;
  if (!(wanted.force > 0)) return Status::ok;

  Correction(few, wanted, centre).run();
  const Sums found(few, centre);
  const auto residual = [&](std::size_t from, double scale) {
    const double lost =
        std::hypot(found.wrench[from] - wanted.wrench[from], found.wrench[from + 1] - wanted.wrench[from + 1],
                   found.wrench[from + 2] - wanted.wrench[from + 2]);
    return scale > 0 ? lost / scale : 0;
  };
  result.force_residual = residual(0, wanted.force);
  result.torque_residual = residual(3, wanted.torque);
  return Status::ok;
}

}  // namespace vps
