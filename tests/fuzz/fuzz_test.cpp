// SPDX-License-Identifier: GPL-3.0-or-later
// A short run of the fuzzer, with the same bytes and the same queries on every machine. `make fuzz` runs longer.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <map>

#include "formats/fields.h"
#include "tests/fuzz/ask_asset.h"
#include "tests/fuzz/seeds.h"
#include "tests/support/random.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

using Bytes = std::vector<std::byte>;

Bytes read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  Bytes bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

const std::map<std::string, Bytes>& seed_files() {
  static const std::map<std::string, Bytes> files = [] {
    std::map<std::string, Bytes> out;
    const TemporaryFolder folder;
    for (const Seed& seed : seeds()) {
      write_seed(seed, folder / "seed.vps.hdf");
      out[seed.name] = read(folder / "seed.vps.hdf");
    }
    return out;
  }();
  return files;
}

// Replaces one to four values of the header or of sections by near values, extreme values or noise.
void mutate(Bytes& file, Random& random) {
  Directory directory;
  if (decode_directory(file, directory) != Status::ok) return;
  const auto pick = [&](std::size_t below) {
    return static_cast<std::size_t>(random.next() * static_cast<double>(below));
  };
  const std::size_t changes = 1 + pick(4);
  for (std::size_t n = 0; n < changes; ++n) {
    std::size_t at = pick(kUserBlockBytes);
    std::size_t size = std::size_t{1} << pick(4);
    if (random.next() < 0.7) {
      const Section& section = directory.sections[pick(directory.section_count)];
      size = element_bytes(section.element);
      at = section.offset + size * pick(section.bytes / size);
    } else if (random.next() < 0.7) {
      // A scalar of the info block.
      std::vector<std::size_t> offsets;
      detail::for_each_info_field(directory.info, [&](std::size_t offset, auto&) { offsets.push_back(offset); });
      size = 8;
      at = offsets[pick(offsets.size())] + 8 * pick(3);
    }
    constexpr std::uint64_t kValues[] = {0,
                                         1,
                                         0x7F,
                                         0x80,
                                         0x7FFF,
                                         0x8000,
                                         0xFFFF,
                                         0x7FFFFFFF,
                                         0x80000000,
                                         0xFFFFFFFE,
                                         0xFFFFFFFF,
                                         0x7F800000 /* infinity as float */,
                                         0x7FC00000,
                                         0x7FF0000000000000 /* as double */,
                                         0x7FF8000000000000,
                                         0xFFFFFFFFFFFFFFFF};
    std::uint64_t value = 0;
    std::memcpy(&value, file.data() + at, size);
    const double what = random.next();
    if (what < 0.3) {
      value += random.next() < 0.5 ? 1 : ~std::uint64_t{0};
    } else if (what < 0.6) {
      value = kValues[pick(std::size(kValues))];
    } else if (what < 0.8) {
      value ^= std::uint64_t{1} << pick(8 * size);
    } else {
      value = static_cast<std::uint64_t>(random.next() * 0x1.0p64);
    }
    std::memcpy(file.data() + at, &value, size);
  }
}

TEST(Fuzz, SeedsThemselvesAreAssets) {
  for (const auto& [name, bytes] : seed_files()) EXPECT_EQ(ask_asset(bytes), Status::ok) << name;
}

TEST(Fuzz, DamagedAssetsAreRefusedOrHarmless) {
  constexpr int kPerSeed = 1500;
  Random random;
  for (const auto& [name, bytes] : seed_files()) {
    std::map<Status, int> verdicts;
    for (int n = 0; n < kPerSeed; ++n) {
      Bytes damaged = bytes;
      mutate(damaged, random);
      seal_header(damaged);
      ++verdicts[ask_asset(damaged)];
    }
    // Enough mutants pass the checks and are queried. The others are refused for many reasons.
    EXPECT_GT(verdicts[Status::ok], kPerSeed / 10) << name;
    EXPECT_GT(verdicts[Status::bad_info], 0) << name;
    EXPECT_GT(verdicts[Status::bad_index], 0) << name;
  }
}

TEST(Fuzz, EveryTruncationIsRefused) {
  const Bytes& file = seed_files().at("box");
  for (std::size_t size = 0; size < file.size(); size = size < kUserBlockBytes ? size + 61 : size + 509) {
    const std::span<const std::byte> cut(file.data(), size);
    EXPECT_NE(ask_asset(cut), Status::ok) << size;
  }
}

}  // namespace
}  // namespace vps::test
