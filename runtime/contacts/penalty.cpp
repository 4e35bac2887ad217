// SPDX-License-Identifier: Zlib
// Penalty force and torque of contacts, and their gradient. Paper: Eqs. (2) and (3), with pressures instead of counts.
#include <array>
#include <cmath>

#include "runtime/fields/penetration.h"
#include "runtime/vps_contacts.h"

namespace vps {
namespace {

using namespace detail;

Status check(const PenaltyLaw& law, const Twist& twist) noexcept {
  const bool good = law.stiffness >= 0 && law.damping >= 0 && std::isfinite(law.stiffness) &&
                    std::isfinite(law.damping) && is_finite(twist.centre) && is_finite(twist.linear) &&
                    is_finite(twist.angular);
  return good ? Status::ok : Status::bad_argument;
}

// Force of one contact.
struct Press {
  Vec3 arm, velocity;
  double force = 0;  // 0: it does not press. [N]
};

Press press(const Contact& contact, const PenaltyLaw& law, const Twist& twist) noexcept {
  Press p;
  p.arm = contact.position - twist.centre;
  p.velocity = twist.linear + cross(twist.angular, p.arm);
  const double pressure = law.stiffness * contact.penetration - law.damping * dot(p.velocity, contact.inward_normal);
  if (contact.penetration >= 0 && pressure > 0) p.force = pressure * contact.area;
  return p;
}

// Force and torque of a unit force along a line. Their product with a motion is its displacement along the line.
std::array<double, 6> line(Vec3 arm, Vec3 along) noexcept {
  const Vec3 moment = cross(arm, along);
  return {along.x, along.y, along.z, moment.x, moment.y, moment.z};
}

}  // namespace

Status penalty_wrench(std::span<const Contact> contacts, const PenaltyLaw& law, const Twist& twist,
                      Wrench& out) noexcept {
  out = {};
  if (const Status status = check(law, twist); status != Status::ok) return status;
  for (const Contact& contact : contacts) {
    const Press p = press(contact, law, twist);
    if (p.force == 0) continue;
    const std::array<double, 6> along = line(p.arm, contact.inward_normal);
    for (std::size_t i = 0; i < 3; ++i) {
      out.force[i] += p.force * along[i];
      out.torque[i] += p.force * along[3 + i];
    }
  }
  return Status::ok;
}

Status penalty_gradient(std::span<const Contact> contacts, std::span<const Vec3> outward_normals, const PenaltyLaw& law,
                        const Twist& twist, WrenchGradient& out) noexcept {
  out = {};
  if (const Status status = check(law, twist); status != Status::ok) return status;
  if (!outward_normals.empty() && outward_normals.size() != contacts.size()) return Status::bad_argument;
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const Press p = press(contacts[c], law, twist);
    if (p.force == 0) continue;
    const Vec3 normal = contacts[c].inward_normal;
    const std::array<double, 6> along = line(p.arm, normal);
    const std::array<double, 6> off = line(p.arm, outward_normals.empty() ? normal : outward_normals[c]);
    // A rotation of the body turns the normal and moves the arm. Both change the speed along the normal.
    const Vec3 turned = cross(normal, p.velocity) + cross(p.arm, cross(normal, twist.angular));
    const double by_turn[6] = {0, 0, 0, turned.x, turned.y, turned.z};
    for (std::size_t column = 0; column < 6; ++column) {
      const double by_pose = contacts[c].area * (-law.stiffness * off[column] - law.damping * by_turn[column]);
      const double by_twist = contacts[c].area * -law.damping * along[column];
      for (std::size_t row = 0; row < 6; ++row) {
        out.pose[6 * row + column] += by_pose * along[row];
        out.twist[6 * row + column] += by_twist * along[row];
      }
    }
    // Force and torque turn with the body: their change is the cross product of the rotation vector and them.
    for (std::size_t half = 0; half < 6; half += 3) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        const std::size_t k = (i + 2) % 3;
        out.pose[6 * (half + j) + 3 + k] += p.force * along[half + i];
        out.pose[6 * (half + k) + 3 + j] -= p.force * along[half + i];
      }
    }
  }
  return Status::ok;
}

}  // namespace vps
