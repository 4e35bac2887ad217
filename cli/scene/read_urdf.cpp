// SPDX-License-Identifier: GPL-3.0-or-later
// Reads scenes in URDF: the collision geometry of a robot's links at its zero configuration. docs/scene.md has the
// subset.
#include <console_bridge/console.h>
#include <fmt/format.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>
#include <sstream>
#include <string_view>
#include <system_error>

#include "cli/scene/scene.h"
#include "cli/scene/urdf_elements.h"
#include "formats/scene_manifest.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;

// Collects urdfdom's error messages, which it would print. The first one becomes the reason of the refusal.
class Listener final : public console_bridge::OutputHandler {
 public:
  Listener() { console_bridge::useOutputHandler(this); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) messages_.push_back(text);
  }
  [[nodiscard]] const std::vector<std::string>& messages() const { return messages_; }

 private:
  std::vector<std::string> messages_;
};

Placement to_placement(const urdf::Pose& pose) {
  Placement result{{pose.position.x, pose.position.y, pose.position.z},
                   {pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w}};
  return result;
}

// The name of the package that a folder is, the first <name> of its package.xml; empty: it has none.
std::string package_of(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_regular_file(folder / "package.xml", ignored)) return {};
  const std::string text = read_text(folder / "package.xml");
  constexpr std::string_view kName = "<name>";
  const std::size_t begin = text.find(kName);
  if (begin == std::string::npos) return {};
  const std::size_t first = text.find_first_not_of(" \t\r\n", begin + kName.size());
  const std::size_t end = text.find_first_of("< \t\r\n", first);
  return end == std::string::npos ? "" : text.substr(first, end - first);
}

// The path of a file:// address, in which %20 means a space.
std::string decoded(const std::string& address) {
  std::string path;
  for (std::size_t i = 0; i < address.size(); ++i) {
    unsigned char code = 0;
    const char* const digits = address.data() + i + 1;
    const bool is_code = address[i] == '%' && i + 2 < address.size() &&
                         std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2 && code != 0;
    path += is_code ? static_cast<char>(code) : address[i];
    if (is_code) i += 2;
  }
  return path;
}

// The folders that a variable lists with colons between them.
std::vector<fs::path> folders_of(const char* variable) {
  const char* const value = std::getenv(variable);
  std::vector<fs::path> folders;
  std::istringstream list(value != nullptr ? value : "");
  for (std::string folder; std::getline(list, folder, ':');) {
    if (!folder.empty()) folders.emplace_back(folder);
  }
  return folders;
}

// A file of a package, where ROS 2 and ROS 1 look for it. Empty: it is not there.
// @param whole, rest  the file's path with the package's name, and without it
fs::path find_in_ros(const fs::path& package, const fs::path& whole, const fs::path& rest) {
  std::error_code ignored;
  for (const fs::path& prefix : folders_of("AMENT_PREFIX_PATH")) {
    if (fs::is_regular_file(prefix / "share" / whole, ignored)) return prefix / "share" / whole;
  }
  for (const fs::path& root : folders_of("ROS_PACKAGE_PATH")) {
    if (fs::is_regular_file(root / whole, ignored)) return root / whole;
    if (package_of(root) == package && fs::is_regular_file(root / rest, ignored)) return root / rest;
    // Repositories hold several packages.
    for (const fs::directory_entry& entry : fs::directory_iterator(root, ignored)) {
      if (fs::is_regular_file(entry.path() / whole, ignored)) return entry.path() / whole;
    }
  }
  return {};
}

