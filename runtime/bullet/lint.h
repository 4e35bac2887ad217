// SPDX-License-Identifier: Zlib
/// @file What lint asks of the algorithm. Internal.
#pragma once

#include "runtime/bullet/vps_bullet.h"

namespace vps::bullet {

/// Whether a dispatcher was given to register_algorithm.
[[nodiscard]] bool is_registered(btDispatcher& dispatcher, const Shape& shape);

}  // namespace vps::bullet
