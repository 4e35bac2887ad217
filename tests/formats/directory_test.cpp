// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string>

#include "formats/vps_format.h"
#include "tests/formats/asset_bytes.h"

namespace vps::test {
namespace {

using Bytes = AssetBytes;

TEST(Directory, EveryFieldSurvivesARoundTrip) {
  const TinyAsset tiny;
  Bytes bytes(tiny);
  const Directory d = bytes.directory();
  EXPECT_EQ(d.info.dims, tiny.info.dims);
  EXPECT_EQ(d.info.origin, tiny.info.origin);
  EXPECT_EQ(d.info.voxel_size, tiny.info.voxel_size);
  EXPECT_EQ(d.info.precision, tiny.info.precision);
  EXPECT_EQ(d.info.lambda, tiny.info.lambda);
  EXPECT_EQ(d.info.surface_voxels, 11U);
  EXPECT_EQ(d.info.inner_voxels, 7U);
  EXPECT_EQ(d.info.bounds_min, tiny.info.bounds_min);
  EXPECT_EQ(d.info.bounds_max, tiny.info.bounds_max);
  EXPECT_EQ(d.info.triangles, 12U);
  EXPECT_EQ(d.info.vertices, 8U);
  EXPECT_EQ(d.info.surface_area, 3.5);
  EXPECT_EQ(d.info.mesh_hash, tiny.info.mesh_hash);
  EXPECT_EQ(d.info.volume, tiny.info.volume);
  EXPECT_EQ(d.info.centre_of_mass, tiny.info.centre_of_mass);
  EXPECT_EQ(d.info.inertia, tiny.info.inertia);
  EXPECT_EQ(d.info.spacing, tiny.info.spacing);
  EXPECT_EQ(d.info.covering_radius, tiny.info.covering_radius);
  EXPECT_EQ(d.info.normal_error_mean, tiny.info.normal_error_mean);
  EXPECT_EQ(d.info.normal_error_max, tiny.info.normal_error_max);
  EXPECT_EQ(d.info.position_origin, tiny.info.position_origin);
  EXPECT_EQ(d.info.position_step, tiny.info.position_step);
  EXPECT_EQ(d.info.area_step, tiny.info.area_step);
  EXPECT_EQ(d.info.points, 4U);
  EXPECT_EQ(d.info.branching, 2U);
  EXPECT_EQ(d.info.levels, 2U);
  EXPECT_EQ(d.info.layers_error.worst_at, tiny.info.layers_error.worst_at);
  EXPECT_EQ(d.info.scaled_error.p99, tiny.info.scaled_error.p99);
  EXPECT_EQ(d.info.real_error.max, tiny.info.real_error.max);
  EXPECT_EQ(d.info.far_origin, tiny.info.far_origin);
  EXPECT_EQ(d.info.far_spacing, tiny.info.far_spacing);
  EXPECT_EQ(d.info.far_step_inner, tiny.info.far_step_inner);
  EXPECT_EQ(d.info.far_step_outer, tiny.info.far_step_outer);
  EXPECT_EQ(d.info.far_range, tiny.info.far_range);
  EXPECT_EQ(d.info.far_error.worst_at, tiny.info.far_error.worst_at);
  EXPECT_EQ(d.info.far_error.bound, tiny.info.far_error.bound);
  EXPECT_EQ(d.info.certificate_samples, 1234U);
  EXPECT_STREQ(d.info.generator.data(), "tiny");
  EXPECT_EQ(d.section_count, tiny.sections.size());
  EXPECT_EQ(validate_indices(bytes.all(), d), Status::ok);
  EXPECT_EQ(verify_hashes(bytes.all(), d), Status::ok);
}

TEST(Directory, FieldsLieWhereTheDocumentationSays) {
  Bytes bytes{TinyAsset{}};
  const auto at = [&](std::size_t offset) { return std::to_integer<unsigned>(bytes.all()[offset]); };
  EXPECT_EQ(at(0), 0x89U);
  EXPECT_EQ(at(1), unsigned('V'));
  EXPECT_EQ(at(8), 2U);
  EXPECT_EQ(at(13), 0x10U);   // 4096, little-endian
  EXPECT_EQ(at(32), 15U);     // sections
  EXPECT_EQ(at(64), 16U);     // dims[0]
  EXPECT_EQ(at(76), 8U);      // brick edge
  EXPECT_EQ(at(112), 3U);     // precision
  EXPECT_EQ(at(232), 0xEFU);  // mesh hash
  EXPECT_EQ(at(336), 4U);     // points
  EXPECT_EQ(at(512), unsigned('t'));
  EXPECT_EQ(at(583), 0x3FU);  // position_origin[2] is 1
  EXPECT_EQ(at(590), 0xE0U);  // position_step is a half
  EXPECT_EQ(at(598), 0xD0U);  // area_step is a quarter
  EXPECT_EQ(at(1024), 1U);    // brick_index
  EXPECT_EQ(at(1024 + 96), 2U);
  EXPECT_EQ(at(655), 0x3FU);          // far_spacing is three quarters
  EXPECT_EQ(at(735), 0x3FU);          // the far error's bound
  EXPECT_EQ(at(1024 + 6 * 96), 20U);  // far
  EXPECT_EQ(at(1024 + 7 * 96), 21U);  // planes
  EXPECT_EQ(at(1024 + 8 * 96), 32U);  // point_positions
  EXPECT_EQ(at(1024 + 8 * 96 + 4), 7U);
}

TEST(Directory, TruncatingTheFileAtAnyByteIsRejected) {
  Bytes bytes{TinyAsset{}};
  for (std::size_t size = 0; size < bytes.all().size(); ++size) {
    Directory d;
    const Status status = decode_directory(bytes.all().first(size), d);
    ASSERT_EQ(status, size < kUserBlockBytes ? Status::too_short : Status::wrong_size) << size;
  }
}

TEST(Directory, EverySingleBitFlipOfTheUserBlockIsRejected) {
  Bytes bytes{TinyAsset{}};
  for (std::size_t bit = 0; bit < 8 * kUserBlockBytes; ++bit) {
    const auto mask = static_cast<std::byte>(1 << bit % 8);
    bytes.all()[bit / 8] ^= mask;
    Directory d;
    const Status status = decode_directory(bytes.all(), d);
    bytes.all()[bit / 8] ^= mask;
    ASSERT_EQ(status, bit < 64   ? Status::wrong_magic
                      : bit < 80 ? Status::wrong_version
                                 : Status::corrupt_header)
        << bit;
  }
}

TEST(Directory, AFileThatGrewAfterBakingIsNamedAsRewrittenOrTooLong) {
  Bytes bytes{TinyAsset{}};
  std::vector<std::byte> longer(bytes.all().begin(), bytes.all().end());
  Directory d;
  longer.resize(longer.size() + 1);
  EXPECT_EQ(decode_directory(longer, d), Status::wrong_size);
  longer.resize(longer.size() + 511);
  EXPECT_EQ(decode_directory(longer, d), Status::rewritten);
}

TEST(Directory, ScalarsOutOfRangeAreRefused) {
  Bytes bytes{TinyAsset{}};
  const Directory good = bytes.directory();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const std::function<void(Directory&)> changes[] = {
      [&](Directory& d) { d.info.voxel_size = 0; },
      [&](Directory& d) { d.info.voxel_size = nan; },
      [&](Directory& d) { d.info.voxel_size = inf; },
      [&](Directory& d) { d.info.dims[1] = 9; },
      [&](Directory& d) { d.info.dims[0] = 0; },
      [&](Directory& d) {
        d.info.dims = {0, 0, 0};
      },
      [&](Directory& d) { d.info.dims[2] = 1u << 31; },
      [&](Directory& d) { d.info.origin[1] = inf; },
      [&](Directory& d) { d.info.lambda = 0; },
      [&](Directory& d) { d.info.band_inner = -1; },
      [&](Directory& d) { d.info.band_outer = nan; },
      [&](Directory& d) { d.info.bounds_min[0] = 2; },
      [&](Directory& d) { d.info.bounds_max[0] = inf; },
      [&](Directory& d) { d.info.surface_area = -1; },
      [&](Directory& d) { d.info.volume = nan; },
      [&](Directory& d) { d.info.centre_of_mass[2] = nan; },
      [&](Directory& d) { d.info.inertia[5] = inf; },
      [&](Directory& d) { d.info.spacing = 0; },
      [&](Directory& d) { d.info.covering_radius = -1; },
      [&](Directory& d) { d.info.position_origin[0] = nan; },
      [&](Directory& d) { d.info.position_origin[1] = -inf; },
      [&](Directory& d) { d.info.position_origin[2] = 1e39; },
      [&](Directory& d) { d.info.position_step = 0; },
      [&](Directory& d) { d.info.position_step = -0.5; },
      [&](Directory& d) { d.info.position_step = nan; },
      [&](Directory& d) { d.info.position_step = inf; },
      [&](Directory& d) { d.info.position_step = 1e34; },
      [&](Directory& d) { d.info.area_step = 0; },
      [&](Directory& d) { d.info.area_step = -1; },
      [&](Directory& d) { d.info.area_step = nan; },
      [&](Directory& d) { d.info.area_step = 1e34; },
      [&](Directory& d) { d.info.points = 0; },
      [&](Directory& d) { d.info.branching = 1; },
      [&](Directory& d) { d.info.levels = 0; },
      [&](Directory& d) { d.info.levels = 65; },
      [&](Directory& d) { d.info.scaled_error.max = -1; },
      [&](Directory& d) { d.info.real_error.worst_at[1] = nan; },
      [&](Directory& d) { d.info.far_origin[2] = nan; },
      [&](Directory& d) { d.info.far_spacing = -1; },
      [&](Directory& d) { d.info.far_spacing = inf; },
      [&](Directory& d) { d.info.far_spacing = 1e300; },
      [&](Directory& d) { d.info.far_spacing = 0; },  // the other scalars say that there is a far grid
      [&](Directory& d) { d.info.far_step_inner = 0; },
      [&](Directory& d) { d.info.far_step_outer = nan; },
      [&](Directory& d) { d.info.far_range = 0; },
      [&](Directory& d) { d.info.far_range = 128 * d.info.far_step_outer; },
      [&](Directory& d) { d.info.far_error.bound = 0.1; },
      [&](Directory& d) { d.info.generator.fill('x'); },
  };
  for (std::size_t i = 0; i < std::size(changes); ++i) {
    Directory changed = good;
    changes[i](changed);
    EXPECT_EQ(bytes.with(changed), Status::bad_info) << "change " << i;
  }
  EXPECT_EQ(bytes.with(good), Status::ok);
}

TEST(Directory, WrongSectionEntriesAreRefused) {
  Bytes bytes{TinyAsset{}};
  const Directory good = bytes.directory();
  using Kind = SectionKind;
  const std::pair<Status, std::function<void(Directory&)>> changes[] = {
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).element = ElementType::f64; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).element = ElementType(99); }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).rank = 3; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).rank = 7; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).rank = 0; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).shape[1] = 4; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).shape[0] = 0; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).shape[0] = 1ull << 62; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).shape[5] = 1; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).bytes += 1; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).offset += 32; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).offset = 0; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).offset = 1ull << 40; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).offset = ~63ull; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::scaled).offset = find(d, Kind::brick_index).offset; }},
      {Status::bad_section, [](Directory& d) { d.sections[d.section_count++] = find(d, Kind::brick_index); }},
      {Status::bad_section,
       [](Directory& d) {
         find(d, Kind::brick_index).shape = {1, 2, 1};
       }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::point_positions).element = ElementType::i16; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::point_inward_normals).element = ElementType::i8; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::point_areas).element = ElementType::i8; }},
      {Status::bad_section,
       [](Directory& d) {
         find(d, Kind::point_inward_normals).shape = {3, 4};
       }},
      {Status::bad_section, [](Directory& d) { d.info.points = 3; }},
      {Status::bad_section, [](Directory& d) { d.info.levels = 1; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::far).element = ElementType::u16; }},
      {Status::bad_section,
       [](Directory& d) {
         find(d, Kind::far).shape = {4, 3, 3};  // too few nodes along x
       }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::planes).element = ElementType::i32; }},
      {Status::bad_section,
       [](Directory& d) {
         find(d, Kind::planes).shape = {2, 4};
       }},
      {Status::bad_section, [](Directory& d) { d.info.far_origin[1] += 0.01; }},
      {Status::bad_section, [](Directory& d) { d.info.far_spacing -= 0.26; }},
      {Status::bad_section, [](Directory& d) { find(d, Kind::far).kind = Kind(999); }},  // optional, but announced
      {Status::missing_section, [](Directory& d) { --d.section_count; }},
      {Status::missing_section, [](Directory& d) { std::swap(d.sections[2], d.sections[--d.section_count]); }},
      {Status::unknown_section, [](Directory& d) { find(d, Kind::scaled).kind = Kind(999); }},
  };
  for (std::size_t i = 0; i < std::size(changes); ++i) {
    Directory changed = good;
    changes[i].second(changed);
    EXPECT_EQ(bytes.with(changed), changes[i].first) << "change " << i;
  }
  Directory too_many = good;
  too_many.section_count = kMaxSections + 1;
  EXPECT_EQ(bytes.with(too_many), Status::bad_info);
}

