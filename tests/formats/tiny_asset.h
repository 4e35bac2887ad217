// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A small complete asset, written by hand: two bricks of layers, two field bricks, four points, two tree levels.
#pragma once

#include <cstring>
#include <vector>

#include "formats/hdf5/hdf5_writer.h"
#include "formats/quantize.h"

namespace vps::test {

template <class T>
SectionData make_section(SectionKind kind, ElementType element, std::vector<std::uint64_t> shape,
                         const std::vector<T>& values) {
  SectionData data{kind, element, std::move(shape), {}};
  data.bytes.resize(values.size() * sizeof(T));
  std::memcpy(data.bytes.data(), values.data(), data.bytes.size());
  return data;
}

struct TinyAsset {
  AssetInfo info;
  std::vector<SectionData> sections;

  TinyAsset() {
    info.dims = {16, 8, 8};
    info.origin = {-0.5, 0.25, 1.5};
    info.voxel_size = 0.125;
    info.precision = 3;
    info.lambda = 0.001;
    info.band_inner = info.band_outer = 0.25;
    info.surface_voxels = 11;
    info.inner_voxels = 7;
    info.bounds_min = {-0.25, 0.5, 1.75};
    info.bounds_max = {1, 1, 2};
    info.triangles = 12;
    info.vertices = 8;
    info.surface_area = 3.5;
    info.mesh_hash = 0x0123456789ABCDEFull;
    info.volume = 0.15;
    info.centre_of_mass = {0.375, 0.75, 1.875};
    info.inertia = {0.005, 0.02, 0.025, 0.001, 0.002, 0.003};
    info.spacing = 0.18;
    info.covering_radius = 0.2;
    info.normal_error_mean = 0.01;
    info.normal_error_max = 0.3;
    info.position_origin = {0, 0, 1};
    info.position_step = 0.5;
    info.area_step = 0.25;
    info.points = 4;
    info.branching = 2;
    info.levels = 2;
    info.layers_error = {0.1, 0.05, 0.08, {1, 2, 3}, 0.2};
    info.scaled_error = {0.01, 0.005, 0.008, {4, 5, 6}, 0.02};
    info.real_error = {0.001, 0.0005, 0.0008, {7, 8, 9}, 0.002};
    info.far_origin = {-0.75, 0, 1.25};
    info.far_spacing = 0.75;
    info.far_step_inner = 0.0078125;
    info.far_step_outer = 0.015625;
    info.far_range = 0.5;
    info.far_error = {0.25, 0.125, 0.2, {1, 0.5, 2}, 0.7};
    info.certificate_samples = 1234;
    std::strcpy(info.generator.data(), "tiny");

    sections.push_back(make_section<std::uint32_t>(SectionKind::brick_index, ElementType::u32, {1, 1, 2}, {0, 1}));
    sections.push_back(make_section<std::int16_t>(SectionKind::coarse_layers, ElementType::i16, {1, 1, 1}, {0}));
    sections.push_back(
        make_section(SectionKind::layers, ElementType::i8, {2, 8, 8, 8}, std::vector<std::int8_t>(1024, -5)));
    const std::uint32_t coarse = std::uint32_t{kCoarsestLevel - kFinestLevel} << kLevelShift;
    sections.push_back(make_section<std::uint32_t>(SectionKind::field_roots, ElementType::u32, {1, 1, 1}, {kNodeFlag}));
    sections.push_back(make_section<std::uint32_t>(
        SectionKind::field_nodes, ElementType::u32, {1, 8},
        {coarse, coarse + kFieldEdge, kFarOutside, kFarOutside, kFarOutside, kFarOutside, kFarOutside, kFarInside}));
    sections.push_back(make_section(SectionKind::scaled, ElementType::i8, {2 * kFieldEdge, kFieldSlice},
                                    std::vector<std::int8_t>(2 * kFieldSamples, -5)));
    sections.push_back(make_section(SectionKind::far, ElementType::i8, {3, 3, 4}, std::vector<std::int8_t>(36, -127)));
    sections.push_back(make_section(SectionKind::planes, ElementType::u32, {1, 8}, std::vector<std::uint32_t>(8, 0)));
    const std::vector<std::uint16_t> positions = {0, 2, 4, 6, 0, 0, 0, 0, 0, 0, 0, 0};
    const std::vector<NormalCode> normals(4, pack({kUnitCode, 0}));
    sections.push_back(make_section(SectionKind::point_positions, ElementType::u16, {3, 4}, positions));
    sections.push_back(make_section(SectionKind::point_inward_normals, ElementType::u8, {4, 3}, normals));
    sections.push_back(
        make_section(SectionKind::point_areas, ElementType::u8, {4}, std::vector<std::uint8_t>{3, 2, 1, 0}));
    const std::vector<std::uint16_t> spheres = {3, 1, 5, 0, 0, 0, 0, 0, 0, 3, 1, 1};
    sections.push_back(make_section(SectionKind::spheres, ElementType::u16, {4, 3}, spheres));
    sections.push_back(make_section<std::uint32_t>(SectionKind::children, ElementType::u32, {4}, {1, 3, 5, 7}));
    sections.push_back(make_section<std::uint32_t>(SectionKind::parent_points, ElementType::u32, {3}, {1, 0, 2}));
    sections.push_back(make_section<std::uint32_t>(SectionKind::level_offsets, ElementType::u32, {3}, {0, 1, 3}));
  }

  SectionData& section(SectionKind kind) {
    for (SectionData& s : sections) {
      if (s.kind == kind) return s;
    }
    std::abort();
  }
};

}  // namespace vps::test
