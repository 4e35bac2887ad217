// SPDX-License-Identifier: GPL-3.0-or-later
// A dense grid of the field for ParaView. Its size is limited, because assets are sparse.
#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "bake/quantity_text.h"
#include "cli/tools/export/export.h"
#include "cli/tools/stored_field.h"
#include "formats/hdf5/write_vtkhdf.h"

namespace vps::cli {
namespace {

constexpr double kMostPoints = 67108864;  // 64 Mi: half a gigabyte

ImageGrid grid_of(const AssetInfo& info, double step) {
  ImageGrid grid;
  grid.spacing = step;
  double points = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double voxels = info.dims[axis] - 1;
    // 1e-6 absorbs rounding: a step of whole voxels ends on the last voxel.
    grid.points[axis] = 1 + static_cast<std::uint64_t>(voxels * info.voxel_size / step + 1e-6);
    grid.origin[axis] = info.origin[axis] + info.voxel_size / 2;
    points *= double(grid.points[axis]);
  }
  if (points > kMostPoints) {
    throw ExportError(fmt::format("{:.3g} points are too many for a dense grid; choose --step {}", points,
                                  bake::format_length(step * std::ceil(100 * std::cbrt(points / kMostPoints)) / 100)));
  }
  return grid;
}

// The layer of the voxel at a point. Voxels far from the surface have +-32767.
std::int16_t stored_layer(const VoxelmapView& map, Vec3 p) {
  constexpr std::int16_t kFar = 32767;
  const detail::Voxel voxel = detail::find_voxel(map, p);
  const std::uint32_t brick = voxel.in_grid ? map.brick_index[voxel.brick] : kNoBrick;
  if (is_stored(brick)) return static_cast<std::int16_t>(layer_at(map, brick, voxel.voxel));
  return brick == kNoBrickInside ? kFar : std::int16_t{-kFar};
}

template <class Value, class Evaluate>
ImageArray array_of(const char* name, ElementType element, const ImageGrid& grid, const Evaluate& evaluate) {
  return {name, element, [&grid, evaluate](std::uint64_t z, void* out) {
            auto* at = static_cast<Value*>(out);
            const auto place = [&](std::uint64_t i, std::size_t axis) {
              return static_cast<float>(grid.origin[axis] + grid.spacing * double(i));
            };
            for (std::uint64_t y = 0; y < grid.points[1]; ++y) {
              for (std::uint64_t x = 0; x < grid.points[0]; ++x) {
                *at++ = evaluate(Vec3{place(x, 0), place(y, 1), place(z, 2)});
              }
            }
          }};
}

}  // namespace

std::size_t write_vtkhdf_field(const Asset& asset, const VoxelmapView& map, double step,
                               const std::filesystem::path& output) {
  const ImageGrid grid = grid_of(asset.info(), step);
  std::vector<ImageArray> arrays;
  arrays.push_back(
      array_of<float>("penetration", ElementType::f32, grid, [&](Vec3 p) { return penetration(map, p, Vec3{}); }));
  arrays.push_back(array_of<std::int8_t>(
      "stored", ElementType::i8, grid, [&](Vec3 p) { return std::int8_t{std::isfinite(stored_penetration(map, p))}; }));
  VoxelmapView layers;
  if (asset.voxelmap(layers, Field::layers) == Status::ok) {
    arrays.push_back(
        array_of<std::int16_t>("layer", ElementType::i16, grid, [&](Vec3 p) { return stored_layer(layers, p); }));
  }
  return write_vtkhdf(output, grid, arrays);
}

}  // namespace vps::cli
