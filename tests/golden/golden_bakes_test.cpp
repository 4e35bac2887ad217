// SPDX-License-Identifier: GPL-3.0-or-later
// The sample meshes bake to the bytes whose hashes are in bakes.txt: for any number of threads, for every instruction
// set, with every compiler. VPS_WRITE_GOLDEN=1 writes that file again.
#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "formats/mesh/mesh_import.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBakes = VPS_GOLDEN "/bakes.txt";
constexpr std::uint32_t kResolution = 32;  // of a mesh that is not in the file yet
constexpr const char* kBakesHead =
    "# What the sample meshes bake to, on every machine. VPS_WRITE_GOLDEN=1 golden_test writes this file.\n"
    "# With the fields layers, scaled and real; the other settings are the defaults of bake::BakeOptions.\n"
    "# sections: XXH3-64 of each section's kind, type, shape and hash, as 64-bit integers, in the order of the file.\n"
    "# scalars: XXH3-64 of the user block that has no sections, no generator and is of format 1.0.\n"
    "# mesh resolution sections scalars\n";

// One line of the file.
struct GoldenBake {
  std::uint32_t resolution = kResolution;
  std::uint64_t sections = 0, scalars = 0;
};

std::map<std::string, GoldenBake> read_bakes() {
  std::map<std::string, GoldenBake> bakes;
  std::istringstream file(read_file(kBakes));
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string mesh;
    GoldenBake bake;
    words >> mesh;
    if (mesh.empty() || mesh[0] == '#') continue;
    words >> bake.resolution >> std::hex >> bake.sections >> bake.scalars;
    EXPECT_FALSE(words.fail()) << line;
    bakes[mesh] = bake;
  }
  return bakes;
}

void write_bakes(const std::map<std::string, GoldenBake>& bakes) {
  std::string text = kBakesHead;
  for (const auto& [mesh, bake] : bakes) {
    char line[128];
    std::snprintf(line, sizeof line, "%s %u %016jx %016jx\n", mesh.c_str(), bake.resolution,
                  static_cast<std::uintmax_t>(bake.sections), static_cast<std::uintmax_t>(bake.scalars));
    text += line;
  }
  write_file(kBakes, text);
}

std::uint64_t hash_sections(const std::vector<SectionData>& sections) {
  std::vector<std::uint64_t> words;
  for (const SectionData& section : sections) {
    words.push_back(static_cast<std::uint64_t>(section.kind));
    words.push_back(static_cast<std::uint64_t>(section.element));
    words.insert(words.end(), section.shape.begin(), section.shape.end());
    words.push_back(hash_bytes(section.bytes));
  }
  return hash_bytes(std::as_bytes(std::span(words)));
}

std::uint64_t hash_scalars(const AssetInfo& info) {
  Directory directory;
  directory.major = 1;
  directory.minor = 0;
  directory.info = info;
  directory.info.generator = {};
  std::array<std::byte, kUserBlockBytes> block;
  encode_directory(directory, block);
  return hash_bytes(block);
}

// Bakes with this number of threads, for any number of cores.
GoldenBake bake_with(const TriangleMesh& mesh, std::uint32_t resolution, int threads) {
  bake::BakeOptions options;
  options.resolution = resolution;
  options.layers = options.scaled = options.real = true;
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  const bake::BakedAsset asset = arena.execute([&] { return bake::bake(mesh, options); });
  return {resolution, hash_sections(asset.sections), hash_scalars(asset.info)};
}

std::vector<std::string> sample_names() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(VPS_SAMPLE_MESHES)) {
    if (entry.path().extension() == ".obj") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

class GoldenBakes : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    mesh_ = import_mesh(fs::path(VPS_SAMPLE_MESHES) / (GetParam() + ".obj"));
    bakes_ = read_bakes();
    if (std::getenv("VPS_WRITE_GOLDEN") != nullptr) {
      golden() = bake_with(mesh_, golden().resolution, 1);
      write_bakes(bakes_);
    }
  }
  GoldenBake& golden() { return bakes_[GetParam()]; }
  void expect_golden(int threads) {
    const GoldenBake now = bake_with(mesh_, golden().resolution, threads);
    EXPECT_EQ(now.sections, golden().sections) << "with " << threads << " threads";
    EXPECT_EQ(now.scalars, golden().scalars) << "with " << threads << " threads";
  }

  TriangleMesh mesh_;
  std::map<std::string, GoldenBake> bakes_;
};

TEST_P(GoldenBakes, HaveTheSameBytesForAnyNumberOfThreads) {
#ifndef VPS_SANITIZE  // slow under sanitizers
  expect_golden(1);
#endif
  expect_golden(2);
  if (GetParam() != "peg") return;  // a quick one
  for (const int threads : {3, 7, 16}) expect_golden(threads);
}

TEST_P(GoldenBakes, HaveTheSameBytesForEveryInstructionSet) {
#ifdef VPS_SANITIZE
  GTEST_SKIP() << "takes long under AddressSanitizer";
#endif
  const std::int64_t supported = hwy::SupportedTargets() & HWY_TARGETS;
  // The lowest bit is the best set, which the other test uses.
  for (std::int64_t left = supported & (supported - 1); left != 0; left &= left - 1) {
    const std::int64_t target = left & -left;
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    expect_golden(2);
    hwy::SetSupportedTargetsForTest(0);
  }
}

INSTANTIATE_TEST_SUITE_P(All, GoldenBakes, testing::ValuesIn(sample_names()),
                         [](const auto& test) { return test.param; });

TEST(GoldenBakesFile, HasALineForEachSampleMesh) {
  std::vector<std::string> names;
  for (const auto& [mesh, bake] : read_bakes()) names.push_back(mesh);
  EXPECT_EQ(names, sample_names());
}

}  // namespace
}  // namespace vps::test
