// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The mutants that tests and the long run share.
#pragma once

#include <map>
#include <string>

#include "tests/fuzz/mutate.h"

namespace vps::test {

/// The bytes of each seed, by its name.
[[nodiscard]] const std::map<std::string, Bytes>& seed_files();

/// How much is asked about a mutant that opens.
enum class Questions : std::uint8_t {
  queries,
  everything,  ///< Bullet, views, checks and exports too
};

/// Mutant `number` of a seed: the same bytes on every machine. Of odd numbers all hashes are right, of even ones only
/// the header's.
/// @return the status of its opening
/// @throw WrongAnswer
Status ask_mutant(const Bytes& seed, std::uint64_t number, Questions questions);

}  // namespace vps::test
