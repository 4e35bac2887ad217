// SPDX-License-Identifier: Zlib
// Prints how deep an asset penetrates a copy of itself that is moved by a few voxels.
#include <cstdio>
#include <vector>

#include "runtime/vps_runtime.h"

namespace {

vps::Status overlap(const char* path, vps::QueryResult& result) {
  vps::Asset asset;
  vps::VoxelmapView map;
  vps::PointshellView shell;
  if (const auto status = vps::Asset::open(path, asset); status != vps::Status::ok) return status;
  if (const auto status = asset.voxelmap(map); status != vps::Status::ok) return status;
  if (const auto status = asset.pointshell(shell); status != vps::Status::ok) return status;
  vps::Pose moved;
  moved.translation[0] = 4 * asset.info().voxel_size;
  vps::Scratch scratch;
  std::vector<vps::Contact> contacts(shell.points);
  return traverse(shell, map, relative_pose({}, moved), {}, scratch, contacts, result);
}

}  // namespace

int main(int argc, char** argv) {
  vps::QueryResult result;
  const auto status = argc == 2 ? overlap(argv[1], result) : vps::Status::bad_argument;
  if (status != vps::Status::ok) {
    std::fprintf(stderr, "overlap: %s\n", vps::describe(status));
    return 1;
  }
  std::printf("%u points, the deepest by %.3g mm\n", result.contacts, 1000 * result.delta);
  return result.contacts > 0 ? 0 : 1;
}
