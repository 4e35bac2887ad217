// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Closed meshes of analytic shapes, generated in memory.
#pragma once

#include "sample_meshes/shapes.h"

namespace vps::test {

using samples::make_box;
using samples::make_sphere;
using samples::make_torus;
using samples::make_wheel;

/// `outer` with a cavity: `inner` with its triangles reversed.
inline TriangleMesh with_cavity(TriangleMesh outer, const TriangleMesh& inner) {
  const auto base = static_cast<std::uint32_t>(outer.vertices.size());
  outer.vertices.insert(outer.vertices.end(), inner.vertices.begin(), inner.vertices.end());
  for (const auto& [a, b, c] : inner.triangles) outer.triangles.push_back({base + a, base + c, base + b});
  return outer;
}

/// Both meshes in one.
inline TriangleMesh joined(TriangleMesh first, const TriangleMesh& second) {
  const auto base = static_cast<std::uint32_t>(first.vertices.size());
  first.vertices.insert(first.vertices.end(), second.vertices.begin(), second.vertices.end());
  for (const auto& [a, b, c] : second.triangles) first.triangles.push_back({base + a, base + b, base + c});
  return first;
}

}  // namespace vps::test
