// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The samples around a block, side by side for vectors. Internal to bake.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/stages/surface_blocks.h"

namespace vps::bake {

/// Squared distances of a sample from the corners of a piece. [m^2]
using CornerDistances = std::array<double, 3>;

/// The samples around a block, in the order of SurfaceBlocks::for_each_near.
class NearSamples {
 public:
  /// A sample, and how far it is from a piece.
  struct Found {
    Sample* sample;
    CornerDistances squared;
    double farthest;  ///< of these
  };

  /// Takes the samples within reach of the patches of `home`.
  void collect(const SurfaceBlocks& blocks, const Block& home, double reach);
  /// Adds a sample that was inserted into the blocks since then. It lies on a patch of `home`.
  void insert(Sample& sample);

  /// Finds samples within reach of a piece of `home`, in order. Only those count whose normals have a cosine above
  /// `same_side` with the piece's. The best is the one whose farthest corner is nearest. Found are all that are nearer
  /// to some corner than the best, and all that are better than each before them.
  void find(const Piece& piece, const Vector& normal, double same_side, std::vector<Found>& found);

 private:
  using Position = SurfaceBlocks::Position;

  [[nodiscard]] std::size_t number_of(const Position& cell) const {
    return static_cast<std::size_t>(((cell[2] - from_[2]) * dims_[1] + cell[1] - from_[1]) * dims_[0] + cell[0] -
                                    from_[0]);
  }

  const SurfaceBlocks* blocks_ = nullptr;
  double reach_ = 0;
  Position from_{}, dims_{};          // the first cell and how many
  std::vector<std::uint32_t> first_;  // of each cell's samples, and the end
  std::vector<Sample*> samples_;
  std::array<std::vector<double>, 7> lanes_;  // position, normal, number of the cell along x; then padding
  // Of a search.
  std::array<std::vector<double>, 3> squared_;
  std::vector<double> farthest_;
  std::vector<std::uint32_t> places_;
};

}  // namespace vps::bake