TEST(Directory, AnUnknownOptionalSectionIsSkipped) {
  TinyAsset tiny;
  tiny.sections.push_back(make_section(SectionKind::real, ElementType::f64, {2 * kFieldEdge, kFieldSlice},
                                       std::vector<double>(2 * kFieldSamples, 1)));
  tiny.sections.push_back(make_section(SectionKind::real_gradient, ElementType::f32, {2 * kFieldEdge, kFieldSlice, 3},
                                       std::vector<float>(6 * kFieldSamples, 1)));
  Bytes bytes(tiny);
  Directory d = bytes.directory();
  find(d, SectionKind::real).kind = SectionKind(998);
  find(d, SectionKind::real_gradient).kind = SectionKind(999);
  find(d, SectionKind(998)).flags = 0;
  EXPECT_EQ(bytes.with(d), Status::unknown_section);
  find(d, SectionKind(999)).flags = 0;
  EXPECT_EQ(bytes.with(d), Status::ok);
}

TEST(Directory, ReservedBytesMustBeZero) {
  Bytes bytes{TinyAsset{}};
  for (const std::size_t offset : {48U, 116U, 504U, 744U, 1023U, 1024U + 88U, 4095U}) {
    std::array<std::byte, kUserBlockBytes> copy;
    std::memcpy(copy.data(), bytes.all().data(), copy.size());
    copy[offset] = std::byte{1};
    std::memset(copy.data() + 24, 0, 8);
    const std::uint64_t hash = hash_bytes(copy);
    std::memcpy(copy.data() + 24, &hash, 8);
    std::vector<std::byte> file(bytes.all().begin(), bytes.all().end());
    std::memcpy(file.data(), copy.data(), copy.size());
    Directory d;
    EXPECT_EQ(decode_directory(file, d), Status::bad_info) << offset;
  }
}

