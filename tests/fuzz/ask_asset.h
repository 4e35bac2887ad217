// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Treats a fuzzer's bytes as an asset and does everything that a simulation does with it.
#pragma once

#include <cstddef>
#include <span>

#include "formats/vps_format.h"

namespace vps::test {

/// Sets only the hash of the header. With a wrong hash nearly every changed file would be refused at once.
void seal_header(std::span<std::byte> file);

/// Opens the bytes in memory and runs every kind of query, at points and poses that depend on the bytes.
/// @param file  aligned to Asset::kMemoryAlignment
/// @return the status of Asset::open
Status ask_asset(std::span<const std::byte> file);

}  // namespace vps::test
