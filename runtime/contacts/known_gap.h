// SPDX-License-Identifier: Zlib
/// @file A proven distance between two bodies, and how long it holds. Internal.
#pragma once

#include <algorithm>
#include <cmath>

namespace vps::detail {

/// Where a body is in the world, in the engine's own numbers: to convert them takes longer than to compare them.
template <class Scalar>
struct PlaceRef {
  static constexpr int kRow = 4;     ///< numbers of a row; the last one is not read
  const Scalar* rotation = nullptr;  ///< row-major
  const Scalar* origin = nullptr;    ///< [m]

  [[nodiscard]] float entry(int i) const noexcept { return static_cast<float>(rotation[i / 3 * kRow + i % 3]); }
};

/// Answers for a pair that is apart by the places of its bodies alone. Most pairs whose boxes overlap are apart, and
/// their relative pose and its change would take longer than the rest of the engine's step.
///
/// Proof. A point x of the first body and a point y of the second, each in the frame of its body, are
/// A x + a - (B y + b) from each other. From one step to another this vector changes by dA x - dB y + d(a - b). A
/// matrix stretches a vector by no more than its Frobenius norm. So no distance between the bodies falls by more than
/// |d(a - b)| + |dA| |x| + |dB| |y|, with the largest |x| and |y|: the arms. Where the second body has no end, look
/// from its frame, where x lies at B^T (A x + a - b): dB acts on a vector no longer than |a - b| + |x|.
class KnownGap {
 public:
  KnownGap() = default;
  /// @param distance  proven for the bodies where they are now. [m]
  /// @param arms      of spheres about their origins that hold their surfaces; one may be infinite. [m]
  template <class Scalar>
  KnownGap(double distance, const PlaceRef<Scalar> (&places)[2], const float (&arms)[2]) noexcept {
    for (int i = 0; i < 3; ++i) between_[i] = difference(places, i);
    const float between = std::sqrt(dot_of(between_));
    for (int body = 0; body < 2; ++body) {
      arms_[body] = std::min(arms[body], between + arms[1 - body]);
      for (int i = 0; i < 9; ++i) rotations_[body][i] = places[body].entry(i);
    }
    // Of single precision, in which the places are compared.
    constexpr double kRounding = 5e-7;
    distance_ = static_cast<float>(distance - kRounding * double{between + arms_[0] + arms_[1]});
  }

  /// Whether the bodies are surely farther apart than `reach`. False where a place is not finite. [m]
  template <class Scalar>
  [[nodiscard]] bool exceeds(float reach, const PlaceRef<Scalar> (&places)[2]) const noexcept {
    if (!(distance_ > reach)) return false;
    float moved[3];
    for (int i = 0; i < 3; ++i) moved[i] = difference(places, i) - between_[i];
    float lost = std::sqrt(dot_of(moved));
    for (int body = 0; body < 2; ++body) {
      float squared = 0;
      for (int i = 0; i < 9; ++i) {
        const float change = places[body].entry(i) - rotations_[body][i];
        squared += change * change;
      }
      lost += std::sqrt(squared) * arms_[body];
    }
    return distance_ - lost > reach;
  }

 private:
  template <class Scalar>
  static float difference(const PlaceRef<Scalar> (&places)[2], int i) noexcept {
    return static_cast<float>(places[0].origin[i] - places[1].origin[i]);
  }
  static float dot_of(const float (&v)[3]) noexcept { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

  float distance_ = 0;  // less what rounding may take; 0: none. [m]
  float between_[3] = {};
  float arms_[2] = {};
  float rotations_[2][9] = {};
};

}  // namespace vps::detail
