// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The program's exact distance oracle, for tests.
#pragma once

#include "cli/lab/oracle.h"

namespace vps::test {

using lab::exact_distance;
using lab::Oracle;
using lab::SoupOracle;
using lab::touches_exactly;

}  // namespace vps::test
