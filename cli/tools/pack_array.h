// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Arrays and triangles for pages: little-endian bytes as base64.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "formats/triangle_mesh.h"

namespace vps::cli {

[[nodiscard]] std::string base64(std::span<const std::byte> bytes);

template <class Number>
[[nodiscard]] std::string pack_array(const std::vector<Number>& numbers) {
  return base64(std::as_bytes(std::span(numbers)));
}

/// `origin`, `step` [m], `positions` (u16 codes: x, y, z of each vertex) and `triangles` (u32).
[[nodiscard]] nlohmann::ordered_json pack_mesh(const TriangleMesh& mesh);

/// Merges the vertices in each cell of a grid, whose cells grow until at most `triangles` triangles are left. A mesh
/// with no more is returned unchanged. @param cell  receives the edge of the cells; 0: unchanged. [m]
[[nodiscard]] TriangleMesh coarsened(TriangleMesh mesh, std::size_t triangles, double& cell);

}  // namespace vps::cli
