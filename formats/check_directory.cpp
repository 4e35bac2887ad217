// SPDX-License-Identifier: Zlib
// Checks the header's scalars, the section table (kinds, types, shapes, places), and that each part is complete.
#include "formats/check_directory.h"

#include <algorithm>
#include <limits>

#include "formats/check_info.h"

namespace vps::detail {
namespace {

// The layout that a kind must have. A shape entry of 0 is a count that is checked elsewhere.
struct Layout {
  SectionKind kind;
  std::array<ElementType, 2> types;
  std::uint32_t rank;
  std::array<std::uint64_t, 6> shape;
};
constexpr ElementType kNone{};
constexpr std::uint64_t kEdge = kBrickEdge;
constexpr Layout kLayouts[] = {
    {SectionKind::brick_index, {ElementType::u32, kNone}, 3, {}},
    {SectionKind::coarse_layers, {ElementType::i16, kNone}, 3, {}},
    {SectionKind::layers, {ElementType::i8, ElementType::i16}, 4, {0, kEdge, kEdge, kEdge}},
    {SectionKind::field_roots, {ElementType::u32, kNone}, 3, {}},
    {SectionKind::field_nodes, {ElementType::u32, kNone}, 2, {0, 8}},
    {SectionKind::scaled, {ElementType::i8, ElementType::i16}, 2, {0, kFieldSlice}},
    {SectionKind::real, {ElementType::f64, kNone}, 2, {0, kFieldSlice}},
    {SectionKind::real_gradient, {ElementType::f32, kNone}, 3, {0, kFieldSlice, 3}},
    {SectionKind::far, {ElementType::i8, kNone}, 3, {}},
    {SectionKind::planes, {ElementType::u32, kNone}, 2, {0, 8}},
    {SectionKind::corners, {ElementType::f32, kNone}, 2, {0, 3}},
    {SectionKind::point_positions, {ElementType::u16, kNone}, 2, {3, 0}},
    {SectionKind::point_inward_normals, {ElementType::u8, kNone}, 2, {0, 3}},
    {SectionKind::point_areas, {ElementType::u8, kNone}, 1, {}},
    {SectionKind::facet_points, {ElementType::u32, kNone}, 1, {}},
    {SectionKind::facet_corners, {ElementType::i8, kNone}, 3, {0, 4, 3}},
    {SectionKind::face_points, {ElementType::u32, kNone}, 1, {}},
    {SectionKind::spheres, {ElementType::u16, kNone}, 2, {4, 0}},
    {SectionKind::children, {ElementType::u32, kNone}, 1, {}},
    {SectionKind::parent_points, {ElementType::u32, kNone}, 1, {}},
    {SectionKind::level_offsets, {ElementType::u32, kNone}, 1, {}},
    {SectionKind::hull_offsets, {ElementType::u32, kNone}, 1, {}},
    {SectionKind::hull_points, {ElementType::u32, kNone}, 1, {}},
    {SectionKind::record, {ElementType::i8, kNone}, 1, {}},
};

const Layout* find_layout(SectionKind kind) noexcept {
  for (const Layout& layout : kLayouts) {
    if (layout.kind == kind) return &layout;
  }
  return nullptr;
}

bool matches(const Section& section, const Layout& layout) noexcept {
  const auto& types = layout.types;
  if (std::find(types.begin(), types.end(), section.element) == types.end()) return false;
  if (section.rank != layout.rank) return false;
  for (std::size_t axis = 0; axis < layout.rank; ++axis) {
    if (layout.shape[axis] != 0 && section.shape[axis] != layout.shape[axis]) return false;
  }
  return true;
}

// Bytes follow from shape and type without overflow; the section lies inside the file, past the user block, aligned.
bool place_is_good(const Section& section, std::uint64_t file_bytes) noexcept {
  const std::uint64_t element = element_bytes(section.element);
  if (element == 0 || section.rank < 1 || section.rank > section.shape.size()) return false;
  std::uint64_t bytes = element;
  for (std::size_t axis = 0; axis < section.shape.size(); ++axis) {
    const std::uint64_t extent = section.shape[axis];
    if (axis >= section.rank) {
      if (extent != 0) return false;
      continue;
    }
    if (extent == 0 || extent > std::numeric_limits<std::uint64_t>::max() / bytes) return false;
    bytes *= extent;
  }
  return bytes == section.bytes && section.offset % kSectionAlignment == 0 && section.offset >= kUserBlockBytes &&
         section.bytes <= file_bytes && section.offset <= file_bytes - section.bytes;
}

bool overlap(const Section& a, const Section& b) noexcept {
  return a.offset < b.offset + b.bytes && b.offset < a.offset + a.bytes;
}

Status check_table(const Directory& directory) noexcept {
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    const Section& section = directory.sections[i];
    if (!place_is_good(section, directory.file_bytes)) return Status::bad_section;
    const Layout* const layout = find_layout(section.kind);
    if (layout == nullptr && (section.flags & kSectionRequired) != 0) return Status::unknown_section;
    if (layout != nullptr && !matches(section, *layout)) return Status::bad_section;
    for (std::uint32_t j = 0; j < i; ++j) {
      const Section& other = directory.sections[j];
      if (other.kind == section.kind || overlap(section, other)) return Status::bad_section;
    }
  }
  return Status::ok;
}

// The nodes cover the mesh's bounds and the range around them, so that no point beyond them is within the range.
// Offsets into the values are 32 bits wide in the vector kernels, which read words of four: the last word must lie in
// the file.
bool far_grid_is_good(const Section& far, const Directory& directory) noexcept {
  const AssetInfo& info = directory.info;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t nodes = far.shape[2 - axis];
    if (nodes < 2 || nodes > 1u << 20) return false;
    const double low = info.far_origin[axis];
    const double high = low + static_cast<double>(nodes - 1) * info.far_spacing;
    if (!(low <= info.bounds_min[axis] - info.far_range && high >= info.bounds_max[axis] + info.far_range))
      return false;
  }
  return far.bytes < 1u << 31 && far.offset + far.bytes + 2 <= directory.file_bytes;
}

