// SPDX-License-Identifier: GPL-3.0-or-later
// OBJ, OFF, PLY and STL are read in double precision, in all common variants. A file that cannot be read correctly is
// refused, or read with assimp and noted.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

#include "formats/mesh/assimp_reader.h"
#include "formats/mesh/mesh_import.h"
#include "tests/support/shared.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

using Point = std::array<double, 3>;
using Face = std::array<std::uint32_t, 3>;

// A tetrahedron whose coordinates no float represents exactly.
const std::array<std::string, 4> kCorners = {"0.12345678901234567 -0.1 0", "1.1000000000000001 0 0", "0 1.1 -0.7",
                                             "0 0.3 1e-3"};
const std::array<Point, 4> kPoints = {
    {{0.12345678901234567, -0.1, 0}, {1.1000000000000001, 0, 0}, {0, 1.1, -0.7}, {0, 0.3, 1e-3}}};
const std::array<Face, 4> kFaces = {{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};

std::string vertex_lines(const std::string& before, const std::string& after) {
  std::string text;
  for (const std::string& corner : kCorners) text += before + corner + after + "\n";
  return text;
}

std::string face_lines(const std::string& before, int first, const std::string& after) {
  std::string text;
  for (const Face& f : kFaces) {
    text += before;
    for (const std::uint32_t v : f) text += ' ' + std::to_string(first + static_cast<int>(v)) + after;
    text += '\n';
  }
  return text;
}

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
  return text;
}

std::string ply_header(const std::string& format, const std::string& vertex, const std::string& face) {
  return "ply\nformat " + format + " 1.0\ncomment made by hand\nelement vertex 4\n" + vertex + "element face 4\n" +
         face + "end_header\n";
}
const std::string kXyz = "property double x\nproperty double y\nproperty double z\n";
const std::string kList = "property list uchar int vertex_indices\n";

std::string stl(const std::string& name, std::size_t begin, std::size_t end) {
  std::string text = "solid " + name + "\n";
  for (std::size_t f = begin; f < end; ++f) {
    text += "facet normal 0 0 nan\nouter loop\n";
    for (const std::uint32_t v : kFaces[f]) text += "vertex " + kCorners[v] + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid " + name + "\n";
}

template <class T>
void put(std::string& bytes, T value, bool big_endian = false) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  if (big_endian) std::reverse(std::begin(raw), std::end(raw));
  bytes.append(raw, sizeof raw);
}

std::string binary_ply(bool big_endian) {
  std::string bytes = ply_header(big_endian ? "binary_big_endian" : "binary_little_endian",
                                 "property uchar quality\n" + kXyz, "property list ushort float uv\n" + kList);
  for (const Point& p : kPoints) {
    bytes += '\7';
    for (const double x : p) put(bytes, x, big_endian);
  }
  for (const Face& f : kFaces) {
    put(bytes, std::uint16_t{2}, big_endian);
    for (const float x : {0.5F, 0.25F}) put(bytes, x, big_endian);
    bytes += '\3';
    for (const std::uint32_t v : f) put(bytes, v, big_endian);
  }
  return bytes;
}

std::string binary_stl(const std::string& title) {
  std::string bytes = title + std::string(80 - title.size(), ' ');
  put(bytes, std::uint32_t{4});
  for (const Face& f : kFaces) {
    for (int i = 0; i < 3; ++i) put(bytes, 0.0F);
    for (const std::uint32_t v : f) {
      for (const double x : kPoints[v]) put(bytes, static_cast<float>(x));
    }
    bytes += std::string(2, '\0');
  }
  return bytes;
}

void expect_exact(const ImportedMesh& mesh, const std::string& what) {
  ASSERT_EQ(mesh.triangles.size(), 4U) << what;
  EXPECT_EQ(mesh.vertices.size(), 4U) << what;
  for (std::size_t f = 0; f < 4; ++f) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(mesh.vertices[mesh.triangles[f][k]], kPoints[kFaces[f][k]]) << what;
  }
  EXPECT_TRUE(mesh.notes.empty()) << what << mesh.notes[0];
}

struct Case {
  const char* what;
  const char* name;
  std::string text;
};

