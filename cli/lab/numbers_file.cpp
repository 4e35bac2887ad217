// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/numbers_file.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "cli/lab/oracle.h"
#include "formats/hdf5/hdf5_writer.h"
#include "formats/vps_format.h"

namespace vps::lab {

std::filesystem::path cache_file(const std::filesystem::path& folder, const std::string& name, const TriangleMesh& mesh,
                                 std::span<const double> options) {
  if (folder.empty()) return {};
  const std::uint64_t hashes[] = {hash_bytes(std::as_bytes(std::span(mesh.vertices))),
                                  hash_bytes(std::as_bytes(std::span(mesh.triangles))),
                                  hash_bytes(std::as_bytes(options))};
  return folder / fmt::format("{}_{:016x}.txt", name, hash_bytes(std::as_bytes(std::span(hashes))));
}

std::optional<std::vector<double>> read_numbers(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return std::nullopt;
  return std::vector<double>(std::istream_iterator<double>(in), {});
}

void write_numbers(const std::filesystem::path& file, std::span<const double> numbers) {
  if (file.empty()) return;
  std::filesystem::create_directories(file.parent_path());
  std::string text;
  for (const double number : numbers) text += fmt::format("{}\n", number);  // the shortest that reads back the same
  try {
    write_whole(file, std::as_bytes(std::span(text)));
  } catch (const WriteError& error) {
    throw MeasureError(file.string() + ": " + error.what());
  }
}

}  // namespace vps::lab
