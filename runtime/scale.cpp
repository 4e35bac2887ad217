// SPDX-License-Identifier: Zlib
// The facts of an asset at another size.
#include "runtime/vps_runtime.h"

namespace vps {

Status check_scale(double scale) noexcept {
  return scale >= kLeastScale && scale <= kMostScale ? Status::ok : Status::bad_argument;
}

AssetInfo scaled(const AssetInfo& info, double scale) noexcept {
  AssetInfo out = info;
  const auto scale_by = [](double by, auto&... values) { ((values *= by), ...); };
  for (FieldCertificate* const field : {&out.layers_error, &out.scaled_error, &out.real_error, &out.far_error}) {
    scale_by(scale, field->max, field->rms, field->p99, field->bound);
    for (double& x : field->worst_at) x *= scale;
  }
  for (auto* const point :
       {&out.origin, &out.bounds_min, &out.bounds_max, &out.centre_of_mass, &out.position_origin, &out.far_origin}) {
    for (double& x : *point) x *= scale;
  }
  scale_by(scale, out.voxel_size, out.lambda, out.band_inner, out.band_outer, out.spacing, out.covering_radius,
           out.feature_covering_radius, out.position_step, out.far_spacing, out.far_step_inner, out.far_step_outer,
           out.far_range);
  const double area = scale * scale;
  scale_by(area, out.surface_area, out.area_step);
  out.volume *= area * scale;
  for (double& x : out.inertia) x *= area * area * scale;
  if (scale != 1) out.precision = -1;
  return out;
}

}  // namespace vps