TEST(Directory, EveryChangedByteIsCaughtByTheHashes) {
  Bytes bytes{TinyAsset{}};
  const Directory d = bytes.directory();
  // In sections and in HDF5's own bytes.
  for (std::size_t at = kUserBlockBytes; at < bytes.all().size(); ++at) {
    bytes.all()[at] ^= std::byte{0x10};
    ASSERT_EQ(verify_hashes(bytes.all(), d), Status::corrupt_payload) << at;
    bytes.all()[at] ^= std::byte{0x10};
  }
}

template <class T>
Status with_value(SectionKind kind, std::size_t at, T value) {
  TinyAsset tiny;
  std::memcpy(tiny.section(kind).bytes.data() + at * sizeof(T), &value, sizeof(T));
  Bytes bytes(tiny);
  return validate_indices(bytes.all(), bytes.directory());
}

// @param root  the only one
Status without_planes(std::uint32_t root) {
  TinyAsset tiny;
  std::memcpy(tiny.section(SectionKind::field_roots).bytes.data(), &root, sizeof root);
  std::erase_if(tiny.sections, [](const SectionData& s) { return s.kind == SectionKind::planes; });
  Bytes bytes(tiny);
  return validate_indices(bytes.all(), bytes.directory());
}

TEST(Validate, EveryIndexOutsideItsTargetIsRefused) {
  EXPECT_EQ(with_value<std::uint32_t>(SectionKind::brick_index, 0, 2), Status::bad_index);
  EXPECT_EQ(with_value<std::uint32_t>(SectionKind::brick_index, 1, kNoBrickInside - 1), Status::bad_index);
  EXPECT_EQ(with_value<std::uint32_t>(SectionKind::brick_index, 1, kNoBrick), Status::ok);
  EXPECT_EQ(with_value<std::uint32_t>(SectionKind::brick_index, 1, kNoBrickInside), Status::ok);
  // The field has ten slices.
  const octree::Slices two{0, 3, 2};
  for (const std::uint32_t entry : {kFarOutside, kFarInside, octree::brick_entry(5, 0), octree::brick_entry(5, 1),
                                    octree::brick_entry(8, 1, two), octree::brick_entry(3, -2, {1, 0, 4})}) {
    EXPECT_EQ(with_value<std::uint32_t>(SectionKind::field_nodes, 7, entry), Status::ok);
  }
  const std::uint32_t no_axis = 3U << kAxisShift;
  for (const std::uint32_t entry : {octree::brick_entry(6, 0), octree::brick_entry(9, 1, two), no_axis,
                                    octree::brick_entry(kMostSlices, 1, two), kNodeFlag | 1, kFarInside - 1}) {
    EXPECT_EQ(with_value<std::uint32_t>(SectionKind::field_nodes, 7, entry), Status::bad_index);
  }
  // With planes a block without samples has one.
  for (const std::uint32_t root : {0U, kInsideFlag, kOctantsFlag - 1, kOctantsFlag, kNodeFlag}) {
    EXPECT_EQ(with_value<std::uint32_t>(SectionKind::field_roots, 0, root), Status::ok);
  }
  for (const std::uint32_t root : {kNodeFlag | 1, kFarInside - 1, kFarInside, kFarOutside}) {
    EXPECT_EQ(with_value<std::uint32_t>(SectionKind::field_roots, 0, root), Status::bad_index);
    EXPECT_EQ(without_planes(root), root >= kFarInside ? Status::ok : Status::bad_index);
  }
  EXPECT_EQ(with_value<std::uint32_t>(SectionKind::field_roots, 0, kOctantsFlag | 1), Status::bad_index);
  // A node that is its own child.
  EXPECT_EQ(with_value<std::uint32_t>(SectionKind::field_nodes, 7, kNodeFlag), Status::bad_index);
  for (std::size_t i = 0; i < 4; ++i) {
    for (const std::uint32_t first : {0U, 1U, 2U, 3U, 4U, 5U, 6U, 7U, 8U, 0x80000000U, 0xFFFFFFFFU}) {
      const std::uint32_t good[] = {1, 3, 5, 7};
      // The two leaves can share the four points in three ways.
      const bool is_good = first == good[i] || (i == 2 && first > 3 && first < 7);
      EXPECT_EQ(with_value(SectionKind::children, i, first), is_good ? Status::ok : Status::bad_index) << i << first;
    }
  }
  EXPECT_EQ(with_value<std::uint32_t>(SectionKind::parent_points, 2, 4), Status::bad_index);
  for (std::size_t i = 0; i < 3; ++i) {
    for (const std::uint32_t bad : {7U, 0xFFFFFFFFU}) {
      EXPECT_EQ(with_value<std::uint32_t>(SectionKind::level_offsets, i, bad), Status::bad_index);
    }
  }
}

