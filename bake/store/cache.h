// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A folder of baked assets, each named by the hash of everything that determines its bytes. The command line and
/// programs that bake while they load share it. Any number of processes may use one folder; any file in it may be
/// deleted. The hashes protect against damage, not against attackers: let only those write to the folder whose assets
/// you trust.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bake/vps_bake.h"
#include "formats/mesh/mesh_import.h"
#include "runtime/vps_runtime.h"

namespace vps::bake {

/// The settings of a bake. With the mesh and the program they determine an asset's bytes.
struct BakeSettings {
  BakeOptions options;
  ImportOptions import;
  double max_error = 0;  ///< choose the voxel size with find_voxel_size; 0: as `options` says. [Units: m]
};

/// One `name value` line for each setting, and for the versions of the asset format and the program. Numbers are
/// written exactly, as %a of printf. Leaves out what changes no byte: limits of memory and time, and `progress`.
[[nodiscard]] std::string describe_settings(const BakeSettings& settings);

/// A number of a record. @return nothing when the text is none
[[nodiscard]] std::optional<double> exact_number(std::string_view text);

/// What an asset is baked from: `describe_settings`, then `mesh EXTENSION HASH` and `buffer HASH` for each buffer of a
/// gltf or glb file, or `vertices HASH` and `triangles HASH` of a mesh in memory. No path, no time. Kept in the asset.
struct BakeRecord {
  std::string text;
  bool operator==(const BakeRecord&) const = default;
};

/// Record of a mesh file. Materials and textures change no geometry.
/// @return nothing when a file cannot be read or understood: import_mesh says why
[[nodiscard]] std::optional<BakeRecord> bake_record(const std::filesystem::path& mesh, const BakeSettings& settings);

/// A mesh file at one moment. Two states are equal only if none of the mesh's files was written in between, not even
/// with the same bytes. This relies on the change times that the file system keeps.
struct MeshState {
  std::optional<BakeRecord> record;  ///< as of bake_record
  std::string stamps;                ///< which files they are, and when they changed last
  bool operator==(const MeshState&) const = default;
};

[[nodiscard]] MeshState mesh_state(const std::filesystem::path& mesh, const BakeSettings& settings);

/// Record of a mesh in memory: vertices and triangles as they are, in their order.
[[nodiscard]] BakeRecord bake_record(const TriangleMesh& mesh, const BakeSettings& settings);

/// The files that determine a mesh's geometry: the mesh file, and the buffers of a gltf or glb file. Includes files
/// that cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> mesh_files(const std::filesystem::path& mesh,
                                                            const ImportOptions& import = {});

/// Puts a record into an asset that was just baked.
void add_record(const BakeRecord& record, BakedAsset& baked);

/// The record in an asset; empty when it has none.
[[nodiscard]] BakeRecord record_of(const Asset& asset);

/// 32 hexadecimal digits: XXH3-128 of a record's text.
struct CacheKey {
  std::string digits;
  bool operator==(const CacheKey&) const = default;
};

[[nodiscard]] CacheKey cache_key(const BakeRecord& record);

/// What a bake reports besides its asset. The cache keeps it with the asset, so that a hit reports the same.
struct BakeReport {
  BakePlan plan;
  Repair repair = Repair::none;    ///< what was needed
  double filled_share = 0;         ///< as in BakedAsset
  std::vector<std::string> notes;  ///< of import and bake, one sentence each
};

/// An entry is two files: KEY.vps.hdf, byte for byte what a bake writes, and KEY.json, the report. They appear whole or
/// not at all, the report first. An entry is used only after every hash in both was compared. The modification time of
/// its asset is the time of its last use. See docs/cache.md.
class AssetCache {
 public:
  /// @param folder     made when the first entry is stored
  /// @param max_bytes  above this size the least recently used entries are removed; the folder may exceed it by a few
  ///                   per cent now and then; 0: no limit
  explicit AssetCache(std::filesystem::path folder, std::uint64_t max_bytes = 0)
      : folder_(std::move(folder)), max_bytes_(max_bytes) {}

  /// Maps an entry and marks it as used. @return false when it is absent or damaged; then bake and store it
  [[nodiscard]] bool open(const CacheKey& key, Asset& asset, BakeReport& report) const;

  /// Adds an entry, or replaces it.
  /// @param key    of the record in `asset`; nothing when a file of the mesh cannot be read: then nothing is stored
  /// @param asset  the bytes of the whole file
  /// @return why it could not be stored, without a full stop; empty when it was
  [[nodiscard]] std::string store(const std::optional<CacheKey>& key, std::span<const std::byte> asset,
                                  const BakeReport& report) const;

 private:
  void keep_small(const CacheKey& stored, std::uint64_t bytes) const;
  std::filesystem::path folder_;
  std::uint64_t max_bytes_;
};

}  // namespace vps::bake