// Looks for package://NAME/REST as NAME/REST in the folders above the URDF, then in ROS, then as REST where no
// package.xml has another name: many packages have a meshes/base_link.stl.
fs::path find_mesh(const fs::path& urdf, const std::string& name, std::vector<std::string>& notes) {
  constexpr const char* kFile = "file://";
  constexpr const char* kPackage = "package://";
  if (name.starts_with(kFile)) return decoded(name.substr(std::string(kFile).size()));
  if (!name.starts_with(kPackage)) return name.find("://") == std::string::npos ? beside(urdf, name) : fs::path(name);
  const fs::path whole = name.substr(std::string(kPackage).size());
  const fs::path package = *whole.begin();
  const fs::path rest = whole.lexically_relative(package);
  std::error_code ignored;
  std::vector<fs::path> folders{fs::weakly_canonical(fs::absolute(urdf).parent_path(), ignored)};
  while (folders.back() != folders.back().parent_path()) folders.push_back(folders.back().parent_path());
  for (const fs::path& at : folders) {
    if (fs::is_regular_file(at / whole, ignored)) return at / whole;
  }
  if (fs::path found = find_in_ros(package, whole, rest); !found.empty()) return found;
  for (const fs::path& at : folders) {
    if (!fs::is_regular_file(at / rest, ignored)) continue;
    const std::string found = package_of(at);
    if (!found.empty() && found != package) continue;
    const std::string note = fmt::format("package '{}' is taken to be the folder '{}'", package.string(), at.string());
    if (found.empty() && at.filename() != package && std::count(notes.begin(), notes.end(), note) == 0)
      notes.push_back(note);
    return at / rest;
  }
  return name;
}

SceneShape read_geometry(const urdf::Geometry& geometry, const fs::path& file, const Place& place,
                         std::vector<std::string>& notes) {
  SceneShape shape;
  shape.place = place;
  switch (geometry.type) {
    case urdf::Geometry::MESH: {
      const auto& mesh = static_cast<const urdf::Mesh&>(geometry);
      shape.mesh = find_mesh(file, mesh.filename, notes);
      shape.units = {mesh.scale.x, mesh.scale.y, mesh.scale.z};
      break;
    }
    case urdf::Geometry::BOX: {
      const auto& box = static_cast<const urdf::Box&>(geometry);
      shape.solid = Solid::box;
      shape.half_extents = {box.dim.x / 2, box.dim.y / 2, box.dim.z / 2};
      break;
    }
    case urdf::Geometry::SPHERE:
      shape.solid = Solid::sphere;
      shape.radius = static_cast<const urdf::Sphere&>(geometry).radius;
      break;
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
      shape.solid = Solid::cylinder;
      shape.radius = cylinder.radius;
      shape.half_height = cylinder.length / 2;
      break;
    }
  }
  return shape;
}

// Links joined by fixed joints, with the sum of their masses.
struct Rigid {
  SceneBody body;
  Triple first_moment{};           // first moment of mass, about the body's origin
  std::array<double, 9> second{};  // inertia about the body's origin, row-major
  bool fixed = false;              // whether it is fixed to the world
};

// Adds the parallel-axis term (Huygens and Steiner): moves an inertia from the centre of mass to the origin, or back
// with a negative mass.
void add_moved(std::array<double, 9>& inertia, double mass, const Triple& by) {
  const double squares = by[0] * by[0] + by[1] * by[1] + by[2] * by[2];
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) inertia[3 * i + j] += mass * ((i == j ? squares : 0) - by[i] * by[j]);
  }
}

void add_inertial(Rigid& rigid, const urdf::Inertial& inertial, const Placement& link) {
  const Placement at = composed(link, to_placement(inertial.origin));
  const double m = inertial.mass;
  for (std::size_t axis = 0; axis < 3; ++axis) rigid.first_moment[axis] += m * at.position[axis];
  rigid.body.mass += m;
  const double own[9] = {inertial.ixx, inertial.ixy, inertial.ixz, inertial.ixy, inertial.iyy,
                         inertial.iyz, inertial.ixz, inertial.iyz, inertial.izz};
  const Triple axes[3] = {rotated(at.orientation, {1, 0, 0}), rotated(at.orientation, {0, 1, 0}),
                          rotated(at.orientation, {0, 0, 1})};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t l = 0; l < 3; ++l) rigid.second[3 * i + j] += axes[k][i] * own[3 * k + l] * axes[l][j];
      }
    }
  }
  add_moved(rigid.second, m, at.position);
}

// Whether every principal moment of an inertia is positive (Sylvester's criterion). @pre its diagonal is positive
bool is_positive(const std::array<double, 9>& i) {
  const double minor = i[0] * i[4] - i[1] * i[1];
  const double determinant =
      i[0] * (i[4] * i[8] - i[5] * i[5]) - i[1] * (i[1] * i[8] - i[5] * i[2]) + i[2] * (i[1] * i[5] - i[4] * i[2]);
  constexpr double kLeast = 1e-9;  // of the moments' product
  return minor > 0 && determinant > kLeast * i[0] * i[4] * i[8];
}