// A tiny asset with facets of these points, and corners for `corners` facets.
TinyAsset with_facets(const std::vector<std::uint32_t>& points, std::size_t corners) {
  TinyAsset tiny;
  if (!points.empty()) {
    tiny.sections.push_back(make_section(SectionKind::facet_points, ElementType::u32, {points.size()}, points));
  }
  if (corners > 0) {
    tiny.sections.push_back(make_section(SectionKind::facet_corners, ElementType::i8, {corners, 4, 3},
                                         std::vector<std::int8_t>(12 * corners, -127)));
  }
  return tiny;
}

TEST(Validate, FacetsHaveCornersAndAscendingPoints) {
  const auto indices = [](const std::vector<std::uint32_t>& points) {
    Bytes bytes(with_facets(points, points.size()));
    return validate_indices(bytes.all(), bytes.directory());
  };
  EXPECT_EQ(indices({0, 0, 3}), Status::ok);
  EXPECT_EQ(indices({1, 0, 3}), Status::bad_index);
  EXPECT_EQ(indices({0, 1, 4}), Status::bad_index);
  const auto decoded = [](const std::vector<std::uint32_t>& points, std::size_t corners) {
    Bytes bytes(with_facets(points, corners));
    Directory directory;
    return decode_directory(bytes.all(), directory);
  };
  EXPECT_EQ(decoded({0, 1}, 2), Status::ok);
  EXPECT_EQ(decoded({0, 1}, 1), Status::bad_section);
  EXPECT_EQ(decoded({0, 1}, 0), Status::missing_section);
  EXPECT_EQ(decoded({}, 1), Status::missing_section);
}

