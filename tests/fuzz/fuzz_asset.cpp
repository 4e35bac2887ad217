// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer's entry point: opens and queries the bytes. `make fuzz` runs it on the seeds for a while.
#include <cstdint>

#include "tests/fuzz/ask_asset.h"
#include "tests/fuzz/mutate.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto* const bytes = reinterpret_cast<const std::byte*>(data);
  vps::test::Bytes file(bytes, bytes + size);
  (void)vps::test::ask_asset(file);  // with the hashes unchanged
  vps::test::seal_everything(file);
  (void)vps::test::ask_asset(file);
  return 0;
}
