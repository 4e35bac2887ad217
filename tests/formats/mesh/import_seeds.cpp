// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/formats/mesh/import_seeds.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <array>
#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <cstdint>
#include <stdexcept>

#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

constexpr const char* kOff =
    "COFF # by hand\n5 5 8\n0 0 0 255 0 0\n1 0 0 0 255 0\n1 1 0 0 0 255\n0 1 0 9 9 9\n0.5 0.5 1.25e0 1 1 1\n"
    "4 3 2 1 0\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4 255 0 0\n";

template <class T>
std::string raw(const T& value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

// A node of binary FBX 7.4. Its offsets count from the start of the file.
struct FbxNode {
  std::string name;
  std::vector<std::string> properties;
  std::vector<FbxNode> children;

  void write(std::string& file) const {
    const std::size_t begin = file.size();
    std::string values;
    for (const std::string& p : properties) values += p;
    file += raw(std::uint32_t{0}) + raw(static_cast<std::uint32_t>(properties.size())) +
            raw(static_cast<std::uint32_t>(values.size())) + static_cast<char>(name.size()) + name + values;
    for (const FbxNode& child : children) child.write(file);
    if (!children.empty()) file += std::string(13, '\0');
    file.replace(begin, 4, raw(static_cast<std::uint32_t>(file.size())));
  }
};

std::string fbx_string(const std::string& text) {
  return "S" + raw(static_cast<std::uint32_t>(text.size())) + text;
}
std::string fbx_number(std::int64_t value) {
  return "L" + raw(value);
}
std::string fbx_integer(std::int32_t value) {
  return "I" + raw(value);
}

template <class T>
std::string fbx_array(char type, const std::vector<T>& values) {
  std::string bytes = type + raw(static_cast<std::uint32_t>(values.size())) + raw(std::uint32_t{0}) +
                      raw(static_cast<std::uint32_t>(values.size() * sizeof(T)));
  for (const T& value : values) bytes += raw(value);
  return bytes;
}

// Written by hand, as assimp's exporter omits the end of a list that assimp's importer requires.
std::string binary_fbx() {
  const std::string joint("\0\1", 2);
  const FbxNode nodes[] = {
      {"FBXHeaderExtension",
       {},
       {{"FBXHeaderVersion", {fbx_integer(1003)}, {}}, {"FBXVersion", {fbx_integer(7400)}, {}}}},
      {"GlobalSettings", {}, {{"Version", {fbx_integer(1000)}, {}}}},
      {"Objects",
       {},
       {{"Geometry",
         {fbx_number(11), fbx_string("g" + joint + "Geometry"), fbx_string("Mesh")},
         {{"Vertices", {fbx_array<double>('d', {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1})}, {}},
          {"PolygonVertexIndex", {fbx_array<std::int32_t>('i', {0, 2, ~1, 0, 1, ~3, 1, 2, ~3, 2, 0, ~3})}, {}}}},
        {"Model",
         {fbx_number(12), fbx_string("m" + joint + "Model"), fbx_string("Mesh")},
         {{"Version", {fbx_integer(232)}, {}}}}}},
      {"Connections",
       {},
       {{"C", {fbx_string("OO"), fbx_number(11), fbx_number(12)}, {}},
        {"C", {fbx_string("OO"), fbx_number(12), fbx_number(0)}, {}}}}};
  std::string file = "Kaydara FBX Binary  " + std::string("\0\x1A\0", 3) + raw(std::uint32_t{7400});
  for (const FbxNode& node : nodes) node.write(file);
  return file + std::string(13, '\0');
}

std::string without(std::string text, const std::string& from, const std::string& to) {
  const std::size_t begin = text.find(from);
  return begin == std::string::npos ? text : text.erase(begin, text.find(to, begin) + to.size() - begin);
}

// The exporter writes the present time; removes it.
std::string without_time(const std::string& text) {
  return without(without(text, "CreationTimeStamp:", "}"), "<created>", "</modified>");
}

}  // namespace

std::vector<Seed> make_seeds(const std::filesystem::path& folder) {
  Assimp::Importer importer;
  const aiScene* const scene =
      importer.ReadFile(VPS_SAMPLE_MESHES "/cube.obj", aiProcess_JoinIdenticalVertices | aiProcess_GenNormals);
  if (scene == nullptr) throw std::runtime_error(importer.GetErrorString());
  const std::array<const char*, 3> formats[] = {
      {"obj", "obj", ".obj"},        {"ply ascii", "ply", ".ply"},   {"ply binary", "plyb", ".ply"},
      {"stl ascii", "stl", ".stl"},  {"stl binary", "stlb", ".stl"}, {"gltf", "gltf2", ".gltf"},
      {"glb", "glb2", ".glb"},       {"dae", "collada", ".dae"},     {"3ds", "3ds", ".3ds"},
      {"fbx ascii", "fbxa", ".fbx"},
  };
  std::vector<Seed> seeds;
  Assimp::Exporter exporter;
  for (const auto& [name, id, extension] : formats) {
    const std::filesystem::path file = folder / (std::string("seed_") + id + extension);
    if (exporter.Export(scene, id, file.string()) != aiReturn_SUCCESS)
      throw std::runtime_error(exporter.GetErrorString());
    seeds.push_back({name, extension, without_time(read_file(file))});
  }
  seeds.push_back({"fbx binary", ".fbx", binary_fbx()});
  seeds.push_back({"off", ".off", kOff});
  return seeds;
}

}  // namespace vps::test
