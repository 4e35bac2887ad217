// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh/mesh_import.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>

#include "formats/mesh/child_process.h"
#include "tests/formats/mesh/import_seeds.h"
#include "tests/support/shared.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

struct Refusal {
  std::string why;
  ImportError::Kind kind = ImportError::Kind::io;
};

Refusal refusal(const std::filesystem::path& path, const ImportOptions& options = {}) {
  try {
    (void)import_mesh(path, options);
  } catch (const ImportError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return {error.what(), error.kind};
  }
  return {"imported", ImportError::Kind::io};
}

constexpr const char* kQuadObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\nf 1 2 3 4\nl 1 3\n";

TEST(MeshImport, PolygonsAreCutLinesSkippedAndUnusedVerticesDropped) {
  const TemporaryFolder folder;
  write_file(folder / "quad.OBJ", kQuadObj);
  ImportOptions millimetres;
  millimetres.unit = 0.001;
  const TriangleMesh mesh = import_mesh(folder / "quad.OBJ", millimetres);
  EXPECT_EQ(mesh.triangles.size(), 2U);
  ASSERT_EQ(mesh.vertices.size(), 4U);
  double largest = 0;
  for (const auto& v : mesh.vertices) largest = std::max(largest, v[0]);
  EXPECT_DOUBLE_EQ(largest, 0.001);
}

