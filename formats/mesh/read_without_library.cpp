// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh/read_without_library.h"

#include <bit>
#include <cstring>
#include <numeric>

#include "formats/mesh/read_obj.h"
#include "formats/mesh/read_off.h"

namespace vps {
namespace {

static_assert(std::endian::native == std::endian::little, "STL is little-endian");

constexpr std::size_t kHeader = 84;
constexpr std::size_t kTriangle = 50;  // a normal and three corners in floats, and two bytes of attributes
constexpr std::size_t kNormal = 12;

// Whether the file has the size that it states. Its first word does not matter: no text has such a count there.
bool is_binary_stl(const std::string& bytes) {
  if (bytes.size() < kHeader) return false;
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, bytes.data() + kHeader - sizeof triangles, sizeof triangles);
  return kHeader + kTriangle * std::size_t{triangles} == bytes.size();
}

PolygonSoup read_binary_stl(const std::string& bytes) {
  PolygonSoup soup;
  const std::size_t triangles = (bytes.size() - kHeader) / kTriangle;
  soup.vertices.reserve(3 * triangles);
  soup.corners.resize(3 * triangles);
  std::iota(soup.corners.begin(), soup.corners.end(), std::size_t{0});
  soup.ends.reserve(triangles);
  for (std::size_t i = 0; i < triangles; ++i) {
    std::array<std::array<float, 3>, 3> corners;
    std::memcpy(&corners, bytes.data() + kHeader + kTriangle * i + kNormal, sizeof corners);
    for (const auto& [x, y, z] : corners) soup.vertices.push_back({x, y, z});
    soup.ends.push_back(3 * i + 3);
  }
  return soup;
}

}  // namespace

std::optional<PolygonSoup> read_without_library(std::string& bytes, const std::string& extension) {
  if (extension == "obj") return read_obj(bytes);
  if (extension == "off") return read_off(bytes);
  if (extension == "stl" && is_binary_stl(bytes)) return read_binary_stl(bytes);
  return std::nullopt;
}

}  // namespace vps
