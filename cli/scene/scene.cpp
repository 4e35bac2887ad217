// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/scene.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <string_view>
#include <system_error>

#include "cli/tools/differing_numbers.h"
#include "cli/tools/most_mass.h"
#include "formats/scene_manifest.h"

namespace vps::cli {

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond to_eigen(const std::array<double, 4>& orientation) {
  return Quaterniond(orientation.data());  // x, y, z, w
}
std::array<double, 4> to_array(const Quaterniond& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}
Triple to_triple(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

std::array<double, 4> from_roll_pitch_yaw(const Triple& angles) {
  const auto turn = [&](int axis) {
    return Quaterniond(Eigen::AngleAxisd(angles[static_cast<std::size_t>(axis)], Vector3d::Unit(axis)));
  };
  return to_array(turn(2) * turn(1) * turn(0));
}

Triple rotated(const std::array<double, 4>& by, const Triple& v) {
  return to_triple(to_eigen(by) * Vector3d(v.data()));
}

Placement composed(const Placement& outer, const Placement& inner) {
  const Quaterniond turn = to_eigen(outer.orientation);
  return {to_triple(Vector3d(outer.position.data()) + turn * Vector3d(inner.position.data())),
          to_array(turn * to_eigen(inner.orientation))};
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

std::filesystem::path beside(const std::filesystem::path& file, const std::string& name) {
  const std::filesystem::path path = file.parent_path() / name;
  return std::find(path.begin(), path.end(), "..") == path.end() ? path.lexically_normal() : path;
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
      require(std::all_of(shape.units.begin(), shape.units.end(), [](double x) { return is_size(std::abs(x)); }),
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

void check_name(const std::string& name, const char* whose, const Place& place) {
  if (!is_file_name(name))
    throw SceneError(place, fmt::format("the name '{}' is empty or has control characters in it", name));
  if (name.size() > scene_manifest::kLongestText)
    throw SceneError(place, fmt::format("a {}'s name is longer than {} bytes", whose, scene_manifest::kLongestText));
}

// What bodies and links without shapes have in common.
void check_mass(const SceneBody& body) {
  const auto require = [&](bool sound, const char* what) {
    if (!sound) throw SceneError(body.place, fmt::format("the {} of '{}' is out of range; check it", what, body.name));
  };
  if (body.motion != Motion::dynamic) return;
  require(is_size(body.mass), "mass");
  require(!body.centre_of_mass || in_reach(*body.centre_of_mass), "centre of mass");
  if (!body.inertia) return;
  const auto& [xx, yy, zz, xy, xz, yz] = *body.inertia;
  const Eigen::Matrix3d tensor{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
  require(tensor.allFinite() && tensor.maxCoeff() <= kFarthest, "inertia");
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(tensor, Eigen::EigenvaluesOnly);
  require(solver.eigenvalues().minCoeff() >= scene_manifest::kLeastInertia, "inertia");
}

// Heavier bodies would be written, but would fall through others.
void refuse_too_heavy(const SceneBody& body) {
  if (body.motion == Motion::dynamic && body.mass > kMostMass) {
    const auto [mass, most] = differing_numbers(body.mass, kMostMass, 3);
    throw SceneError(body.place, fmt::format("'{}' has {} kg: Bullet's solver takes bodies of more than {} kg for "
                                             "static, and they fall through others; make it lighter",
                                             body.name, mass, most));
  }
}

void check_body(const SceneBody& body) {
  const auto require = [&](bool sound, const std::string& reason) {
    if (!sound) throw SceneError(body.place, reason);
  };
  check_name(body.name, "body", body.place);
  refuse_too_heavy(body);
  const bool is_dynamic = body.motion == Motion::dynamic;
  require(in_reach(body.pose.position) && in_reach(body.velocity) && (!is_dynamic || is_size(body.mass)),
          fmt::format("a number of '{}' is beyond 1e9, or its mass below 1e-9 kg", body.name));
  require(body.shapes.size() <= scene_manifest::kMostShapes,
          fmt::format("'{}' has more than {} shapes", body.name, scene_manifest::kMostShapes));
  require(!is_dynamic || body.shapes.size() == 1 || body.centre_of_mass,
          fmt::format("'{}' has several shapes and no centre of mass; state the link's <inertial>", body.name));
  require(!is_dynamic || body.shapes.front().solid != Solid::plane, "a plane cannot move; set type = \"static\"");
  check_mass(body);
  for (const SceneShape& shape : body.shapes) check_shape(shape);
}

// @param kind  "bodies" or "joints"
void check_new(std::map<std::string_view, int>& lines, const std::string& name, const Place& place, const char* kind) {
  const auto [known, is_new] = lines.emplace(name, place.line);
  if (!is_new)
    throw SceneError(place,
                     fmt::format("two {} are named '{}', the other on line {}; rename one", kind, name, known->second));
}

// Checks limits of the runtime, which would refuse the manifest.
void check_ranges(const Scene& scene) {
  if (scene.bodies.size() > scene_manifest::kMostBodies) {
    throw SceneError(scene.bodies[scene_manifest::kMostBodies].place,
                     fmt::format("a scene has at most {} bodies", scene_manifest::kMostBodies));
  }
  for (const SceneBody& body : scene.bodies) check_body(body);
  for (const SceneBody& link : scene.links) {
    check_name(link.name, "link", link.place);
    refuse_too_heavy(link);
    check_mass(link);
  }
  for (const SceneJoint& joint : scene.joints) {
    check_name(joint.name, "joint", joint.place);
    if (!in_reach(joint.pose.position))
      throw SceneError(joint.place, fmt::format("joint '{}' lies farther than 1e9 m from its parent", joint.name));
  }
  std::map<std::string_view, int> bodies, joints;  // lines by name
  for (const auto* const list : {&scene.bodies, &scene.links}) {
    for (const SceneBody& body : *list) check_new(bodies, body.name, body.place, "bodies");
  }
  for (const SceneJoint& joint : scene.joints) check_new(joints, joint.name, joint.place, "joints");
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
