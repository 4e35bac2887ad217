// SPDX-License-Identifier: GPL-3.0-or-later
// Imports thousands of damaged files of every format: each is read or refused in time, and the program survives.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>

#include "formats/mesh/mesh_import.h"
#include "tests/formats/mesh/import_seeds.h"
#include "tests/formats/mesh/mutate.h"
#include "tests/support/temporary_folder.h"

#ifdef VPS_SANITIZE
// Memory limits are not enforced under AddressSanitizer: its own limit replaces them. The children's reports are
// shortened, as nobody reads them and they take long to write.
extern "C" const char* __asan_default_options() {
  return "max_allocation_size_mb=512:symbolize=0:print_legend=0";
}
#endif

namespace vps::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct Verdicts {
  int meshes = 0, refused = 0, crashed = 0, out_of_memory = 0, timed_out = 0;
  double seconds = 0, slowest = 0;
};

void check_mesh(const ImportedMesh& mesh) {
  ASSERT_FALSE(mesh.triangles.empty());
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) ASSERT_LT(v, mesh.vertices.size());
  }
  for (const auto& p : mesh.vertices) {
    for (const double x : p) ASSERT_TRUE(std::isfinite(x));
  }
}

void count(const std::string& why, Verdicts& verdicts) {
  ASSERT_FALSE(why.empty());
  ASSERT_EQ(why.find('\n'), std::string::npos) << why;
  ASSERT_LT(why.size(), 400U) << why;
  const auto says = [&](const char* words) { return why.find(words) != std::string::npos; };
  ++(says("crashed")         ? verdicts.crashed
     : says("out of memory") ? verdicts.out_of_memory
     : says("in time")       ? verdicts.timed_out
                             : verdicts.refused);
}

void import_mutant(const fs::path& file, Verdicts& verdicts) {
  ImportOptions options;
  options.memory_limit_bytes = 512'000'000;
  options.timeout = 1;
  const auto begin = Clock::now();
  try {
    check_mesh(import_mesh(file, options));
    ++verdicts.meshes;
  } catch (const ImportError& error) {
    count(error.what(), verdicts);
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  verdicts.seconds += seconds;
  verdicts.slowest = std::max(verdicts.slowest, seconds);
}

void expect_a_verdict_for_each(int files) {
  const TemporaryFolder folder;
  const std::vector<Seed> seeds = make_seeds(folder.path());
  for (std::size_t s = 0; s < seeds.size(); ++s) {
    const Seed& seed = seeds[s];
    const fs::path file = folder / ("mutant" + seed.extension);
    // The seed itself must be a mesh, otherwise the mutants test nothing.
    write_file(file, seed.bytes);
    Verdicts verdicts;
    ASSERT_NO_THROW(check_mesh(import_mesh(file))) << seed.name;
    const int share = (files + static_cast<int>(s)) / static_cast<int>(seeds.size());
    for (int i = 0; i < share; ++i) {
      // A generator for each mutant, so that it can be reproduced from its number.
      std::mt19937_64 random(1'000'003 * (s + 1) + static_cast<std::uint64_t>(i));
      write_file(file, mutate(seed.bytes, random));
      import_mutant(file, verdicts);
      if (::testing::Test::HasFailure()) {
        fs::copy_file(file, fs::temp_directory_path() / ("vps_mutant" + seed.extension),
                      fs::copy_options::overwrite_existing);
        FAIL() << seed.name << ", mutant " << i << ": kept as vps_mutant" << seed.extension
               << " in the temporary folder";
      }
    }
    EXPECT_GT(verdicts.meshes + verdicts.refused, 0) << seed.name;
    EXPECT_LT(verdicts.slowest, 10) << seed.name;
    std::printf("%-10s %5d files: %5d meshes, %5d refused, %4d crashed, %3d out of memory, %3d timed out, %.1f s\n",
                seed.name.c_str(), share, verdicts.meshes, verdicts.refused, verdicts.crashed, verdicts.out_of_memory,
                verdicts.timed_out, verdicts.seconds);
    std::fflush(stdout);
  }
}

// The mesh, or why there is none, in bytes.
std::string outcome(const fs::path& file, double timeout) {
  ImportOptions options;
  options.timeout = timeout;
  try {
    const ImportedMesh mesh = import_mesh(file, options);
    std::string bytes = "notes:";
    for (const std::string& note : mesh.notes) bytes += note + '\n';
    const auto append = [&](const auto& rows) {
      if (!rows.empty()) bytes.append(reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof rows[0]);
    };
    append(mesh.vertices);
    append(mesh.triangles);
    return bytes;
  } catch (const ImportError& error) {
    return error.what();
  }
}

// A child reads every file that may take less than a second.
TEST(ImportMutation, ASmallFileIsTheSameReadHereAndInAChild) {
  const TemporaryFolder folder;
  int meshes = 0, refused = 0;
  for (const Seed& seed : make_seeds(folder.path())) {
    if (seed.extension != ".obj" && seed.extension != ".off" && seed.extension != ".stl") continue;
    const fs::path file = folder / ("mutant" + seed.extension);
    for (unsigned i = 0; i < 40; ++i) {
      std::mt19937_64 random(i);
      write_file(file, i == 0 ? seed.bytes : mutate(seed.bytes, random));
      const std::string here = outcome(file, 60);
      ASSERT_EQ(here, outcome(file, 0.99)) << seed.name << ", mutant " << i;
      ++(here.starts_with("notes:") ? meshes : refused);
    }
  }
  EXPECT_GT(meshes, 20);
  EXPECT_GT(refused, 20);
}

TEST(ImportMutation, SixHundredDamagedFilesEachGetAVerdict) {
  expect_a_verdict_for_each(600);
}

TEST(ImportMutationSlow, TwentyThousandDamagedFilesEachGetAVerdict) {
  expect_a_verdict_for_each(20'004);
}

}  // namespace
}  // namespace vps::test
