// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Samples where a field jumps most between bricks: at least one of the two errs there. Internal to bake.
#pragma once

#include "bake/stages/certify.h"
#include "bake/stages/sample_field.h"

namespace vps::bake {

/// V of stored samples, from the level of their brick and their number in the tree. [m]
struct StoredSamples {
  const FieldTree& tree;
  const SampleForm& form;
  bool real = false;  ///< those of `real`, instead of `scaled`
  [[nodiscard]] double operator()(int level, std::size_t n) const {
    return real ? tree.penetration[n] : tree.scaled[n] * form.step(level);
  }
};

/// Starts of the search for the largest error, in the band that the certificate covers: both sides of the faces between
/// bricks, where the bricks differ most. The two errors add up to the difference.
[[nodiscard]] std::vector<CertificateSample> jump_samples(const Truth& truth, const Grid& grid,
                                                          const StoredSamples& stored);

}  // namespace vps::bake
