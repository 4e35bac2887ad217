// SPDX-License-Identifier: GPL-3.0-or-later
// Mesh import. A child process reads all but plain files of some megabytes; the parent checks all that it sends.
#include "formats/mesh/mesh_import.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>

#include "formats/mesh/assimp_reader.h"
#include "formats/mesh/child_process.h"
#include "formats/mesh/polygon_soup_reader.h"
#include "formats/mesh/position_numbers.h"
#include "formats/mesh/raw_mesh.h"
#include "formats/mesh/read_without_library.h"
#include "formats/mesh/tidy.h"
#include "formats/vps_format.h"

namespace vps {
namespace {

namespace fs = std::filesystem;
using Kind = ImportError::Kind;

constexpr std::uint64_t kMaxTriangles = 1ull << 31;
constexpr double kLargestCoordinate = 1e30;

[[noreturn]] void refuse(const std::string& message, Kind kind = Kind::bad_input) {
  throw ImportError(kind, message);
}

bool is_known(const std::string& extension) {
  return std::find(std::begin(kMeshFormats), std::end(kMeshFormats), extension) != std::end(kMeshFormats);
}

std::string check_format(const fs::path& path, const ImportOptions& options) {
  std::string extension = mesh_format(path, options);
  if (is_known(extension)) return extension;
  std::string known;
  for (const std::string_view format : kMeshFormats) {
    known += (known.empty() ? "" : format == std::end(kMeshFormats)[-1] ? " or " : ", ") + std::string(format);
  }
  if (extension == "urdf" || extension == "toml") refuse("this is no mesh; scenes and robots are for `vpsbake scene`");
  refuse((extension.empty() ? "the file name has no extension" : "unknown mesh format ." + extension) +
         "; use one of " + known);
}

void check_content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse("the file may not be read; check its permissions", Kind::io);
  if (file.peek() == std::ifstream::traits_type::eof()) refuse("the file is empty; export it again");
}

// Turns any message of the importer into one short line of plain characters, without the file's path.
std::string clean(std::string text, const std::string& path) {
  for (std::size_t at = text.find(path); at != std::string::npos; at = text.find(path)) {
    text.replace(at, path.size(), "this file");
  }
  std::string line;
  for (const char c : text) {
    const bool plain = std::isgraph(static_cast<unsigned char>(c)) != 0 && c != ';';
    if (plain) line += c;
    if (!plain && !line.empty() && line.back() != ' ') line += ' ';
  }
  constexpr std::size_t kLongest = 160;
  if (line.size() > kLongest) return line.substr(0, kLongest) + "...";
  while (!line.empty() && (line.back() == ' ' || line.back() == '.')) line.pop_back();
  return line.empty() ? "the importer gave no reason" : line;
}

// Runs in the child.
RawMesh read_mesh(const std::string& path, const std::string& extension) {
  if (extension != "obj" && extension != "off" && extension != "ply" && extension != "stl")
    return read_with_assimp(path, extension);
  std::string why;
  try {
    return read_polygon_soup(path, extension);
  } catch (const NeedsAssimp& special) {
    why = special.what();
  }
  RawMesh raw = read_with_assimp(path, extension);
  if (!why.empty()) raw.note = "read in single precision: " + why;
  return raw;
}

// @param request  the extension, a zero, and the path
void read_and_send(const std::string& request, int fd) {
  const std::size_t zero = request.find('\0');
  try {
    send_mesh(fd, read_mesh(request.substr(zero + 1), request.substr(0, zero)));
  } catch (const ReadError& error) {
    send_error(fd, error.what());
  }
}

GrowingBytes run_importer(const fs::path& path, const std::string& extension, const ImportOptions& options) {
  using End = ChildResult::End;
  ChildResult child =
      run_in_child({options.memory_limit_bytes, options.timeout}, read_and_send, extension + '\0' + path.string());
  const auto too_large = [](const std::string& what, const char* option) {
    refuse("the importer " + what + "; the file is damaged, or so large that it needs a higher " + option);
  };
  switch (child.end) {
    case End::finished:
      return std::move(child.bytes);
    case End::failed:
      refuse("the importer failed on this file; the file is damaged: export it again");
    case End::crashed:
      refuse("the importer crashed on this file (signal " + std::to_string(child.signal) +
             "); the file is damaged: export it again");
    case End::out_of_memory:
      too_large("ran out of memory on this file", "--import-memory");
      break;
    case End::timed_out:
      too_large("did not finish in time on this file", "--import-timeout");
      break;
    case End::cannot_start:
      break;
  }
  refuse("the importer cannot be started; check the limits on processes", Kind::io);
}

// @param bytes  of the child, aligned as memory that was allocated is
RawMeshView parse(std::span<const std::byte> bytes, const std::string& path) {
  constexpr const char* kGarbled = "the importer gave a garbled answer on this file; export it again";
  RawMeshHeader header;
  if (bytes.size() < sizeof header) refuse(kGarbled);
  std::memcpy(&header, bytes.data(), sizeof header);
  bytes = bytes.subspan(sizeof header);
  const auto text = [&](std::size_t size) { return clean({reinterpret_cast<const char*>(bytes.data()), size}, path); };
  if (header.tag == RawMeshHeader::kError) refuse(text(bytes.size()) + "; export it again");
  RawMeshView raw;
  constexpr std::uint64_t kVertexBytes = sizeof raw.vertices[0];
  constexpr std::uint64_t kTriangleBytes = sizeof raw.triangles[0];
  // The first comparisons keep the products from overflowing.
  if (header.tag != RawMeshHeader::kMesh || header.vertices > bytes.size() || header.triangles > bytes.size() ||
      header.note_bytes + header.vertices * kVertexBytes + header.triangles * kTriangleBytes != bytes.size()) {
    refuse(kGarbled);
  }
  raw.skipped_primitives = header.skipped_primitives;
  static_assert(sizeof header % alignof(double) == 0);
  const auto take = [&](auto& rows, std::uint64_t count) {
    rows = {reinterpret_cast<decltype(rows.data())>(bytes.data()), count};
    bytes = bytes.subspan(rows.size_bytes());
  };
  take(raw.vertices, header.vertices);
  take(raw.triangles, header.triangles);
  if (header.note_bytes > 0) raw.note = text(header.note_bytes);
  return raw;
}

// Of a file that is read here: its size, and the corners of a polygon, for cutting it may take time of their third
// power.
constexpr std::uintmax_t kLargestHere = std::uintmax_t{1} << 24;
constexpr std::size_t kMostCornersHere = 64;

// Memory and seconds that are several times what such a file takes: 16 MB took at most 204 MB and 2.7 s.
constexpr std::uintmax_t memory_here(std::uintmax_t size) {
  return (std::uintmax_t{64} << 20) + 16 * size;
}
constexpr double seconds_here(std::uintmax_t size) {
  return 0.9 + 0.5e-6 * static_cast<double>(size);
}

// A file that needs no library is read here: with a child a small bake takes a quarter longer, and a file of 2.4 MB
// takes 20 ms more.
// @return nothing when the child has to read it
std::optional<RawMesh> read_here(const std::string& path, const std::string& extension, const ImportOptions& options) {
  std::error_code failed;
  const std::uintmax_t size = fs::file_size(path, failed);
  if (failed || size > kLargestHere || options.memory_limit_bytes < memory_here(size) ||
      options.timeout < seconds_here(size))
    return std::nullopt;
  try {
    std::string bytes = read_bytes(path);
    std::optional<PolygonSoup> soup = read_without_library(bytes, extension);
    if (!soup || soup->most_corners() > kMostCornersHere) return std::nullopt;
    return to_raw_mesh(std::move(*soup));
  } catch (const NeedsAssimp&) {
    return std::nullopt;
  } catch (const ReadError& error) {
    refuse(clean(error.what(), path) + "; export it again");
  }
}

void check_number_of_triangles(const RawMeshView& raw) {
  if (raw.triangles.empty()) {
    const bool something = raw.skipped_primitives > 0 || !raw.vertices.empty();
    refuse(something ? "the file has points or lines but no triangles; export a surface"
                     : "the file has no triangles; export a surface");
  }
  if (raw.triangles.size() > kMaxTriangles) refuse("the mesh has more than 2^31 triangles; simplify it");
}

void check_coordinate(double value, double unit, std::size_t vertex, std::size_t triangle) {
  if (std::abs(value) < kLargestCoordinate && std::abs(value * unit) < kLargestCoordinate) return;
  const char* const what = std::isfinite(value) ? "too large" : "not a finite number";
  refuse("vertex " + std::to_string(vertex) + ", used by triangle " + std::to_string(triangle) +
         " (both counted from 0), is " + what + "; correct it or export it again");
}

// Joins identical positions in order of first use; drops unused vertices.
ImportedMesh join(const RawMeshView& raw, double unit) {
  check_number_of_triangles(raw);
  ImportedMesh mesh;
  mesh.triangles.reserve(raw.triangles.size());
  PositionNumbers<> numbers(raw.vertices.size());
  constexpr std::uint32_t kUnseen = ~0U;
  std::vector<std::uint32_t> number(raw.vertices.size(), kUnseen);
  for (const auto& triangle : raw.triangles) {
    std::array<std::uint32_t, 3> joined{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (triangle[k] >= raw.vertices.size()) refuse("a face refers to a vertex that is not there; export it again");
      std::uint32_t& n = number[triangle[k]];
      if (n == kUnseen) {
        const std::array<double, 3>& p = raw.vertices[triangle[k]];
        for (const double x : p) check_coordinate(x, unit, triangle[k], mesh.triangles.size());
        n = numbers.number_of(p);
      }
      joined[k] = n;
    }
    mesh.triangles.push_back(joined);
  }
  mesh.vertices = std::move(numbers).take_positions();
  for (auto& position : mesh.vertices) {
    for (double& x : position) x *= unit;
  }
  if (!raw.note.empty()) mesh.notes.push_back(raw.note);
  return mesh;
}

}  // namespace

