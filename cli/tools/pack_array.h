// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Arrays and triangles in a form that pages take: little-endian bytes as base64.
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

/// The mesh with the vertices of each cell of a grid as one, cells as small as leaves no more than so many triangles;
/// unchanged when it has no more. @param cell  the edge of the cells; 0: unchanged. [m]
[[nodiscard]] TriangleMesh coarsened(TriangleMesh mesh, std::size_t triangles, double& cell);

}  // namespace vps::cli
