// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh/raw_mesh.h"

#include <fstream>

#include "formats/mesh/child_process.h"

namespace vps {

std::string read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  std::string bytes(file ? static_cast<std::size_t>(file.tellg()) : 0, '\0');
  file.seekg(0);
  if (!file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) throw ReadError("the file cannot be read");
  return bytes;
}

void send_mesh(int fd, const RawMesh& raw) {
  RawMeshHeader header;
  header.tag = RawMeshHeader::kMesh;
  header.note_bytes = static_cast<std::uint32_t>(raw.note.size());
  header.skipped_primitives = raw.skipped_primitives;
  header.vertices = raw.vertices.size();
  header.triangles = raw.triangles.size();
  write_all(fd, &header, sizeof header);
  write_all(fd, raw.vertices.data(), raw.vertices.size() * sizeof raw.vertices[0]);
  write_all(fd, raw.triangles.data(), raw.triangles.size() * sizeof raw.triangles[0]);
  write_all(fd, raw.note.data(), raw.note.size());
}

void send_error(int fd, const std::string& text) {
  RawMeshHeader header;
  header.tag = RawMeshHeader::kError;
  write_all(fd, &header, sizeof header);
  write_all(fd, text.data(), text.size());
}

}  // namespace vps
