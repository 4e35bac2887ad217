// SPDX-License-Identifier: Zlib
// Prints the volume of an asset as the share of a grid's points that lie inside, computed in one batch over all processors.
#include <stdio.h>
#include <stdlib.h>

#include "runtime/vps.h"

enum { kSide = 100, kCount = kSide * kSide * kSide };

// A point and its answer lie together; a batch takes both where they are.
typedef struct Probe {
  float position[3];
  float penetration;
} Probe;

static VpsStatus probe(const VpsAsset* asset, Probe* probes) {
  const VpsVoxelmap* map = NULL;
  VpsBatch* batch = NULL;
  VpsStatus status = vps_asset_voxelmap(asset, vps_field_finest, &map);
  if (status == vps_ok) status = vps_batch_create(0, &batch);
  if (status == vps_ok) {
    const VpsConstArray points = {probes->position, sizeof(Probe)};
    const VpsConstArray no_normals = {NULL, 0};
    const VpsArray penetrations = {&probes->penetration, sizeof(Probe)};
    status = vps_penetration_batch(batch, vps_map_ref(map), kCount, points, no_normals, penetrations);
  }
  vps_batch_destroy(batch);
  return status;
}

int main(int argc, char** argv) {
  VpsAsset* asset = NULL;
  VpsAssetInfo info;
  Probe* const probes = malloc(kCount * sizeof(Probe));
  VpsStatus status = argc == 2 && probes != NULL ? vps_asset_open(argv[1], &asset) : vps_bad_argument;
  if (status == vps_ok) status = vps_asset_info(asset, &info);
  if (status == vps_ok) {
    for (int i = 0; i < kCount; ++i) {
      const int cell[3] = {i % kSide, i / kSide % kSide, i / kSide / kSide};
      for (int axis = 0; axis < 3; ++axis) {
        const double low = info.bounds_min[axis], high = info.bounds_max[axis];
        probes[i].position[axis] = (float)(low + (high - low) * (cell[axis] + 0.5) / kSide);
      }
    }
    status = probe(asset, probes);
  }
  if (status != vps_ok) {
    fprintf(stderr, "volume: %s\n", vps_status_text(status));
    return 1;
  }
  double volume = 1;
  int inside = 0;
  for (int axis = 0; axis < 3; ++axis) volume *= info.bounds_max[axis] - info.bounds_min[axis];
  for (int i = 0; i < kCount; ++i) inside += probes[i].penetration >= 0;
  volume *= (double)inside / kCount;
  printf("%.4g cm^3, by the mesh %.4g cm^3\n", 1e6 * volume, 1e6 * info.volume);
  vps_asset_close(asset);
  free(probes);
  return volume > 0.98 * info.volume && volume < 1.02 * info.volume ? 0 : 1;
}
