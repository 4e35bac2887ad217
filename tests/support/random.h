// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Deterministic random numbers, for tests.
#pragma once

#include "cli/lab/random.h"

namespace vps::test {

using lab::Random;

}  // namespace vps::test
