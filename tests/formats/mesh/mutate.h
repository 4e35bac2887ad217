// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Damages files at random, the same on every machine.
#pragma once

#include <cstdint>
#include <random>
#include <string>

namespace vps::test {

/// @return `seed_file` with one to four mutations, mostly one: bytes flipped, deleted, inserted or duplicated; written
///         or binary numbers replaced by extreme ones; the end truncated
[[nodiscard]] std::string mutate(std::string seed_file, std::mt19937_64& random);

}  // namespace vps::test
