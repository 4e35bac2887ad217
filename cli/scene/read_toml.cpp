// SPDX-License-Identifier: GPL-3.0-or-later
// Reads scenes in TOML; docs/scene.md has the keys. Unknown keys and values are errors that name their line.
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "cli/scene/scene.h"
#include "cli/scene/toml_table.h"
#include "cli/terminal/units.h"
#include "cli/tools/toml_keys.h"
#include "formats/scene_manifest.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;

void read_wishes(Table table, Scene& scene) {
  table.allow_only({"error", "time_budget", "memory", "step"});
  const auto wish = [&](const char* key, Table::Parser parse, Wish& out) {
    if (table.quantity(key, parse, out.value)) out.place = table.place_of(*table.take(key));
  };
  wish("error", parse_length, scene.error);
  wish("time_budget", parse_time, scene.time);
  wish(
      "memory", [](const std::string& text) { return static_cast<double>(parse_size(text)); }, scene.memory);
  if (table.quantity("step", parse_time, scene.step) && !(scene.step >= 1e-6 && scene.step <= 1))
    table.refuse(*table.take("step"), "step is a time from 1us to 1s");
}

void read_world(Table table, Scene& scene) {
  table.allow_only({"gravity"});
  Triple gravity{};
  if (!table.quantities("gravity", parse_acceleration, gravity)) return;
  const auto is_strong = [](double g) { return std::abs(g) > scene_manifest::kMostGravity; };
  if (std::any_of(gravity.begin(), gravity.end(), is_strong))
    table.refuse(*table.take("gravity"), fmt::format("gravity is beyond {:g} m/s^2", scene_manifest::kMostGravity));
  scene.gravity = gravity;
}

// The file that a key names, relative to the scene's folder.
fs::path file_at(Table& table, const char* key, const std::string& scene) {
  const std::string name = table.text(key, "");
  if (!is_file_name(name)) table.refuse(*table.take(key), fmt::format("{} is not the name of a file", key));
  return beside(scene, name);
}

// Reads a mesh or one of Bullet's shapes; nothing when the body comes from a URDF.
std::optional<SceneShape> read_shape(Table& table, const std::string& file) {
  SceneShape shape;
  shape.place = table.place();
  const int sources = int{table.has("mesh")} + int{table.has("shape")} + int{table.has("urdf")};
  if (sources != 1) {
    throw SceneError(table.place(), "a body has one of mesh = \"FILE\", shape = \"box\" or another, urdf = \"FILE\"");
  }
  if (const toml::node* const mesh = table.take("mesh")) {
    shape.place = table.place_of(*mesh);
    shape.mesh = file_at(table, "mesh", file);
    const std::string unit = table.text("unit", "m");
    double metres = 1;
    try {
      metres = parse_unit(unit);
    } catch (const UsageError& error) {
      table.refuse(*table.take("unit"), std::string("unit: ") + error.what());
    }
    double scale = 1;
    table.number("scale", 1e-9, 1e9, scale);
    shape.units.fill(metres * scale);
    return shape;
  }
  if (table.has("urdf")) return std::nullopt;
  shape.solid = table.choice<Solid>("shape",
                                    {{"box", Solid::box},
                                     {"sphere", Solid::sphere},
                                     {"capsule", Solid::capsule},
                                     {"cylinder", Solid::cylinder},
                                     {"plane", Solid::plane}},
                                    Solid::box);
  const auto need = [&](bool there, const char* key) {
    if (!there) throw SceneError(table.place(), fmt::format("this shape needs {}", key));
  };
  if (shape.solid == Solid::box) {
    need(table.quantities("size", parse_length, shape.half_extents), "size = [\"1m\", \"1m\", \"5cm\"]");
    for (double& x : shape.half_extents) x /= 2;
  } else if (shape.solid != Solid::plane) {
    need(table.quantity("radius", parse_length, shape.radius), "radius = \"5mm\"");
    if (shape.solid != Solid::sphere) {
      need(table.quantity("length", parse_length, shape.half_height), "length = \"5mm\"");
      shape.half_height /= 2;
    }
  }
  return shape;
}