TEST(MeshImport, EachTextFormatGivesTheSameTetrahedron) {
  const TemporaryFolder folder;
  write_file(folder / "t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  write_file(folder / "t.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n");
  write_file(folder / "t.ply",
             "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
             "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
             "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n");
  std::string stl = "solid t\n";
  const char* corners[] = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
  const int faces[][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  for (const auto& face : faces) {
    stl += "facet normal 0 0 0\nouter loop\n";
    for (const int corner : face) stl += std::string("vertex ") + corners[corner] + "\n";
    stl += "endloop\nendfacet\n";
  }
  write_file(folder / "t.stl", stl + "endsolid t\n");
  for (const char* name : {"t.obj", "t.off", "t.ply", "t.stl"}) {
    const TriangleMesh mesh = import_mesh(folder / name);
    EXPECT_EQ(mesh.vertices.size(), 4U) << name;
    EXPECT_EQ(mesh.triangles.size(), 4U) << name;
  }
}

TEST(MeshImport, WhatCannotBeReadIsAnIoError) {
  const TemporaryFolder folder;
  EXPECT_EQ(refusal(folder / "none.obj").why, "the file does not exist; check its name");
  EXPECT_EQ(refusal(folder / "none.obj").kind, ImportError::Kind::io);
  EXPECT_EQ(refusal(folder.path()).why, "this is a folder; give a mesh file");
  if (::geteuid() != 0) {
    write_file(folder / "secret.obj", kQuadObj);
    std::filesystem::permissions(folder / "secret.obj", std::filesystem::perms::none);
    EXPECT_EQ(refusal(folder / "secret.obj").why, "the file may not be read; check its permissions");
  }
}

TEST(MeshImport, WhatIsNoMeshIsBadInput) {
  const TemporaryFolder folder;
  const std::tuple<const char*, const char*, const char*> cases[] = {
      {"empty.obj", "", "the file is empty"},
      {"model.step", "ISO-10303-21;", "unknown mesh format .step; use one of obj, ply"},
      {"noextension", "x", "the file name has no extension; use one of obj"},
      {"junk.obj", "\x01\x02 this is not a mesh\n\n", "export"},
      {"junk.stl", "hello", "export it again"},
      {"junk.glb", "hello world, this is no glTF", "export it again"},
      {"nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not a finite number"},
      {"inf.obj", "v 0 0 1e999\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not a finite number"},
      {"huge.obj", "v 0 0 3.4e38\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "is too large"},
      {"index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", "export it again"},
  };
  for (const auto& [name, text, why] : cases) {
    write_file(folder / name, text);
    const Refusal refused = refusal(folder / name);
    EXPECT_NE(refused.why.find(why), std::string::npos) << name << ": " << refused.why;
    EXPECT_EQ(refused.kind, ImportError::Kind::bad_input) << name;
  }
}

TEST(MeshImport, PointsAndLinesAloneAreNotAMesh) {
  const TemporaryFolder folder;
  write_file(folder / "line.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3\n");
  EXPECT_NE(refusal(folder / "line.obj").why.find("no triangles"), std::string::npos);
}

TEST(ChildProcess, CrashesHangsAndExceptionsStayInTheChild) {
  const ChildLimits limits{1 << 30, 0.5};
  using End = ChildResult::End;
  EXPECT_EQ(run_in_child(limits, [](int) { ::raise(SIGKILL); }).end, End::crashed);
  EXPECT_EQ(run_in_child(limits, [](int) { ::raise(SIGKILL); }).signal, SIGKILL);
  EXPECT_EQ(run_in_child(limits, [](int) { ::pause(); }).end, End::timed_out);
  EXPECT_EQ(run_in_child(limits, [](int) { throw std::bad_alloc(); }).end, End::out_of_memory);
  EXPECT_EQ(run_in_child(limits, [](int) { throw 1; }).end, End::failed);
  const ChildResult result = run_in_child(limits, [](int fd) {
    const std::vector<char> text(200000, 'x');
    write_all(fd, text.data(), text.size());
  });
  EXPECT_EQ(result.end, End::finished);
  EXPECT_EQ(result.bytes.size(), 200000U);
}

// The work of a server's child.
void do_as_asked(const std::string& request, int fd) {
  if (request == "crash") ::raise(SIGKILL);
  if (request == "hang") ::pause();
  if (request == "memory") throw std::bad_alloc();
  if (request == "fail") throw 1;
  for (int i = 0; i < 100; ++i) write_all(fd, request.data(), request.size());
}

TEST(ChildProcess, AServerForksTheSameChildren) {
  prepare_children();
  const pid_t before = ::getpid();
  const ChildLimits limits{1 << 30, 0.5};
  using End = ChildResult::End;
  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(run_in_child(limits, do_as_asked, "crash").end, End::crashed);
    EXPECT_EQ(run_in_child(limits, do_as_asked, "crash").signal, SIGKILL);
    EXPECT_EQ(run_in_child(limits, do_as_asked, "hang").end, End::timed_out);
    EXPECT_EQ(run_in_child(limits, do_as_asked, "memory").end, End::out_of_memory);
    EXPECT_EQ(run_in_child(limits, do_as_asked, "fail").end, End::failed);
    for (const std::size_t size : {1, 4000, 100000}) {  // the last one is more than the server takes
      const ChildResult result = run_in_child(limits, do_as_asked, std::string(size, 'x'));
      EXPECT_EQ(result.end, End::finished) << size;
      EXPECT_EQ(result.bytes.size(), 100 * size);
    }
  }
  EXPECT_EQ(::getpid(), before);
}

TEST(ChildProcess, AServerThatWasKilledIsDoneWithout) {
  prepare_children();
  const ChildLimits limits{1 << 30, 0.5};
  const ChildWork tell_parent = [](const std::string&, int fd) {
    const pid_t parent = ::getppid();
    write_all(fd, &parent, sizeof parent);
  };
  const auto parent_of_child = [&] {
    const ChildResult result = run_in_child(limits, tell_parent, "");
    pid_t parent = 0;
    if (result.bytes.size() == sizeof parent) std::memcpy(&parent, result.bytes.data(), sizeof parent);
    return parent;
  };
  const pid_t server = parent_of_child();
  ASSERT_GT(server, 0);
  ASSERT_NE(server, ::getpid());
  ::kill(server, SIGKILL);
  while (::waitpid(server, nullptr, WNOHANG) == 0) ::usleep(100);
  EXPECT_EQ(parent_of_child(), ::getpid());
}

TEST(MeshImport, ContentShowsTheFormatWithoutTheName) {
  const TemporaryFolder folder;
  for (const Seed& seed : make_seeds(folder.path())) {
    write_file(folder / "mesh", seed.bytes);
    ImportOptions options;
    options.format = detect_mesh_format(folder / "mesh");
    EXPECT_EQ("." + options.format, seed.extension) << seed.name;
    if (seed.extension == ".gltf") continue;  // its buffer is another file
    write_file(folder / ("named" + seed.extension), seed.bytes);
    EXPECT_TRUE(import_mesh(folder / "mesh", options).vertices ==
                import_mesh(folder / ("named" + seed.extension)).vertices)
        << seed.name;
  }
  for (const char* const text : {"", "#", "hello v 1", "<html>", "\x17\x01"}) {
    write_file(folder / "mesh", text);
    EXPECT_EQ(detect_mesh_format(folder / "mesh"), "") << text;
  }
}

TEST(MeshImport, ContentOfRealFilesShowsTheFormat) {
  VPS_SHARED_FILE_OR_SKIP(meshes, "meshes");
  for (const auto& entry : std::filesystem::directory_iterator(meshes)) {
    if (!has_mesh_extension(entry.path())) continue;
    EXPECT_EQ(detect_mesh_format(entry.path()), mesh_format(entry.path())) << entry;
  }
}

// Numbers of welded vertices and triangles, counted by another program (README of the shared folder).
TEST(MeshImport, RealFilesGiveTheKnownCounts) {
  VPS_SHARED_FILE_OR_SKIP(meshes, "meshes");
  const std::tuple<const char*, std::size_t, std::size_t> known[] = {
      {"bunny_closed.obj", 34835, 69666},  {"bunny_full.obj", 34834, 69451},    {"bunny_insideout.ply", 34834, 69451},
      {"bunny_3k5.off", 3485, 6966},       {"armadillo_52k.off", 26002, 52000}, {"screw_M3x10.stl", 7768, 15532},
      {"gearwheel_40.stl", 1222, 2444},    {"propeller.stl", 3689, 7375},       {"spot.obj", 2930, 5856},
      {"scallop_120k.glb", 60002, 120000}, {"asteroid.3ds", 24002, 48000},      {"sliver_tet.ply", 4, 4},
      {"nested_instances.glb", 24, 36},    {"ur5_forearm.dae", 10523, 21028},   {"shape_sorter.obj", 96, 200},
  };
  for (const auto& [name, vertices, triangles] : known) {
    const TriangleMesh mesh = import_mesh(meshes / name);
    EXPECT_EQ(mesh.vertices.size(), vertices) << name;
    EXPECT_EQ(mesh.triangles.size(), triangles) << name;
  }
}

TEST(MeshImport, InstancesAndTransformsAreApplied) {
  VPS_SHARED_FILE_OR_SKIP(truck, "meshes/milk_truck.glb");
  const TriangleMesh mesh = import_mesh(truck);
  EXPECT_EQ(mesh.triangles.size(), 3624U);
  std::array<double, 3> low = mesh.vertices[0];
  std::array<double, 3> high = low;
  for (const auto& v : mesh.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], v[axis]);
      high[axis] = std::max(high[axis], v[axis]);
    }
  }
  EXPECT_NEAR(high[0] - low[0], 4.87, 0.01);
  EXPECT_NEAR(high[1] - low[1], 2.58, 0.01);
  EXPECT_NEAR(high[2] - low[2], 2.79, 0.01);
}

