// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What a fuzzer does with bytes that may be an asset: everything that a simulation does.
#pragma once

#include <cstddef>
#include <span>

#include "formats/vps_format.h"

namespace vps::test {

/// Sets the hash of the header, which would refuse nearly every change at once, and leaves all else.
void seal_header(std::span<std::byte> file);

/// Opens the bytes in memory and runs every kind of query, from places and poses drawn from the bytes.
/// @param file  aligned to Asset::kMemoryAlignment
/// @return what Asset::open said
Status ask_asset(std::span<const std::byte> file);

}  // namespace vps::test
