// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/assets.h"

#include <stdexcept>
#include <utility>

#include "bake/store/vps_store.h"

namespace vps::lab {

BakedFile bake_file(const TriangleMesh& mesh, const bake::BakeOptions& options, const std::filesystem::path& path) {
  const bake::BakedAsset baked = bake::bake(mesh, options);
  write_asset(path, baked.info, baked.sections);
  auto asset = std::make_shared<Asset>();
  if (const Status status = Asset::open(path.c_str(), *asset); status != Status::ok) {
    throw std::runtime_error(path.string() + ": " + describe(status));
  }
  return {path, std::move(asset)};
}

std::shared_ptr<const Asset> bake_in_memory(const TriangleMesh& mesh, const bake::BakeOptions& options,
                                            const RecordOf& record) {
  bake::BakedAsset baked = bake::bake(mesh, options);
  if (record) bake::add_record(record(options), baked);
  return bake::open_in_memory(asset_bytes(baked.info, baked.sections));
}

TriangleMesh centred(TriangleMesh mesh, const Asset& asset) {
  const std::array<double, 3>& centre = asset.info().centre_of_mass;
  for (auto& v : mesh.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) v[axis] -= centre[axis];
  }
  return mesh;
}

}  // namespace vps::lab
