// SPDX-License-Identifier: GPL-3.0-or-later
// Mesh import: transforms, strips, damaged binary files, and imports from several threads.
#include <gtest/gtest.h>

#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "formats/mesh/child_process.h"
#include "formats/mesh/mesh_import.h"
#include "formats/mesh/triangulate.h"
#include "tests/support/shared.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

using Point = std::array<double, 3>;

double volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Point &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum / 6;
}

Point size(const TriangleMesh& mesh) {
  Point low = mesh.vertices[0], high = low;
  for (const auto& v : mesh.vertices) {
    for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], v[k]), high[k] = std::max(high[k], v[k]);
  }
  return {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
}

std::string reason_of(const std::filesystem::path& path, const ImportOptions& options = {}) {
  try {
    (void)import_mesh(path, options);
  } catch (const ImportError& error) {
    return error.what();
  }
  return "imported";
}

std::string collada(const std::string& matrix) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Y_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/>
</vertices><triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 1 2 3 2 0 3</p></triangles>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node id="n"><matrix>)" +
         matrix + R"(</matrix><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST(MeshImportCorners, AMirroringTransformKeepsTheVolumePositive) {
  const TemporaryFolder folder;
  write_file(folder / "plain.dae", collada("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"));
  write_file(folder / "mirror.dae", collada("-2 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1"));
  EXPECT_NEAR(volume(import_mesh(folder / "plain.dae")), 1.0 / 6, 1e-12);
  EXPECT_NEAR(volume(import_mesh(folder / "mirror.dae")), 2.0 / 6, 1e-12);
}

TEST(MeshImportCorners, TriangleStripsAreRefused) {
  const TemporaryFolder folder;
  write_file(
      folder / "strip.ply",
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2 3\n");
  EXPECT_NE(reason_of(folder / "strip.ply").find("triangle strips"), std::string::npos);
}

TEST(MeshImportCorners, TheContentCannotChooseALoaderOutsideTheExtension) {
  const TemporaryFolder folder;
  write_file(folder / "x.stl", "BLENDER-v279REND");
  write_file(folder / "y.ply", "# vrml V2.0 utf8\nShape { geometry Box {} }\n");
  EXPECT_NE(reason_of(folder / "x.stl"), "imported");
  EXPECT_NE(reason_of(folder / "y.ply"), "imported");
}

TEST(MeshImportCorners, NegativeZeroAndZeroAreOnePosition) {
  const TemporaryFolder folder;
  write_file(folder / "z.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -0 -0 0\nv 0 0 1\nf 1 2 3\nf 4 3 5\n");
  EXPECT_EQ(import_mesh(folder / "z.obj").vertices.size(), 4U);
}

TEST(MeshImportCorners, AUselessUnitIsRefused) {
  const TemporaryFolder folder;
  write_file(folder / "t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  ImportOptions options;
  for (const double unit : {0.0, -1.0, std::nan(""), 1e300 * 1e300}) {
    options.unit = unit;
    EXPECT_NE(reason_of(folder / "t.obj", options).find("unit"), std::string::npos);
  }
}

TEST(MeshImportCorners, ABridgedHoleIsLeftOpen) {
  // A square of size 4 with a square hole of size 2, joined by a bridge from corner 0.
  const std::vector<Point> ring = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 0},
                                   {1, 1, 0}, {1, 3, 0}, {3, 3, 0}, {3, 1, 0}, {1, 1, 0}};
  double sum = 0;
  for (const auto& [a, b, c] : triangulate_polygon(ring)) {
    const double area = ((ring[b][0] - ring[a][0]) * (ring[c][1] - ring[a][1]) -
                         (ring[b][1] - ring[a][1]) * (ring[c][0] - ring[a][0])) /
                        2;
    EXPECT_GE(area, 0);
    sum += area;
  }
  EXPECT_DOUBLE_EQ(sum, 12);
}

