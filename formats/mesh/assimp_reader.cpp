// SPDX-License-Identifier: GPL-3.0-or-later
// The only source that includes assimp. No post-processing: some steps abort on damaged input, and assimp's own
// triangulation cuts concave polygons wrongly.
#include "formats/mesh/assimp_reader.h"

#include <assimp/BaseImporter.h>
#include <assimp/DefaultIOSystem.h>
#include <assimp/config.h>
#include <assimp/importerdesc.h>
#include <assimp/scene.h>

#include <array>
#include <assimp/Importer.hpp>
#include <cstdint>
#include <new>
#include <sstream>
#include <utility>
#include <vector>

#include "formats/mesh/gltf.h"
#include "formats/mesh/mesh_import.h"
#include "formats/mesh/triangulate.h"

namespace vps {
namespace {

// Row-major 4x4 in double, so that nested transforms lose no more digits than assimp's floats already have.
using Matrix = std::array<double, 16>;

constexpr Matrix kIdentity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

Matrix to_matrix(const aiMatrix4x4& m) {
  return {m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3, m.d4};
}

Matrix multiply(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t k = 0; k < 4; ++k) out[4 * i + j] += a[4 * i + k] * b[4 * k + j];
    }
  }
  return out;
}

double determinant3(const Matrix& m) {
  return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
}

std::array<double, 3> transformed(const Matrix& m, const aiVector3D& v) {
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z + m[3], m[4] * v.x + m[5] * v.y + m[6] * v.z + m[7],
          m[8] * v.x + m[9] * v.y + m[10] * v.z + m[11]};
}

void add_mesh(const aiMesh& mesh, const Matrix& transform, RawMesh& out) {
  constexpr std::size_t kMaxVertices = 0xFFFFFFFF;
  if (out.vertices.size() + mesh.mNumVertices > kMaxVertices) throw ReadError("more than 2^32 vertices");
  const auto base = static_cast<std::uint32_t>(out.vertices.size());
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) out.vertices.push_back(transformed(transform, mesh.mVertices[i]));
  // A mirroring transform reverses the winding.
  const bool mirrored = determinant3(transform) < 0;
  std::vector<std::array<double, 3>> corners;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices < 3) {
      ++out.skipped_primitives;
      continue;
    }
    corners.clear();
    for (unsigned k = 0; k < face.mNumIndices; ++k) {
      // The parent checks indices too, but positions are needed here.
      if (face.mIndices[k] >= mesh.mNumVertices) throw ReadError("a face refers to a vertex that is not there");
      // Positions as in the file, before any transform, so that rounding does not bend a straight outline.
      const aiVector3D& v = mesh.mVertices[face.mIndices[k]];
      corners.push_back({v.x, v.y, v.z});
    }
    for (auto [a, b, c] : triangulate_polygon(corners)) {
      if (mirrored) std::swap(b, c);
      out.triangles.push_back({base + face.mIndices[a], base + face.mIndices[b], base + face.mIndices[c]});
    }
  }
}

// Iterative: a file may nest nodes deeper than the stack.
void add_nodes(const aiScene& scene, RawMesh& out) {
  struct Visit {
    const aiNode* node;
    Matrix transform;
  };
  std::vector<Visit> stack = {{scene.mRootNode, kIdentity}};
  while (!stack.empty()) {
    const Visit visit = stack.back();
    stack.pop_back();
    const Matrix transform = multiply(visit.transform, to_matrix(visit.node->mTransformation));
    for (unsigned i = 0; i < visit.node->mNumMeshes; ++i) {
      const unsigned mesh = visit.node->mMeshes[i];
      if (mesh >= scene.mNumMeshes) throw ReadError("a node refers to a mesh that is not there");
      add_mesh(*scene.mMeshes[mesh], transform, out);
    }
    for (unsigned i = visit.node->mNumChildren; i-- > 0;) stack.push_back({visit.node->mChildren[i], transform});
  }
}

// Opens only the files that a glTF file's names refer to. assimp looks for a missing one elsewhere, where the cache,
// which identifies meshes by their bytes, does not look.
class Files : public Assimp::DefaultIOSystem {
 public:
  explicit Files(const std::string& mesh) : folder_(mesh.substr(0, mesh.rfind('/') + 1)) {}
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    const std::string name = file;
    if (is_missing_ || !name.starts_with(folder_)) return nullptr;
    Assimp::IOStream* const stream =
        DefaultIOSystem::Open(referred_file(folder_, name.substr(folder_.size())).c_str(), mode);
    is_missing_ = stream == nullptr;
    return stream;
  }

 private:
  std::string folder_;
  bool is_missing_ = false;
};

bool supports(const aiImporterDesc& loader, const std::string& extension) {
  std::istringstream words(loader.mFileExtensions);
  for (std::string word; words >> word;) {
    if (word == extension) return true;
  }
  return false;
}

// Removes other loaders. Otherwise assimp guesses from the content, and a file named .ply may reach any of its 50
// loaders.
void keep_loaders(Assimp::Importer& importer, const std::string& extension) {
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    if (supports(*importer.GetImporterInfo(i), extension)) continue;
    Assimp::BaseImporter* const loader = importer.GetImporter(i);
    importer.UnregisterLoader(loader);
    delete loader;  // no longer owned by the importer
  }
}

// assimp's loaders look at the extension of the name. Where the name has another one they read from memory, with a
// hint.
const aiScene* read_scene(Assimp::Importer& importer, const std::string& path, const std::string& extension) {
  if (mesh_format(path) == extension) return importer.ReadFile(path, 0);
  const std::string bytes = read_bytes(path);
  return importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, extension.c_str());
}

}  // namespace

RawMesh read_with_assimp(const std::string& path, const std::string& extension) {
  Assimp::Importer importer;
  keep_loaders(importer, extension);
  RawMesh raw;
  if (extension == "gltf" || extension == "glb") {
    importer.SetIOHandler(new Files(path));  // the importer deletes it
    raw.note = check_gltf(read_bytes(path));
  }
  // The asset's frame is the mesh's own, so the importer must not turn it.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* const scene = read_scene(importer, path, extension);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    const std::string error = importer.GetErrorString();
    // assimp turns exceptions of its loaders into text.
    if (error.find("bad_alloc") != std::string::npos) throw std::bad_alloc();
    const bool unknown = error.starts_with("No suitable reader found");
    throw ReadError(unknown ? "the content is not that of a sound ." + extension + " file" : error);
  }
  add_nodes(*scene, raw);
  return raw;
}

}  // namespace vps
