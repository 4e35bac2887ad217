// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bakes a closed triangle mesh into a voxelmap and a pointshell. Paper: Sec. 2.1.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "formats/hdf5/hdf5_writer.h"
#include "formats/triangle_mesh.h"
#include "formats/vps_format.h"

namespace vps::bake {

/// The most invasive repair that may close an open mesh. Each value includes the ones before it, except `wrap`.
enum class Repair : std::uint8_t {
  none,       ///< the mesh must be closed; only open surfaces inside solids are dropped
  weld,       ///< merge vertices within a millionth of the mesh's longest side
  stitch,     ///< join open edges that are at most a voxel apart
  fill,       ///< triangulate all holes
  wrap,       ///< replace the mesh by a skin around it
  automatic,  ///< the least invasive of none, weld, stitch and fill that works. A mesh with holes wider than a voxel is
              ///< refused where it may be a solid or have thin walls, or where filling would lose sheets
};

/// "none", "weld" and so on.
[[nodiscard]] const char* describe(Repair repair);

struct BakePlan;

struct BakeOptions {
  double voxel_size = 0;              ///< s; 0: use `resolution`. [Units: m]
  std::uint32_t resolution = 0;       ///< voxels along the longest side. [Limits: 1 <= value <= 8192]
  bool layers = false;                ///< store the integer layers
  bool scaled = true;                 ///< store adaptive samples of V as scaled integers, Eq. (1)
  bool real = false;                  ///< store the same samples as doubles, with gradients as in Eq. (5)
  bool voxelmap = true;               ///< bake the part that plays the voxelmap
  bool pointshell = true;             ///< bake the part that plays the pointshell
  int precision = kAutoPrecision;     ///< p of Eq. (1); 16 bits must hold the band. [Limits: 0 <= value <= 15]
  std::uint32_t branching = 14;       ///< K. [Limits: 2 <= value <= 64]
  double band_inside = 2.5;           ///< width of the narrow band inside. [Limits: 2 <= value <= 8] [Units: vx]
  double band_outside = 2.5;          ///< its width outside. [Limits: 2 <= value <= 8] [Units: vx]
  double field_error = 0.1;           ///< largest interpolation error that sampling aims for, before samples are
                                      ///< rounded. [Limits: 0.01 <= value <= 1] [Units: vx]
  bool prove_bound = false;           ///< prove the bound of `scaled` and `real` for every cell, instead of estimating
                                      ///< it from the largest error that a search finds (docs/internals/bounds.md)
  double alpha = 1.4142135623730951;  ///< spacing of the pointshell divided by s. [Limits: 0.25 <= value <= 64]
  double thin_faces = 1;              ///< largest spacing of the points inside faces, flat or nearly so, divided by
                                      ///< that elsewhere. [Limits: 1 <= value <= 4]
  Repair repair = Repair::automatic;
  double sheet_thickness = 0;  ///< open surfaces are baked as solids this thick; 0: as `repair` says. [Units: m]
  std::size_t memory_limit_bytes = 8'000'000'000;
  /// Called once by `bake`, with what `plan_bake` gives, before the first stage.
  std::function<void(const BakePlan&)> planned;
  /// Called at the start of stages and of steps of a mesh's check, as "check: unite shells", and during long stages,
  /// with the part of the expected time that is done (0 to 1). By one thread at a time. What it throws ends the bake.
  std::function<void(const char* stage, double fraction)> progress;

