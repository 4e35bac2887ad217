// SPDX-License-Identifier: GPL-3.0-or-later
// Polygon File Format (G. Turk, 1994), binary little-endian, points only.
#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <vector>

#include "cli/tools/export/export.h"

namespace vps::cli {
namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::uint32_t kSegments = 15;  // the paper's

template <class Number>
void append(std::string& text, Number value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  text.append(bytes, sizeof value);
}

// For each point its node at a level of the tree.
std::vector<std::uint32_t> nodes_of_points(const PointshellView& shell, std::uint32_t level) {
  std::vector<std::uint32_t> nodes(shell.points);
  for (std::uint32_t node = shell.level_offsets[level - 1]; node < shell.level_offsets[level]; ++node) {
    std::uint32_t first = node, last = node;  // of the nodes below it, then of the points
    for (std::uint32_t down = level; down <= shell.levels; ++down) {
      first = children_of(shell, first).begin;
      last = children_of(shell, last).end - 1;
    }
    for (std::uint32_t i = first; i <= last; ++i) nodes[i] = node;
  }
  return nodes;
}

}  // namespace

std::string to_ply(const Asset& asset) {
  PointshellView shell;
  if (asset.pointshell(shell) != Status::ok) {
    throw ExportError("it has no pointshell; bake it with --parts voxelmap,pointshell");
  }
  const std::uint32_t level = segment_level_for(shell, kSegments);
  const std::vector<std::uint32_t> leaf = nodes_of_points(shell, shell.levels), segment = nodes_of_points(shell, level);
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment vpsbake pointshell, metres, asset frame\n"
      "comment nx ny nz point out of the body; area in m^2\n"
      "comment leaf and segment are numbers of tree nodes, segment those of level {}\nelement vertex {}\n",
      level, shell.points);
  for (const char* const name : {"x", "y", "z", "nx", "ny", "nz", "area"})
    text += fmt::format("property float {}\n", name);
  text += "property uint leaf\nproperty uint segment\nend_header\n";
  for (std::uint32_t i = 0; i < shell.points; ++i) {
    const Vec3 p = point_position(shell, i), n = point_inward_normal(shell, i);
    for (const float x : {p.x, p.y, p.z, -n.x, -n.y, -n.z, point_area(shell, i)}) append(text, x);
    append(text, leaf[i]);
    append(text, segment[i]);
  }
  return text;
}

}  // namespace vps::cli
