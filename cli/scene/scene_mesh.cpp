// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/scene_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <system_error>

#include "bake/quantity_text.h"
#include "formats/mesh/mesh_import.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;

void scale(TriangleMesh& mesh, const Triple& by) {
  for (auto& p : mesh.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] *= by[axis];
  }
  if (by[0] * by[1] * by[2] > 0) return;
  // Mirrored triangles would face inwards.
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
}

SceneMesh read_mesh(const SceneShape& shape) {
  const auto refuse = [&](const std::string& reason, SceneError::Kind kind) {
    throw SceneError(shape.place, fmt::format("mesh '{}': {}", shape.mesh.string(), reason), kind);
  };
  SceneMesh one;
  one.file = shape.mesh;
  try {
    ImportedMesh imported = import_mesh(shape.mesh);
    one.notes = imported.notes;
    one.mesh = std::move(imported);
    scale(one.mesh, shape.units);
  } catch (const ImportError& error) {
    refuse(error.what(), error.kind == ImportError::Kind::io ? SceneError::Kind::io : SceneError::Kind::bad_input);
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  one.bounds_min = {kInfinity, kInfinity, kInfinity};
  one.bounds_max = {-kInfinity, -kInfinity, -kInfinity};
  for (const auto& p : one.mesh.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      one.bounds_min[axis] = std::min(one.bounds_min[axis], p[axis]);
      one.bounds_max[axis] = std::max(one.bounds_max[axis], p[axis]);
    }
  }
  constexpr double kSmallest = 1e-6;  // inertias of smaller bodies are zero in float. [m]
  if (!(one.longest() >= kSmallest)) {
    refuse("it is smaller than a thousandth of a millimetre; check its unit and scale", SceneError::Kind::bad_input);
  }
  return one;
}

bool are_equal(const TriangleMesh& a, const TriangleMesh& b) {
  return a.vertices == b.vertices && a.triangles == b.triangles;
}

}  // namespace

double SceneMesh::longest() const {
  double longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) longest = std::max(longest, bounds_max[axis] - bounds_min[axis]);
  return longest;
}

std::string SceneMesh::size() const {
  const auto side = [&](std::size_t axis) { return bake::format_length(bounds_max[axis] - bounds_min[axis]); };
  return fmt::format("{} x {} x {}", side(0), side(1), side(2));
}

bool SceneMesh::is_of(const SceneShape& shape) const {
  return std::find(spellings.begin(), spellings.end(), std::pair(shape.mesh, shape.units)) != spellings.end();
}

std::vector<SceneMesh> read_meshes(const Scene& scene) {
  std::vector<SceneMesh> meshes;
  std::map<std::pair<fs::path, Triple>, std::size_t> known;  // by canonical path and units
  for (const SceneBody& body : scene.bodies) {
    for (const SceneShape& shape : body.shapes) {
      if (shape.solid != Solid::mesh) continue;
      std::error_code failed;  // the import reports errors of the file
      const fs::path canonical = fs::weakly_canonical(shape.mesh, failed);
      const auto [file, is_new] = known.emplace(std::pair(failed ? shape.mesh : canonical, shape.units), meshes.size());
      if (is_new) {
        SceneMesh one = read_mesh(shape);
        file->second = static_cast<std::size_t>(
            std::find_if(meshes.begin(), meshes.end(),
                         [&](const SceneMesh& other) { return are_equal(one.mesh, other.mesh); }) -
            meshes.begin());
        if (file->second == meshes.size()) meshes.push_back(std::move(one));
      }
      SceneMesh& mesh = meshes[file->second];
      if (!mesh.is_of(shape)) mesh.spellings.emplace_back(shape.mesh, shape.units);
    }
  }
  return meshes;
}

void doubt_units(Scene& scene, const std::vector<SceneMesh>& meshes) {
  // Densities of the mesh's bounding box: a tenth of air, and somewhat more than the densest metal. [kg/m^3]
  constexpr double kLightest = 0.1;
  constexpr double kHeaviest = 25'000;
  for (const SceneBody& body : scene.bodies) {
    if (body.motion != Motion::dynamic || body.shapes.size() != 1 || body.shapes.front().solid != Solid::mesh) continue;
    const auto mesh = std::find_if(meshes.begin(), meshes.end(),
                                   [&](const SceneMesh& one) { return one.is_of(body.shapes.front()); });
    double volume = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) volume *= mesh->bounds_max[axis] - mesh->bounds_min[axis];
    const double density = body.mass / volume;
    if (!(volume > 0) || (density >= kLightest && density <= kHeaviest)) continue;
    scene.notes.push_back(
        fmt::format("{}:{}: {:.4g} kg of '{}' in {} are {:.2g} kg/m^3; check its unit, scale and mass", body.place.file,
                    body.place.line, body.mass, body.name, mesh->size(), density));
  }
}

}  // namespace vps::cli