TEST(Validate, CornersAreFewAndFinite) {
  const auto with_corners = [](std::size_t count, float last) {
    TinyAsset tiny;
    std::vector<float> places(3 * count, 0.5F);
    places.back() = last;
    tiny.sections.push_back(make_section(SectionKind::corners, ElementType::f32, {count, 3}, places));
    return tiny;
  };
  const auto indices = [&](float last) {
    Bytes bytes(with_corners(2, last));
    return validate_indices(bytes.all(), bytes.directory());
  };
  EXPECT_EQ(indices(-7), Status::ok);
  EXPECT_EQ(indices(std::numeric_limits<float>::infinity()), Status::bad_index);
  EXPECT_EQ(indices(std::numeric_limits<float>::quiet_NaN()), Status::bad_index);
  const auto decoded = [&](std::size_t count) {
    Bytes bytes(with_corners(count, 0));
    Directory directory;
    return decode_directory(bytes.all(), directory);
  };
  EXPECT_EQ(decoded(kMostMeshCorners), Status::ok);
  EXPECT_EQ(decoded(kMostMeshCorners + 1), Status::bad_section);
}

TEST(Directory, FacePointsHaveABitForEachPoint) {
  const auto decoded = [](std::size_t words) {
    TinyAsset tiny;
    const std::vector<std::uint32_t> faces(words, 5);
    tiny.sections.push_back(make_section(SectionKind::face_points, ElementType::u32, {words}, faces));
    Bytes bytes(tiny);
    Directory directory;
    return decode_directory(bytes.all(), directory);
  };
  EXPECT_EQ(decoded(1), Status::ok);
  EXPECT_EQ(decoded(2), Status::bad_section);
}

