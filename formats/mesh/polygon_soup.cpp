// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh/polygon_soup.h"

#include <algorithm>
#include <span>

#include "formats/mesh/triangulate.h"

namespace vps {
namespace {

void add_polygon(std::span<const std::size_t> polygon, RawMesh& out) {
  if (polygon.size() < 3) {
    ++out.skipped_primitives;
    return;
  }
  for (const std::size_t index : polygon) {
    if (index >= out.vertices.size()) throw ReadError("a face refers to a vertex that is not there");
  }
  const auto number = [&](std::size_t corner) { return static_cast<std::uint32_t>(polygon[corner]); };
  if (polygon.size() == 3) {
    out.triangles.push_back({number(0), number(1), number(2)});
    return;
  }
  std::vector<std::array<double, 3>> corners;
  corners.reserve(polygon.size());
  for (const std::size_t index : polygon) corners.push_back(out.vertices[index]);
  for (const auto& [a, b, c] : triangulate_polygon(corners)) {
    out.triangles.push_back({number(a), number(b), number(c)});
  }
}

}  // namespace

std::size_t PolygonSoup::most_corners() const {
  std::size_t most = 0, begin = 0;
  for (const std::size_t end : ends) {
    most = std::max(most, end - begin);
    begin = end;
  }
  return most;
}

RawMesh to_raw_mesh(PolygonSoup&& soup) {
  constexpr std::size_t kMaxVertices = 0xFFFFFFFF;
  if (soup.vertices.size() > kMaxVertices) throw ReadError("more than 2^32 vertices");
  RawMesh raw;
  raw.vertices = std::move(soup.vertices);
  raw.skipped_primitives = soup.skipped_primitives;
  raw.triangles.reserve(soup.ends.size());
  std::size_t begin = 0;
  for (const std::size_t end : soup.ends) {
    add_polygon(std::span(soup.corners).subspan(begin, end - begin), raw);
    begin = end;
  }
  return raw;
}

}  // namespace vps