TEST(MeshImportCorners, TheSharedConcavePolygonKeepsItsArea) {
  VPS_SHARED_FILE_OR_SKIP(path, "meshes/concave_polygon.obj");
  std::vector<Point> listed, ring;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (Point p{}; word == "v" && words >> p[0] >> p[1] >> p[2]) listed.push_back(p);
    while (word == "f" && words >> word) ring.push_back(listed[std::stoul(word) - 1]), word = "f";
  }
  double outline = 0, triangles = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Point &p = ring[i], &q = ring[(i + 1) % ring.size()];
    outline += (p[1] * q[2] - p[2] * q[1]) / 2;
  }
  const TriangleMesh mesh = import_mesh(path);
  for (const auto& t : mesh.triangles) {
    const Point &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    triangles += std::abs((b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])) / 2;
  }
  EXPECT_NEAR(triangles, std::abs(outline), 1e-5);
}

TEST(MeshImportCorners, NestedTransformsGiveTheKnownBox) {
  VPS_SHARED_FILE_OR_SKIP(path, "meshes/nested_instances.glb");
  const Point box = size(import_mesh(path));
  EXPECT_NEAR(box[0], 1.44, 0.005);
  EXPECT_NEAR(box[1], 3.34, 0.005);
  EXPECT_NEAR(box[2], 0.539, 0.0005);
}

TEST(MeshImportCorners, EverySharedMeshHasTheCountsOfItsTable) {
  VPS_SHARED_FILE_OR_SKIP(table, "meshes/README.md");
  std::ifstream in(table);
  int rows = 0;
  for (std::string line; std::getline(in, line) && line.find("## invalid") == std::string::npos;) {
    std::vector<std::string> cells;
    std::istringstream parts(line);
    for (std::string cell; std::getline(parts, cell, '|');) {
      std::erase_if(cell, [](char c) { return c == ' ' || c == ','; });
      cells.push_back(cell);
    }
    if (cells.size() < 6 || !std::filesystem::is_regular_file(table.parent_path() / cells[1])) continue;
    const TriangleMesh mesh = import_mesh(table.parent_path() / cells[1]);
    EXPECT_EQ(mesh.vertices.size(), std::stoul(cells[4].substr(cells[4].find('/') + 1))) << cells[1];
    EXPECT_EQ(mesh.triangles.size(), std::stoul(cells[5])) << cells[1];
    ++rows;
  }
  EXPECT_EQ(rows, 42);
}

TEST(MeshImportCorners, MutatedBinaryFilesEachGetAVerdict) {
  const TemporaryFolder folder;
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n";
  const float points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  ply.append(reinterpret_cast<const char*>(points), sizeof points);
  for (const std::array<int, 3> f : {std::array{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
    ply += '\3';
    ply.append(reinterpret_cast<const char*>(f.data()), sizeof f);
  }
  ImportOptions options;
  options.memory_limit_bytes = 256ull << 20;
  options.timeout = 2;
  std::uint32_t state = 99;
  const auto next = [&] { return state = state * 1664525u + 1013904223u, state >> 8; };
  std::map<std::string, int> verdicts;
  for (int trial = 0; trial < 200; ++trial) {
    std::string mutated = ply;
    for (std::uint32_t n = 1 + next() % 4; n > 0; --n) mutated[next() % mutated.size()] = static_cast<char>(next());
    write_file(folder / "m.ply", mutated);
    ++verdicts[reason_of(folder / "m.ply", options).substr(0, 50)];
  }
  EXPECT_GT(verdicts.size(), 3U);
}

TEST(MeshImportCorners, ThreadsImportAtTheSameTimeAndAHangOfOneDoesNotHoldTheOthers) {
#ifdef VPS_SANITIZE
  GTEST_SKIP() << "AddressSanitizer's allocator cannot be forked while other threads allocate";
#endif
  const TemporaryFolder folder;
  std::string big = "OFF\n30000 10000 0\n";
  for (int i = 0; i < 10000; ++i)
    big += std::to_string(i) + " 0 0\n" + std::to_string(i) + " 1 0\n" + std::to_string(i) + " 0 1\n";
  for (int i = 0; i < 10000; ++i)
    big += "3 " + std::to_string(3 * i) + ' ' + std::to_string(3 * i + 1) + ' ' + std::to_string(3 * i + 2) + '\n';
  write_file(folder / "big.off", big);
  std::atomic<bool> stop = false;
  std::thread noise([&] {
    while (!stop) std::vector<std::string> busy(100, std::string(1000, 'x'));
  });
  std::thread hang([] { (void)run_in_child({1ull << 30, 3.0}, [](int) { ::pause(); }); });
  std::atomic<int> good = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 10; ++i) good += import_mesh(folder / "big.off").triangles.size() == 10000;
    });
  for (auto& t : threads) t.join();
  stop = true;
  noise.join();
  hang.join();
  EXPECT_EQ(good, 40);
}