// A tiny asset with hulls: `offsets` for its three nodes, and these corners.
TinyAsset with_hulls(const std::vector<std::uint32_t>& offsets, const std::vector<std::uint32_t>& corners) {
  TinyAsset tiny;
  if (!offsets.empty()) {
    tiny.sections.push_back(make_section(SectionKind::hull_offsets, ElementType::u32, {offsets.size()}, offsets));
  }
  if (!corners.empty()) {
    tiny.sections.push_back(make_section(SectionKind::hull_points, ElementType::u32, {corners.size()}, corners));
  }
  return tiny;
}

TEST(Validate, HullsHaveOffsetsForEveryNodeAndCornersThatArePoints) {
  const auto indices = [](const std::vector<std::uint32_t>& offsets, const std::vector<std::uint32_t>& corners) {
    Bytes bytes(with_hulls(offsets, corners));
    return validate_indices(bytes.all(), bytes.directory());
  };
  EXPECT_EQ(indices({0, 0, 2, 3}, {0, 3, 1}), Status::ok);
  EXPECT_EQ(indices({0, 2, 1, 3}, {0, 3, 1}), Status::bad_index);
  EXPECT_EQ(indices({1, 1, 2, 3}, {0, 3, 1}), Status::bad_index);
  EXPECT_EQ(indices({0, 0, 2, 4}, {0, 3, 1}), Status::bad_index);
  EXPECT_EQ(indices({0, 0, 2, 2}, {0, 3, 1}), Status::bad_index);
  EXPECT_EQ(indices({0, 0, 2, 3}, {0, 4, 1}), Status::bad_index);
  const auto decoded = [](const std::vector<std::uint32_t>& offsets, const std::vector<std::uint32_t>& corners) {
    Bytes bytes(with_hulls(offsets, corners));
    Directory directory;
    return decode_directory(bytes.all(), directory);
  };
  EXPECT_EQ(decoded({0, 1, 1, 1}, {0}), Status::ok);
  EXPECT_EQ(decoded({0, 1, 1}, {0}), Status::bad_section);
  EXPECT_EQ(decoded({0, 1, 1, 1, 1}, {0}), Status::bad_section);
  EXPECT_EQ(decoded({0, 1, 1, 1}, {}), Status::missing_section);
  EXPECT_EQ(decoded({}, {0}), Status::missing_section);
}

