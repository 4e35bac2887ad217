// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/scene.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <system_error>

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

std::string read_text(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    throw SceneError({file.string(), 0}, "the scene does not exist or is not a file; check the name");
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) throw SceneError({file.string(), 0}, "the scene cannot be read; check its permissions");
  return text;
}

namespace {

// What the runtime would refuse.
void check_ranges(const Scene& scene) {
  constexpr double kFarthest = 1e9;
  constexpr double kLeast = 1e-9;
  const auto in_reach = [](const Triple& v) {
    return std::all_of(v.begin(), v.end(), [](double x) { return std::abs(x) <= kFarthest; });
  };
  const auto is_size = [](double x) { return x >= kLeast && x <= kFarthest; };
  for (const SceneBody& body : scene.bodies) {
    const bool good = in_reach(body.pose.position) && in_reach(body.velocity) &&
                      (body.motion != Motion::dynamic || is_size(body.mass));
    if (!good) throw SceneError(body.place, "a number of '" + body.name + "' is beyond 1e9, or its mass below 1e-9 kg");
    if (std::any_of(body.name.begin(), body.name.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }))
      throw SceneError(body.place, "the name '" + body.name + "' has control characters in it");
    if (body.motion == Motion::dynamic && body.shapes.size() > 1 && !body.centre_of_mass) {
      throw SceneError(body.place,
                       "'" + body.name + "' has several shapes and no centre of mass; state the link's <inertial>");
    }
    for (const SceneShape& shape : body.shapes) {
      bool sound = in_reach(shape.pose.position);
      if (shape.solid == Solid::mesh) sound = sound && is_size(shape.unit);
      if (shape.solid == Solid::box)
        sound = sound && std::all_of(shape.half_extents.begin(), shape.half_extents.end(), is_size);
      const bool round = shape.solid != Solid::mesh && shape.solid != Solid::box && shape.solid != Solid::plane;
      if (round) sound = sound && is_size(shape.radius) && (shape.solid == Solid::sphere || is_size(shape.half_height));
      if (!sound) throw SceneError(shape.place, "a size or scale is not above zero, or beyond 1e9 m");
    }
    if (body.motion == Motion::dynamic && body.shapes.front().solid == Solid::plane)
      throw SceneError(body.place, "a plane cannot move; set type = \"static\"");
  }
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
  return scene;
}

}  // namespace vps::cli
