// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The library itself, past Bullet.
#pragma once

#include <filesystem>
#include <memory>

#include "cli/lab/pair.h"

namespace vps::lab {

/// `traverse` alone, all contacts: the asset's pointshell against its voxelmap.
/// @param options  without `cache`; `node_areas` are found where a level or a budget needs them
/// @throw std::runtime_error when the asset lacks one of them
[[nodiscard]] std::unique_ptr<PairPeer> our_traverse(std::shared_ptr<const Asset> asset, QueryOptions options = {});

/// `separation`, exact: the same asset against itself.
/// @throw std::runtime_error when the asset lacks one of them
[[nodiscard]] std::unique_ptr<PairPeer> our_separation(std::shared_ptr<const Asset> asset);

/// A pose of bodies about their centres of mass, for an asset's own frame.
[[nodiscard]] Pose in_asset_frame(const Asset& asset, Pose pose);

struct Opening {
  double open_us = 0;   ///< map and validate
  double query_us = 0;  ///< the same, and a first query with fresh working memory
};

/// Opens a file anew and asks it once.
/// @throw std::runtime_error
[[nodiscard]] Opening open_once(const std::filesystem::path& asset, const Pose& first_in_second);

}  // namespace vps::lab
