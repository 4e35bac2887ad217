// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Shows, checks, compares and exports a fuzzer's asset, as the program does.
#pragma once

#include "runtime/vps_runtime.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {

/// @param asset   open
/// @param other   an asset to compare with
/// @param folder  for the files that are written
/// Exceptions that become a line of the program are caught; others are defects.
void ask_tools(const Asset& asset, const Asset& other, const TemporaryFolder& folder);

}  // namespace vps::test
