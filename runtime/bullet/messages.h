// SPDX-License-Identifier: Zlib
/// @file Messages about wrong use. Internal.
#pragma once

#include <string>

#include "runtime/bullet/vps_bullet.h"

namespace vps::bullet {

/// Passes a line about a shape to the handler.
/// @param text  what is wrong; what to do
void send_message(const Shape& shape, const std::string& text);

}  // namespace vps::bullet
