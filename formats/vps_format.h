// SPDX-License-Identifier: Zlib
/// @file The byte layout of a baked asset (`NAME.vps.hdf`) and its validation. docs/internals/format.md describes every
/// byte.
///
/// An asset is an HDF5 file whose 4096-byte user block holds a directory: scalars about the asset and a table of
/// sections. Readers that only know this header can map the file and use it without an HDF5 library.
/// Nothing here allocates, throws or prints; every function is safe on untrusted bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/octree.h"

namespace vps {

inline constexpr std::array<std::uint8_t, 8> kMagic = {0x89, 'V', 'P', 'S', '\r', '\n', 0x1A, '\n'};
inline constexpr std::uint16_t kFormatMajor = 2;
inline constexpr std::uint16_t kFormatMinor = 0;
inline constexpr std::size_t kUserBlockBytes = 4096;
inline constexpr std::size_t kSectionTableOffset = 1024;
inline constexpr std::size_t kSectionEntryBytes = 96;
inline constexpr std::size_t kMaxSections = (kUserBlockBytes - kSectionTableOffset) / kSectionEntryBytes;
/// Every section starts at a multiple of this. [Units: bytes]
inline constexpr std::size_t kSectionAlignment = 64;
/// Edge of a brick. [Units: vx]
inline constexpr std::uint32_t kBrickEdge = 8;
inline constexpr std::uint32_t kBrickVoxels = kBrickEdge * kBrickEdge * kBrickEdge;
/// Values in `brick_index` of a brick whose layers are not stored: no voxel centre of it lies in the narrow band. It
/// lies outside, or inside the solid.
inline constexpr std::uint32_t kNoBrick = 0xFFFFFFFFu;
inline constexpr std::uint32_t kNoBrickInside = 0xFFFFFFFEu;
[[nodiscard]] constexpr bool is_stored(std::uint32_t brick) noexcept {
  return brick < kNoBrickInside;
}
/// Values of the far grid are clamped at this and its opposite.
inline constexpr int kLargestFarValue = 127;
/// Edge of the blocks of `coarse_layers`. [Units: vx]
inline constexpr std::uint32_t kCoarseEdge = 16;
/// A block's centre is at least |coarse layer| and less than |coarse layer| + this from the surface. [Units: vx]
inline constexpr float kCoarseLayerSlack = 3;

/// Why an asset was refused or a query could not run. `describe` gives one sentence for each.
enum class Status : std::uint8_t {
  ok,
  cannot_open,      ///< the file does not exist, is no regular file or may not be read
  cannot_map,       ///< the operating system refused to map it
  too_short,        ///< fewer bytes than a user block
  wrong_magic,      ///< not a vpsbake asset
  wrong_version,    ///< another major version: bake again
  wrong_size,       ///< truncated, or bytes were added
  corrupt_header,   ///< the header's hash does not match its bytes
  rewritten,        ///< another HDF5 tool moved or changed the sections
  bad_info,         ///< a scalar of the header is out of range
  bad_section,      ///< a section's type, shape, offset or byte count is wrong
  unknown_section,  ///< a required section that this reader does not know
  missing_section,  ///< a part of the asset is incomplete
  bad_index,        ///< an index or number inside a section is outside its range
  corrupt_payload,  ///< a section's hash does not match its bytes
  missing_part,     ///< the asset has no voxelmap or no pointshell, and the query needs it
  bad_pose,         ///< a pose is not finite, its rotation not orthonormal, or it is farther than 1e12 m
  output_full,      ///< the caller's buffer was too small; the result says how many there were
  bad_argument,     ///< an argument is outside its documented range
  no_memory,        ///< working memory could not grow
};

/// One sentence without a full stop, for messages. Never null.
[[nodiscard]] const char* describe(Status status) noexcept;

/// What a section holds. Numbers are part of the format. Shapes are C order, slowest axis first.
/// b = brick grid (x, y, z), n = stored bricks of layers, r = octree roots, N = octree nodes, f = slices of field
/// bricks, C = corners, P = points, F = facets, M = tree nodes, L = tree levels, H = corners of hulls.
enum class SectionKind : std::uint32_t {
  brick_index = 1,    ///< u32 [bz,by,bx]: number of the stored brick, kNoBrick or kNoBrickInside; with `layers` only
  coarse_layers = 2,  ///< i16 [rz,ry,rx]: lower bound of the distance from the CENTRE of each block of 16x16x16 voxels
                      ///< to the surface, signed as layers. [vx]
  field_roots = 3,    ///< u32 [rz,ry,rx]: entry of each block of 16x16x16 cells; with `scaled` or `real`
  field_nodes = 4,    ///< u32 [N,8]: entry of each octant, x fastest; with `scaled` or `real`
  layers =
      16,  ///< i8 or i16 [n,8,8,8]: layer v of each voxel (0 surface, +n inside, -n outside), Chebyshev steps. [vx]
  scaled = 17,  ///< i8 or i16 [f,25]: penetration of each sample in steps of lambda, at level 1 of 2 lambda. Eq. (1)
  real = 18,    ///< f64 [f,25]: penetration of each sample. [m]
  real_gradient = 19,  ///< f32 [f,25,3]: gradient (x,y,z) of V at each sample, as in Eq. (5). [m per voxel step]
  far = 20,      ///< i8 [nz,ny,nx]: penetration at the nodes of the far grid, in far_step_inner or far_step_outer.
                 ///< Optional
  planes = 21,   ///< u32 [t,8]: a linear upper bound of V in each octant of a root: of those with nodes, which have the
                 ///< same numbers, then of others near the surface. The rest have one in their entry
                 ///< (formats/cell_plane.h). With `scaled`. Optional
  corners = 22,  ///< f32 [C,3]: convex corners and tips of the mesh. Optional. [m]
  point_positions = 32,       ///< u16 [3,P]: rows x, y, z: position_origin + position_step * code. [m]
  point_inward_normals = 33,  ///< u8 [P,3]: octahedral codes of 12 + 12 bits (formats/quantize.h), into the body. [-]
  point_areas = 34,           ///< u8 [P]: surface area that the point represents: area_step * code^2. [m^2]
  facet_points = 35,  ///< u32 [F]: points whose part of the surface is folded, ascending, one entry per facet. Optional
  facet_corners = 36,  ///< i8 [F,4,3]: corners of each facet less its point: covering_radius / kFacetSteps * code. [m]
  face_points = 37,    ///< u32 [ceil(P/32)]: bit i % 32 of word i / 32 tells whether point i lies inside a face, where
                       ///< the points are thinned out. Optional
  spheres = 48,        ///< u16 [4,M]: rows x, y, z, radius of the bounding sphere of all points below a node; radius =
                       ///< position_step * code. [m]
  children = 49,  ///< u32 [M+1]: first child of each node, on the leaf level M + number of the first point; M + P last
  parent_points = 50,  ///< u32 [M]: the point that represents the node (P_1 of Eq. 6)
  level_offsets = 51,  ///< u32 [L+1]: nodes of level l (root = 1) are [offset[l-1], offset[l])
  hull_offsets = 52,   ///< u32 [M+1]: where the corners of each node's hull begin; nodes that are not flat have none.
                       ///< Optional
  hull_points = 53,    ///< u32 [H]: points that are corners, ascending within a node; with hull_offsets
  record = 64,  ///< i8 [n]: what the asset was baked from, as text (bake/store/cache.h). Optional; no query reads it
};

/// Steps of `facet_corners` in a covering radius.
inline constexpr float kFacetSteps = 112;

/// Most `corners`: queries test each of them.
inline constexpr std::uint32_t kMostMeshCorners = 256;

/// Farthest that a place on a face lies off the tangent plane of the point that speaks for it. Measured at the samples
/// from which the points are chosen, a `spacing` apart. [Units: vx]
inline constexpr double kFaceSag = 0.005;

/// Every point below a flat node lies within twice this of the hull of the node's corners. [Units: covering radii]
inline constexpr double kHullTolerance = 0.01;

/// No kind uses i32.
enum class ElementType : std::uint32_t { i8 = 1, i16 = 2, i32 = 3, u32 = 4, f32 = 5, f64 = 6, u16 = 7, u8 = 8 };

/// Bytes of one element; 0 for a value that is not an ElementType.
[[nodiscard]] std::size_t element_bytes(ElementType type) noexcept;

/// One row of the section table. `flags` bit 0: a reader that does not know the kind must refuse the asset.
struct Section {
  SectionKind kind{};
  ElementType element{};
  std::uint32_t flags = 0;
  std::uint32_t rank = 0;                ///< [Limits: 1 <= value <= 6]
  std::array<std::uint64_t, 6> shape{};  ///< unused axes are 0
  std::uint64_t offset = 0;              ///< from the file's first byte. [Units: bytes]
  std::uint64_t bytes = 0;               ///< product of shape and element size. [Units: bytes]
  std::uint64_t hash = 0;                ///< XXH3-64 of the section's bytes
};
inline constexpr std::uint32_t kSectionRequired = 1;

/// Error of one field against the mesh, measured when the asset was baked, up to half a voxel's diagonal from the ends
/// of the band. All 0 when absent.
struct FieldCertificate {
  double max = 0;                    ///< largest absolute error that was found. [m]
  double rms = 0;                    ///< root mean square. [m]
  double p99 = 0;                    ///< 99 % of the samples are no worse. [m]
  std::array<double, 3> worst_at{};  ///< where `max` was found, asset frame. [m]
  double bound = 0;                  ///< error bound that queries use: no less than `max`; proven for `layers` and
                                     ///< the far grid; for `scaled` and `real` only if the bake was asked to
                                     ///< prove it, else an estimate. [m]
};

/// The scalars of an asset. SI units, asset frame (the mesh's own frame, in metres).
struct AssetInfo {
  // Voxelmap. dims are 0 when the asset has none.
  std::array<std::uint32_t, 3> dims{};  ///< voxels along x, y, z, each a multiple of kBrickEdge
  std::array<double, 3> origin{};       ///< lowest corner of voxel (0,0,0). [m]
  double voxel_size = 0;                ///< s. Also set for an asset with only a pointshell. [m]
  std::int32_t precision = 0;           ///< p of Eq. (1); -1: lambda is no power of ten
  double lambda = 0;                    ///< step of `scaled` up to level 0: 10^-p, or chosen for the band. [m]
  double band_inner = 0;                ///< samples are valid where -band_outer <= V <= band_inner. Others may be
                                        ///< clamped, but not into the band. [m]
  double band_outer = 0;                ///< [m]
  std::uint64_t surface_voxels = 0;
  std::uint64_t inner_voxels = 0;  ///< voxels inside that are not surface voxels
  // Mesh.
  std::array<double, 3> bounds_min{};  ///< of the mesh. [m]
  std::array<double, 3> bounds_max{};
  std::uint64_t triangles = 0;
  std::uint64_t vertices = 0;
  double surface_area = 0;      ///< [m^2]
  std::uint64_t mesh_hash = 0;  ///< XXH3-64 of the checked mesh
  // Mass properties at unit density.
  double volume = 0;                       ///< [m^3]
  std::array<double, 3> centre_of_mass{};  ///< [m]
  std::array<double, 6> inertia{};         ///< xx, yy, zz, xy, xz, yz about the centre of mass. [m^5]
  // Pointshell and tree. 0 when the asset has none.
  double spacing = 0;          ///< least distance that sampling aimed at, alpha * s. [m]
  double covering_radius = 0;  ///< every surface point has a stored shell point no farther than this. [m]
  /// The same for places on no face; 0: for all. Other places lie within kFaceSag of the tangent plane of a point that
  /// is no farther than `covering_radius`. [m]
  double feature_covering_radius = 0;
  double normal_error_mean = 0;  ///< mean angle of stored normals to their face's, sharp edges left out. [rad]
  double normal_error_max = 0;   ///< [rad]
  std::array<double, 3> position_origin{};  ///< bounds_min, rounded down to float. [m]
  double position_step = 0;  ///< largest extent of the bounds / 65535, rounded up to 8 significant bits. [m]
  double area_step = 0;      ///< the largest area / 65025. [m^2]
  std::uint64_t points = 0;
  std::uint32_t branching = 0;  ///< K
  std::uint32_t levels = 0;     ///< L, root = 1
  // Far grid: coarse samples of V inside and round the body. All 0 when the asset has none.
  std::array<double, 3> far_origin{};  ///< node (0,0,0). [m]
  double far_spacing = 0;              ///< between nodes. [m]
  double far_step_inner = 0;           ///< of values above 0. [m]
  double far_step_outer = 0;           ///< of values below 0. [m]
  double far_range = 0;                ///< distances are known up to this far outside. [m]
  FieldCertificate far_error;  ///< beyond the band, to the range. `bound` is proven: half a cell's diagonal and a step
  // Certificate.
  FieldCertificate layers_error, scaled_error, real_error;
  std::uint64_t certificate_samples = 0;
  std::array<char, 32> generator{};  ///< tool and version, zero-terminated
};

/// The decoded user block.
struct Directory {
  std::uint16_t major = kFormatMajor;
  std::uint16_t minor = kFormatMinor;
  std::uint64_t file_bytes = 0;
  std::uint64_t metadata_hash = 0;  ///< XXH3-64 of all bytes after the user block that belong to no section
  AssetInfo info;
  std::uint32_t section_count = 0;  ///< [Limits: value <= kMaxSections]
  std::array<Section, kMaxSections> sections{};

