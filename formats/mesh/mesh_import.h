// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads a mesh file into triangles with CGAL or assimp. They run in a child process, because they may crash on
/// damaged files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "formats/triangle_mesh.h"

namespace vps {

struct ImportOptions {
  double unit = 1.0;                               ///< metres per unit of the file's numbers. [Limits: value > 0]
  std::size_t memory_limit_bytes = 4'000'000'000;  ///< address space the importer may use
  double timeout = 120.0;                          ///< the child is killed after this long. [s]
  std::string format = {};                         ///< such as "stl"; empty: the extension of the file's name
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

/// Refuses what is no regular file before it is opened: reading a pipe may wait for ever.
/// @param kind  of the file that is expected, such as "a mesh file"
/// @throw ImportError
void check_is_file(const std::filesystem::path& path, const char* kind);

/// Whether a file's name has an extension that import_mesh reads.
[[nodiscard]] bool has_mesh_extension(const std::filesystem::path& path);

/// Extensions of the formats that import_mesh reads, in lower case without the dot.
inline constexpr std::string_view kMeshFormats[] = {"obj", "ply", "stl", "off", "gltf", "glb", "dae", "3ds", "fbx"};

/// The format of a mesh: `options.format`, or the extension of its name in lower case without the dot.
[[nodiscard]] std::string mesh_format(const std::filesystem::path& path, const ImportOptions& options = {});

/// The format that the content of a file shows, whatever its name; empty when no format is recognised.
[[nodiscard]] std::string detect_mesh_format(const std::filesystem::path& path);

/// The file that a buffer's name in a glTF file refers to. Tries the name as it is written, then with its
/// percent-encoded bytes decoded (RFC 3986, Sec. 2.1), then with slashes for backslashes too.
/// @param folder  of the mesh, with a slash at its end, or empty
[[nodiscard]] std::string referred_file(const std::string& folder, const std::string& name);

/// Reads a mesh. obj, off, ply and stl keep double precision, except for rare variants, which a note names; the other
/// formats come in single precision. Applies node transforms and instances, skips points and lines, triangulates
/// polygons (concave ones by ear clipping), joins identical positions, drops unused vertices, and checks every index
/// and coordinate.
/// @throw ImportError on anything that is not a usable mesh with at least one triangle.
[[nodiscard]] ImportedMesh import_mesh(const std::filesystem::path& path, const ImportOptions& options = {});

}  // namespace vps
