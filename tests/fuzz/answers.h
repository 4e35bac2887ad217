// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What every answer with the status ok has to be, however strange the asset is.
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>

#include "runtime/vps_queries.h"

namespace vps::test {

/// An answer that no program can use. `what()` names it.
struct WrongAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline void expect(bool sound, const char* name) {
  if (!sound) throw WrongAnswer(std::string(name) + " is no number, or infinite");
}
template <class... Numbers>
void expect_finite(const char* name, const Numbers&... numbers) {
  expect((std::isfinite(numbers) && ...), name);
}
inline void expect_finite(const char* name, Vec3 v) {
  expect_finite(name, v.x, v.y, v.z);
}
/// A direction is of unit length, or zero where there is none.
inline void expect_direction(const char* name, Vec3 n) {
  expect_finite(name, n);
  const double size = std::hypot(n.x, n.y, n.z);
  if (size != 0 && std::abs(size - 1) > 1e-3) throw WrongAnswer(std::string(name) + " is not of unit length");
}
inline void expect_contact(const Contact& contact) {
  expect_finite("a contact's place", contact.position);
  expect_finite("a contact's normal", contact.inward_normal);
  expect_finite("a contact", contact.penetration, contact.area);
}
inline void expect_result(const QueryResult& r) {
  expect_finite("delta", r.delta, r.delta_bound);
  expect_finite("the force", r.force[0], r.force[1], r.force[2]);
  expect_finite("the torque", r.torque[0], r.torque[1], r.torque[2]);
}
inline void expect_separation(const SeparationResult& r) {
  expect_finite("a separation", r.delta, r.delta_bound, r.upper);
  // There is no lower bound of a polytope's V where only its planes are known.
  expect(!std::isnan(r.lower), "the lower bound of a separation");
  expect_finite("a separation's place", r.position);
  expect_direction("a separation's direction", r.direction);
}

}  // namespace vps::test
