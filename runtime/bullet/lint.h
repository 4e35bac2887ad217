// SPDX-License-Identifier: Zlib
/// @file What lint and shapes ask of the algorithm. Internal.
#pragma once

#include "runtime/bullet/vps_bullet.h"

namespace vps::bullet {

/// Whether a dispatcher was given to register_algorithm: creates one algorithm by it, and deletes that.
[[nodiscard]] bool is_registered(btDispatcher& dispatcher, const Shape& shape);

/// Whether any dispatcher of the program was given to register_algorithm. For calls that see no dispatcher: where
/// Shapes meet Shapes alone, an unregistered dispatcher calls getAabb and nothing else.
[[nodiscard]] bool is_any_dispatcher_registered();

}  // namespace vps::bullet
