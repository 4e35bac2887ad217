// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/write_output.h"

#include <fmt/format.h>

#include <span>

#include "bake/quantity_text.h"
#include "cli/terminal/complain.h"
#include "formats/hdf5/hdf5_writer.h"

namespace vps::cli {

namespace fs = std::filesystem;

int write_quietly(const fs::path& output, std::string_view bytes) {
  try {
    write_whole(output, std::as_bytes(std::span(bytes.data(), bytes.size())));
  } catch (const WriteError& error) {
    return fail(kIo, output.string(), error.what());
  }
  return kOk;
}

int write_output(const fs::path& output, std::string_view bytes) {
  if (const int code = write_quietly(output, bytes); code != kOk) return code;
  fmt::print("{}: {}\n", output.string(), bake::format_bytes(double(bytes.size())));
  return kOk;
}

}  // namespace vps::cli
