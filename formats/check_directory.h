// SPDX-License-Identifier: Zlib
/// @file Checks what a decoded directory says, before any section is looked at. Internal.
#pragma once

#include "formats/vps_format.h"

namespace vps::detail {

/// @pre directory.section_count <= kMaxSections
[[nodiscard]] Status check_directory(const Directory& directory) noexcept;

}  // namespace vps::detail
