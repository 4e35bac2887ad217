// SPDX-License-Identifier: Zlib
// Prints how deep the wedge penetrates the bracket as it is lowered into the bracket's corner.
#include <cstdio>
#include <vector>

#include "runtime/vps_runtime.h"

namespace {

// Prints the reason when the file is not an asset.
bool open(const char* path, vps::Asset& asset) {
  const vps::Status status = vps::Asset::open(path, asset);
  if (status != vps::Status::ok) std::fprintf(stderr, "%s: %s\n", path, vps::describe(status));
  return status == vps::Status::ok;
}

}  // namespace

int main() {
  vps::Asset bracket, wedge;
  if (!open(ASSETS "bracket.vps.hdf", bracket) || !open(ASSETS "wedge.vps.hdf", wedge)) return 1;
  vps::VoxelmapView map;
  vps::PointshellView shell;
  if (bracket.voxelmap(map) != vps::Status::ok || wedge.pointshell(shell) != vps::Status::ok) return 1;

  vps::Scratch scratch;
  std::vector<vps::Contact> contacts(shell.points);
  for (const double height : {0.020, 0.009}) {
    vps::Pose lowered;
    lowered.translation[0] = 0.020;
    lowered.translation[2] = height;
    vps::QueryResult result;
    const vps::Status status = traverse(shell, map, relative_pose({}, lowered), {}, scratch, contacts, result);
    if (status != vps::Status::ok) return 1;
    std::printf("at %.0f mm: %u points touch, the deepest by %.2f mm\n", 1000 * height, result.contacts,
                result.contacts > 0 ? 1000 * result.delta : 0.0);
  }
}
