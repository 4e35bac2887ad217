// SPDX-License-Identifier: Zlib
/// @file Contacts with what each is recognised by from step to step. Internal.
#pragma once

#include <span>

#include "runtime/vps_runtime.h"

namespace vps::bullet {

/// A contact as a manifold keeps it.
struct ManifoldContact : Contact {
  /// The same number for the same contact from step to step: the point of the shell, or a corner of a triangle (see
  /// corner_feature).
  std::uint32_t feature = 0;
};

/// Features of contacts that a query has found. Those of fields are points of the shell and are not listed.
/// @param features  in the order of `contacts`, or empty
inline std::uint32_t feature_of(std::span<const Contact> contacts, std::span<const std::uint32_t> features,
                                std::size_t i) {
  return features.empty() ? contacts[i].point : features[i];
}

/// Numbers beyond the shell's points are corners of triangles.
/// @param triangle  Triangle::id
/// @param corner    [Limits: value < 3]
inline std::uint32_t corner_feature(const PointshellView& shell, std::uint32_t triangle, unsigned corner) {
  return shell.points + (3 * triangle + corner) % 0x7F000000U;
}

}  // namespace vps::bullet
