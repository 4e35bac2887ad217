// SPDX-License-Identifier: Zlib
/// @file What lint and shapes ask of the algorithm. Internal.
#pragma once

#include "runtime/bullet/vps_bullet.h"

namespace vps::bullet {

/// Whether a dispatcher was given to register_algorithm.
[[nodiscard]] bool is_registered(btDispatcher& dispatcher, const Shape& shape);

/// Whether any dispatcher of the program was.
[[nodiscard]] bool any_dispatcher_knows();

}  // namespace vps::bullet
