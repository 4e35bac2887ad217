/* SPDX-License-Identifier: Zlib */
/// @file Assets in C (C99): opens them and tells what they hold. A part of vps.h, which includes it and says what holds
/// for all of its functions.
#pragma once

#include <stddef.h>
#include <stdint.h>

// NOLINTBEGIN(modernize-use-using): C.
#ifdef __cplusplus
extern "C" {
#endif

typedef int32_t VpsStatus;
enum {
  vps_ok,
  vps_cannot_open,      ///< the file does not exist, is no regular file or may not be read
  vps_cannot_map,       ///< the operating system refused to map it
  vps_too_short,        ///< fewer bytes than a user block
  vps_wrong_magic,      ///< not a vpsbake asset
  vps_wrong_version,    ///< another major version: bake again
  vps_wrong_size,       ///< truncated, or bytes were added
  vps_corrupt_header,   ///< the header's hash does not match its bytes
  vps_rewritten,        ///< another HDF5 tool moved or changed the sections
  vps_bad_info,         ///< a scalar of the header is out of range
  vps_bad_section,      ///< a section's type, shape, offset or byte count is wrong
  vps_unknown_section,  ///< a required section that this reader does not know
  vps_missing_section,  ///< a part of the asset is incomplete
  vps_bad_index,        ///< an index or number inside a section is outside its range
  vps_corrupt_payload,  ///< a section's hash does not match its bytes
  vps_missing_part,     ///< the asset has no such voxelmap or no pointshell
  vps_bad_pose,         ///< a pose is not finite, its rotation not orthonormal, or it is farther than 1e12 m
  vps_output_full,      ///< the buffer was too small; the result says how many contacts there were
  vps_bad_argument,     ///< an argument is outside its documented range
  vps_no_memory = 1000  ///< an allocation failed
};

/// One sentence without a full stop, for messages. Never NULL, for any number.
const char* vps_status_text(VpsStatus status);

/// An asset, mapped from a file or in memory.
typedef struct VpsAsset VpsAsset;
/// Views of an asset's parts: owned by the asset, alive until it is closed.
typedef struct VpsVoxelmap VpsVoxelmap;
typedef struct VpsPointshell VpsPointshell;

/// Maps a file read-only and checks its directory and every index. On failure *asset is NULL.
VpsStatus vps_asset_open(const char* path, VpsAsset** asset);
/// The parts of an asset that will be used: bits.
typedef int32_t VpsUse;
enum {
  vps_use_layers = 1,
  vps_use_scaled = 2,
  vps_use_real = 4,
  vps_use_voxelmap = 7,  ///< all stored fields
  vps_use_pointshell = 8,
  vps_use_everything = 15
};
/// As vps_asset_open, for the given parts. Sections that only other parts need are never read and take no memory;
/// requests for these parts return `vps_missing_part`. Unknown bits are `vps_bad_argument`.
VpsStatus vps_asset_open_for(const char* path, VpsUse use, VpsAsset** asset);
/// As vps_asset_open_for, for an asset in memory: the `count` bytes of a whole file, which are not copied. They must
/// outlive the asset and its views, and must not change meanwhile. Their address is a multiple of 8; other addresses
/// are `vps_bad_argument`.
VpsStatus vps_asset_open_memory(const void* bytes, size_t count, VpsUse use, VpsAsset** asset);
/// Unmaps the file. The bytes of an asset in memory may be freed afterwards. NULL is allowed.
VpsStatus vps_asset_close(VpsAsset* asset);
/// Compares all hashes with the bytes: reads the whole asset.
VpsStatus vps_asset_verify(const VpsAsset* asset);

/// Error of one field against the mesh, sampled in the narrow band when the asset was baked. All 0 when absent.
typedef struct VpsCertificate {
  double max;          ///< largest absolute error found. [m]
  double rms;          ///< root mean square. [m]
  double p99;          ///< 99 % of the samples have at most this error. [m]
  double worst_at[3];  ///< where `max` was found, asset frame. [m]
  double bound;        ///< error that queries allow for; at least `max`. [m]
} VpsCertificate;

/// The facts of an asset, asset frame.
typedef struct VpsAssetInfo {
  double bounds_min[3];  ///< of the mesh. [m]
  double bounds_max[3];
  uint64_t triangles;
  uint64_t vertices;
  double surface_area;             ///< [m^2]
  double volume;                   ///< [m^3]
  double centre_of_mass[3];        ///< [m]
  double inertia[6];               ///< at unit density: xx, yy, zz, xy, xz, yz about the centre of mass. [m^5]
  double voxel_size;               ///< [m]
  uint32_t dims[3];                ///< voxels along x, y, z; 0 without a voxelmap
  double origin[3];                ///< lowest corner of voxel (0,0,0). [m]
  double band_inner;               ///< samples are exact where -band_outer <= penetration <= band_inner. [m]
  double band_outer;               ///< [m]
  uint64_t points;                 ///< of the pointshell; 0 without one
  uint32_t levels;                 ///< of its tree, root = 1
  uint32_t branching;              ///< children of a node at most
  double spacing;                  ///< least distance between points that sampling aims at. [m]
  double covering_radius;          ///< every surface point has a shell point within this distance. [m]
  double feature_covering_radius;  ///< the same for points on no face; 0: for all. [m]
  double normal_error_mean;        ///< of the shell's normals, away from sharp edges. [rad]
  double normal_error_max;         ///< [rad]
  VpsCertificate layers_error;
  VpsCertificate scaled_error;
  VpsCertificate real_error;
  double far_spacing;  ///< of the far grid's nodes; 0 without one. [m]
  double far_range;    ///< distances outside are known up to this one. [m]
  VpsCertificate far_error;
  uint64_t certificate_samples;
  char generator[32];  ///< tool and version, zero-terminated
} VpsAssetInfo;
VpsStatus vps_asset_info(const VpsAsset* asset, VpsAssetInfo* info);
/// Uses the asset at another size: all lengths of its facts, voxelmap and pointshell become those of the bake times
/// `scale`; areas, volume and inertia follow. For several scales open the asset several times: a file is in memory
/// once. Not while a query uses the asset.
/// @param scale  other values are `vps_bad_argument`, without a change. [Limits: 0.001 <= value <= 1000]
VpsStatus vps_asset_scale(VpsAsset* asset, double scale);

/// Which stored field of a voxelmap answers.
typedef int32_t VpsField;
enum {
  vps_field_finest,  ///< the first stored one of real, scaled, layers
  vps_field_layers,
  vps_field_scaled,
  vps_field_real
};
/// `vps_missing_part` when the asset has no voxelmap, or not that field; *map is NULL then.
VpsStatus vps_asset_voxelmap(const VpsAsset* asset, VpsField field, const VpsVoxelmap** map);
/// The field that answers: never `vps_field_finest`.
VpsStatus vps_voxelmap_field(const VpsVoxelmap* map, VpsField* field);

/// `vps_missing_part` when the asset has no pointshell; *shell is NULL then.
VpsStatus vps_asset_pointshell(const VpsAsset* asset, const VpsPointshell** shell);

/// Which of two bodies plays the pointshell; the other plays the voxelmap.
typedef int32_t VpsShellRole;
enum { vps_shell_first, vps_shell_second };
/// The body with fewer points, if it can. `vps_missing_part` when neither can.
VpsStatus vps_choose_roles(const VpsAsset* first, const VpsAsset* second, VpsShellRole* role);

/// A point of the shell, asset frame.
typedef struct VpsPoint {
  float position[3];       ///< [m]
  float inward_normal[3];  ///< into the body, unit length. [-]
  float area;              ///< surface area that the point represents. [m^2]
} VpsPoint;
/// @param index  [Limits: value < VpsAssetInfo::points]
VpsStatus vps_pointshell_point(const VpsPointshell* shell, uint32_t index, VpsPoint* point);

/// Level of the tree whose number of clusters is nearest to `segments`, for VpsQueryOptions::segment_level. 0 gives 0.
VpsStatus vps_pointshell_segment_level(const VpsPointshell* shell, uint32_t segments, uint32_t* level);

#ifdef __cplusplus
}
#endif
// NOLINTEND(modernize-use-using)