// Reads how the meshes of a body are baked and used.
void read_baking(Table& table, SceneBody& body) {
  SceneShape as_said;
  table.quantity("voxel", parse_length, as_said.voxel_size);
  table.quantity("thicken", parse_length, as_said.sheet_thickness);
  as_said.repair = table.choice<bake::Repair>("repair",
                                              {{"none", bake::Repair::none},
                                               {"weld", bake::Repair::weld},
                                               {"stitch", bake::Repair::stitch},
                                               {"fill", bake::Repair::fill},
                                               {"wrap", bake::Repair::wrap}},
                                              bake::Repair::automatic);
  for (SceneShape& shape : body.shapes) {
    shape.voxel_size = as_said.voxel_size;
    shape.sheet_thickness = as_said.sheet_thickness;
    shape.repair = as_said.repair;
  }
  std::uint32_t segments = 0;
  if (table.integer("segments", 0, 4096, segments)) body.segments = segments;
  if (const toml::node* const keep = table.take("keep")) {
    if (keep->as_array() == nullptr) table.refuse(*keep, "keep is a list, such as [\"voxelmap\"]");
    for (const toml::node& part : *keep->as_array()) {
      body.keep =
          body.keep | table.chosen<Use>("keep", part, {{"voxelmap", Use::scaled}, {"pointshell", Use::pointshell}});
    }
  }
}

// Reads how a body moves and what it meets. These keys override those of a URDF.
void read_motion(Table& table, SceneBody& body, bool from_urdf) {
  const bool has_type = table.has("type");
  body.motion = table.choice<Motion>(
      "type", {{"static", Motion::fixed}, {"kinematic", Motion::kinematic}, {"dynamic", Motion::dynamic}}, body.motion);
  const bool has_mass = table.quantity("mass", parse_mass, body.mass);
  if (has_mass && !has_type) body.motion = Motion::dynamic;
  if (has_mass) body.inertia.reset();  // it belonged to another mass
  if (!has_type && !has_mass && !from_urdf) {
    throw SceneError(table.place(), fmt::format("body '{}' needs type = \"static\", or mass = \"0.1kg\"", body.name));
  }
  if (body.motion == Motion::dynamic && !(body.mass > 0))
    throw SceneError(table.place(), fmt::format("body '{}' is dynamic and needs mass = \"0.1kg\"", body.name));
  if (body.motion != Motion::dynamic && has_mass)
    table.refuse(*table.take("mass"), "mass is for dynamic bodies; leave it out or set type = \"dynamic\"");
  if (body.motion == Motion::dynamic) {
    table.quantities("velocity", parse_velocity, body.velocity);
    body.group = 1;
    body.mask = -1;
  } else {
    // As Bullet's groups: static and kinematic bodies do not meet each other.
    body.group = 2;
    body.mask = ~2;
    body.mass = 0;
  }
  constexpr std::int64_t kLow = std::numeric_limits<std::int32_t>::min();
  constexpr std::int64_t kHigh = std::numeric_limits<std::int32_t>::max();
  table.integer("group", kLow, kHigh, body.group);
  table.integer("mask", kLow, kHigh, body.mask);
  double speed = 0;
  if (body.motion != Motion::fixed && table.quantity("speed", parse_velocity, speed)) {
    if (speed < 0) table.refuse(*table.take("speed"), "speed is the largest expected, and not negative");
    body.speed = speed;
  }
  table.number("friction", 0, 1000, body.friction);
  table.number("restitution", 0, 1, body.restitution);
}

