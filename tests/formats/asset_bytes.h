// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The bytes of a tiny asset, whose directory a test may change.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "formats/vps_format.h"
#include "tests/formats/tiny_asset.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {

// Aligned to 64 bytes.
class AssetBytes {
 public:
  explicit AssetBytes(const TinyAsset& tiny) {
    const TemporaryFolder folder;
    write_asset(folder / "tiny.vps.hdf", tiny.info, tiny.sections);
    const std::string text = read_file(folder / "tiny.vps.hdf");
    storage_.resize(text.size() + 64);
    base_ = (64 - reinterpret_cast<std::uintptr_t>(storage_.data()) % 64) % 64;
    size_ = text.size();
    std::memcpy(storage_.data() + base_, text.data(), text.size());
  }
  std::span<std::byte> all() { return {storage_.data() + base_, size_}; }
  std::span<std::byte, kUserBlockBytes> header() { return all().first<kUserBlockBytes>(); }
  Directory directory() {
    Directory d;
    EXPECT_EQ(decode_directory(all(), d), Status::ok);
    return d;
  }
  // Writes a changed directory with a correct hash and returns the decoder's status.
  Status with(const Directory& changed) {
    encode_directory(changed, header());
    Directory d;
    return decode_directory(all(), d);
  }

 private:
  std::vector<std::byte> storage_;
  std::size_t base_ = 0;
  std::size_t size_ = 0;
};

inline Section& find(Directory& directory, SectionKind kind) {
  return const_cast<Section&>(*directory.find(kind));
}

}  // namespace vps::test
