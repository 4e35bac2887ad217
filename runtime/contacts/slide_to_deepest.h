// SPDX-License-Identifier: Zlib
/// @file Moves a contact from a sample of the shell to the place between the samples where the bodies overlap most.
/// Internal. The paper's contacts (Sec. 2.3) stay at the samples.
#pragma once

#include <cstdint>
#include <span>

#include "runtime/fields/placed_field.h"

namespace vps::detail {

/// Two bodies that touch, seen from the frame of their contacts.
struct TouchingBodies {
  const PlacedField& shell;    ///< distances of the shell's body; scaled or real
  const FieldAtPlaces& field;  ///< the other body
  float voxel_size = 0;        ///< of the shell's distances. [m]
};

/// Where a contact may go.
struct Reach {
  float ring = 0;  ///< radius of the neighbourhood that decides: a few voxels. [m]
  /// Of a contact ahead: the plane of the place where it arrives, in place of the field. Null: the bodies touch now.
  const HalfSpaceField* arrival = nullptr;
};

enum class Slide : std::uint8_t {
  stayed,   ///< no place near it is better: the bodies are flat or sharp there
  arrived,  ///< the contact is where the bodies overlap most
  sloping,  ///< the overlap still grows farther away
};

/// A contact that slides.
struct Slider {
  Contact* contact = nullptr;  ///< with its final direction. Position, penetration and direction change when it arrives
                               ///< or slopes
  Slide* slide = nullptr;      ///< the result
  Reach reach;
};

/// Slides contacts along the bodies to where they overlap most, each at most one ring away. The gap between the bodies,
/// at a place between them, is the sum of both distances. A quadratic through the gaps at the contact and on a ring
/// around it has its least value where two smooth bodies touch. Along directions in which the gap is flat or has an
/// edge the contact stays. Values of a ring, unlike the gradient at one point, average the fields' rounding.
///
/// No contact depends on another. They go together because one alone fills half of a vector.
void slide_to_deepest(const TouchingBodies& bodies, std::span<Slider> sliders) noexcept;

/// Whether the shell slopes away from a contact's plane by more than about 9 degrees, without an edge or corner there.
bool is_steep(const TouchingBodies& bodies, const Contact& contact) noexcept;

}  // namespace vps::detail
