// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Estimates the error of straight lines between samples from the field's second differences. Vectorized.
/// Internal to bake.
#pragma once

namespace vps::bake {

/// Samples on all lines along the axes through a cube of 9x9x9 samples, with three more at both ends of each line.
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

/// Fills `error`. A bend is the second difference at a sample; a and b are the bends at a chord's ends. A crease
/// between the ends gives the chord an error of a b / (a + b). A curve gives it an error of an eighth of the bend, and
/// the bend continues beyond the ends. So the part of a and b that the next bends beyond the ends have in common with
/// them counts as curve, the rest as crease. Where one of a and b is not known, the other one's value is used for it.
/// The results are bit-identical with all vector instructions.
void chord_errors(ChordLines& lines);

}  // namespace vps::bake