TEST(PolygonSoup, EveryVariantKeepsEveryBitOfItsDoubles) {
  const TemporaryFolder folder;
  const std::string obj = vertex_lines("v ", "") + face_lines("f", 1, "");
  const std::string off = vertex_lines("", "") + face_lines("3", 0, "");
  const std::string ply = vertex_lines("", "") + face_lines("3", 0, "");
  const Case cases[] = {
      {"plain", "a.obj", obj},
      {"negative indices", "a.obj", vertex_lines("v ", "") + face_lines("f", -4, "")},
      {"faces before vertices", "a.obj", face_lines("f", 1, "") + vertex_lines("v ", "")},
      {"all forms of corners", "a.obj",
       vertex_lines("v ", "") + "vt 0 0\nvn 0 0 1\nf 1/1/1 3//1 2/1\n" +
           face_lines("f", 1, "/1/-1").substr(face_lines("f", 1, "/1/-1").find('\n'))},
      {"tabs and blanks", "a.obj", replaced(obj, " ", " \t ")},
      {"DOS", "a.obj", replaced(obj, "\n", "\r\n")},
      {"old Mac", "a.obj", replaced(obj, "\n", "\r")},
      {"byte order mark", "a.obj", "\xEF\xBB\xBF" + obj},
      {"points, lines, groups", "a.obj",
       "mtllib x.mtl\no a\ng b c\ns off\nl 1 2\np 1\nusemtl m\n" + obj + "l 1/1 2/2\n"},
      {"comments", "a.obj", "# C:\\folder\\\n" + replaced(obj, "\n", " # 7 8\n")},
      {"continued lines", "a.obj", replaced(replaced(obj, "f 1 ", "f 1 \\\n"), "v 0 1.1", "v 0 \\\r\n1.1")},
      {"colours", "a.obj", vertex_lines("v ", " 0.5 0.25 1") + face_lines("f", 1, "")},
      {"weights of one", "a.obj", vertex_lines("v ", " 1.0") + face_lines("f", 1, "")},
      {"plus signs", "a.obj", replaced(obj, " 1.1", " +1.1")},
      {"plain", "a.off", "OFF\n4 4 6\n" + off},
      {"counts behind the keyword", "a.off", "OFF 4 4 6\n" + off},
      {"no count of edges", "a.off", "OFF\n4 4\n" + off},
      {"no keyword", "a.off", "4 4 6\n" + off},
      {"comments", "a.off", "# a\nOFF # b\n\n4 4 6 # c\n# d\n" + replaced(off, "\n", " # e\n# f\n\n")},
      {"colours", "a.off", "COFF\n4 4 6\n" + vertex_lines("", " 255 0 0 255") + face_lines("3", 0, "")},
      {"normals", "a.off", "NOFF\n4 4 6\n" + vertex_lines("", " 0 0 1") + face_lines("3", 0, "")},
      {"texture coordinates", "a.off", "STOFF\n4 4 6\n" + vertex_lines("", " 0.5 0.5") + face_lines("3", 0, "")},
      {"all of them", "a.off", "STCNOFF\n4 4 6\n" + vertex_lines("", " 0 0 1 9 9 9 9 0 1") + face_lines("3", 0, "")},
      {"three dimensions", "a.off", "nOFF\n3\n4 4 6\n" + off},
      {"colours of faces", "a.off", "OFF\n4 4 6\n" + replaced(off, "\n3 0 2 1\n", "\n3 0 2 1 3 255 0 0\n")},
      {"DOS", "a.off", replaced("OFF\n4 4 6\n" + off, "\n", "\r\n")},
      {"no last line end", "a.off", ("OFF\n4 4 6\n" + off).substr(0, 9 + off.size())},
      {"plain", "a.ply", ply_header("ascii", kXyz, kList) + ply},
      {"vertex_index", "a.ply", ply_header("ascii", kXyz, "property list int uint vertex_index\n") + ply},
      {"names with sizes", "a.ply",
       replaced(replaced(ply_header("ascii", kXyz, kList), "double", "float64"), "uchar int", "uint8 int32") + ply},
      {"DOS", "a.ply", replaced(ply_header("ascii", kXyz, kList) + ply, "\n", "\r\n")},
      {"a comment first", "a.ply", replaced(ply_header("ascii", kXyz, kList) + ply, "ply\n", "ply\ncomment x\n")},
      {"an empty comment", "a.ply",
       replaced(ply_header("ascii", kXyz, kList) + ply, "comment made by hand", "obj_info\n")},
      {"integer colours", "a.ply",
       ply_header("ascii", kXyz + "property int red\nproperty uchar green\nproperty short blue\n", kList) +
           vertex_lines("", " 1 2 3") + face_lines("3", 0, "")},
      {"another element between", "a.ply",
       replaced(ply_header("ascii", kXyz, kList), "element face",
                "element edge 2\nproperty list char float w\nelement face") +
           vertex_lines("", "") + "3 1 2 0\n0\n" + face_lines("3", 0, "")},
      {"half-edges", "a.ply",
       replaced(ply_header("ascii", kXyz, kList), "end_header",
                "element halfedge 1\nproperty float source\nend_header") +
           ply + "0.5\n"},
      {"faces first", "a.ply",
       "ply\nformat ascii 1.0\nelement face 4\n" + kList + "element vertex 4\n" + kXyz + "end_header\n" +
           face_lines("3", 0, "") + vertex_lines("", "")},
      {"binary, little endian", "a.ply", binary_ply(false)},
      {"binary, big endian", "a.ply", binary_ply(true)},
      {"plain", "a.stl", stl("t", 0, 4)},
      {"several solids", "a.stl", stl("t", 0, 1) + stl("u", 1, 4)},
      {"names of keywords", "a.stl", stl("solid facet of a vertex", 0, 4)},
      {"no name", "a.stl", stl("", 0, 4)},
      {"an end left out", "a.stl", replaced(stl("t", 0, 2), "endsolid t\n", "") + stl("u", 2, 4)},
      {"capitals", "a.stl",
       replaced(replaced(replaced(stl("t", 0, 4), "vertex", "VERTEX"), "facet", "FACET"), "solid", "SOLID")},
      {"all in few lines", "a.stl", replaced(stl("t", 0, 4), "loop\n", "loop ")},
      {"DOS", "a.stl", replaced(stl("t", 0, 4), "\n", "\r\n")},
  };
  for (const auto& [what, name, text] : cases) {
    write_file(folder / name, text);
    try {
      expect_exact(import_mesh(folder / name), std::string(name) + ", " + what);
    } catch (const ImportError& error) {
      ADD_FAILURE() << name << ", " << what << ": " << error.what();
    }
  }
}

