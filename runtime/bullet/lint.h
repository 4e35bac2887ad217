// SPDX-License-Identifier: Zlib
/// @file Checks that the algorithm is registered. Internal.
#pragma once

#include "runtime/bullet/vps_bullet.h"

namespace vps::bullet {

/// Whether a dispatcher was passed to register_algorithm. Has the dispatcher create one algorithm, and deletes it.
[[nodiscard]] bool is_registered(btDispatcher& dispatcher, const Shape& shape);

/// Whether any dispatcher of the program was passed to register_algorithm. For calls that see no dispatcher: where only
/// Shapes meet, an unregistered dispatcher calls getAabb and nothing else.
[[nodiscard]] bool is_any_dispatcher_registered();

}  // namespace vps::bullet
