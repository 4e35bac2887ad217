// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/fuzz/ask_everything.h"

#include <cstring>
#include <memory>

#include "tests/fuzz/ask_asset.h"
#include "tests/fuzz/ask_tools.h"
#include "tests/fuzz/seeds.h"
#ifdef VPS_TEST_BULLET
#include "tests/fuzz/ask_bullet.h"
#endif

namespace vps::test {
namespace {

Bytes read(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  Bytes bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

struct HeldAsset {
  Bytes bytes;
  Asset asset;
};

// Null for bytes that are refused.
std::shared_ptr<const Asset> open(Bytes bytes) {
  const auto held = std::make_shared<HeldAsset>();
  held->bytes = std::move(bytes);
  if (Asset::open(held->bytes, held->asset) != Status::ok) return nullptr;
  return {held, &held->asset};
}

}  // namespace

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

Status ask_mutant(const Bytes& seed, std::uint64_t number, Questions questions) {
  Bytes bytes = seed;
  Random random(number);
  mutate(bytes, random);
  number % 2 == 0 ? seal_header(bytes) : seal_everything(bytes);
  const Status status = ask_asset(bytes);
  if (status != Status::ok || questions == Questions::queries) return status;
  const std::shared_ptr<const Asset> asset = open(std::move(bytes));
  const std::shared_ptr<const Asset> sound = open(seed_files().at("torus_all_fields"));
  const TemporaryFolder folder;
  ask_tools(*asset, *sound, folder);
#ifdef VPS_TEST_BULLET
  ask_bullet(asset, sound);
#endif
  return status;
}

}  // namespace vps::test
