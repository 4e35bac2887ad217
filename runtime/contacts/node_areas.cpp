// SPDX-License-Identifier: Zlib
// Areas of a point-sphere tree's nodes, and its segmentation level. Paper: Secs. 2.1.2 and 2.4.
#include "runtime/vps_runtime.h"

namespace vps {

Status node_areas(const PointshellView& shell, std::span<float> areas) noexcept {
  if (shell.points == 0) return Status::missing_part;
  if (areas.size() != shell.nodes) return Status::bad_argument;
  const std::uint32_t leaves = shell.level_offsets[shell.levels - 1];
  // Children have larger numbers than their parents.
  for (std::uint32_t node = shell.nodes; node-- > 0;) {
    const auto [begin, end] = children_of(shell, node);
    double sum = 0;
    for (std::uint32_t i = begin; i < end; ++i) sum += node < leaves ? areas[i] : point_area(shell, i);
    areas[node] = static_cast<float>(sum);
  }
  return Status::ok;
}

std::uint32_t segment_level_for(const PointshellView& shell, std::uint32_t segments) noexcept {
  if (segments == 0 || shell.points == 0) return 0;
  const auto clusters = [&](std::uint32_t level) {
    return std::uint64_t{shell.level_offsets[level] - shell.level_offsets[level - 1]};
  };
  // The next level has the nearer number, as a ratio, where the wish exceeds their geometric mean.
  const std::uint64_t squared = std::uint64_t{segments} * segments;
  std::uint32_t level = 1;
  while (level < shell.levels && squared > clusters(level) * clusters(level + 1)) ++level;
  return level;
}

}  // namespace vps
