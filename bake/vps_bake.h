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

/// How far repair may go to close an open mesh. Each includes the milder ones before it, except `wrap`.
enum class Repair : std::uint8_t {
  none,       ///< the mesh has to be closed, but for open surfaces inside of solids: these are dropped
  weld,       ///< merge vertices that are a millionth of the mesh's size apart
  stitch,     ///< sew open edges together that are no more than a voxel apart
  fill,       ///< triangulate all holes
  wrap,       ///< replace the mesh by a skin around it
  automatic,  ///< the mildest of none, weld, stitch and fill that suffices; holes wider than a voxel are refused
};

/// "none", "weld" and so on.
[[nodiscard]] const char* describe(Repair repair);

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
  double band_inside = 2.5;           ///< depth of the band of distances. [Limits: 2 <= value <= 8] [Units: vx]
  double band_outside = 2.5;          ///< its width outside. [Limits: 2 <= value <= 8] [Units: vx]
  double field_error = 0.1;           ///< largest error of interpolation that samples are laid for, before they are
                                      ///< rounded. [Limits: 0.01 <= value <= 1] [Units: vx]
  double alpha = 1.4142135623730951;  ///< spacing of the pointshell over s. [Limits: 0.25 <= value <= 64]
  Repair repair = Repair::automatic;
  double sheet_thickness = 0;  ///< open surfaces are baked as solids this thick; 0: as `repair` says. [Units: m]
  std::size_t memory_limit_bytes = 8'000'000'000;
  /// Called at the start of each stage with the fraction done (0 to 1).
  std::function<void(const char* stage, double fraction)> progress;

  /// Steps of s/50 or finer, twice that in the coarsest bricks, such that the band fills the integers.
  static constexpr int kAutoPrecision = -1;
};

/// What baking would do, known before it starts.
struct BakePlan {
  double voxel_size = 0;                ///< [m]
  std::array<std::uint32_t, 3> dims{};  ///< [vx]
  std::uint64_t voxels = 0;
  std::uint64_t predicted_points = 0;
  std::size_t predicted_memory_bytes = 0;  ///< peak while baking
  std::size_t predicted_asset_bytes = 0;   ///< of the file: from above, 1.2 to 4 times what it will be
};

/// Seconds spent per stage, in order.
struct StageTime {
  std::string stage;
  double seconds = 0;
};

struct BakedAsset {
  AssetInfo info;
  std::vector<SectionData> sections;
  std::vector<StageTime> times;
  Repair repair = Repair::none;    ///< what was needed
  double filled_share = 0;         ///< of the closed surface's area, in patches that repair laid over holes
  std::vector<std::string> notes;  ///< what was repaired or is worth knowing, one sentence each
};

/// A mesh or setting that cannot be baked. `what()` is "reason; what to do".
struct BakeError : std::runtime_error {
  std::string stage;
  BakeError(std::string stage_in, const std::string& message)
      : std::runtime_error(message), stage(std::move(stage_in)) {}
};

/// Grid and memory of a bake. @throw BakeError when the options are out of range, or the grid is absurd for the mesh.
[[nodiscard]] BakePlan plan_bake(const TriangleMesh& mesh, const BakeOptions& options);

/// The coarsest voxel size (within 5 %) with which every field asked for has a certificate with at most this bound.
/// @throw BakeError when the memory limit or the grid's largest size comes first
[[nodiscard]] double find_voxel_size(const TriangleMesh& mesh, const BakeOptions& options, double max_error);

/// What is wrong with a mesh, counted on exactly joined vertices, before and after repair.
struct MeshReport {
  // As it is.
  std::size_t triangles = 0, vertices = 0;           ///< of the import
  std::array<double, 3> bounds_min{}, bounds_max{};  ///< [m]
  std::uint32_t components = 0;                      ///< pieces connected by vertices
  std::size_t collapsed = 0;                         ///< triangles without area
  std::size_t duplicates = 0;                        ///< triangles on the vertices of another one
  std::size_t open_edges = 0;                        ///< with one triangle
  std::size_t nonmanifold_edges = 0;                 ///< with more than two triangles
  std::size_t nonmanifold_vertices = 0;              ///< with more than one fan of triangles
  std::size_t inconsistent_edges = 0;                ///< two triangles that run along it the same way
  std::size_t self_intersections = 0;                ///< pairs of triangles
  bool inside_out = false;                           ///< a closed mesh with negative volume
  std::string likely_unit;                           ///< of the file's numbers, by the size of common things
  // After the repair that a bake would do.
  bool usable = false;
  std::string refusal;             ///< when not: reason and what to do
  Repair repair = Repair::none;    ///< what is needed
  double filled_share = 0;         ///< of the closed surface's area, in patches that repair lays over holes
  std::vector<std::string> notes;  ///< what was repaired
  double area = 0, volume = 0;     ///< [m^2], [m^3]
  /// Thickness of the walls under the surface, infinite where no wall lies opposite (an edge or a wedge does). [m]
  double wall_median = 0;  ///< half of the surface has more; infinite when half of it has no opposite wall
  double wall_p01 = 0;     ///< 99 % of it have more; infinite when hardly any of it has an opposite wall
  double thin_share = 0;   ///< of the surface, where walls are thinner than two voxels; 0 without a voxel size
};

/// Checks a mesh without baking it. A voxel size of 0 leaves out what depends on it: stitching and thin walls.
/// @throw BakeError on bad indices or coordinates only
[[nodiscard]] MeshReport inspect_mesh(const TriangleMesh& mesh, const BakeOptions& options);

/// The surface that a bake works on: closed, wound outward, shells united.
struct ClosedMesh {
  TriangleMesh mesh;
  Repair repair = Repair::none;    ///< what was needed
  double filled_share = 0;         ///< of its area, in patches that repair laid over holes
  std::vector<std::string> notes;  ///< what was repaired
};

/// Closes a mesh as `bake` does. @throw BakeError
[[nodiscard]] ClosedMesh closed_mesh(const TriangleMesh& mesh, const BakeOptions& options);

/// The whole bake: check, voxelize, fill_layers, distance_field, thin_walls, coarse_layers, sample_field, certify,
/// sample_pointshell, cluster_points, bounding_spheres. Deterministic for any number of threads. @throw BakeError
[[nodiscard]] BakedAsset bake(const TriangleMesh& mesh, const BakeOptions& options);

}  // namespace vps::bake