TEST(PolygonSoup, AMissingCountOfEdgesTakesNoSignOff) {
  const TemporaryFolder folder;
  write_file(folder / "a.off", "OFF\n3 1\n-0.5 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_EQ(import_mesh(folder / "a.off").vertices[0][0], -0.5);
}

TEST(PolygonSoup, BinaryStlKeepsItsFloatsWhateverItsTitleBeginsWith) {
  const TemporaryFolder folder;
  for (const char* title : {"title", "solid title", "solid", " ", "SOLID\n"}) {
    write_file(folder / "a.stl", binary_stl(title));
    const ImportedMesh mesh = import_mesh(folder / "a.stl");
    ASSERT_EQ(mesh.triangles.size(), 4U) << title;
    for (std::size_t f = 0; f < 4; ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          EXPECT_EQ(mesh.vertices[mesh.triangles[f][k]][axis], static_cast<float>(kPoints[kFaces[f][k]][axis]))
              << title;
        }
      }
    }
    EXPECT_TRUE(mesh.notes.empty()) << title;
  }
}

TEST(PolygonSoup, WhatOnlyAssimpReadsIsReadInSinglePrecisionAndNoted) {
  const TemporaryFolder folder;
  const std::string off = "4OFF\n4 4 6\n" + vertex_lines("", " 1") + face_lines("3", 0, "");
  const Case cases[] = {
      {"the vertex has the weight '2'", "a.obj", vertex_lines("v ", " 2") + face_lines("f", 1, "")},
      {"unknown word 'sphere'", "a.obj", "sphere 1\n" + vertex_lines("v ", "") + face_lines("f", 1, "")},
      {"'nan' is not a finite number", "a.obj", vertex_lines("v ", "") + face_lines("f", 1, "") + "v 0 0 nan\n"},
      {"homogeneous", "a.off", off},
      {"32 bits", "a.ply",
       ply_header("ascii", kXyz, "property list uchar ushort vertex_indices\n") + vertex_lines("", "") +
           face_lines("3", 0, "")},
      {"more numbers than the header says", "a.ply",
       ply_header("ascii", kXyz, kList) + vertex_lines("", " 9") + face_lines("3", 0, "")},
      {"no end", "a.stl", replaced(stl("t", 0, 4), "endsolid t\n", "")},
  };
  for (const auto& [why, name, text] : cases) {
    write_file(folder / name, text);
    try {
      const ImportedMesh mesh = import_mesh(folder / name);
      EXPECT_EQ(mesh.triangles.size(), 4U) << name << ": " << why;
      ASSERT_EQ(mesh.notes.size(), 1U) << name << ": " << why;
      EXPECT_TRUE(mesh.notes[0].starts_with("read in single precision: ")) << mesh.notes[0];
      EXPECT_NE(mesh.notes[0].find(why), std::string::npos) << mesh.notes[0];
    } catch (const ImportError& error) {
      ADD_FAILURE() << name << ", " << why << ": " << error.what();
    }
  }
}

