// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/evaluate/numbers_file.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "cli/evaluate/oracle.h"
#include "formats/vps_format.h"

namespace vps::evaluate {

std::filesystem::path cache_file(const std::filesystem::path& folder, const std::string& name, const TriangleMesh& mesh,
                                 std::span<const double> options) {
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
  std::filesystem::create_directories(file.parent_path());
  const std::filesystem::path unfinished = file.string() + ".part";
  std::ofstream out(unfinished);
  for (const double number : numbers) out << fmt::format("{}\n", number);  // the shortest text that reads back the same
  out.close();
  if (!out) throw MeasureError(unfinished.string() + " cannot be written; free space or choose another folder");
  std::filesystem::rename(unfinished, file);
}

}  // namespace vps::evaluate
