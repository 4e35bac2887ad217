// SPDX-License-Identifier: GPL-3.0-or-later
// Assets that are well-formed but made to break their readers.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "formats/check_directory.h"
#include "tests/formats/asset_bytes.h"

namespace vps::test {
namespace {

// Vector kernels number bricks in signed integers of 32 bits. Such a file is sparse: it takes little space on a disk.
TEST(HostileAsset, AGridOfMoreBricksThanTheKernelsCanNumberIsRefused) {
  const auto status_of = [](const std::array<std::uint32_t, 3>& dims) {
    AssetBytes bytes{TinyAsset{}};
    Directory d = bytes.directory();
    d.info.dims = dims;
    d.file_bytes = std::uint64_t{1} << 40;
    std::uint64_t offset = std::uint64_t{1} << 36;
    const std::uint64_t x = dims[0];
    const std::uint64_t y = dims[1];
    const std::uint64_t z = dims[2];
    for (const SectionKind kind : {SectionKind::brick_index, SectionKind::coarse_layers, SectionKind::field_roots}) {
      Section& section = find(d, kind);
      const std::uint64_t edge = kind == SectionKind::brick_index ? kBrickEdge : kRootCells;
      section.shape = {(z + edge - 1) / edge, (y + edge - 1) / edge, (x + edge - 1) / edge};
      section.bytes = element_bytes(section.element) * section.shape[0] * section.shape[1] * section.shape[2];
      section.offset = offset;
      offset += std::uint64_t{1} << 36;
    }
    return detail::check_directory(d);
  };
  EXPECT_EQ(status_of({16384, 8192, 8184}), Status::ok);
  EXPECT_EQ(status_of({16384, 8192, 8192}), Status::bad_info);
  EXPECT_EQ(status_of({1U << 20, 1U << 20, 1U << 20}), Status::bad_info);
}

TEST(HostileAsset, SamplesThatTheKernelsCannotNumberOrWouldReadBeyondTheFileAreRefused) {
  const auto status_of = [](std::uint64_t slices, std::uint64_t bytes_behind) {
    AssetBytes bytes{TinyAsset{}};
    Directory d = bytes.directory();
    Section& scaled = find(d, SectionKind::scaled);
    scaled.shape[0] = slices;
    scaled.bytes = slices * kFieldSlice;
    scaled.offset = std::uint64_t{1} << 36;
    d.file_bytes = scaled.offset + scaled.bytes + bytes_behind;
    return detail::check_directory(d);
  };
  EXPECT_EQ(status_of(10, 2), Status::ok);
  EXPECT_EQ(status_of(10, 1), Status::bad_section);
  EXPECT_EQ(status_of(kMostSlices, 2), Status::ok);
  EXPECT_EQ(status_of(kMostSlices + 1, 2), Status::bad_section);
}

// One leaf with all points.
TinyAsset with_points(std::uint32_t points) {
  TinyAsset tiny;
  tiny.info.points = points;
  tiny.info.levels = 1;
  const auto set = [&](SectionKind kind, ElementType element, std::vector<std::uint64_t> shape, auto values) {
    tiny.section(kind) = make_section(kind, element, std::move(shape), values);
  };
  using U16 = std::vector<std::uint16_t>;
  using U32 = std::vector<std::uint32_t>;
  set(SectionKind::point_positions, ElementType::u16, {3, points}, U16(3 * points, 1));
  set(SectionKind::point_inward_normals, ElementType::u8, {points, 3}, std::vector<NormalCode>(points));
  set(SectionKind::point_areas, ElementType::u8, {points}, std::vector<std::uint8_t>(points, 1));
  set(SectionKind::spheres, ElementType::u16, {4, 1}, U16{1, 1, 1, 0});
  set(SectionKind::children, ElementType::u32, {2}, U32{1, 1 + points});
  set(SectionKind::parent_points, ElementType::u32, {1}, U32{0});
  set(SectionKind::level_offsets, ElementType::u32, {2}, U32{0, 1});
  return tiny;
}

// Queries sort the children of a node.
TEST(HostileAsset, ANodeOfFarMoreChildrenThanTheBranchingIsRefused) {
  const auto status_of = [](const TinyAsset& tiny) {
    AssetBytes bytes(tiny);
    return validate_indices(bytes.all(), bytes.directory());
  };
  EXPECT_EQ(status_of(with_points(32)), Status::ok);
  EXPECT_EQ(status_of(with_points(33)), Status::bad_index);
  AssetBytes bytes(with_points(400'000));
  Directory wide = bytes.directory();
  wide.info.branching = 400'000;
  EXPECT_EQ(bytes.with(wide), Status::bad_info);
}

TEST(HostileAsset, FiniteScalarsWithWhichNoQueryCanComputeAreRefused) {
  AssetBytes bytes{TinyAsset{}};
  const Directory good = bytes.directory();
  const std::pair<const char*, std::function<void(AssetInfo&)>> changes[] = {
      {"voxel size, tiny", [](AssetInfo& i) { i.voxel_size = 1e-300; }},
      {"voxel size, denormal", [](AssetInfo& i) { i.voxel_size = std::numeric_limits<double>::denorm_min(); }},
      {"voxel size, huge", [](AssetInfo& i) { i.voxel_size = 1e300; }},
      {"voxel size, smaller than the grid needs", [](AssetInfo& i) { i.voxel_size = 0.01; }},
      {"origin beyond the mesh", [](AssetInfo& i) { i.origin[0] = 1; }},
      {"origin, far", [](AssetInfo& i) { i.origin[0] = 1e15; }},
      {"origin, far below", [](AssetInfo& i) { i.origin[1] = -1e15; }},
      {"lambda, tiny", [](AssetInfo& i) { i.lambda = 1e-300; }},
      {"lambda, huge", [](AssetInfo& i) { i.lambda = 1e300; }},
      {"lambda of more than half a voxel", [](AssetInfo& i) { i.lambda = 0.0626; }},
      {"inner band, tiny", [](AssetInfo& i) { i.band_inner = 1e-300; }},
      {"outer band, huge", [](AssetInfo& i) { i.band_outer = 1e300; }},
      {"bounds, huge", [](AssetInfo& i) { i.bounds_max[0] = 1e300; }},
      {"bounds, flat", [](AssetInfo& i) { i.bounds_max[1] = i.bounds_min[1]; }},
      {"surface area, none", [](AssetInfo& i) { i.surface_area = 0; }},
      {"surface area, huge", [](AssetInfo& i) { i.surface_area = 1e300; }},
      {"volume, none", [](AssetInfo& i) { i.volume = 0; }},
      {"volume, negative", [](AssetInfo& i) { i.volume = -0.1; }},
      {"volume, tiny", [](AssetInfo& i) { i.volume = 1e-300; }},
      {"volume, more than the bounds hold", [](AssetInfo& i) { i.volume = 0.16; }},
      {"centre of mass, huge", [](AssetInfo& i) { i.centre_of_mass[0] = 1e300; }},
      {"centre of mass beyond the bounds", [](AssetInfo& i) { i.centre_of_mass[2] = 2.1; }},
      {"inertia, none", [](AssetInfo& i) { i.inertia = {}; }},
      {"inertia, tiny", [](AssetInfo& i) { i.inertia = {1e-300, 1e-300, 1e-300, 0, 0, 0}; }},
      {"inertia, huge", [](AssetInfo& i) { i.inertia[0] = 1e300; }},
      {"product of inertia, huge", [](AssetInfo& i) { i.inertia[4] = -1e300; }},
      {"spacing, tiny", [](AssetInfo& i) { i.spacing = 1e-300; }},
      {"covering radius, huge", [](AssetInfo& i) { i.covering_radius = 1e300; }},
      {"normal error, huge", [](AssetInfo& i) { i.normal_error_max = 1e300; }},
      {"position origin, far", [](AssetInfo& i) { i.position_origin[1] = 1e20; }},
      {"position step, tiny", [](AssetInfo& i) { i.position_step = 1e-300; }},
      {"position step, huge", [](AssetInfo& i) { i.position_step = 1e20; }},
      {"area step, tiny", [](AssetInfo& i) { i.area_step = 1e-300; }},
      {"area step, huge", [](AssetInfo& i) { i.area_step = 1e30; }},
      {"branching, huge", [](AssetInfo& i) { i.branching = 65; }},
      {"certificate, huge", [](AssetInfo& i) { i.scaled_error.bound = 1e300; }},
      {"worst place, far", [](AssetInfo& i) { i.real_error.worst_at[0] = 1e300; }},
      {"far grid, fine", [](AssetInfo& i) { i.far_spacing = 1e-300; }},
      {"far step inner, tiny", [](AssetInfo& i) { i.far_step_inner = 1e-300; }},
      {"far step outer, huge", [](AssetInfo& i) { i.far_step_outer = 1e300; }},
  };
  for (const auto& [name, change] : changes) {
    Directory changed = good;
    change(changed.info);
    EXPECT_EQ(bytes.with(changed), Status::bad_info) << name;
  }
  EXPECT_EQ(bytes.with(good), Status::ok);
}

}  // namespace
}  // namespace vps::test
