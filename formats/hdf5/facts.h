// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The attributes of the root group in their order, for both the writer and the check. Internal.
#pragma once

#include <string>

#include "formats/vps_format.h"

namespace vps::detail {

/// Calls visit(name, value) with a text, a number or an array of numbers. All SI.
template <class Visit>
void for_each_fact(const AssetInfo& info, Visit visit) {
  visit("format", "vpsbake asset; see the user block and docs/format.md");
  visit("generator", static_cast<const char*>(info.generator.data()));
  visit("units", "SI: m, m^2, m^3, m^5");
  visit("voxel_size", info.voxel_size);
  visit("origin", info.origin);
  visit("dims", info.dims);
  visit("precision", info.precision);
  visit("lambda", info.lambda);
  visit("band_inner", info.band_inner);
  visit("band_outer", info.band_outer);
  visit("surface_voxels", info.surface_voxels);
  visit("inner_voxels", info.inner_voxels);
  visit("bounds_min", info.bounds_min);
  visit("bounds_max", info.bounds_max);
  visit("triangles", info.triangles);
  visit("vertices", info.vertices);
  visit("surface_area", info.surface_area);
  visit("mesh_hash", info.mesh_hash);
  visit("volume", info.volume);
  visit("centre_of_mass", info.centre_of_mass);
  visit("inertia_xx_yy_zz_xy_xz_yz", info.inertia);
  visit("spacing", info.spacing);
  visit("covering_radius", info.covering_radius);
  visit("feature_covering_radius", info.feature_covering_radius);
  visit("normal_error_mean", info.normal_error_mean);
  visit("normal_error_max", info.normal_error_max);
  visit("position_origin", info.position_origin);
  visit("position_step", info.position_step);
  visit("area_step", info.area_step);
  visit("points", info.points);
  visit("branching", std::uint64_t{info.branching});
  visit("levels", std::uint64_t{info.levels});
  visit("far_origin", info.far_origin);
  visit("far_spacing", info.far_spacing);
  visit("far_step_inner", info.far_step_inner);
  visit("far_step_outer", info.far_step_outer);
  visit("far_range", info.far_range);
  const auto certificate = [&](const std::string& field, const FieldCertificate& c) {
    visit((field + "_error_max").c_str(), c.max);
    visit((field + "_error_rms").c_str(), c.rms);
    visit((field + "_error_p99").c_str(), c.p99);
    visit((field + "_error_worst_at").c_str(), c.worst_at);
    visit((field + "_error_bound").c_str(), c.bound);
  };
  certificate("layers", info.layers_error);
  certificate("scaled", info.scaled_error);
  certificate("real", info.real_error);
  certificate("far", info.far_error);
  visit("certificate_samples", info.certificate_samples);
}

}  // namespace vps::detail