TEST(PolygonSoup, WhatNobodyReadsRightlyIsRefusedWithItsPlace) {
  const TemporaryFolder folder;
  const std::string vertices = vertex_lines("v ", "");
  const std::string off_vertices = vertex_lines("", "");
  const std::string faces = face_lines("3", 0, "");
  const std::string ply = ply_header("ascii", kXyz, kList);
  const Case cases[] = {
      {"line 5: 'x' is no corner", "a.obj", vertices + "f 1 2 x 3\n"},
      {"line 5: '1//2/3' is no corner", "a.obj", vertices + "f 1//2/3 2 3\n"},
      {"vertex '0', which is not there", "a.obj", vertices + "f 0 1 2\n" + vertices},
      {"that is not there", "a.obj", vertices + "f 1 2 5\n"},
      {"that is not there", "a.obj", vertices + "f -5 1 2\n" + vertices},
      {"which is not there", "a.obj", vertices + "f 1 2 99999999999\n"},
      {"line 1: '1d5' is no number", "a.obj", "v 0 0 1d5\n" + vertices + "f 1 2 3\n"},
      {"line 1: a number is missing", "a.obj", "v 0 0\n" + vertices + "f 1 2 3\n"},
      {"line 1: a vertex of 5 numbers", "a.obj", "v 0 0 0 1 1\n" + vertices + "f 1 2 3\n"},
      {"no triangles", "a.obj", vertices + "f 1 2\nl 1 2\n"},
      {"too few corners", "a.off", "OFF\n4 4 0\n" + off_vertices + replaced(faces, "3 0 2 1", "4 0 2 1")},
      {"vertex '4', which is not there", "a.off", "OFF\n4 4 0\n" + off_vertices + replaced(faces, "0 2 1", "0 2 4")},
      {"'1.5' is no count", "a.off", "OFF\n4 4 0\n" + off_vertices + replaced(faces, "0 2 1", "0 2 1.5")},
      {"'-1' is no count", "a.off", "OFF\n4 4 0\n" + off_vertices + replaced(faces, "0 2 1", "0 2 -1")},
      {"ends before its last", "a.off", "OFF\n4 5 0\n" + off_vertices + faces},
      {"ends before its last", "a.off", "OFF\n4 4 0\n" + replaced(off_vertices, "\n", " ") + "\n" + faces},
      {"goes on after its last face", "a.off", "OFF\n4 3 0\n" + off_vertices + faces},
      {"binary OFF", "a.off", "OFF BINARY\n" + std::string(40, '\0')},
      {"dimensions", "a.off", "nOFF 4\n4 4 0\n" + off_vertices + faces},
      {"no OFF header", "a.off", "OOFF\n4 4 0\n" + off_vertices + faces},
      {"unknown type 'float128'", "a.ply", replaced(ply, "double y", "float128 y") + off_vertices + faces},
      {"the vertices have no y", "a.ply", replaced(ply, "double y", "double w") + off_vertices + faces},
      {"the faces have no list", "a.ply", replaced(ply, "vertex_indices", "corners") + off_vertices + faces},
      {"unknown PLY format", "a.ply", replaced(ply, "ascii", "text") + off_vertices + faces},
      {"'1.0' is no integer", "a.ply", ply + off_vertices + replaced(faces, "0 2 1", "0 2 1.0")},
      {"no length of a list", "a.ply", ply + off_vertices + replaced(faces, "3 0 2 1", "300 0 2 1")},
      {"a number is missing", "a.ply", ply + off_vertices + replaced(faces, "3 0 2 1", "4 0 2 1")},
      {"goes on after its last", "a.ply", replaced(ply, "face 4", "face 3") + off_vertices + faces},
      {"ends before its last", "a.ply", replaced(ply, "face 4", "face 5") + off_vertices + faces},
      {"ends before its last", "a.ply", binary_ply(false).substr(0, binary_ply(false).size() - 1)},
      {"goes on after its last", "a.ply", binary_ply(true) + "x"},
      {"ends inside its header", "a.ply", ply.substr(0, ply.size() - 12)},
      {"that is not there", "a.ply", ply + off_vertices + replaced(faces, "0 2 1", "0 2 -1")},
      {"a facet of 4 corners", "a.stl", replaced(stl("t", 0, 4), "endloop", "vertex 0 0 0\nendloop")},
      {"ends inside a facet", "a.stl", stl("t", 0, 4).substr(0, stl("t", 0, 4).size() - 20)},
      {"unexpected word 'vortex'", "a.stl", replaced(stl("t", 0, 4), "vertex", "vortex")},
      {"not a finite number", "a.stl", replaced(stl("t", 0, 4), "1e-3", "1e999")},
      {"binary data of the size it states", "a.stl", binary_stl("t") + "x"},
  };
  for (const auto& [why, name, text] : cases) {
    write_file(folder / name, text);
    try {
      (void)import_mesh(folder / name);
      ADD_FAILURE() << name << " was imported: " << why;
    } catch (const ImportError& error) {
      EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << name << ": " << error.what();
    }
  }
}

