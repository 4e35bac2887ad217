// SPDX-License-Identifier: GPL-3.0-or-later
// Times OpenVDB's meshToVolume on one mesh, for comparison with a bake. Writes no file.
//   openvdb_peer MESH SCALE VOXEL_SIZE    (metres per unit of the file, metres)
#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <chrono>
#include <cstdlib>
#include <exception>
#include <vector>

#include "formats/mesh/mesh_import.h"

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

int run(const char* path, double scale, double voxel_size) {
  // vpsbake's own import, so that neither side gains by a faster reader.
  const auto import_begin = Clock::now();
  vps::ImportOptions options;
  options.unit = scale;
  const vps::ImportedMesh mesh = vps::import_mesh(path, options);
  const double import_seconds = seconds_since(import_begin);

  // Converts to voxel units, which meshToVolume requires; this is not timed.
  std::vector<openvdb::Vec3s> points;
  points.reserve(mesh.vertices.size());
  for (const auto& v : mesh.vertices) points.emplace_back(v[0] / voxel_size, v[1] / voxel_size, v[2] / voxel_size);
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);

  openvdb::initialize();
  const auto begin = Clock::now();
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, triangles);
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel_size);
  constexpr float kBand = 4;  // voxels, on both sides
  const auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(adapter, *transform, kBand, kBand);
  const double seconds = seconds_since(begin);

  fmt::print("{{\"import\": {}, \"mesh_to_volume\": {}, \"triangles\": {}, \"active_voxels\": {}}}\n", import_seconds,
             seconds, triangles.size(), grid->activeVoxelCount());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    fmt::print(stderr, "usage: openvdb_peer MESH SCALE VOXEL_SIZE\n");
    return 1;
  }
  try {
    return run(argv[1], std::atof(argv[2]), std::atof(argv[3]));
  } catch (const std::exception& error) {
    fmt::print(stderr, "openvdb_peer: error: {}: {}\n", argv[1], error.what());
    return 4;
  }
}
