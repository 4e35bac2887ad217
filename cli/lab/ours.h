// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Queries of this library without Bullet, and the time to open an asset.
#pragma once

#include <filesystem>
#include <memory>

#include "cli/lab/pair.h"

namespace vps::lab {

/// Times `traverse` of the asset's pointshell against its voxelmap, with all contacts.
/// @param options  without `cache`; `node_areas` are computed where a level or a budget needs them
/// @throw std::runtime_error when the asset has no pointshell or no voxelmap
[[nodiscard]] std::unique_ptr<PairPeer> our_traverse(std::shared_ptr<const Asset> asset, QueryOptions options = {});

/// Times an exact `separation` (tolerance 0) of the asset against itself.
/// @throw std::runtime_error when the asset has no pointshell or no voxelmap
[[nodiscard]] std::unique_ptr<PairPeer> our_separation(std::shared_ptr<const Asset> asset);

/// Converts a pose between bodies whose origins are their centres of mass to one between asset frames.
[[nodiscard]] Pose in_asset_frame(const Asset& asset, Pose pose);

struct Opening {
  double open_us = 0;   ///< to map and validate the file
  double query_us = 0;  ///< `open_us` and a first query with fresh working memory
};

/// Opens a file and runs one query.
/// @throw std::runtime_error
[[nodiscard]] Opening open_once(const std::filesystem::path& asset, const Pose& first_in_second);

}  // namespace vps::lab
