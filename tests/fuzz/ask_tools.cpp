// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/fuzz/ask_tools.h"

#include <algorithm>
#include <vector>

#include "cli/tools/compare/compare_assets.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/export/export.h"
#include "cli/tools/field_surface.h"
#include "cli/tools/slice/slice_picture.h"
#include "cli/tools/stored_field.h"
#include "cli/tools/validate/check.h"
#include "cli/tools/view/page.h"
#include "cli/tools/view/view_data.h"

namespace vps::test {
namespace {

// Reasons that the program prints.
template <class Work>
void allow_refusal(const Work& work) {
  try {
    work();
  } catch (const cli::ExportError&) {
  } catch (const cli::FieldSurfaceError&) {
  }
}

void draw_slices(const Asset& asset, const VoxelmapView& map) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = cli::slice_range(asset.info(), axis).middle;
    (void)cli::draw_slice(asset.info(), map, {"fuzzed", axis, at, 600});
  }
}

void export_field(const Asset& asset, const VoxelmapView& map, const TemporaryFolder& folder) {
  const AssetInfo& info = asset.info();
  // About 60 cells along the longest side, however many voxels there are.
  double longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    longest = std::max(longest, info.bounds_max[axis] - info.bounds_min[axis]);
  const double step = std::max(info.voxel_size, longest / 60);
  allow_refusal([&] { (void)cli::to_obj(map, step); });
  allow_refusal([&] { (void)cli::to_cdf(map, {step, info.band_outer}); });
  allow_refusal([&] { (void)cli::write_vtkhdf_field(asset, map, step, folder / "field.vtk.hdf"); });
}

void check(const Asset& asset, const TemporaryFolder& folder) {
  const std::span<const std::byte> bytes = asset.bytes();
  write_file(folder / "fuzzed.vps.hdf", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  Asset opened;
  std::vector<cli::Check> checks;
  if (!cli::check_structure(folder / "fuzzed.vps.hdf", opened, checks)) return;
  cli::check_file(folder / "fuzzed.vps.hdf", opened, checks);
  cli::check_contents(opened, checks);
  cli::check_origin(opened, checks);
}

}  // namespace

void ask_tools(const Asset& asset, const Asset& other, const TemporaryFolder& folder) {
  (void)cli::to_text(cli::asset_to_json("fuzzed", asset));
  (void)cli::info_to_text(asset.info());
  (void)cli::to_json_text("fuzzed", asset);
  (void)cli::compare_assets(asset, other);
  allow_refusal([&] { (void)cli::to_ply(asset); });
  allow_refusal([&] { (void)cli::make_view_page(cli::kViewPage, cli::view_data(asset, "fuzzed", nullptr)); });
  for (const Field field : {Field::layers, Field::scaled, Field::real}) {
    VoxelmapView map;
    if (asset.voxelmap(map, field) != Status::ok) continue;
    draw_slices(asset, map);
    export_field(asset, map, folder);
  }
  check(asset, folder);
}

}  // namespace vps::test
