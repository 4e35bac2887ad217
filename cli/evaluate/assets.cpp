// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/evaluate/assets.h"

#include <stdexcept>

namespace vps::evaluate {

BakedFile bake_file(const TriangleMesh& mesh, const BakeOptions& options, const std::filesystem::path& path) {
  const BakedAsset baked = bake(mesh, options);
  write_asset(path, baked.info, baked.sections);
  auto asset = std::make_shared<Asset>();
  if (const Status status = Asset::open(path.c_str(), *asset); status != Status::ok) {
    throw std::runtime_error(path.string() + ": " + describe(status));
  }
  return {path, asset};
}

TriangleMesh centred(TriangleMesh mesh, const Asset& asset) {
  const std::array<double, 3>& centre = asset.info().centre_of_mass;
  for (auto& v : mesh.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) v[axis] -= centre[axis];
  }
  return mesh;
}

}  // namespace vps::evaluate
