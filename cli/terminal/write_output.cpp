// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/write_output.h"

#include <fmt/format.h>

#include "bake/quantity_text.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/tools/standard_streams.h"
#include "cli/tools/utf8.h"
#include "formats/hdf5/hdf5_writer.h"

namespace vps::cli {

namespace fs = std::filesystem;

std::FILE* messages_beside(const fs::path& output) {
  return is_standard_stream(output) ? stderr : stdout;
}

void write_bytes(const fs::path& output, std::span<const std::byte> bytes) {
  if (is_standard_stream(output)) return write_to_standard_output(bytes);
  write_whole(output, bytes);
}

int write_quietly(const fs::path& output, std::string_view bytes) {
  try {
    write_bytes(output, std::as_bytes(std::span(bytes.data(), bytes.size())));
  } catch (const WriteError& error) {
    return fail(kIo, output.string(), error.what());
  }
  return kOk;
}

int write_output(const fs::path& output, std::string_view bytes) {
  if (const int code = write_quietly(output, bytes); code != kOk) return code;
  print_lines(messages_beside(output), "{}: {}\n", one_line(output.string()), bake::format_bytes(double(bytes.size())));
  return kOk;
}

}  // namespace vps::cli