// The layers have a brick index of their own; scaled and real share an octree.
Status check_voxelmap(const Directory& directory) noexcept {
  const Section* const coarse = directory.find(SectionKind::coarse_layers);
  const Section* const index = directory.find(SectionKind::brick_index);
  const Section* const layers = directory.find(SectionKind::layers);
  const Section* const roots = directory.find(SectionKind::field_roots);
  const Section* const nodes = directory.find(SectionKind::field_nodes);
  const Section* const scaled = directory.find(SectionKind::scaled);
  const Section* const real = directory.find(SectionKind::real);
  const Section* const gradient = directory.find(SectionKind::real_gradient);
  const Section* const far = directory.find(SectionKind::far);
  const Section* const planes = directory.find(SectionKind::planes);
  const auto& dims = directory.info.dims;
  if (dims[0] == 0) {
    const Section* const all[] = {coarse, index, layers, roots, nodes, scaled, real, gradient, far, planes};
    return std::all_of(std::begin(all), std::end(all), [](const Section* s) { return s == nullptr; })
               ? Status::ok
               : Status::bad_info;
  }
  const bool sampled = scaled != nullptr || real != nullptr;
  if (coarse == nullptr || (layers == nullptr && !sampled) || (index == nullptr) != (layers == nullptr) ||
      (roots == nullptr) == sampled || (nodes == nullptr) == sampled || (real == nullptr) != (gradient == nullptr) ||
      (planes != nullptr && scaled == nullptr)) {
    return Status::missing_section;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t dim = dims[2 - axis];
    if (index != nullptr && index->shape[axis] != dim / kBrickEdge) return Status::bad_section;
    for (const Section* grid : {coarse, roots}) {
      if (grid != nullptr && grid->shape[axis] != (dim + kRootCells - 1) / kRootCells) return Status::bad_section;
    }
  }
  // One code of `scaled` is a part of a voxel, and its range holds the band.
  const double voxel_size = directory.info.voxel_size;
  if (scaled != nullptr && !(directory.info.lambda >= 0x1p-16 * voxel_size && directory.info.lambda <= voxel_size / 2))
    return Status::bad_info;
  // The vector kernels read samples in words of four bytes, coarse layers in words of two: the last word must lie in
  // the file.
  if (scaled != nullptr && scaled->offset + scaled->bytes + 2 > directory.file_bytes) return Status::bad_section;
  if ((coarse->offset + coarse->bytes + 3) / 4 * 4 > directory.file_bytes) return Status::bad_section;
  if (layers != nullptr && layers->shape[0] > kMostCount) return Status::bad_section;
  if (nodes != nullptr && nodes->shape[0] > kMostNodes) return Status::bad_section;
  if (planes != nullptr && planes->shape[0] > (kOctantsFlag >> 3)) return Status::bad_section;
  if (const Section* const corners = directory.find(SectionKind::corners);
      corners != nullptr && corners->shape[0] > kMostMeshCorners) {
    return Status::bad_section;
  }
  std::uint64_t slices = 0;
  if (far == nullptr ? directory.info.far_spacing != 0 : !far_grid_is_good(*far, directory)) return Status::bad_section;
  for (const Section* field : {scaled, real, gradient}) {
    if (field == nullptr) continue;
    const std::uint64_t count = field->shape[0];
    if (count > kMostSlices || (slices != 0 && count != slices)) return Status::bad_section;
    slices = count;
  }
  return Status::ok;
}

