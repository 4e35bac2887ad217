// SPDX-License-Identifier: Zlib
// Prints how deep an asset penetrates the ground, the plane z = 0 through its origin.
#include <stdio.h>

#include "runtime/vps.h"

static VpsStatus sink(const char* path, VpsQueryResult* result) {
  const VpsHalfSpace ground = {{0, 0, 1}, 0};
  const VpsPose pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  VpsContact contacts[16];
  VpsAsset* asset = NULL;
  VpsScratch* scratch = NULL;
  const VpsPointshell* shell = NULL;
  VpsStatus status = vps_asset_open(path, &asset);
  if (status == vps_ok) status = vps_asset_pointshell(asset, &shell);
  if (status == vps_ok) status = vps_scratch_create(&scratch);
  if (status == vps_ok) {
    status = vps_traverse(shell, vps_half_space_ref(&ground), &pose, NULL, scratch, contacts, 16, result);
    if (status == vps_output_full) status = vps_ok;  // the sums include all points
  }
  vps_scratch_destroy(scratch);
  vps_asset_close(asset);
  return status;
}

int main(int argc, char** argv) {
  VpsQueryResult result;
  const VpsStatus status = argc == 2 ? sink(argv[1], &result) : vps_bad_argument;
  if (status != vps_ok) {
    fprintf(stderr, "deepest: %s\n", vps_status_text(status));
    return 1;
  }
  printf("%u points, the deepest by %.3g mm\n", (unsigned)result.contacts, 1000 * result.delta);
  return result.contacts > 0 ? 0 : 1;
}