// Whether a body may have an inertia: no moment is above the sum of the others. @pre its moments are positive
bool is_of_a_body(std::array<double, 9> i) {
  constexpr double kRounding = 1e-3;
  const double half = (0.5 + kRounding) * (i[0] + i[4] + i[8]);
  for (std::size_t k = 0; k < 9; ++k) i[k] = (k % 4 == 0 ? half : 0) - i[k];
  return i[0] > 0 && i[4] > 0 && i[8] > 0 && is_positive(i);
}

class Reader {
 public:
  Reader(const urdf::ModelInterface& model, const fs::path& file, const UrdfElements& elements)
      : model_(model), file_(file), elements_(elements) {}

  Scene read() {
    const urdf::LinkConstSharedPtr root = model_.getRoot();
    visit(*root, start(*root, {}, root->name == "world"), {}, {});
    for (const auto& [name, link] : model_.links_) {
      if (visited_.count(name) == 0)
        throw SceneError(elements_.of_link(name), fmt::format("link '{}' does not hang on the root '{}'; its joints go "
                                                              "round in a circle",
                                                              name, root->name));
    }
    std::map<std::size_t, std::size_t> number;  // scene's index of each rigid with shapes
    for (std::size_t i = 0; i < rigids_.size(); ++i) {
      if (rigids_[i].body.shapes.empty()) continue;
      number[i] = scene_.bodies.size();
      scene_.bodies.push_back(finished(rigids_[i], i == 0));
    }
    for (const Held& held : held_) add_joint(held, number);
    for (const auto& [a, b] : joined_) {
      if (number.count(a) > 0 && number.count(b) > 0) scene_.joined.emplace_back(number[a], number[b]);
    }
    if (scene_.bodies.empty())
      throw SceneError(elements_.of_link(root->name), "no link has collision geometry; there is nothing to bake");
    return std::move(scene_);
  }

 private:
  struct Held {
    const urdf::Joint* joint;
    std::size_t parent, child;  // rigids
    Placement pose;             // of the child, in the parent
  };

  void leave_out(const urdf::Joint& joint, const std::string& reason) {
    scene_.assumptions.push_back(fmt::format("joint '{}' is left out: {}", joint.name, reason));
  }

  // Adds a joint of one axis whose child has a mass: others are left to the program.
  void add_joint(const Held& held, const std::map<std::size_t, std::size_t>& number) {
    const urdf::Joint& joint = *held.joint;
    SceneJoint added;
    switch (joint.type) {
      case urdf::Joint::REVOLUTE:
        added.type = SceneJoint::Type::revolute;
        break;
      case urdf::Joint::CONTINUOUS:
        added.type = SceneJoint::Type::continuous;
        break;
      case urdf::Joint::PRISMATIC:
        added.type = SceneJoint::Type::prismatic;
        break;
      case urdf::Joint::FLOATING:
        return;
      default:
        return leave_out(joint, "its type is not supported");
    }
    if (joint.mimic) {
      scene_.assumptions.push_back(fmt::format("joint '{}' mimics '{}', which is not read: it moves by itself",
                                               joint.name, joint.mimic->joint_name));
    }
    const auto is_link = [&](std::size_t i) { return number.count(i) > 0 || links_.count(i) > 0; };
    for (const std::size_t i : {held.parent, held.child}) {
      Rigid& rigid = rigids_[i];
      if (is_link(i) || (i == held.parent && (rigid.fixed || !(rigid.body.mass > 0)))) continue;
      const std::string no_link = fmt::format("link '{}' has neither shape nor ", names_[i]);
      if (!(rigid.body.mass > 0)) return leave_out(joint, no_link + "mass");
      SceneBody link = finished(rigid, false);
      if (!link.inertia) return leave_out(joint, no_link + "inertia");
      links_.insert(i);
      scene_.links.push_back(std::move(link));
    }
    const bool on_world = !is_link(held.parent);
    if (on_world && held.parent != 0)
      return leave_out(joint, fmt::format("link '{}' has neither shape nor mass", names_[held.parent]));
    const auto name_of = [&](std::size_t i) { return names_[i]; };
    added.name = joint.name;
    added.parent = on_world ? "" : name_of(held.parent);
    added.child = name_of(held.child);
    const bool has_mass =
        number.count(held.child) == 0 || scene_.bodies[number.at(held.child)].motion == Motion::dynamic;
    if (!has_mass) return;
    added.pose = held.pose;
    const double length = std::hypot(joint.axis.x, joint.axis.y, joint.axis.z);
    if (!(length > 0)) {
      scene_.assumptions.push_back(fmt::format("joint '{}' has no axis: its child is free", joint.name));
      return;
    }
    added.axis = {joint.axis.x / length, joint.axis.y / length, joint.axis.z / length};
    added.place = elements_.of_link(joint.child_link_name);
    if (joint.limits && joint.type != urdf::Joint::CONTINUOUS) {
      const auto in_range = [](double limit) {
        return std::clamp(limit, -scene_manifest::kFarthest, scene_manifest::kFarthest);
      };
      const double lower = in_range(joint.limits->lower), upper = in_range(joint.limits->upper);
      if (lower <= upper) {
        added.limits = {lower, upper};
        if (lower != joint.limits->lower || upper != joint.limits->upper) {
          scene_.assumptions.push_back(fmt::format("joint '{}' has limits of {:g} and {:g}: they are {:g} and {:g}",
                                                   joint.name, joint.limits->lower, joint.limits->upper, lower, upper));
        }
      } else {
        scene_.assumptions.push_back(
            fmt::format("joint '{}' has a lower limit above its upper one: it has no limits", joint.name));
      }
    }
    scene_.joints.push_back(std::move(added));
  }

