// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The program's own judge, for tests.
#pragma once

#include "cli/lab/oracle.h"

namespace vps::test {

using evaluate::exact_distance;
using evaluate::Oracle;
using evaluate::SoupOracle;
using evaluate::touches_exactly;

}  // namespace vps::test
