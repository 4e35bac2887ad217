// SPDX-License-Identifier: Zlib
/// @file Checks a decoded directory before any section is read. Internal.
#pragma once

#include "formats/vps_format.h"

namespace vps::detail {

/// @pre directory.section_count <= kMaxSections
[[nodiscard]] Status check_directory(const Directory& directory) noexcept;

}  // namespace vps::detail
