// SPDX-License-Identifier: GPL-3.0-or-later
// usage: threads_test ASSET    built with ThreadSanitizer, which ends it with an error on a data race
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/threads/threads.h"

namespace vps::test {
const char* asset_path = nullptr;
}

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc != 2) {
    std::fprintf(stderr, "usage: threads_test ASSET\n");
    return 1;
  }
  vps::test::asset_path = argv[1];
  return RUN_ALL_TESTS();
}
