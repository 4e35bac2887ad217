// SPDX-License-Identifier: GPL-3.0-or-later
// A short run of the fuzzer, with the same bytes and the same queries on every machine. `make fuzz` runs longer.
#include <gtest/gtest.h>

#include "tests/fuzz/answers.h"
#include "tests/fuzz/ask_asset.h"
#include "tests/fuzz/ask_everything.h"

namespace vps::test {
namespace {

#if defined(VPS_SANITIZE)
constexpr std::uint64_t kPerSeed = 100;
#else
constexpr std::uint64_t kPerSeed = 300;
#endif

TEST(Fuzz, SeedsThemselvesAreAssets) {
  for (const auto& [name, bytes] : seed_files()) EXPECT_EQ(ask_asset(bytes), Status::ok) << name;
}

TEST(Fuzz, DamagedAssetsAreRefusedOrHarmless) {
  for (const auto& [name, bytes] : seed_files()) {
    std::map<Status, std::uint64_t> verdicts;
    for (std::uint64_t n = 0; n < kPerSeed; ++n) {
      const Questions questions = n % 16 < 2 ? Questions::everything : Questions::queries;
      try {
        ++verdicts[ask_mutant(bytes, n, questions)];
      } catch (const WrongAnswer& error) {
        ADD_FAILURE() << name << ", mutant " << n << ": " << error.what();
      }
    }
    // Enough mutants pass the checks and are queried. The others are refused for many reasons.
    EXPECT_GT(verdicts[Status::ok], kPerSeed / 10) << name;
    EXPECT_GT(verdicts[Status::bad_info], 0U) << name;
    EXPECT_GT(verdicts[Status::bad_index], 0U) << name;
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