TEST(PolygonSoup, AHeaderThatPromisesMoreThanTheFileHoldsIsRefusedAtOnce) {
  const TemporaryFolder folder;
  const auto with_count = [&](const std::string& format, const std::string& element, const std::string& count) {
    return replaced(ply_header(format, kXyz, kList), "element " + element + " 4", "element " + element + " " + count);
  };
  const Case cases[] = {
      {"vertices", "a.off", "OFF\n2000000000 4 0\n0 0 0\n"},
      {"faces", "a.off", "OFF\n1 4294967295 0\n0 0 0\n"},
      {"both", "a.off", "OFF\n9223372036854775807 9223372036854775807 0\n0 0 0\n"},
      {"vertices", "a.ply", with_count("ascii", "vertex", "4000000000") + "0 0 0\n"},
      {"faces", "a.ply", with_count("ascii", "face", "9223372036854775807") + "0 0 0\n"},
      {"binary", "a.ply", with_count("binary_big_endian", "vertex", "999999999999") + "0 0 0\n"},
      {"nothing", "a.ply", "ply\nformat ascii 1.0\nelement nothing 9223372036854775807\nend_header\n"},
  };
  for (const auto& [what, name, text] : cases) {
    write_file(folder / name, text);
    const auto begin = std::chrono::steady_clock::now();
    try {
      (void)import_mesh(folder / name);
      ADD_FAILURE() << name << " was imported: " << what;
    } catch (const ImportError& error) {
      EXPECT_NE(std::string(error.what()).find("the header promises"), std::string::npos) << error.what();
    }
    EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), 1) << name << what;
  }
}

TEST(PolygonSoup, ConcavePolygonsKeepTheirArea) {
  const TemporaryFolder folder;
  const std::string arrow[] = {"0 0 0", "2 -1 0", "0 3 0", "-2 -1 0"};  // concave at the first corner; area 6
  std::string obj, lines;
  for (const std::string& p : arrow) obj += "v " + p + "\n", lines += p + "\n";
  write_file(folder / "a.obj", obj + "f 1 2 3 4\n");
  write_file(folder / "a.off", "OFF\n4 1 0\n" + lines + "4 0 1 2 3\n");
  write_file(folder / "a.ply", replaced(ply_header("ascii", kXyz, kList), "face 4", "face 1") + lines + "4 0 1 2 3\n");
  for (const char* name : {"a.obj", "a.off", "a.ply"}) {
    const ImportedMesh mesh = import_mesh(folder / name);
    ASSERT_EQ(mesh.triangles.size(), 2U) << name;
    for (const Face& f : mesh.triangles) {
      const Point &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
      EXPECT_DOUBLE_EQ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]), 6) << name;
    }
  }
}

// assimp's conversion of decimals has errors of up to two float steps.
TEST(PolygonSoup, SharedMeshesAgreeWithAssimpToSinglePrecision) {
  VPS_SHARED_FILE_OR_SKIP(meshes, "meshes");
  int compared = 0;
  for (const auto& entry : std::filesystem::directory_iterator(meshes)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".obj" && extension != ".off" && extension != ".ply" && extension != ".stl") continue;
    const RawMesh expected = read_with_assimp(entry.path().string(), extension.substr(1));
    const ImportedMesh mesh = import_mesh(entry.path());
    EXPECT_TRUE(mesh.notes.empty()) << entry.path();
    ASSERT_EQ(mesh.triangles.size(), expected.triangles.size()) << entry.path();
    double worst = 0;
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double exact = mesh.vertices[mesh.triangles[f][k]][axis];
          const double single = expected.vertices[expected.triangles[f][k]][axis];
          const double step = std::abs(exact) * 0x1p-23 + 1e-30;
          worst = std::max(worst, std::abs(exact - single) / step);
        }
      }
    }
    EXPECT_LE(worst, 2.5) << entry.path();
    ++compared;
  }
  EXPECT_EQ(compared, 35);
}

}  // namespace
}  // namespace vps::test