  /// Chooses a step of s/50 or finer with which the band fills the range of 8 or 16 bits. The coarsest bricks use twice
  /// that step.
  static constexpr int kAutoPrecision = -1;
};

/// What baking would do, known before it starts.
struct BakePlan {
  double voxel_size = 0;                ///< [m]
  std::array<std::uint32_t, 3> dims{};  ///< [vx]
  std::uint64_t voxels = 0;
  std::uint64_t predicted_points = 0;
  std::size_t predicted_memory_bytes = 0;  ///< peak while baking
  std::size_t predicted_asset_bytes = 0;   ///< upper estimate of the file's size: 1.2 to 4 times the real size
};

/// Time from a stage's start to its end. Stages of a bake run side by side where they can.
struct StageTime {
  std::string stage;
  double seconds = 0;
  bool critical = true;  ///< on the longest path of stages that need each other: more processors cannot hide it
};

struct BakedAsset {
  AssetInfo info;
  std::vector<SectionData> sections;
  std::vector<StageTime> times;
  Repair repair = Repair::none;    ///< the repair that was needed
  double filled_share = 0;         ///< share of the closed surface's area that patches over holes have
  std::vector<std::string> notes;  ///< what was repaired, and warnings; one sentence each
};

/// A mesh or setting that cannot be baked. `what()` is "reason; what to do".
struct BakeError : std::runtime_error {
  std::string stage;
  BakeError(std::string stage_in, const std::string& message)
      : std::runtime_error(message), stage(std::move(stage_in)) {}
};

/// Grid and memory of a bake. @throw BakeError when the options are out of range, or the grid is absurd for the mesh.
[[nodiscard]] BakePlan plan_bake(const TriangleMesh& mesh, const BakeOptions& options);

/// The largest voxel size, within 5 %, for which every requested field has a certified error bound of at most
/// `max_error`. [m]
/// @throw BakeError when the memory limit or the largest grid is reached first
[[nodiscard]] double find_voxel_size(const TriangleMesh& mesh, const BakeOptions& options, double max_error);

/// Defects of a mesh, before and after repair. Counted after vertices with identical positions are joined.
struct MeshReport {
  // As it is.
  std::size_t triangles = 0, vertices = 0;           ///< triangles of the input; vertices after joining
  std::array<double, 3> bounds_min{}, bounds_max{};  ///< [m]
  std::uint32_t components = 0;                      ///< pieces connected by vertices
  std::size_t collapsed = 0;                         ///< triangles without area
  std::size_t duplicates = 0;                        ///< triangles dropped because others use the same three vertices
  std::size_t open_edges = 0;                        ///< edges with one triangle
  std::size_t nonmanifold_edges = 0;                 ///< edges with more than two triangles
  std::size_t nonmanifold_vertices = 0;              ///< vertices with more than one fan of triangles
  std::size_t inconsistent_edges = 0;                ///< edges whose two triangles run along them in the same direction
  std::size_t self_intersections = 0;                ///< pairs of triangles
  bool inside_out = false;                           ///< a closed mesh with negative volume
  // After the repair that a bake would do.
  bool usable = false;
  std::string refusal;             ///< when not usable: reason and what to do
  Repair repair = Repair::none;    ///< the repair that is needed
  double filled_share = 0;         ///< share of the closed surface's area that patches over holes have
  std::vector<std::string> notes;  ///< what was repaired
  double area = 0, volume = 0;     ///< [m^2], [m^3]
  /// Thickness of the walls under the surface. Infinite where no wall lies opposite, as at an edge or a wedge. [m]
  double wall_median = 0;  ///< half of the surface has thicker walls; infinite when half of it has no opposite wall
  double wall_p01 = 0;     ///< 99 % of it have thicker walls; infinite when hardly any of it has an opposite wall
  double thin_share = 0;   ///< share of the surface over walls thinner than two voxels; 0 without a voxel size
};

/// Checks a mesh without baking it. Without a voxel size and a resolution it leaves out stitching and thin walls.
/// @throw BakeError on bad indices or coordinates only
[[nodiscard]] MeshReport inspect_mesh(const TriangleMesh& mesh, const BakeOptions& options);

/// The surface that a bake works on: closed, wound outward, shells united.
struct ClosedMesh {
  TriangleMesh mesh;
  Repair repair = Repair::none;    ///< the repair that was needed
  double filled_share = 0;         ///< share of its area that patches over holes have
  std::vector<std::string> notes;  ///< what was repaired
};

/// Closes a mesh as `bake` does. @throw BakeError
[[nodiscard]] ClosedMesh closed_mesh(const TriangleMesh& mesh, const BakeOptions& options);

/// The whole bake: check, then voxelize, fill_layers, distance_field, thin_walls, coarse_layers, sample_field, certify,
/// far_field, fit_planes, and sample_pointshell, cluster_points, bounding_spheres. The output is identical for any
/// number of threads.
/// @throw BakeError
[[nodiscard]] BakedAsset bake(const TriangleMesh& mesh, const BakeOptions& options);

}  // namespace vps::bake
