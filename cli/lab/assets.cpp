// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/assets.h"

#include <unistd.h>

#include <stdexcept>

namespace vps::lab {
namespace {

std::shared_ptr<const Asset> opened(const std::filesystem::path& path) {
  auto asset = std::make_shared<Asset>();
  if (const Status status = Asset::open(path.c_str(), *asset); status != Status::ok) {
    throw std::runtime_error(path.string() + ": " + describe(status));
  }
  return asset;
}

}  // namespace

BakedFile bake_file(const TriangleMesh& mesh, const bake::BakeOptions& options, const std::filesystem::path& path) {
  const bake::BakedAsset baked = bake::bake(mesh, options);
  write_asset(path, baked.info, baked.sections);
  return {path, opened(path), nullptr};
}

BakedFile bake_nameless(const TriangleMesh& mesh, const bake::BakeOptions& options, const RecordOf& record) {
  bake::BakedAsset baked = bake::bake(mesh, options);
  if (record) bake::add_record(record(options), baked);
  const int file = write_nameless_asset(std::filesystem::temp_directory_path(), baked.info, baked.sections);
  BakedFile out;
  out.open = std::shared_ptr<const void>(nullptr, [file](const void*) { ::close(file); });
  out.path = "/proc/self/fd/" + std::to_string(file);
  out.asset = opened(out.path);
  return out;
}

TriangleMesh centred(TriangleMesh mesh, const Asset& asset) {
  const std::array<double, 3>& centre = asset.info().centre_of_mass;
  for (auto& v : mesh.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) v[axis] -= centre[axis];
  }
  return mesh;
}

}  // namespace vps::lab
