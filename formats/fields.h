// SPDX-License-Identifier: Zlib
/// @file One list of every scalar of the user block with its offset, for both the encoder and the decoder. Internal.
#pragma once

#include "formats/vps_format.h"

namespace vps::detail {

/// Calls visit(offset, field) for each scalar or array of the header's info block. docs/internals/format.md has the
/// same table.
template <class Info, class Visit>
void for_each_info_field(Info& info, Visit visit) {
  visit(64, info.dims);
  visit(80, info.origin);
  visit(104, info.voxel_size);
  visit(112, info.precision);
  visit(120, info.lambda);
  visit(128, info.band_inner);
  visit(136, info.band_outer);
  visit(144, info.surface_voxels);
  visit(152, info.inner_voxels);
  visit(160, info.bounds_min);
  visit(184, info.bounds_max);
  visit(208, info.triangles);
  visit(216, info.vertices);
  visit(224, info.surface_area);
  visit(232, info.mesh_hash);
  visit(240, info.volume);
  visit(248, info.centre_of_mass);
  visit(272, info.inertia);
  visit(320, info.spacing);
  visit(328, info.covering_radius);
  visit(736, info.feature_covering_radius);
  visit(336, info.points);
  visit(344, info.branching);
  visit(348, info.levels);
  std::size_t at = 352;
  for (auto* certificate : {&info.layers_error, &info.scaled_error, &info.real_error}) {
    visit(at, certificate->max);
    visit(at + 8, certificate->rms);
    visit(at + 16, certificate->p99);
    visit(at + 24, certificate->worst_at);
    at += 48;
  }
  visit(496, info.certificate_samples);
  visit(512, info.generator);
  visit(544, info.normal_error_mean);
  visit(552, info.normal_error_max);
  visit(560, info.position_origin);
  visit(584, info.position_step);
  visit(592, info.area_step);
  visit(600, info.layers_error.bound);
  visit(608, info.scaled_error.bound);
  visit(616, info.real_error.bound);
  visit(624, info.far_origin);
  visit(648, info.far_spacing);
  visit(656, info.far_step_inner);
  visit(664, info.far_step_outer);
  visit(672, info.far_range);
  visit(680, info.far_error.max);
  visit(688, info.far_error.rms);
  visit(696, info.far_error.p99);
  visit(704, info.far_error.worst_at);
  visit(728, info.far_error.bound);
}

/// Calls visit(offset in the entry, field) for each scalar of a section table entry.
template <class Entry, class Visit>
void for_each_section_field(Entry& section, Visit visit) {
  visit(0, section.kind);
  visit(4, section.element);
  visit(8, section.flags);
  visit(12, section.rank);
  visit(16, section.shape);
  visit(64, section.offset);
  visit(72, section.bytes);
  visit(80, section.hash);
}

/// Fixed fields outside the info block.
inline constexpr std::size_t kMajorOffset = 8;
inline constexpr std::size_t kMinorOffset = 10;
inline constexpr std::size_t kUserBlockBytesOffset = 12;
inline constexpr std::size_t kFileBytesOffset = 16;
inline constexpr std::size_t kHashOffset = 24;
inline constexpr std::size_t kSectionCountOffset = 32;
inline constexpr std::size_t kTableOffsetOffset = 36;
inline constexpr std::size_t kMetadataHashOffset = 40;
inline constexpr std::size_t kBrickEdgeOffset = 76;

}  // namespace vps::detail