  /// The section of a kind, or null.
  [[nodiscard]] const Section* find(SectionKind kind) const noexcept;
};

/// XXH3-64 of bytes, the hash of the format.
[[nodiscard]] std::uint64_t hash_bytes(std::span<const std::byte> bytes) noexcept;

/// Writes the user block, little-endian, header hash included.
void encode_directory(const Directory& directory, std::span<std::byte, kUserBlockBytes> out) noexcept;

/// Decodes and checks the user block of a whole file in memory: magic, version, size, hash, every scalar's range, every
/// section's kind, type, shape, alignment, bounds and overlap, and that each part (voxelmap, pointshell) is complete.
/// @param file  all bytes of the file; need not be aligned
[[nodiscard]] Status decode_directory(std::span<const std::byte> file, Directory& out) noexcept;

/// The parts of an asset that will be used. Values combine with `|`.
enum class Use : std::uint8_t {
  layers = 1,
  scaled = 2,
  real = 4,
  voxelmap = 7,  ///< all fields that the asset has
  pointshell = 8,
  everything = 15,
};
[[nodiscard]] constexpr Use operator|(Use a, Use b) noexcept {
  return static_cast<Use>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}
/// Whether two sets have a value in common.
[[nodiscard]] constexpr bool overlap(Use a, Use b) noexcept {
  return (static_cast<unsigned>(a) & static_cast<unsigned>(b)) != 0;
}

/// Checks every index stored in the sections (brick numbers, the octree's entries, children, parent points, levels), so
/// that no query can read outside the mapping or walk without end. Reads these sections once, and skips those that
/// `use` does not need. Points and spheres need no check, because all their codes are valid.
/// @pre `directory` came from decode_directory on the same bytes, which start at an address aligned for a double, the
/// widest element.
[[nodiscard]] Status validate_indices(std::span<const std::byte> file, const Directory& directory,
                                      Use use = Use::everything) noexcept;

/// Hash of the bytes between and after the sections, which are HDF5's own, in file order.
/// @pre the sections lie inside the file and do not overlap
[[nodiscard]] std::uint64_t hash_metadata(std::span<const std::byte> file, const Directory& directory) noexcept;

/// Compares every section's hash, and that of all bytes outside the sections, with the bytes. Reads the whole file.
[[nodiscard]] Status verify_hashes(std::span<const std::byte> file, const Directory& directory) noexcept;

}  // namespace vps
