// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The meshes of a scene, each read once.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "cli/scene/scene.h"
#include "formats/triangle_mesh.h"

namespace vps::cli {

/// A mesh of the scene, in metres. Shapes share it when they name the same file, by any path, or a file with the same
/// content.
struct SceneMesh {
  std::filesystem::path file;  ///< as the first shape names it
  TriangleMesh mesh;
  Triple bounds_min{}, bounds_max{};  ///< [m]
  std::vector<std::string> notes;
  std::vector<std::pair<std::filesystem::path, Triple>> spellings;  ///< files and units of the shapes that use it
  [[nodiscard]] double longest() const;
  /// "5.5 mm x 6.351 mm x 1.8 mm"
  [[nodiscard]] std::string size() const;
  /// Whether a shape uses this mesh.
  [[nodiscard]] bool is_of(const SceneShape& shape) const;
};

/// Reads every mesh. @throw SceneError with the line that names the mesh
[[nodiscard]] std::vector<SceneMesh> read_meshes(const Scene& scene);

/// Adds a note to the scene for each body whose mass is implausible for its size. Usually its mesh has another unit.
void doubt_units(Scene& scene, const std::vector<SceneMesh>& meshes);

}  // namespace vps::cli
