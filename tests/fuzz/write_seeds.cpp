// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the fuzzer's first corpus into a folder.
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>

#include "tests/fuzz/seeds.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "write_seeds FOLDER\n";
    return EXIT_FAILURE;
  }
  try {
    std::filesystem::create_directories(argv[1]);
    for (const vps::test::Seed& seed : vps::test::seeds()) {
      vps::test::write_seed(seed, std::filesystem::path(argv[1]) / (seed.name + ".vps.hdf"));
    }
  } catch (const std::exception& e) {
    std::cerr << "write_seeds: " << e.what() << '\n';
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
