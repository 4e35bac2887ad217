// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <system_error>

#include "formats/scene_manifest.h"

namespace vps::cli {

std::array<double, 4> from_roll_pitch_yaw(const Triple& angles) {
  const double cx = std::cos(angles[0] / 2);
  const double sx = std::sin(angles[0] / 2);
  const double cy = std::cos(angles[1] / 2);
  const double sy = std::sin(angles[1] / 2);
  const double cz = std::cos(angles[2] / 2);
  const double sz = std::sin(angles[2] / 2);
  return {sx * cy * cz - cx * sy * sz, cx * sy * cz + sx * cy * sz, cx * cy * sz - sx * sy * cz,
          cx * cy * cz + sx * sy * sz};
}

Triple rotated(const std::array<double, 4>& by, const Triple& v) {
  const auto [x, y, z, w] = by;
  const Triple t = {2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])};
  return {v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2],
          v[2] + w * t[2] + x * t[1] - y * t[0]};
}

Placement composed(const Placement& outer, const Placement& inner) {
  Placement result;
  const Triple moved = rotated(outer.orientation, inner.position);
  for (std::size_t axis = 0; axis < 3; ++axis) result.position[axis] = outer.position[axis] + moved[axis];
  const auto [ax, ay, az, aw] = outer.orientation;
  const auto [bx, by, bz, bw] = inner.orientation;
  result.orientation = {aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
                        aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz};
  return result;
}

bool is_file_name(const std::string& name) {
  return !name.empty() && std::none_of(name.begin(), name.end(), [](unsigned char c) { return std::iscntrl(c) != 0; });
}

std::string read_text(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    throw SceneError({file.string(), 0}, "the scene does not exist or is not a file; check the name",
                     SceneError::Kind::io);
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream)
    throw SceneError({file.string(), 0}, "the scene cannot be read; check its permissions", SceneError::Kind::io);
  return text;
}

namespace {

using scene_manifest::kFarthest;
using scene_manifest::kLeast;

bool in_reach(const Triple& v) {
  return std::all_of(v.begin(), v.end(), [](double x) { return std::abs(x) <= kFarthest; });
}

bool is_size(double x) {
  return x >= kLeast && x <= kFarthest;
}

void check_shape(const SceneShape& shape) {
  const auto require = [&](bool sound, const char* reason) {
    if (!sound) throw SceneError(shape.place, reason);
  };
  require(in_reach(shape.pose.position), "the shape lies farther than 1e9 m from its body's origin");
  constexpr const char* kSize = "a size of this shape is below 2 nm or above 2e9 m; check the number and its unit";
  switch (shape.solid) {
    case Solid::mesh:
      require(is_file_name(shape.mesh.string()), "the mesh is not the name of a file");
      require(is_size(shape.unit),
              "the mesh's unit and scale make less than 1e-9 or more than 1e9 m of its numbers' 1");
      break;
    case Solid::box:
      require(std::all_of(shape.half_extents.begin(), shape.half_extents.end(), is_size), kSize);
      break;
    case Solid::capsule:
    case Solid::cylinder:
      require(is_size(shape.half_height), kSize);
      [[fallthrough]];
    case Solid::sphere:
      require(is_size(shape.radius), kSize);
      break;
    case Solid::plane:
      break;
  }
}

void check_body(const SceneBody& body) {
  const auto require = [&](bool sound, const std::string& reason) {
    if (!sound) throw SceneError(body.place, reason);
  };
  require(is_file_name(body.name), fmt::format("the name '{}' is empty or has control characters in it", body.name));
  require(body.name.size() <= scene_manifest::kLongestText,
          fmt::format("a body's name is longer than {} bytes", scene_manifest::kLongestText));
  const bool is_dynamic = body.motion == Motion::dynamic;
  require(in_reach(body.pose.position) && in_reach(body.velocity) && (!is_dynamic || is_size(body.mass)),
          fmt::format("a number of '{}' is beyond 1e9, or its mass below 1e-9 kg", body.name));
  require(body.shapes.size() <= scene_manifest::kMostShapes,
          fmt::format("'{}' has more than {} shapes", body.name, scene_manifest::kMostShapes));
  require(!is_dynamic || body.shapes.size() == 1 || body.centre_of_mass,
          fmt::format("'{}' has several shapes and no centre of mass; state the link's <inertial>", body.name));
  require(!is_dynamic || body.shapes.front().solid != Solid::plane, "a plane cannot move; set type = \"static\"");
  for (const SceneShape& shape : body.shapes) check_shape(shape);
}

// Checks limits of the runtime, which would refuse the manifest.
void check_ranges(const Scene& scene) {
  if (scene.bodies.size() > scene_manifest::kMostBodies) {
    throw SceneError(scene.bodies[scene_manifest::kMostBodies].place,
                     fmt::format("a scene has at most {} bodies", scene_manifest::kMostBodies));
  }
  for (const SceneBody& body : scene.bodies) check_body(body);
}

Scene read_any(const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  if (extension == ".toml") return read_toml(file);
  if (extension == ".urdf" || extension == ".xml") return read_urdf(file);
  throw SceneError({file.string(), 0}, "a scene is a .toml or a .urdf file; see docs/scene.md");
}

}  // namespace

Scene read_scene(const std::filesystem::path& file) {
  Scene scene = read_any(file);
  check_ranges(scene);
  scene.notes.insert(scene.notes.end(), scene.assumptions.begin(), scene.assumptions.end());
  return scene;
}

}  // namespace vps::cli