std::string mesh_format(const fs::path& path, const ImportOptions& options) {
  if (!options.format.empty()) return options.format;
  std::string extension = path.extension().string();
  if (!extension.empty()) extension.erase(0, 1);
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

bool has_mesh_extension(const fs::path& path) {
  return is_known(mesh_format(path));
}

std::string referred_file(const std::string& folder, const std::string& name) {
  std::error_code ignored;
  if (fs::exists(folder + name, ignored)) return folder + name;
  std::string decoded;
  for (std::size_t i = 0; i < name.size(); ++i) {
    std::uint8_t byte = 0;
    const char* const end = name.data() + std::min(i + 3, name.size());
    const bool is_code =
        name[i] == '%' && std::from_chars(name.data() + i + 1, end, byte, 16).ptr == name.data() + i + 3;
    decoded += is_code && byte != 0 ? static_cast<char>(byte) : name[i];
    if (is_code && byte != 0) i += 2;
  }
  if (fs::exists(folder + decoded, ignored)) return folder + decoded;
  std::replace(decoded.begin(), decoded.end(), '\\', '/');
  return folder + (fs::exists(folder + decoded, ignored) ? decoded : name);
}

void check_is_file(const fs::path& path, const char* kind) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) refuse("the file does not exist; check its name", Kind::io);
  if (!fs::status_known(status))
    refuse("the file cannot be reached (" + error.message() + "); check its path", Kind::io);
  if (fs::is_directory(status)) refuse(std::string("this is a folder; give ") + kind, Kind::io);
  if (!fs::is_regular_file(status)) refuse(std::string("this is not a regular file; give ") + kind, Kind::io);
}

ImportedMesh import_mesh(const fs::path& path, const ImportOptions& options) {
  if (!(options.unit > 0 && std::isfinite(options.unit)))
    refuse("the unit must be a positive number of metres; change it");
  check_is_file(path, "a mesh file");
  const std::string extension = check_format(path, options);
  check_content(path);
  if (const std::optional<RawMesh> raw = read_here(path.string(), extension, options))
    return join({raw->vertices, raw->triangles, raw->skipped_primitives, raw->note}, options.unit);
  const GrowingBytes bytes = run_importer(path, extension, options);
  return join(parse({bytes.data(), bytes.size()}, path.string()), options.unit);
}

}  // namespace vps