  std::size_t start(const urdf::Link& link, const Placement& world, bool fixed) {
    Rigid rigid;
    rigid.body.name = link.name;
    rigid.body.pose = world;
    rigid.body.place = elements_.of_link(link.name);
    rigid.fixed = fixed;
    rigids_.push_back(std::move(rigid));
    names_.push_back(link.name);
    return rigids_.size() - 1;
  }

  // @param at     pose of the link in its rigid
  // @param world  pose of the link in the robot
  void visit(const urdf::Link& link, std::size_t rigid, const Placement& at, const Placement& world) {
    constexpr std::size_t kDeepest = 1000;
    // urdfdom lets joints share a child.
    if (!visited_.insert(link.name).second)
      throw SceneError(elements_.of_link(link.name),
                       fmt::format("link '{}' is the child of two joints; a URDF is a tree", link.name));
    if (++depth_ > kDeepest) {
      throw SceneError(elements_.of_link(link.name),
                       fmt::format("link '{}' hangs on a chain of more than {} links", link.name, kDeepest));
    }
    for (std::size_t i = 0; i < link.collision_array.size(); ++i) {
      const urdf::Collision& collision = *link.collision_array[i];
      if (!collision.geometry) continue;
      SceneShape shape =
          read_geometry(*collision.geometry, file_, elements_.of_geometry(link.name, i), scene_.assumptions);
      shape.pose = composed(at, to_placement(collision.origin));
      rigids_[rigid].body.shapes.push_back(std::move(shape));
    }
    if (link.inertial) {
      const urdf::Inertial& inertial = *link.inertial;
      if (!(inertial.mass >= 0 && inertial.ixx >= 0 && inertial.iyy >= 0 && inertial.izz >= 0))
        throw SceneError(elements_.of_link(link.name),
                         fmt::format("link '{}' has a negative mass or moment of inertia", link.name));
      add_inertial(rigids_[rigid], inertial, at);
    }
    for (const urdf::JointSharedPtr& joint : link.child_joints) {
      const urdf::LinkConstSharedPtr child = model_.getLink(joint->child_link_name);
      const Placement offset = to_placement(joint->parent_to_joint_origin_transform);
      if (joint->type == urdf::Joint::FIXED) {
        visit(*child, rigid, composed(at, offset), composed(world, offset));
        continue;
      }
      const std::size_t next = start(*child, composed(world, offset), false);
      // As in Bullet's importer, a link does not collide with its parent but does with its grandparent. What hangs in
      // the world collides with what is fixed to the world.
      const bool is_world = &link == model_.getRoot().get() && rigids_[rigid].fixed && link.collision_array.empty();
      if (joint->type != urdf::Joint::FLOATING && !is_world) joined_.emplace_back(rigid, next);
      held_.push_back({joint.get(), rigid, next, composed(at, offset)});
      visit(*child, next, {}, composed(world, offset));
    }
    --depth_;
  }

