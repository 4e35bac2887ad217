// SPDX-License-Identifier: GPL-3.0-or-later
// Recognises a mesh's format by its content.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

#include "formats/mesh/mesh_import.h"

namespace vps {
namespace {

std::uint32_t u32_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  if (bytes.size() >= at + sizeof value) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// A binary STL file has a header of 80 bytes, the number of triangles, and 50 bytes for each.
bool is_binary_stl(std::string_view start, std::uint64_t size) {
  constexpr std::uint64_t kHeader = 84, kTriangle = 50;
  return size > kHeader && start.size() >= kHeader && size == kHeader + kTriangle * u32_at(start, 80);
}

// A 3DS file is one chunk: 0x4D4D and its size.
bool is_3ds(std::string_view start, std::uint64_t size) {
  return start.starts_with("MM") && u32_at(start, 2) == size;
}

bool is_obj_keyword(const std::string& word) {
  constexpr std::string_view kWords[] = {"v", "vn", "vt", "vp", "f", "l", "p", "o", "g", "s", "mtllib", "usemtl"};
  return std::find(std::begin(kWords), std::end(kWords), word) != std::end(kWords);
}

// @param text  the beginning of the file
std::string text_format(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    std::string word;
    std::istringstream(line) >> word;
    if (word.empty() || word[0] == '#') continue;
    if (word == "ply") return "ply";
    if (word == "solid") return "stl";
    if (word.ends_with("OFF")) return "off";  // COFF, NOFF and so on have colours and normals
    if (word == ";" && line.find("FBX") != line.npos) return "fbx";
    if (word[0] == '{') return "gltf";
    if (word[0] == '<') return text.find("<COLLADA") != text.npos ? "dae" : "";
    return is_obj_keyword(word) ? "obj" : "";
  }
  return {};
}

}  // namespace

std::string detect_mesh_format(const std::filesystem::path& path) {
  std::string start(std::size_t{1} << 16, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(start.data(), std::streamsize(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  std::error_code unknown;
  const std::uint64_t size = std::filesystem::file_size(path, unknown);
  if (start.starts_with("glTF")) return "glb";
  if (start.starts_with("Kaydara FBX Binary")) return "fbx";
  if (is_binary_stl(start, size)) return "stl";  // its header may begin as text does
  if (is_3ds(start, size)) return "3ds";
  return text_format(start);
}

}  // namespace vps
