// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The samples of the bricks of half the size in those of a brick. Internal to bake.
#pragma once

#include <array>
#include <cstddef>

namespace vps::bake {

/// Fills a cube of samples at half the step from one of `Edge` samples a side, both x fastest: every second sample is
/// one of `coarse`, the ones between combine their neighbours, axis by axis.
template <int Edge, class T, std::size_t M, std::size_t N, class Combine>
void fill_between(const std::array<T, M>& coarse, Combine combine, std::array<T, N>& fine) {
  constexpr int kFine = 2 * Edge - 1;
  static_assert(M >= Edge * Edge * Edge && N >= kFine * kFine * kFine);
  const auto widen = [&](const T* from, int from_step, T* to, int to_step) {
    for (int i = 0; i + 1 < Edge; ++i) {
      to[2 * i * to_step] = from[i * from_step];
      to[(2 * i + 1) * to_step] = combine(from[i * from_step], from[(i + 1) * from_step]);
    }
    to[(kFine - 1) * to_step] = from[(Edge - 1) * from_step];
  };
  T x[Edge][Edge][kFine];
  T xy[Edge][kFine][kFine];
  for (int z = 0; z < Edge; ++z) {
    for (int y = 0; y < Edge; ++y) widen(coarse.data() + (z * Edge + y) * Edge, 1, x[z][y], 1);
    for (int i = 0; i < kFine; ++i) widen(&x[z][0][i], kFine, &xy[z][0][i], kFine);
  }
  for (int i = 0; i < kFine * kFine; ++i) widen(&xy[0][0][0] + i, kFine * kFine, fine.data() + i, kFine * kFine);
}

}  // namespace vps::bake
