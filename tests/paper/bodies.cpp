// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/paper/bodies.h"

#include <LinearMath/btConvexHullComputer.h>

#include "cli/lab/hacd.h"
#include "formats/mesh/mesh_import.h"
#include "runtime/bullet/vps_bullet.h"
#include "sample_meshes/shapes.h"

namespace vps::paper {
namespace {

using lab::BakedFile;

constexpr double kFloorHalfWidth = 3;  // large enough for rolling bodies. [m]
// Ratios of point spacing to voxel size that give about the paper's numbers of points.
constexpr double kBallLowAlpha = 19;
constexpr double kBallHighAlpha = 1.77;
constexpr double kCubeAlpha = 4;  // for a cube's faces a grid of 50 x 50 points
constexpr double kBunnyLowAlpha = 14.5;
constexpr double kBunnyFineAlpha = 2.1235;
constexpr std::uint32_t kPaperBranching = 4;

std::vector<btVector3> hull_corners(const TriangleMesh& mesh) {
  std::vector<float> coordinates;
  for (const auto& v : mesh.vertices) {
    for (const double x : v) coordinates.push_back(float(x));
  }
  btConvexHullComputer hull;
  hull.compute(coordinates.data(), 3 * sizeof(float), int(mesh.vertices.size()), 0, 0);
  std::vector<btVector3> corners;
  for (int i = 0; i < hull.vertices.size(); ++i) corners.push_back(hull.vertices[i]);
  return corners;
}

}  // namespace

Balls make_balls(const std::filesystem::path& folder) {
  const auto bake = [&](const TriangleMesh& mesh, double alpha, const char* name) {
    bake::BakeOptions options;
    options.voxel_size = kCoarseVoxel;
    options.alpha = alpha;
    return lab::bake_file(mesh, options, folder / name);
  };
  const TriangleMesh sphere = samples::make_sphere(kBallRadius, 6);
  return {bake(sphere, kBallLowAlpha, "paper_ball_low.vps.hdf"),
          bake(sphere, kBallHighAlpha, "paper_ball_high.vps.hdf"),
          bake(samples::make_box({kBallRadius, kBallRadius, kBallRadius}), kCubeAlpha, "paper_cube.vps.hdf")};
}

Bunnies make_bunnies(const std::filesystem::path& mesh, double scale, const std::filesystem::path& folder) {
  ImportOptions import;
  import.unit = scale;
  const TriangleMesh body = import_mesh(mesh, import);
  const auto bake = [&](double alpha, std::uint32_t branching, const char* name) {
    bake::BakeOptions options;
    options.alpha = alpha;
    options.branching = branching;
    return bench::bake_body(body, options, folder / name);
  };
  Bunnies out;
  const std::uint32_t branching = bake::BakeOptions{}.branching;
  out.low = bake(kBunnyLowAlpha, branching, "paper_bunny_low.vps.hdf");
  out.fine = bake(kBunnyFineAlpha, branching, "paper_bunny_fine.vps.hdf");
  out.low_k4 = bake(kBunnyLowAlpha, kPaperBranching, "paper_bunny_low_k4.vps.hdf");
  out.fine_k4 = bake(kBunnyFineAlpha, kPaperBranching, "paper_bunny_fine_k4.vps.hdf");
  const Asset& asset = *out.fine.asset;
  const TriangleMesh centred = lab::centred(body, asset);
  out.triangles = centred.triangles.size();
  out.corners = hull_corners(centred);
  out.hull = {"hull", lab::hull_of_42(centred, lab::kPeerMargin)};
  out.hacd.push_back(
      {"HACD", lab::compound_of(lab::hacd_hulls(body, {}, folder), asset.info().centre_of_mass, lab::kPeerMargin)});
  out.gimpact = {"GImpact", lab::gimpact_of(centred)};
  return out;
}

bool meets(const Side& peer, const Floor& floor, const Bunnies& bunnies) {
  return floor.name == "plane" || (floor.name == "box" && peer.name != bunnies.gimpact.name);
}

std::vector<std::uint32_t> clusters_of_levels(const Asset& asset) {
  PointshellView shell;
  (void)asset.pointshell(shell);  // left empty where there is none
  std::vector<std::uint32_t> clusters;
  for (std::uint32_t l = 0; l < shell.levels; ++l) {
    clusters.push_back(shell.level_offsets[l + 1] - shell.level_offsets[l]);
  }
  return clusters;
}

Side ours(const std::string& name, const BakedFile& file, std::uint32_t level) {
  const auto shape = std::make_shared<bullet::Shape>(file.asset);
  if (level > 0) shape->set_segments(clusters_of_levels(*file.asset).at(level - 1));
  return {name, {{}, shape}};
}

Side advanced(Side side) {
  side.name += ", advanced";
  side.motion = Motion::advanced;
  return side;
}

std::vector<Floor> make_floors(const std::filesystem::path& folder) {
  bake::BakeOptions options;
  options.voxel_size = kCoarseVoxel;
  options.pointshell = false;
  const BakedFile slab = lab::bake_file(samples::make_box({kFloorHalfWidth, 0.25, kFloorHalfWidth}), options,
                                        folder / "paper_slab.vps.hdf");
  return {{"plane", lab::plane_ground()},
          {"box", lab::box_ground({kFloorHalfWidth, 0.5, kFloorHalfWidth})},
          {"baked", lab::baked_ground(slab.asset)}};
}

}  // namespace vps::paper
