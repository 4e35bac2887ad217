// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A fuzzer's asset in a world of Bullet's.
#pragma once

#include <memory>

#include "runtime/vps_runtime.h"

namespace vps::test {

/// Drops a sound body and a box of Bullet's on the asset, and the asset on them.
/// @throw WrongAnswer when a body that is not the asset's gets a pose that is no number
void ask_bullet(const std::shared_ptr<const Asset>& asset, const std::shared_ptr<const Asset>& sound);

}  // namespace vps::test
