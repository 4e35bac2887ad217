// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Damages assets on purpose, and puts their hashes right again.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "formats/vps_format.h"
#include "tests/support/random.h"

namespace vps::test {

using Bytes = std::vector<std::byte>;

/// Sets only the hash of the header. With a wrong hash nearly every changed file would be refused at once.
void seal_header(std::span<std::byte> file);

/// Sets all hashes: of the sections, of the bytes between them, and of the header. Then checks behind the hashes see
/// the damage. Does nothing to files whose directory is refused.
void seal_everything(std::span<std::byte> file);

/// Replaces one to four values of the header or of sections by near values, extreme values or noise.
void mutate(Bytes& file, Random& random);

}  // namespace vps::test
