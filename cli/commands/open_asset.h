// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Opens the assets on the command line.
#pragma once

#include <string>

#include "runtime/vps_runtime.h"

namespace vps::cli {

/// What `check_is_file` advises where an asset is expected.
inline constexpr const char* kAssetFile = "a .vps.hdf file";

/// Opens an asset and checks every hash; prints an error in one line.
/// @param reason  takes the error; may be null
/// @return kOk, kIo or kBadInput
[[nodiscard]] int open_asset(const std::string& path, Asset& asset, std::string* reason = nullptr);

/// Prints in one line that an asset lacks the field. @return kBadInput
[[nodiscard]] int fail_field(const std::string& asset, const std::string& name);

}  // namespace vps::cli
