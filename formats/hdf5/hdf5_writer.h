// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Writes an asset as HDF5 with the user-block directory. The only user of libhdf5.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "formats/vps_format.h"

namespace vps {

/// One section's content, C order, little-endian. `bytes` must hold exactly the product of shape and element size.
struct SectionData {
  SectionKind kind{};
  ElementType element{};
  std::vector<std::uint64_t> shape;
  std::vector<std::byte> bytes;
  std::optional<std::uint64_t> hash = {};  ///< of the bytes, if known: `hash_bytes`
};

struct WriteError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Prefix of the names of temporary files. A file that a killed process has left may be deleted.
inline constexpr std::string_view kTemporaryPrefix = ".vps.";

/// The file that a symbolic link leads to, also one that does not exist yet. A loop of links is a link again.
[[nodiscard]] std::filesystem::path link_target(std::filesystem::path path);

/// Writes the asset whole or not at all: a temporary file in the folder of `path`, fsync, then a link or rename. The
/// temporary file has no name where the file system supports that. Same input, same bytes.
/// Threads may call it at the same time.
/// @return size of the file. [bytes]
/// @throw WriteError with the reason and what to do.
std::size_t write_asset(const std::filesystem::path& path, const AssetInfo& info,
                        std::span<const SectionData> sections);

/// The bytes that `write_asset` writes, for `Asset::open`.
/// @throw WriteError with the reason and what to do.
[[nodiscard]] std::vector<std::byte> asset_bytes(const AssetInfo& info, std::span<const SectionData> sections);

/// Whether a symbolic link at an output's name leads to the file that is written, or the file takes its place.
enum class Links : std::uint8_t { follow, replace };

/// Writes any bytes whole or not at all, as write_asset does.
/// @throw WriteError with the reason and what to do.
void write_whole(const std::filesystem::path& path, std::span<const std::byte> bytes, Links links = Links::follow);

}  // namespace vps
