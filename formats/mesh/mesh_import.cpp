// SPDX-License-Identifier: GPL-3.0-or-later
// Mesh import: the child process reads, this side trusts nothing it says.
#include "formats/mesh/mesh_import.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>
#include <span>
#include <system_error>
#include <unordered_map>

#include "formats/mesh/assimp_reader.h"
#include "formats/mesh/child_process.h"
#include "formats/vps_format.h"

namespace vps {
namespace {

namespace fs = std::filesystem;
using Kind = ImportError::Kind;

constexpr const char* kFormats[] = {"obj", "ply", "stl", "off", "gltf", "glb", "dae", "3ds", "fbx"};
constexpr std::uint64_t kMaxTriangles = 1ull << 31;

[[noreturn]] void refuse(const std::string& message, Kind kind = Kind::bad_input) { throw ImportError(kind, message); }

void check_file(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) refuse("the file does not exist; check its name", Kind::io);
  if (fs::is_directory(status)) refuse("this is a folder; give a mesh file", Kind::io);
  if (!fs::is_regular_file(status)) refuse("this is not a regular file; give a mesh file", Kind::io);
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool known = std::any_of(std::begin(kFormats), std::end(kFormats),
                                 [&](const char* format) { return extension == std::string(".") + format; });
  if (!known) {
    refuse((extension.empty() ? "the file name has no extension" : "unknown mesh format " + extension) +
           "; use obj, ply, stl, off, gltf, glb, dae, 3ds or fbx");
  }
  if (!std::ifstream(path).good()) refuse("the file may not be read; check its permissions", Kind::io);
  if (fs::file_size(path, error) == 0) refuse("the file is empty; export it again");
}

// One short line without control characters, whatever the importer says.
std::string clean(std::string text) {
  for (char& c : text) {
    if (std::iscntrl(static_cast<unsigned char>(c)) != 0) c = ' ';
  }
  constexpr std::size_t kLongest = 160;
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  while (!text.empty() && (text.back() == ' ' || text.back() == '.' || text.back() == ';')) text.pop_back();
  return text.empty() ? "the importer gave no reason" : text;
}

std::vector<std::byte> run_importer(const fs::path& path, const ImportOptions& options) {
  ChildResult child = run_in_child({options.memory_limit_bytes, options.timeout},
                                   [&](int fd) { read_with_assimp(path.string(), fd); });
  switch (child.end) {
    case ChildResult::End::finished: return std::move(child.bytes);
    case ChildResult::End::crashed:
      refuse("the importer crashed on this file (signal " + std::to_string(child.signal) +
             "); it is damaged: export it again, or in another format");
    case ChildResult::End::out_of_memory:
      refuse("the importer ran out of memory on this file; it is damaged or too large: export it again");
    case ChildResult::End::timed_out:
      refuse("the importer did not finish in time; the file is damaged or too large: export it again");
    case ChildResult::End::cannot_start: break;
  }
  refuse("cannot start the importer; check the limits on processes", Kind::io);
}

struct RawMesh {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

RawMesh parse(std::span<const std::byte> bytes) {
  RawMeshHeader header;
  if (bytes.size() < sizeof header) refuse("the importer failed on this file; export it again");
  std::memcpy(&header, bytes.data(), sizeof header);
  bytes = bytes.subspan(sizeof header);
  if (header.tag == RawMeshHeader::kError) {
    refuse(clean({reinterpret_cast<const char*>(bytes.data()), bytes.size()}) + "; export it again");
  }
  RawMesh raw;
  constexpr std::uint64_t kVertexBytes = sizeof raw.vertices[0];
  constexpr std::uint64_t kTriangleBytes = sizeof raw.triangles[0];
  if (header.tag != RawMeshHeader::kMesh || header.vertices > bytes.size() || header.triangles > bytes.size() ||
      header.vertices * kVertexBytes + header.triangles * kTriangleBytes != bytes.size()) {
    refuse("the importer failed on this file; export it again");
  }
  if (header.triangles == 0) {
    refuse(header.skipped_primitives > 0 ? "the file has points or lines but no triangles; export a surface"
                                         : "the file has no triangles; export a surface");
  }
  if (header.triangles > kMaxTriangles) refuse("the mesh has more than 2^31 triangles; simplify it");
  raw.vertices.resize(header.vertices);
  raw.triangles.resize(header.triangles);
  std::memcpy(raw.vertices.data(), bytes.data(), header.vertices * kVertexBytes);
  std::memcpy(raw.triangles.data(), bytes.data() + header.vertices * kVertexBytes, header.triangles * kTriangleBytes);
  return raw;
}

struct PositionHash {
  std::size_t operator()(const std::array<double, 3>& p) const {
    return static_cast<std::size_t>(hash_bytes(std::as_bytes(std::span(p))));
  }
};

// Joins identical positions in order of first use; unused vertices fall away.
TriangleMesh join(const RawMesh& raw, double unit) {
  constexpr double kLargest = 1e30;
  TriangleMesh mesh;
  mesh.triangles.reserve(raw.triangles.size());
  std::unordered_map<std::array<double, 3>, std::uint32_t, PositionHash> numbers;
  numbers.reserve(raw.vertices.size());
  for (const auto& triangle : raw.triangles) {
    std::array<std::uint32_t, 3> joined{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (triangle[k] >= raw.vertices.size()) refuse("a face refers to a vertex that is not there; export it again");
      std::array<double, 3> p = raw.vertices[triangle[k]];
      for (double& x : p) {
        if (!(std::abs(x) < kLargest)) {
          refuse("vertex " + std::to_string(triangle[k]) + " has a coordinate that is not a finite number; export it again");
        }
        x += 0.0;  // -0 and 0 are one position
      }
      const auto [it, fresh] = numbers.try_emplace(p, static_cast<std::uint32_t>(mesh.vertices.size()));
      if (fresh) mesh.vertices.push_back({p[0] * unit, p[1] * unit, p[2] * unit});
      joined[k] = it->second;
    }
    mesh.triangles.push_back(joined);
  }
  return mesh;
}

}  // namespace

TriangleMesh import_mesh(const fs::path& path, const ImportOptions& options) {
  check_file(path);
  return join(parse(run_importer(path, options)), options.unit);
}

}  // namespace vps
