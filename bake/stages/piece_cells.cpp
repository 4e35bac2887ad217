// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/piece_cells.h"

namespace vps::bake {

std::span<const PieceCells::Place> PieceCells::cell(const Candidate& of) {
  if (is_surely_empty(of)) return {};
  std::size_t count = 3;
  reserve(count);
  Place* cell = places_[0].data();
  Place* clipped = places_[1].data();
  cell[0] = {1, 0};
  cell[1] = {0, 1};
  cell[2] = {0, 0};
  for (const Candidate& other : candidates_) {
    if (&other == &of) continue;
    const double third = of.squared[2] - other.squared[2];
    const double slope[2] = {of.squared[0] - other.squared[0] - third, of.squared[1] - other.squared[1] - third};
    if (third < 0 && third + slope[0] < 0 && third + slope[1] < 0) continue;
    double* const excess = excess_.data();
    // Places equally far from both belong to the first.
    const bool is_first = &of < &other;
    const auto inside = [&](double e) { return e < 0 || (e == 0 && is_first); };
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      excess[i] = third + cell[i][0] * slope[0] + cell[i][1] * slope[1];
      kept += inside(excess[i]) ? 1 : 0;
    }
    if (kept == count) continue;
    if (kept == 0) return {};
    std::size_t made = 0;
    for (std::size_t i = 0, previous = count - 1; i < count; previous = i++) {
      const double before = excess[previous];
      const double here = excess[i];
      const Place& p = cell[i];
      if (inside(before) != inside(here)) {
        const Place& q = cell[previous];
        const double t = before / (before - here);
        clipped[made++] = {q[0] + t * (p[0] - q[0]), q[1] + t * (p[1] - q[1])};
      }
      if (inside(here)) clipped[made++] = p;
    }
    count = made;
    places_[0].swap(places_[1]);
    reserve(count);
    cell = places_[0].data();
    clipped = places_[1].data();
  }
  return {cell, count};
}

}  // namespace vps::bake
