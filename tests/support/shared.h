// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Access to real meshes that are not part of the project. Tests that need them skip with a message.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>

/// Path of a file below the shared folder; skips the test when it is absent.
#define VPS_SHARED_FILE_OR_SKIP(variable, relative)                                          \
  const std::filesystem::path variable = std::filesystem::path(VPS_SHARED_DIR) / (relative); \
  if (!std::filesystem::exists(variable)) GTEST_SKIP() << "needs " << variable << ", which is absent"
