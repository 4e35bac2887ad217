// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Leaves out slices of field bricks that lie beyond the band, and stores equal bricks once. Internal to bake.
#pragma once

#include <tbb/parallel_for.h>

#include <array>
#include <utility>
#include <vector>

#include "bake/stages/sample_field.h"

namespace vps::bake {

/// Number of a brick's stored sample n among all samples of the brick.
[[nodiscard]] inline std::size_t sample_of(const octree::Slices& stored, std::uint32_t n) {
  std::array<std::uint32_t, 3> at = {n % kFieldEdge, n / kFieldEdge % kFieldEdge, stored.first + n / kFieldSlice};
  std::swap(at[stored.axis], at[2]);
  return (std::size_t{at[2]} * kFieldEdge + at[1]) * kFieldEdge + at[0];
}

/// A tree as the asset stores it. V of a point is the same in both, except in cells beyond the band: there it may be
/// closer to 0, but not in the band.
struct TrimmedTree {
  std::vector<std::uint32_t> roots, nodes;
  std::vector<octree::Slices> bricks;  ///< what is stored of each brick of the tree
  std::vector<std::uint32_t> first;    ///< number of each brick's first slice
  std::vector<std::uint32_t> kept;     ///< bricks that are stored: others have the slices of one of these
  std::size_t slices = 0;              ///< f

  /// @param values  of the whole bricks, [b,125,n] with `parts` n
  /// @return those that are stored, [f,25,n]
  template <class Stored, class Value>
  [[nodiscard]] UnsetVector<Stored> stored(const UnsetVector<Value>& values, std::size_t parts = 1) const {
    UnsetVector<Stored> out(slices * kFieldSlice * parts);
    tbb::parallel_for(std::size_t{0}, kept.size(), [&](std::size_t i) {
      const std::size_t brick = kept[i];
      const octree::Slices& slices_here = bricks[brick];
      Stored* to = out.data() + first[brick] * kFieldSlice * parts;
      for (std::uint32_t n = 0; n < kFieldSlice * slices_here.count; ++n) {
        const std::size_t from = (brick * kFieldSamples + sample_of(slices_here, n)) * parts;
        for (std::size_t part = 0; part < parts; ++part) *to++ = static_cast<Stored>(values[from + part]);
      }
    });
    return out;
  }
};

/// Leaves out as many slices as possible at one end of each brick. Bricks with the same samples share their slices, as
/// along faces that are level in the grid: queries find out sooner that such a face is flat. Samples of cells to which
/// no entry leads may change.
[[nodiscard]] TrimmedTree trim_bricks(const FieldTree& tree, const SampleForm& form);

}  // namespace vps::bake
