// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The Voronoi cells of the samples on a piece of the surface. Internal to bake.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "bake/stages/piece_kernels.h"
#include "bake/stages/surface_blocks.h"

namespace vps::bake {

/// Two points are on the same side if the cosine between their triangles' normals is above this. Others lie on two
/// sides of a wall or wedge. Both sides are sampled, however thin it is.
inline constexpr double kSameSide = -0.25;

/// The Voronoi cells of the samples on a piece's side, clipped to the piece. The difference of the squared distances to
/// two samples is linear on a piece. So a cell is a convex polygon, and it is farthest from its sample at a corner.
class PieceCells {
 public:
  /// Place on a piece: the weights of its first two corners.
  using Place = std::array<double, 2>;

  /// A sample that may be the nearest to some place on a piece.
  using Candidate = NearSamples::Found;

  /// Starts with the samples that are within reach of the piece.
  PieceCells(const SurfaceBlocks& blocks, double reach) : blocks_(blocks), reach_(reach) {}

  void start(const Block& home, const Piece& piece, const Vector& normal) {
    piece_ = piece;
    for (std::size_t k = 0; k < 3; ++k) edges_[k] = (piece[k] - piece[k == 2 ? 0 : k + 1]).squaredNorm();
    if (home_ != &home) near_.collect(blocks_, home, reach_);
    home_ = &home;
    candidates_.clear();
    near_.find(piece, normal, kSameSide, found_);
    for (const Candidate& c : found_) push(c);
    prune();
  }
  void add(Sample& sample) {
    near_.insert(sample);
    Candidate c{&sample, {}, 0};
    for (std::size_t k = 0; k < 3; ++k) c.squared[k] = (sample.position - piece_[k]).squaredNorm();
    c.farthest = std::max({c.squared[0], c.squared[1], c.squared[2]});
    push(c);
    prune();
  }

  /// The samples that may have a cell. The first is the one whose farthest corner is nearest.
  [[nodiscard]] const std::vector<Candidate>& candidates() const { return candidates_; }
  [[nodiscard]] Vector at(const Place& p) const {
    return p[0] * piece_[0] + p[1] * piece_[1] + (1 - p[0] - p[1]) * piece_[2];
  }
  [[nodiscard]] double squared_distance(const Candidate& c, const Place& p) const {
    const double third = 1 - p[0] - p[1];
    return p[0] * c.squared[0] + p[1] * c.squared[1] + third * c.squared[2] -
           (p[0] * p[1] * edges_[0] + p[1] * third * edges_[1] + third * p[0] * edges_[2]);
  }
  /// Whether all of the piece is surely nearer to a sample than the root of `limit`. Much faster than the cells.
  [[nodiscard]] bool surely_covered(double limit) const { return bake::surely_covered(candidates_, edges_, limit); }
  /// The corners of a candidate's cell, which may be empty. Valid until the next call.
  std::span<const Place> cell(const Candidate& of);

 private:
  void push(const Candidate& c) {
    if (!candidates_.empty() && !may_have_cell(c)) return;
    candidates_.push_back(c);
    if (c.farthest < candidates_.front().farthest) std::swap(candidates_.front(), candidates_.back());
  }

  // A sample that is farther than the first from all corners is farther from all of the piece.
  [[nodiscard]] bool may_have_cell(const Candidate& c) const {
    const std::array<double, 3>& first = candidates_.front().squared;
    return c.squared[0] < first[0] || c.squared[1] < first[1] || c.squared[2] < first[2];
  }
  // Whether another sample is nearer to all corners, by more than rounding.
  [[nodiscard]] bool is_surely_empty(const Candidate& c) const {
    const double margin = 1e-12 * c.farthest;
    for (const Candidate& other : candidates_) {
      const double gain[3] = {c.squared[0] - other.squared[0], c.squared[1] - other.squared[1],
                              c.squared[2] - other.squared[2]};
      if (std::min({gain[0], gain[1], gain[2]}) > margin) return true;
    }
    return false;
  }
  void prune() {
    if (candidates_.empty()) return;
    const auto none = std::remove_if(candidates_.begin() + 1, candidates_.end(),
                                     [&](const Candidate& c) { return !may_have_cell(c); });
    candidates_.erase(none, candidates_.end());
  }

  // Makes room to cut a cell. In exact arithmetic one more corner would do.
  void reserve(std::size_t corners) {
    if (excess_.size() >= 2 * corners) return;
    excess_.resize(4 * corners);
    for (std::vector<Place>& places : places_) places.resize(4 * corners);
  }

  const SurfaceBlocks& blocks_;
  const double reach_;
  NearSamples near_;
  std::vector<Candidate> found_;
  const Block* home_ = nullptr;
  Piece piece_;
  std::array<double, 3> edges_ = {};  // squared
  std::vector<Candidate> candidates_;
  std::vector<Place> places_[2];  // a cell's corners, and those after the next cut
  std::vector<double> excess_;    // of the corners
};

}  // namespace vps::bake