TEST(MeshImport, LinePrimitivesOfACadExportAreSkipped) {
  VPS_SHARED_FILE_OR_SKIP(link, "meshes/franka_link5.dae");
  EXPECT_EQ(import_mesh(link).triangles.size(), 18327U);
}

TEST(MeshImport, KnownInvalidFilesGetAVerdict) {
  VPS_SHARED_FILE_OR_SKIP(invalid, "meshes/invalid");
  ImportOptions options;
  options.memory_limit_bytes = 2ull << 30;
  options.timeout = 20;
  for (const char* name :
       {"malformed_index.obj", "empty.obj", "empty.ply", "wrong_face_count.stl", "points_only.ply"}) {
    EXPECT_EQ(refusal(invalid / name, options).kind, ImportError::Kind::bad_input) << name;
  }
  EXPECT_EQ(import_mesh(invalid / "nan_normal.stl", options).triangles.size(), 4U);
  const Refusal bomb = refusal(invalid / "huge_vertex_count.off", options);
  EXPECT_EQ(bomb.kind, ImportError::Kind::bad_input);
  EXPECT_NE(bomb.why.find("promises 353535235358 vertices"), std::string::npos) << bomb.why;
}

TEST(MeshImport, MutatedFilesNeverTakeTheProgramDown) {
  const TemporaryFolder folder;
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
  ImportOptions options;
  options.memory_limit_bytes = 256ull << 20;
  options.timeout = 1;
  std::uint32_t state = 7;
  const auto next = [&] { return state = state * 1664525u + 1013904223u, state >> 8; };
  int refused = 0;
  for (int trial = 0; trial < 60; ++trial) {
    std::string mutated = ply;
    for (std::uint32_t n = 1 + next() % 4; n > 0; --n) {
      mutated[next() % mutated.size()] = static_cast<char>(next() % 4 == 0 ? next() % 256 : '0' + next() % 10);
    }
    write_file(folder / "m.ply", mutated);
    try {
      const TriangleMesh mesh = import_mesh(folder / "m.ply", options);
      for (const auto& t : mesh.triangles) {
        for (const std::uint32_t v : t) ASSERT_LT(v, mesh.vertices.size());
      }
    } catch (const ImportError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 10);
}

}  // namespace
}  // namespace vps::test