  SceneBody finished(Rigid& rigid, bool is_root) {
    SceneBody& body = rigid.body;
    if (body.mass > 0 && !rigid.fixed) {
      Triple centre{};
      for (std::size_t axis = 0; axis < 3; ++axis) centre[axis] = rigid.first_moment[axis] / body.mass;
      add_moved(rigid.second, -body.mass, centre);
      body.centre_of_mass = centre;
      const std::array<double, 9>& i = rigid.second;
      if (i[0] > 0 && i[4] > 0 && i[8] > 0) {
        body.inertia = {i[0], i[4], i[8], i[1], i[2], i[5]};
      } else {
        scene_.assumptions.push_back(
            fmt::format("link '{}' has a moment of inertia of 0: those of its shapes are taken", body.name));
      }
      if (body.inertia && !is_positive(i)) {
        body.inertia = {i[0], i[4], i[8], 0, 0, 0};
        scene_.assumptions.push_back(
            fmt::format("link '{}' has products of inertia too large for its moments: they are left out", body.name));
      } else if (body.inertia && !is_of_a_body(i)) {
        const bool has_shapes = !body.shapes.empty();
        if (has_shapes) body.inertia.reset();
        scene_.assumptions.push_back(
            fmt::format("link '{}' has moments of inertia that no body has, one above the sum of the others{}",
                        body.name, has_shapes ? ": those of its shapes are taken" : ""));
      }
    } else {
      body.mass = 0;
      body.motion = is_root ? Motion::fixed : Motion::kinematic;
      body.group = 2;
      body.mask = ~2;
      if (!rigid.fixed) {
        scene_.assumptions.push_back(fmt::format("link '{}' has no mass: it is {}", body.name,
                                                 is_root ? "static" : "kinematic, moved by the program alone"));
      }
    }
    return std::move(body);
  }

  const urdf::ModelInterface& model_;
  const fs::path& file_;
  const UrdfElements& elements_;
  Scene scene_;
  std::vector<Rigid> rigids_;
  std::set<std::string> visited_;  // links
  std::size_t depth_ = 0;          // of the visited link
  std::vector<std::pair<std::size_t, std::size_t>> joined_;
  std::vector<Held> held_;
  std::vector<std::string> names_;  // of the rigids: their bodies are moved from
  std::set<std::size_t> links_;     // rigids without shapes that joints hold
};

}  // namespace

Scene read_urdf(const fs::path& file) {
  const std::string text = read_text(file);
  const UrdfElements elements(file.string(), text);
  const Listener listener;
  urdf::ModelInterfaceSharedPtr model;
  std::string reason;
  try {
    model = urdf::parseURDF(text);
  } catch (const std::exception& error) {
    reason = error.what();
  }
  // Links own each other. This breaks the cycle where joints go round in a circle, so that they are freed.
  const std::shared_ptr<void> free_links(nullptr, [&model](void*) {
    if (!model) return;
    for (const auto& [name, link] : model->links_) {
      link->child_links.clear();
      link->child_joints.clear();
    }
  });
  // urdfdom omits geometry that it does not understand and goes on, so its messages count as errors.
  if (reason.empty() && !listener.messages().empty()) reason = listener.messages().front();
  if (reason.empty() && (!model || !model->getRoot())) reason = "it has no links";
  if (!reason.empty()) {
    const bool is_geometry = reason.find("Unknown geometry type") != reason.npos;
    throw SceneError(elements.of_messages(listener.messages()),
                     fmt::format("this is not a URDF that can be used: {}{}", reason,
                                 is_geometry ? "; a URDF has meshes, boxes, spheres and cylinders" : ""));
  }
  Scene scene = Reader(*model, file, elements).read();
  scene.notes = elements.notes();
  return scene;
}

}  // namespace vps::cli