void read_body(Table table, const std::string& file, Scene& scene) {
  // Checked first, so that a mistyped key is not reported as a missing one.
  table.allow_only({"name",     "mesh",  "shape", "urdf",  "type",     "mass",        "size",     "radius",
                    "length",   "unit",  "scale", "voxel", "repair",   "thicken",     "position", "rotation",
                    "velocity", "speed", "group", "mask",  "friction", "restitution", "segments", "keep"});
  SceneBody body;
  body.place = table.place();
  body.name = table.text("name", "");
  if (body.name.empty()) throw SceneError(body.place, "a body needs a name, such as name = \"nut\"");
  Placement pose;
  Triple angles{};
  table.quantities("position", parse_coordinate, pose.position);
  if (table.quantities("rotation", parse_angle, angles)) pose.orientation = from_roll_pitch_yaw(angles);
  const std::optional<SceneShape> shape = read_shape(table, file);
  std::vector<SceneBody> bodies;
  const std::size_t first = scene.bodies.size();
  if (shape) {
    body.shapes.push_back(*shape);
    bodies.push_back(std::move(body));
  } else {
    const Place place = table.place_of(*table.take("urdf"));
    const fs::path urdf = file_at(table, "urdf", file);
    std::error_code ignored;
    if (!fs::is_regular_file(urdf, ignored))
      throw SceneError(place, fmt::format("'{}' does not exist; it is sought beside the scene", urdf.string()),
                       SceneError::Kind::io);
    Scene robot = read_urdf(urdf);
    const bool is_one = robot.bodies.size() == 1 && robot.links.empty();
    const auto full = [&](const std::string& name) { return is_one ? body.name : body.name + "/" + name; };
    for (SceneBody& link : robot.bodies) {
      link.name = full(link.name);
      bodies.push_back(std::move(link));
    }
    for (SceneBody& link : robot.links) {
      link.name = full(link.name);
      scene.links.push_back(std::move(link));
    }
    for (SceneJoint& joint : robot.joints) {
      joint.name = body.name + "/" + joint.name;
      joint.child = full(joint.child);
      if (joint.parent.empty()) {
        joint.pose = composed(pose, joint.pose);
      } else {
        joint.parent = full(joint.parent);
      }
      scene.joints.push_back(std::move(joint));
    }
    for (const auto& [a, b] : robot.joined) scene.joined.emplace_back(first + a, first + b);
    scene.notes.insert(scene.notes.end(), robot.notes.begin(), robot.notes.end());
    if (!table.has("type") && !table.has("mass"))
      scene.assumptions.insert(scene.assumptions.end(), robot.assumptions.begin(), robot.assumptions.end());
    if (table.has("mass") && bodies.size() > 1)
      table.refuse(*table.take("mass"), "mass is for a URDF of one link; this one states its own");
  }
  for (SceneBody& one : bodies) {
    one.pose = composed(pose, one.pose);
    read_motion(table, one, !shape);
    // A joint cannot move what has no mass.
    if (one.motion != Motion::dynamic)
      std::erase_if(scene.joints, [&](const SceneJoint& joint) { return joint.child == one.name; });
    if (!table.has("shape")) read_baking(table, one);
    scene.bodies.push_back(std::move(one));
  }
  table.finish();
}

}  // namespace

Scene read_toml(const fs::path& path) {
  const std::string file = path.string();
  const std::string text = read_text(path);
  if (const int line = line_of_deep_key(text); line > 0) {
    throw SceneError({file, line},
                     fmt::format("a key has more than {} parts; those of a scene have one or two", kMostKeyParts));
  }
  toml::table root;
  try {
    root = toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw SceneError({file, static_cast<int>(error.source().begin.line)},
                     fmt::format("this is not TOML: {}", error.description()));
  }
  Scene scene;
  Table top(root, file, "a scene");
  top.allow_only({"body", "wishes", "world"});
  const auto table_at = [&](const char* key, const char* name) -> std::optional<Table> {
    const toml::node* const node = top.take(key);
    if (node == nullptr) return std::nullopt;
    if (node->as_table() == nullptr) top.refuse(*node, fmt::format("write [{}]", key));
    return Table(*node->as_table(), file, name);
  };
  const auto wishes = table_at("wishes", "[wishes]");
  const auto world = table_at("world", "[world]");
  const toml::node* const bodies = top.take("body");
  if (wishes) read_wishes(*wishes, scene);
  if (world) read_world(*world, scene);
  const toml::array* const list = bodies != nullptr ? bodies->as_array() : nullptr;
  if (bodies != nullptr && list == nullptr) top.refuse(*bodies, "write [[body]], with two brackets, for each body");
  if (list == nullptr || list->empty()) throw SceneError({file, 1}, "the scene has no body; write [[body]] for each");
  for (const toml::node& node : *list) {
    if (node.as_table() == nullptr) top.refuse(node, "write [[body]] for each body");
    read_body(Table(*node.as_table(), file, "[[body]]"), file, scene);
  }
  return scene;
}

}  // namespace vps::cli
