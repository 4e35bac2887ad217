// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A mesh that is closed with large voxels only.
#pragma once

#include <gtest/gtest.h>

#include "tests/cli/program.h"

namespace vps::test {

/// A cube of 100 mm whose top lies 1.8 mm above its walls: with smaller voxels the crack stays open.
inline void write_cracked_cube(const std::filesystem::path& file) {
  std::string cube = read_file(sample("cube"));
  const std::size_t top = cube.find("f 5 6 7\nf 6 8 7\n");
  ASSERT_NE(top, std::string::npos);
  cube.replace(top, 16, "f 9 10 11\nf 10 12 11\n");
  for (const char* const corner : {"-0.05 -0.05", "0.05 -0.05", "-0.05 0.05", "0.05 0.05"})
    cube.insert(cube.find("f "), std::string("v ") + corner + " 0.0518\n");
  write_file(file, cube);
}

}  // namespace vps::test
