// SPDX-License-Identifier: Zlib
// Writes the sample meshes as OBJ files into a folder. The files beside this source are its output.
#include <cstdio>
#include <string>

#include "sample_meshes/shapes.h"

namespace {

using namespace vps::samples;

bool write_obj(const std::string& path, const vps::TriangleMesh& mesh) {
  std::FILE* const file = std::fopen(path.c_str(), "w");
  if (file == nullptr) return false;
  std::fprintf(file, "# SPDX-License-Identifier: Zlib\n# Made by sample_meshes/generate.cpp. Unit: metre.\n");
  // Nine digits hide the differences between mathematical libraries. Adding 0 turns -0 into 0.
  for (const auto& v : mesh.vertices) {
    double p[3];
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] = (std::abs(v[axis]) < 1e-15 ? 0 : v[axis]) + 0.0;
    std::fprintf(file, "v %.9g %.9g %.9g\n", p[0], p[1], p[2]);
  }
  for (const auto& t : mesh.triangles) std::fprintf(file, "f %u %u %u\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return std::fclose(file) == 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: sample_mesh_generator FOLDER\n");
    return 1;
  }
  const std::pair<const char*, vps::TriangleMesh> meshes[] = {
      {"cube", make_box({0.05, 0.05, 0.05})},
      {"icosphere", make_sphere(0.05, 4)},
      {"torus", make_torus(0.05, 0.02, 64, 32)},
      {"bolt", make_bolt()},
      {"nut", make_nut()},
      {"gear", make_gear()},
      {"peg", make_peg()},
      {"hole", make_hole()},
      {"thin_plate", make_box({0.05, 0.05, 0.00025})},
  };
  for (const auto& [name, mesh] : meshes) {
    const std::string path = std::string(argv[1]) + "/" + name + ".obj";
    if (!write_obj(path, mesh)) {
      std::fprintf(stderr, "sample_mesh_generator: error: %s: cannot be written; check the folder\n", path.c_str());
      return 2;
    }
  }
  return 0;
}
