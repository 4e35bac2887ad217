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

/// A mesh of the scene, in metres. Shapes that name the same file, in whatever way, or a file with the same content
/// share it.
struct SceneMesh {
  std::filesystem::path file;  ///< as the first shape names it
  TriangleMesh mesh;
  Triple bounds_min{}, bounds_max{};  ///< [m]
  std::vector<std::string> notes;
  std::vector<std::pair<std::filesystem::path, double>> spellings;  ///< files and units of the shapes that mean it
  [[nodiscard]] double longest() const;
  /// "5.5 mm x 6.351 mm x 1.8 mm"
  [[nodiscard]] std::string size() const;
  /// Whether a shape with a mesh means this one.
  [[nodiscard]] bool is_of(const SceneShape& shape) const;
};

/// Reads every mesh. @throw SceneError naming the line that names the mesh
[[nodiscard]] std::vector<SceneMesh> read_meshes(const Scene& scene);

/// Adds a note to the scene for each body whose mass is absurd for its size: as a rule its mesh has another unit.
void doubt_units(Scene& scene, const std::vector<SceneMesh>& meshes);

}  // namespace vps::cli
