// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Damages files at random, the same on every machine.
#pragma once

#include <cstdint>
#include <random>
#include <string>

namespace vps::test {

/// @return `seed_file` with one to four mutations: bytes flipped, deleted, inserted, duplicated; numbers, written or
///         binary, replaced by extreme ones; the end cut off. Mostly one.
[[nodiscard]] std::string mutate(std::string seed_file, std::mt19937_64& random);

}  // namespace vps::test