Status check_pointshell(const Directory& directory) noexcept {
  const AssetInfo& info = directory.info;
  // Each section, its axis that counts points or nodes, and the count that it must have.
  const Section* const spheres = directory.find(SectionKind::spheres);
  const std::uint64_t nodes = spheres == nullptr ? 0 : spheres->shape[1];
  if (nodes > kMostCount) return Status::bad_section;
  const struct {
    SectionKind kind;
    std::size_t axis;
    std::uint64_t count;
  } kParts[] = {
      {SectionKind::point_positions, 1, info.points},
      {SectionKind::point_inward_normals, 0, info.points},
      {SectionKind::point_areas, 0, info.points},
      {SectionKind::spheres, 1, nodes},
      {SectionKind::children, 0, nodes + 1},
      {SectionKind::parent_points, 0, nodes},
      {SectionKind::level_offsets, 0, std::uint64_t{info.levels} + 1},
  };
  for (const auto& part : kParts) {
    const Section* const section = directory.find(part.kind);
    if (info.points == 0) {
      if (section != nullptr) return Status::bad_info;
    } else if (section == nullptr) {
      return Status::missing_section;
    } else if (section->shape[part.axis] != part.count) {
      return Status::bad_section;
    }
  }
  if (const Section* const faces = directory.find(SectionKind::face_points); faces != nullptr) {
    if (info.points == 0) return Status::bad_info;
    if (faces->shape[0] != (info.points + 31) / 32) return Status::bad_section;
  }
  // Optional, but both or none.
  const auto check_pair = [&](SectionKind first, SectionKind second, const auto& fit) {
    const Section* const one = directory.find(first);
    const Section* const other = directory.find(second);
    if (one == nullptr && other == nullptr) return Status::ok;
    if (info.points == 0) return Status::bad_info;
    if (one == nullptr || other == nullptr) return Status::missing_section;
    return fit(one->shape[0], other->shape[0]) && other->shape[0] <= kMostCount ? Status::ok : Status::bad_section;
  };
  const Status status = check_pair(SectionKind::facet_points, SectionKind::facet_corners,
                                   [](std::uint64_t points, std::uint64_t corners) { return points == corners; });
  if (status != Status::ok) return status;
  return check_pair(SectionKind::hull_offsets, SectionKind::hull_points,
                    [=](std::uint64_t offsets, std::uint64_t) { return offsets == nodes + 1; });
}

}  // namespace

Status check_directory(const Directory& directory) noexcept {
  const AssetInfo& info = directory.info;
  if (!info_is_good(info)) return Status::bad_info;
  if (info.dims[0] == 0 && info.points == 0) return Status::bad_info;
  if (const Status status = check_table(directory); status != Status::ok) return status;
  if (const Status status = check_voxelmap(directory); status != Status::ok) return status;
  return check_pointshell(directory);
}

}  // namespace vps::detail