TEST(Validate, EveryCodeOfAPointOrSphereIsAValue) {
  for (const std::uint16_t code : std::array<std::uint16_t, 5>{0x0000, 0x7FFF, 0x8000, 0x8001, 0xFFFF}) {
    EXPECT_EQ(with_value(SectionKind::point_positions, 5, code), Status::ok);
    EXPECT_EQ(with_value(SectionKind::spheres, 9, code), Status::ok);
    EXPECT_EQ(with_value(SectionKind::point_inward_normals, 11, static_cast<std::uint8_t>(code)), Status::ok);
    EXPECT_EQ(with_value(SectionKind::point_areas, 3, static_cast<std::uint8_t>(code)), Status::ok);
  }
}

TEST(Describe, EveryStatusHasASentence) {
  std::set<std::string> sentences;
  for (int i = 0; i <= static_cast<int>(Status::no_memory); ++i) {
    const std::string text = describe(static_cast<Status>(i));
    EXPECT_NE(text, "unknown status");
    EXPECT_NE(text.back(), '.');
    sentences.insert(text);
  }
  EXPECT_EQ(sentences.size(), static_cast<std::size_t>(Status::no_memory) + 1);
  EXPECT_STREQ(describe(static_cast<Status>(200)), "unknown status");
}

}  // namespace
}  // namespace vps::test
