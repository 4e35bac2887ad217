// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Treats a fuzzer's bytes as an asset and does everything that a simulation does with it.
#pragma once

#include <cstddef>
#include <span>

#include "formats/vps_format.h"

namespace vps::test {

/// Opens the bytes in memory and runs every kind of query, at points, poses and scales that depend on the bytes.
/// @param file  aligned to Asset::kMemoryAlignment
/// @return the status of Asset::open
/// @throw WrongAnswer for an answer with the status ok that is no number
Status ask_asset(std::span<const std::byte> file);

}  // namespace vps::test
