// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/face_jumps.h"

#include <cmath>

#include "formats/brick_faces.h"
#include "runtime/fields/penetration.h"

namespace vps::cli {

FaceJump largest_face_jump(const VoxelmapView& map, double voxel_size) {
  const detail::CertifiedBand band = detail::certified_band(map);
  const auto is_certified = [&](double v) { return v > -double(band.outer) && v < double(band.inner); };
  const auto sample = [&](std::uint32_t entry, std::size_t n) {
    detail::FieldCell cell;
    cell.edge = std::ldexp(map.voxel_size, octree::level_of(entry));
    return double(detail::sample_value(map, cell, n));
  };
  FaceJump jump;
  const octree::Octree tree{map.field_roots, map.field_nodes, map.root_dims};
  for (std::size_t root = 0; root < tree.root_count(); ++root) {
    octree::for_each_sample_on_faces(tree, root, sample, [&](const octree::Place& place, double here, double there) {
      if (std::abs(here - there) <= jump.largest || !is_certified(here) || !is_certified(there)) return;
      jump.largest = std::abs(here - there);
      for (std::size_t k = 0; k < 3; ++k) {
        jump.place[k] = map.origin[k] + voxel_size * (double(place[k]) / octree::kPlacesPerVoxel + 0.5);
      }
    });
  }
  return jump;
}

std::vector<std::pair<Field, FaceJump>> face_jumps(const Asset& asset) {
  std::vector<std::pair<Field, FaceJump>> jumps;
  for (const Field field : {Field::scaled, Field::real}) {
    VoxelmapView map;
    if (asset.voxelmap(map, field) != Status::ok) continue;
    jumps.emplace_back(field, largest_face_jump(map, asset.info().voxel_size));
  }
  return jumps;
}

}  // namespace vps::cli
