// SPDX-License-Identifier: Zlib
/// @file Contacts with a number that identifies them from step to step. Internal.
#pragma once

#include <span>

#include "runtime/vps_runtime.h"

namespace vps::detail {

/// A contact as a manifold keeps it.
struct ManifoldContact : Contact {
  /// The same number for the same contact from step to step: the point of the shell, or a corner of a triangle (see
  /// corner_feature).
  std::uint32_t feature = 0;
  int slot = 0;  ///< of the manifold, see Manifolds
};

/// Feature of contact `i` of a query.
/// @param features  in the order of `contacts`; empty for contacts with fields, whose feature is the shell's point
inline std::uint32_t feature_of(std::span<const Contact> contacts, std::span<const std::uint32_t> features,
                                std::size_t i) {
  return features.empty() ? contacts[i].point : features[i];
}

/// Feature of a triangle's corner: a number beyond those of the shell's points.
/// @param triangle  Triangle::id
/// @param corner    [Limits: value < 3]
inline std::uint32_t corner_feature(const PointshellView& shell, std::uint32_t triangle, unsigned corner) {
  return shell.points + (3 * triangle + corner) % 0x7F000000U;
}

}  // namespace vps::detail
