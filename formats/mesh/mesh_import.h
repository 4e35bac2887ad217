// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads a mesh file into triangles, with CGAL or assimp, in a child process: they crash on damaged files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "formats/triangle_mesh.h"

namespace vps {

struct ImportOptions {
  double unit = 1.0;                               ///< metres per unit of the file's numbers. [Limits: value > 0]
  std::size_t memory_limit_bytes = 4'000'000'000;  ///< address space the importer may use
  double timeout = 120.0;                          ///< the child is killed after this long. [s]
};

/// A file that cannot be used. `what()` is "reason; what to do", without the file's name.
struct ImportError : std::runtime_error {
  enum class Kind { io, bad_input };  ///< io: missing or unreadable. bad_input: everything else
  Kind kind;
  ImportError(Kind kind_in, const std::string& message) : std::runtime_error(message), kind(kind_in) {}
};

struct ImportedMesh : TriangleMesh {
  std::vector<std::string> notes;  ///< what the caller should know, such as a loss of precision; one line each
};

/// Whether a file's name ends as those of meshes do that import_mesh reads.
[[nodiscard]] bool has_mesh_extension(const std::filesystem::path& path);

/// The file that a buffer's name in a glTF file means: as it is written or, where no such file is, with its
/// percent-encoded bytes decoded (RFC 3986, Sec. 2.1), or with slashes for backslashes too.
/// @param folder  of the mesh, with a slash behind, or empty
[[nodiscard]] std::string referred_file(const std::string& folder, const std::string& name);

/// Reads a mesh. obj, off, ply and stl keep double precision, except for rare variants, which a note names; the other
/// formats come in single precision. Node transforms and instances applied, points and lines skipped, polygons
/// triangulated (concave ones by ear clipping), identical positions joined, unused vertices dropped, every index and
/// coordinate checked.
/// @throw ImportError on anything that is not a usable mesh with at least one triangle.
[[nodiscard]] ImportedMesh import_mesh(const std::filesystem::path& path, const ImportOptions& options = {});

}  // namespace vps
