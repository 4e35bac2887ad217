// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/pack_array.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace vps::cli {
namespace {

struct Bounds {
  std::array<double, 3> low{}, high{};
  [[nodiscard]] double longest() const { return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}); }
};

Bounds bounds_of(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return {};
  Bounds bounds{mesh.vertices[0], mesh.vertices[0]};
  for (const auto& p : mesh.vertices) {
    for (std::size_t k = 0; k < 3; ++k) {
      bounds.low[k] = std::min(bounds.low[k], p[k]);
      bounds.high[k] = std::max(bounds.high[k], p[k]);
    }
  }
  return bounds;
}

TriangleMesh clustered(const TriangleMesh& mesh, const Bounds& bounds, double cell) {
  TriangleMesh out;
  std::map<std::array<std::int64_t, 3>, std::uint32_t> cells;
  std::vector<std::uint32_t> number;
  std::vector<int> members;
  for (const auto& p : mesh.vertices) {
    std::array<std::int64_t, 3> at;
    for (std::size_t k = 0; k < 3; ++k) at[k] = static_cast<std::int64_t>(std::floor((p[k] - bounds.low[k]) / cell));
    const auto [found, is_new] = cells.try_emplace(at, static_cast<std::uint32_t>(out.vertices.size()));
    if (is_new) {
      out.vertices.push_back({});
      members.push_back(0);
    }
    for (std::size_t k = 0; k < 3; ++k) out.vertices[found->second][k] += p[k];
    ++members[found->second];
    number.push_back(found->second);
  }
  for (std::size_t i = 0; i < out.vertices.size(); ++i) {
    for (double& x : out.vertices[i]) x /= members[i];
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::array<std::uint32_t, 3> t = {number[a], number[b], number[c]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) out.triangles.push_back(t);
  }
  return out;
}

}  // namespace

std::string base64(std::span<const std::byte> bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t n) { return i + n < bytes.size() ? static_cast<unsigned>(bytes[i + n]) : 0U; };
    const unsigned bits = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (std::size_t digit = 0; digit < 4; ++digit) {
      text += i + digit > bytes.size() ? '=' : kDigits[bits >> (18 - 6 * digit) & 63];
    }
  }
  return text;
}

nlohmann::ordered_json pack_mesh(const TriangleMesh& mesh) {
  const Bounds bounds = bounds_of(mesh);
  constexpr double kLargest = 65535;
  const double step = std::max(bounds.longest() / kLargest, 1e-30);
  std::vector<std::uint16_t> codes;
  for (const auto& p : mesh.vertices) {
    for (std::size_t k = 0; k < 3; ++k) {
      codes.push_back(static_cast<std::uint16_t>(std::clamp(std::round((p[k] - bounds.low[k]) / step), 0.0, kLargest)));
    }
  }
  std::vector<std::uint32_t> corners;
  for (const auto& t : mesh.triangles) corners.insert(corners.end(), t.begin(), t.end());
  return {{"origin", bounds.low}, {"step", step}, {"positions", pack_array(codes)}, {"triangles", pack_array(corners)}};
}

TriangleMesh coarsened(TriangleMesh mesh, std::size_t triangles, double& cell) {
  cell = 0;
  if (mesh.triangles.size() <= triangles) return mesh;
  const Bounds bounds = bounds_of(mesh);
  for (cell = bounds.longest() / 1024;; cell *= 1.25) {
    TriangleMesh coarse = clustered(mesh, bounds, cell);
    if (coarse.triangles.size() <= triangles) return coarse;
  }
}

}  // namespace vps::cli
