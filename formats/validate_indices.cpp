// SPDX-License-Identifier: Zlib
// Checks every index stored in the sections and the widths of the tree. After this no query can leave the mapping.
// Loops are plain and without early exits, so that compilers vectorize them: this runs at every open.
#include <algorithm>
#include <bit>
#include <cmath>

#include "formats/check_info.h"
#include "formats/check_octree.h"

namespace vps {
namespace {

// A node has at most this many times as many children as the branching says. On average it has one times as many; the
// most that were seen are two times.
constexpr std::uint32_t kMostChildren = 16;

static_assert(std::endian::native == std::endian::little, "assets are mapped as they lie in the file");

template <class T>
std::span<const T> section(std::span<const std::byte> file, const Directory& directory, SectionKind kind) noexcept {
  const Section* const s = directory.find(kind);
  if (s == nullptr) return {};
  return {reinterpret_cast<const T*>(file.data() + s->offset), s->bytes / sizeof(T)};
}

Status check_bricks(std::span<const std::uint32_t> index, std::uint64_t bricks) noexcept {
  // kNoBrick and kNoBrickInside wrap to 1 and 0, so one comparison serves all.
  static_assert(kNoBrickInside + 2 == 0);
  std::uint32_t largest = 0;
  for (const std::uint32_t brick : index) largest = brick + 2 > largest ? brick + 2 : largest;
  return largest <= bricks + 1 ? Status::ok : Status::bad_index;
}

// Children of a level follow each other without gaps: every node but the root has one parent, every point one leaf.
Status check_tree(std::span<const std::uint32_t> offsets, std::span<const std::uint32_t> children,
                  const AssetInfo& info) noexcept {
  const std::uint32_t most = kMostChildren * info.branching;
  const std::size_t levels = offsets.size() - 1;
  const std::uint64_t nodes = children.size() - 1;
  if (offsets[0] != 0 || offsets[1] != 1 || offsets[levels] != nodes) return Status::bad_index;
  for (std::size_t level = 0; level < levels; ++level) {
    if (offsets[level + 1] <= offsets[level] || offsets[level + 1] > nodes) return Status::bad_index;
    // The points follow the nodes.
    if (children[offsets[level]] != offsets[level + 1]) return Status::bad_index;
  }
  if (children[nodes] != nodes + info.points) return Status::bad_index;
  std::int32_t bad = 0;
  for (std::uint64_t node = 0; node < nodes; ++node) {
    const std::uint32_t first = children[node];
    const std::uint32_t end = children[node + 1];
    bad |= (end <= first) | (end - first > most);
  }
  return bad == 0 ? Status::ok : Status::bad_index;
}

bool all_below(std::span<const std::uint32_t> values, std::uint64_t limit) noexcept {
  std::uint32_t largest = 0;
  for (const std::uint32_t v : values) largest = v > largest ? v : largest;
  return largest < limit;
}

// std::is_sorted, which stops early, takes twice as long.
bool is_ascending(std::span<const std::uint32_t> values) noexcept {
  std::int32_t bad = 0;
  for (std::size_t i = 1; i < values.size(); ++i) bad |= values[i - 1] > values[i];
  return bad == 0;
}

}  // namespace

Status validate_indices(std::span<const std::byte> file, const Directory& directory, Use use) noexcept {
  if (directory.info.dims[0] != 0) {
    const Section* const layers = directory.find(SectionKind::layers);
    if (layers != nullptr && overlap(use, Use::layers)) {
      const Status status =
          check_bricks(section<std::uint32_t>(file, directory, SectionKind::brick_index), layers->shape[0]);
      if (status != Status::ok) return status;
    }
    const Section* const scaled = directory.find(SectionKind::scaled);
    const Section* const field = scaled != nullptr ? scaled : directory.find(SectionKind::real);
    if (field != nullptr && overlap(use, Use::scaled | Use::real)) {
      const Section* const planes = directory.find(SectionKind::planes);
      const bool is_good = detail::octree_is_good(section<std::uint32_t>(file, directory, SectionKind::field_roots),
                                                  section<std::uint32_t>(file, directory, SectionKind::field_nodes),
                                                  field->shape[0], planes != nullptr ? planes->shape[0] : 0);
      if (!is_good) return Status::bad_index;
    }
  }
  if (directory.find(SectionKind::corners) != nullptr && overlap(use, Use::voxelmap)) {
    const auto corners = section<float>(file, directory, SectionKind::corners);
    if (!std::all_of(corners.begin(), corners.end(), [](float x) { return std::isfinite(x); }))
      return Status::bad_index;
  }
  if (directory.info.points == 0 || !overlap(use, Use::pointshell)) return Status::ok;
  const std::uint64_t points = directory.info.points;
  const Status status = check_tree(section<std::uint32_t>(file, directory, SectionKind::level_offsets),
                                   section<std::uint32_t>(file, directory, SectionKind::children), directory.info);
  if (status != Status::ok) return status;
  if (!all_below(section<std::uint32_t>(file, directory, SectionKind::parent_points), points)) return Status::bad_index;
  if (directory.find(SectionKind::facet_points) != nullptr) {
    const auto facets = section<std::uint32_t>(file, directory, SectionKind::facet_points);
    if (!is_ascending(facets) || facets.back() >= points) return Status::bad_index;
  }
  if (directory.find(SectionKind::hull_offsets) != nullptr) {
    const auto offsets = section<std::uint32_t>(file, directory, SectionKind::hull_offsets);
    const auto corners = section<std::uint32_t>(file, directory, SectionKind::hull_points);
    if (offsets.front() != 0 || offsets.back() != corners.size() || !is_ascending(offsets) ||
        !all_below(corners, points)) {
      return Status::bad_index;
    }
  }
  return Status::ok;
}

}  // namespace vps
