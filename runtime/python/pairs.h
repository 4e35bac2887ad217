// SPDX-License-Identifier: Zlib
/// @file Queries of two assets over many poses. Either may give the points; all results are in the first one's frame.
/// Internal.
#pragma once

#include "runtime/python/held.h"

namespace vps::python {

/// @param matrices  of the second body in the first one, shape (n, 4, 4)
/// @return contacts of all poses one after the other; the pose of each; the result of each pose
py::tuple contacts(const SharedHeld& first, const SharedHeld& second, const Doubles& matrices, float distance,
                   std::uint32_t threads);

/// @param most  for each pose
/// @return room for `most` contacts of each pose; how many there are
py::tuple step_contacts(const SharedHeld& first, const SharedHeld& second, const Doubles& matrices, float distance,
                        std::uint32_t most, std::uint32_t threads);

/// @return for each pose; `direction` points from the first body to the second
py::array_t<VpsSeparation> separation(const SharedHeld& first, const SharedHeld& second, const Doubles& matrices,
                                      float tolerance, std::uint32_t threads);

/// The second body moves, and gives the points.
/// @param start   shape (1, 4, 4)
/// @param motion  velocity, angular velocity, duration: shape (7,)
/// @return whether there is an impact; its time; the separation then
py::tuple time_of_impact(const SharedHeld& first, const SharedHeld& second, const Doubles& start, const Doubles& motion,
                         float distance, float tolerance);

}  // namespace vps::python
