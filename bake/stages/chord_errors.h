// SPDX-License-Identifier: GPL-3.0-or-later
/// @file How far straight lines between samples may lie from the sampled field, judged by its bends. Vectorized.
/// Internal to bake.
#pragma once

namespace vps::bake {

/// Samples on all lines along the axes through a cube of 9x9x9 samples, and three more at both ends of each.
/// Sample (x,y,z) lies on line 9 z + y along x, 9 z + x along y and 9 y + x along z.
struct ChordLines {
  static constexpr int kSide = 9;
  static constexpr int kHalo = 3;
  static constexpr int kLines = 96;  ///< rounded up for vectors
  /// [axis][kHalo + place][line]: NaN where a value is not known, and in the padding.
  alignas(64) float value[3][kSide + 2 * kHalo][kLines];
  /// [axis][1 + place][line]: error of the chord from this place to the next, in the unit of `value`. Signed: positive
  /// where the chord lies above.
  alignas(64) float error[3][kSide + 1][kLines];
};

/// Fills `error`. The bends at a chord's ends, a and b, tell a crease between them, where the chord errs by
/// a b / (a + b), from a curve, whose bend goes on beyond and whose chord errs by an eighth of it; what the bends
/// beyond have in common with a and b counts as curve. Where a bend is not known there may be a crease as sharp as the
/// known end's. The same bits with all vector instructions.
void chord_errors(ChordLines& lines);

}  // namespace vps::bake