// A tetrahedron of one metre.
// @param more  members of the file, `nodes` among them
std::string gltf(const std::string& more, const std::string& mesh = "") {
  return R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "scene": 0, "meshes": [{)" + mesh +
         R"("primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
{"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
{"bufferView": 0, "componentType": 5126, "count": 1, "type": "MAT4"}],
"bufferViews": [{"buffer": 0, "byteLength": 64}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
"buffers": [{"byteLength": 72, "uri": "data:application/octet-stream;base64,)"
         R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAACAAEAAAABAAMAAQACAAMAAgAAAAMA"}], )" +
         more + "}";
}

TEST(MeshImportCorners, WhatAGltfFileRequiresIsReadOrRefused) {
  const TemporaryFolder folder;
  const auto imported = [&](const std::string& text) {
    write_file(folder / "t.gltf", text);
    return import_mesh(folder / "t.gltf");
  };
  const std::string nodes = R"("nodes": [{"mesh": 0}])";
  EXPECT_EQ(imported(gltf(nodes)).triangles.size(), 4U);
  const ImportedMesh shiny =
      imported(gltf(nodes + R"(, "extensionsRequired": ["KHR_materials_unlit", "KHR_texture_transform"])"));
  EXPECT_NEAR(volume(shiny), 1.0 / 6, 1e-9);
  EXPECT_TRUE(shiny.notes.empty());
  for (const std::string extension :
       {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization", "EXT_mesh_gpu_instancing"}) {
    write_file(folder / "t.gltf", gltf(nodes + R"(, "extensionsRequired": [")" + extension + R"("])"));
    EXPECT_EQ(reason_of(folder / "t.gltf"),
              "the file needs the glTF extension " + extension + ", which is not read; export it again");
  }
  std::string glb = gltf(nodes + R"(, "extensionsRequired": ["X_shape"])");
  const auto size = static_cast<std::uint32_t>(glb.size());
  const std::uint32_t header[] = {0x46546C67, 2, size + 20, size, 0x4E4F534A};
  write_file(folder / "t.glb", std::string(reinterpret_cast<const char*>(header), sizeof header) + glb);
  EXPECT_NE(reason_of(folder / "t.glb").find("X_shape"), std::string::npos);
}

TEST(MeshImportCorners, ANoteNamesWhatOfAGltfFileIsNotRead) {
  const TemporaryFolder folder;
  const auto note_of = [&](const std::string& text) {
    write_file(folder / "t.gltf", text);
    const ImportedMesh mesh = import_mesh(folder / "t.gltf");
    EXPECT_EQ(mesh.triangles.size(), 4U);
    return mesh.notes.empty() ? "" : mesh.notes[0];
  };
  const std::string begin = "not read, so shapes are as they were modelled: ";
  EXPECT_EQ(note_of(gltf(R"("nodes": [{"mesh": 0}])", R"("weights": [0, 0.5], )")), begin + "weights of morph targets");
  EXPECT_EQ(note_of(gltf(R"("nodes": [{"mesh": 0}])", R"("weights": [0, 0], )")), "");
  EXPECT_EQ(note_of(gltf(R"("nodes": [{"mesh": 0, "skin": 0}, {}], "skins": [{"joints": [1], "inverseBindMatrices": 2}],
"extensionsUsed": ["EXT_mesh_gpu_instancing"])")),
            begin + "skins, instances (EXT_mesh_gpu_instancing)");
  write_file(folder / "t.gltf", gltf(R"("nodes": [{"mesh": 0, "skin": 0}, {}], "skins": [{"joints": [1]}])"));
  EXPECT_EQ(reason_of(folder / "t.gltf"), "a skin without inverse bind matrices, which is not read; export it again");
}

TEST(MeshImportCorners, TwoImportsGiveTheSameMesh) {
  VPS_SHARED_FILE_OR_SKIP(path, "meshes/bunny_3k5.off");
  const TriangleMesh a = import_mesh(path), b = import_mesh(path);
  EXPECT_TRUE(a.vertices == b.vertices && a.triangles == b.triangles);
}

}  // namespace
}  // namespace vps::test
