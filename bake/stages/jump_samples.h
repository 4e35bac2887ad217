// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Samples where a field jumps most between bricks: at least one of the two errs there. Internal to bake.
#pragma once

#include <functional>

#include "bake/stages/certify.h"
#include "bake/stages/sample_field.h"

namespace vps::bake {

/// V of a stored sample, from its brick's level and its number in the tree. [m]
using StoredSample = std::function<double(int level, std::size_t n)>;

/// Starts of the search for the largest error, in the band that the certificate covers: both sides of the faces between
/// bricks, where the bricks differ most. The two errors add up to the difference.
[[nodiscard]] std::vector<CertificateSample> jump_samples(const Truth& truth, const Grid& grid, const FieldTree& tree,
                                                          const StoredSample& stored);

}  // namespace vps::bake
