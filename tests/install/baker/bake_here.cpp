// SPDX-License-Identifier: GPL-3.0-or-later
// Inspects a mesh, bakes it into memory, checks the asset against the mesh, compares it with a baked file and exports
// it.
#include <cstdio>
#include <vector>

#include "bake/store/vps_store.h"
#include "cli/tools/compare/compare_assets.h"
#include "cli/tools/export/export.h"
#include "cli/tools/validate/check.h"

namespace {

int bake_here(const char* mesh_file, const char* baked_file) {
  const vps::ImportedMesh mesh = vps::import_mesh(mesh_file, {});
  vps::bake::BakeSettings settings;
  settings.options.voxel_size = 0.5e-3;
  const vps::bake::MeshReport report = vps::bake::inspect_mesh(mesh, settings.options);
  const vps::bake::ClosedMesh closed = vps::bake::closed_mesh(mesh, settings.options);
  const vps::bake::StoredAsset loaded = vps::bake::load_or_bake(mesh_file, settings);
  const vps::Asset& asset = *loaded.asset;

  std::vector<vps::cli::Check> checks;
  vps::cli::check_contents(asset, checks);
  vps::cli::check_against_mesh(asset, closed.mesh, {1000, 1}, checks);
  std::size_t failed = 0;
  for (const vps::cli::Check& check : checks) failed += check.result == vps::cli::Check::Result::failed ? 1 : 0;

  vps::Asset baked;
  if (vps::Asset::open(baked_file, baked) != vps::Status::ok) return 1;
  const bool same = vps::cli::compare_assets(asset, baked).same != vps::cli::Comparison::Same::nothing;
  std::printf("%zu triangles, %zu of %zu checks failed, %s the file's, %zu bytes of PLY\n", report.triangles, failed,
              checks.size(), same ? "the same as" : "not", vps::cli::to_ply(asset).size());
  return report.usable && loaded.baked && failed == 0 && same ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 1;
  try {
    return bake_here(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bake_here: %s\n", error.what());
    return 1;
  }
}
