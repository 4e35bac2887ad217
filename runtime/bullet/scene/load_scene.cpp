// SPDX-License-Identifier: Zlib
// Makes bodies from manifests of `vpsbake scene`. Manifests are not trusted: every value is checked.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "runtime/bullet/convert.h"
#include "runtime/bullet/principal_axes.h"
#include "runtime/bullet/scene/manifest.h"
#include "runtime/bullet/scene/multibodies.h"
#include "runtime/bullet/vps_scene.h"

namespace vps::bullet {

struct Scene::Contents {
  std::string error;
  btDiscreteDynamicsWorld* world = nullptr;
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  Multibodies multibodies;
  std::map<const btCollisionObject*, btTransform> frames;  // of Bullet's bodies, in the frames of the manifest's
  std::map<std::string, btRigidBody*, std::less<>> rigid;
  std::map<std::string, btMultiBodyLinkCollider*, std::less<>> links;
  btScalar step = 0;

  ~Contents() {
    if (auto* const multibody_world = dynamic_cast<btMultiBodyDynamicsWorld*>(world)) {
      multibodies.remove_from(*multibody_world);
    }
    for (const auto& body : bodies) {
      if (world != nullptr) world->removeRigidBody(body.get());
    }
  }
};

Scene::Scene() : contents_(std::make_unique<Contents>()) {}
Scene::Scene(Scene&& other) noexcept = default;
Scene& Scene::operator=(Scene&& other) noexcept = default;
Scene::~Scene() = default;

const std::string& Scene::error() const {
  static const std::string moved_from = "this scene was moved to another place";
  return contents_ ? contents_->error : moved_from;
}
std::span<const std::unique_ptr<btRigidBody>> Scene::bodies() const {
  if (!contents_) return {};
  return contents_->bodies;
}
btRigidBody* Scene::find(std::string_view name) const {
  if (!contents_) return nullptr;
  const auto it = contents_->rigid.find(name);
  return it == contents_->rigid.end() ? nullptr : it->second;
}
btMultiBodyLinkCollider* Scene::find_link(std::string_view name) const {
  if (!contents_) return nullptr;
  const auto it = contents_->links.find(name);
  return it == contents_->links.end() ? nullptr : it->second;
}
JointPlace Scene::find_joint(std::string_view name) const {
  if (!contents_) return {};
  const auto it = contents_->multibodies.joints.find(name);
  return it == contents_->multibodies.joints.end() ? JointPlace{} : it->second;
}
btTransform Scene::origin(const btCollisionObject& body) const {
  if (contents_) {
    const auto it = contents_->frames.find(&body);
    if (it != contents_->frames.end()) return body.getWorldTransform() * it->second.inverse();
  }
  return body.getWorldTransform();
}
btScalar Scene::step() const {
  return contents_ ? contents_->step : btScalar(0);
}

namespace {

namespace fs = std::filesystem;
using manifest::choose;
using manifest::kFarthest;
using manifest::kLeast;
using manifest::Refusal;
using manifest::Value;

// A shape and the pose of its frame in the body's.
struct Placed {
  btCollisionShape* shape = nullptr;
  btTransform pose;
};

class Loader {
 public:
  Loader(fs::path folder, const LoadOptions& options, std::vector<std::unique_ptr<btCollisionShape>>& shapes)
      : folder_(std::move(folder)), options_(options), shapes_(shapes) {}

  // Maps each file once, with the parts that all of its entries use.
  void open_assets(const std::vector<Value>& entries) {
    std::map<fs::path, Use> uses;
    for (const Value& entry : entries) {
      entry.allow_only({"file", "key", "use"});
      Use& use = uses.emplace(entry["file"].file(), Use{}).first->second;
      use = use | use_of(entry);
    }
    std::map<fs::path, std::shared_ptr<const Asset>> known;
    for (const Value& entry : entries) {
      const fs::path file = entry["file"].file();
      std::shared_ptr<const Asset>& asset = known[file];
      if (asset == nullptr) asset = open(file, uses[file]);
      if (entry["key"].text() != scene_manifest::asset_key(asset->bytes()))
        throw Refusal{file.string() + " is not the asset that the scene was planned with; plan it again"};
      assets_.push_back(asset);
    }
  }

  Placed placed(const Value& value, Axes axes) {
    Placed result;
    result.pose = value.pose();
    if (value.has("asset")) {
      value.allow_only({"asset", "part", "segments", "position", "orientation"});
      Shape& shape = asset_shape(value, axes);
      result.shape = &shape;
      result.pose = shape.body_pose(result.pose);
    } else {
      value.allow_only({"primitive", "half_extents", "radius", "half_height", "position", "orientation"});
      result.shape = primitive(value);
    }
    return result;
  }

  btCollisionShape* keep(std::unique_ptr<btCollisionShape> shape) {
    shapes_.push_back(std::move(shape));
    return shapes_.back().get();
  }

 private:
  static Use use_of(const Value& entry) {
    Use use{};
    for (const Value& one : entry["use"].list()) {
      use =
          use |
          choose<Use>(
              one,
              {{"layers", Use::layers}, {"scaled", Use::scaled}, {"real", Use::real}, {"pointshell", Use::pointshell}});
    }
    return use;
  }

  [[nodiscard]] std::shared_ptr<const Asset> open(const fs::path& file, Use use) const {
    const fs::path path = folder_ / file;
    auto asset = std::make_shared<Asset>();
    Status status = Status::ok;
    if (options_.verify) {
      // In a mapping of its own: parts that are not used take no memory afterwards.
      Asset whole;
      status = Asset::open(path.c_str(), whole, Use{});
      if (status == Status::ok) status = whole.verify();
    }
    if (status == Status::ok) status = Asset::open(path.c_str(), *asset, use);
    if (status != Status::ok) throw Refusal{file.string() + ": " + describe(status)};
    return asset;
  }

  Shape& asset_shape(const Value& value, Axes axes) {
    const auto number = static_cast<std::size_t>(value["asset"].integer(0, std::int64_t{1} << 31));
    if (number >= assets_.size()) value["asset"].refuse("is not the number of an asset");
    const Part part = choose<Part>(
        value["part"], {{"mixed", Part::mixed}, {"pointshell", Part::pointshell}, {"voxelmap", Part::voxelmap}});
    constexpr std::int64_t kMostSegments = 1 << 20;
    const auto segments =
        static_cast<std::uint32_t>(value.has("segments") ? value["segments"].integer(0, kMostSegments) : 0);
    const std::shared_ptr<const Asset>& asset = assets_[number];
    Shape*& shape = known_[{asset.get(), part, segments, axes}];
    if (shape == nullptr) {
      auto made = std::make_unique<Shape>(asset, part, axes);
      if ((part != Part::voxelmap && made->pointshell().points == 0) ||
          (part != Part::pointshell && made->voxelmap().field == Field::none)) {
        value.refuse("plays a part that its asset has not or that is not in use");
      }
      made->set_segments(segments);
      shape = made.get();
      keep(std::move(made));
    }
    return *shape;
  }

  btCollisionShape* primitive(const Value& value) {
    const auto size = [&](const char* key) { return static_cast<btScalar>(value[key].number(kLeast, kFarthest)); };
    enum class Kind : std::uint8_t { box, sphere, capsule, cylinder, plane };
    switch (choose<Kind>(value["primitive"], {{"box", Kind::box},
                                              {"sphere", Kind::sphere},
                                              {"capsule", Kind::capsule},
                                              {"cylinder", Kind::cylinder},
                                              {"plane", Kind::plane}})) {
      case Kind::box:
        return keep(std::make_unique<btBoxShape>(value["half_extents"].vector(kLeast, kFarthest)));
      case Kind::sphere:
        return keep(std::make_unique<btSphereShape>(size("radius")));
      case Kind::capsule:
        return keep(std::make_unique<btCapsuleShapeZ>(size("radius"), 2 * size("half_height")));
      case Kind::cylinder:
        return keep(std::make_unique<btCylinderShapeZ>(btVector3(size("radius"), size("radius"), size("half_height"))));
      case Kind::plane:
        break;
    }
    // Bullet's plane fills a half space. Its normal is z here, and the body's orientation turns it.
    return keep(std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0)));
  }

  fs::path folder_;
  const LoadOptions& options_;
  std::vector<std::unique_ptr<btCollisionShape>>& shapes_;
  std::vector<std::shared_ptr<const Asset>> assets_;  // in the manifest's order
  std::map<std::tuple<const Asset*, Part, std::uint32_t, Axes>, Shape*> known_;
};

enum class BodyType : std::uint8_t { fixed, kinematic, dynamic };

// A single shape as it is, if its frame is that of the body in Bullet; otherwise a compound.
btCollisionShape* shape_in(const btTransform& frame, const std::vector<Placed>& placed, Loader& loader) {
  if (placed.size() == 1 && placed.front().pose == frame) return placed.front().shape;
  auto compound = std::make_unique<btCompoundShape>();
  for (const Placed& one : placed) compound->addChildShape(frame.inverse() * one.pose, one.shape);
  return loader.keep(std::move(compound));
}

// @param value  three moments, or three moments and the products xy, xz, yz. [kg m^2]
PrincipalAxes stated_inertia(const Value& value) {
  constexpr double kSmallest = scene_manifest::kLeastInertia;
  const std::vector<Value> numbers = value.list();
  if (numbers.size() != 3 && numbers.size() != 6) value.refuse("has neither three nor six numbers");
  std::array<double, 6> tensor{};
  double largest = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    tensor[i] = i < 3 ? numbers[i].number(kSmallest, kFarthest) : numbers[i].number(-largest, largest);
    largest = std::max(largest, tensor[i]);
  }
  PrincipalAxes found = find_principal_axes(tensor);
  for (const double moment : found.moments) {
    if (!(moment >= kSmallest)) value.refuse("has products too large for its moments");
  }
  return found;
}

// [kg m^2]
btVector3 inertia_by_shape(const Value& value, const btCollisionShape& shape, btScalar mass) {
  btVector3 inertia;
  shape.calculateLocalInertia(mass, inertia);
  // The volume of a forged asset may be any number.
  for (int axis = 0; axis < 3; ++axis) {
    if (!(inertia[axis] > 0 && std::isfinite(inertia[axis]))) value.refuse("has no inertia by its shape; state one");
  }
  return inertia;
}

// Sets the frame and the inertia that a value states.
void read_inertia(const Value& value, BodyParts& body) {
  const PrincipalAxes stated = stated_inertia(value["inertia"]);
  body.frame.setBasis(stated.rotation);
  for (int axis = 0; axis < 3; ++axis) {
    body.inertia[axis] = btScalar(stated.moments[static_cast<std::size_t>(axis)]);
  }
}

BodyParts read_body(const Value& value, Loader& loader) {
  value.allow_only({"name", "type", "mass", "inertia", "centre_of_mass", "velocity", "position", "orientation", "group",
                    "mask", "friction", "restitution", "shapes"});
  BodyParts body;
  body.name = value["name"].text();
  const BodyType type = choose<BodyType>(
      value["type"], {{"static", BodyType::fixed}, {"kinematic", BodyType::kinematic}, {"dynamic", BodyType::dynamic}});
  const bool is_dynamic = type == BodyType::dynamic;
  const bool by_shape = !value.has("centre_of_mass") && !value.has("inertia");
  std::vector<Placed> placed;
  bool has_plane = false;
  for (const Value& shape : value["shapes"].list(scene_manifest::kMostShapes)) {
    placed.push_back(loader.placed(shape, is_dynamic && by_shape ? Axes::principal : Axes::of_asset));
    has_plane = has_plane || placed.back().shape->getShapeType() == STATIC_PLANE_PROXYTYPE;
  }
  if (placed.empty()) value["shapes"].refuse("is empty");
  if (has_plane && (placed.size() > 1 || is_dynamic || !(placed.front().pose == btTransform::getIdentity())))
    value.refuse("has a plane that moves or is one of several shapes");
  if (placed.size() > 1 && is_dynamic && !value.has("centre_of_mass"))
    value.refuse("has several shapes and no centre_of_mass");
  body.is_dynamic = is_dynamic;
  body.is_kinematic = type == BodyType::kinematic;
  body.pose = value.pose();
  body.frame = placed.front().pose;
  if (!is_dynamic || !by_shape) body.frame.setBasis(btMatrix3x3::getIdentity());
  if (value.has("centre_of_mass")) body.frame.setOrigin(value["centre_of_mass"].vector(-kFarthest, kFarthest));
  if (is_dynamic && value.has("inertia")) read_inertia(value, body);
  body.shape = has_plane ? placed.front().shape : shape_in(body.frame, placed, loader);
  if (is_dynamic) {
    body.mass = static_cast<btScalar>(value["mass"].number(kLeast, kFarthest));
    if (!value.has("inertia")) body.inertia = inertia_by_shape(value, *body.shape, body.mass);
    if (value.has("velocity")) body.velocity = value["velocity"].vector(-kFarthest, kFarthest);
  }
  if (value.has("friction")) body.friction = static_cast<btScalar>(value["friction"].number(0, 1e3));
  if (value.has("restitution")) body.restitution = static_cast<btScalar>(value["restitution"].number(0, 1));
  const auto bits = [&](const char* key) {
    return static_cast<int>(value[key].integer(std::numeric_limits<int>::min(), std::numeric_limits<int>::max()));
  };
  body.group = bits("group");
  body.mask = bits("mask");
  return body;
}

// A link without collision geometry.
BodyParts read_link(const Value& value) {
  value.allow_only({"name", "mass", "inertia", "centre_of_mass"});
  BodyParts link;
  link.name = value["name"].text();
  link.is_dynamic = true;
  link.mass = static_cast<btScalar>(value["mass"].number(kLeast, kFarthest));
  link.frame.setOrigin(value["centre_of_mass"].vector(-kFarthest, kFarthest));
  read_inertia(value, link);
  return link;
}

std::unique_ptr<btRigidBody> make_rigid(const BodyParts& parts) {
  btRigidBody::btRigidBodyConstructionInfo info(parts.mass, nullptr, parts.shape, parts.inertia);
  info.m_startWorldTransform = parts.pose * parts.frame;
  info.m_friction = parts.friction;
  info.m_restitution = parts.restitution;
  auto body = std::make_unique<btRigidBody>(info);
  if (parts.is_kinematic) {
    body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    body->setActivationState(DISABLE_DEACTIVATION);
  }
  if (parts.is_dynamic) body->setLinearVelocity(parts.velocity);
  return body;
}

// Links of a multibody know which of them do not meet.
void keep_apart(const Value& pair, const std::map<std::string, btCollisionObject*, std::less<>>& objects) {
  const std::vector<Value> names = pair.list();
  const auto object = [&](std::size_t i) -> btCollisionObject* {
    const auto it = names.size() == 2 ? objects.find(names[i].text()) : objects.end();
    return it == objects.end() ? nullptr : it->second;
  };
  btCollisionObject* const first = object(0);
  btCollisionObject* const second = object(1);
  if (first == nullptr || second == nullptr || first == second) pair.refuse("does not name two bodies");
  first->setIgnoreCollisionCheck(second, true);
  second->setIgnoreCollisionCheck(first, true);
}

}  // namespace

Scene Scene::load(const std::string& path, btDiscreteDynamicsWorld& world, const LoadOptions& options) {
  Scene scene;
  const auto fail = [&path](const std::string& why) {
    Scene failed;
    std::string reason = path + ": " + why;
    // Keeps the message on one line: it may quote the file.
    for (char& c : reason) c = std::iscntrl(static_cast<unsigned char>(c)) != 0 ? '?' : c;
    failed.contents_->error = std::move(reason);
    return failed;
  };
  try {
    Contents& contents = *scene.contents_;
    const nlohmann::json json = manifest::read_json(path);
    const Value root(json, "");
    if (root["format"].text() != "vps-scene") root["format"].refuse("is not vps-scene");
    if (root["version"].integer(0, 1000) != 1) root["version"].refuse("is not 1; plan the scene again");
    auto* const dispatcher = dynamic_cast<btCollisionDispatcher*>(world.getDispatcher());
    if (dispatcher == nullptr) throw Refusal{"the world's dispatcher is not a btCollisionDispatcher"};
    contents.step = static_cast<btScalar>(root["step"].number(1e-6, 10));

    root.allow_only(
        {"format", "version", "generator", "step", "gravity", "assets", "bodies", "links", "joints", "apart"});
    // Before compounds ask their shapes for bounds: two of a kind look like steps of an unregistered world.
    register_algorithm(*dispatcher);
    Loader loader(fs::path(path).parent_path(), options, contents.shapes);
    loader.open_assets(root["assets"].list(scene_manifest::kMostAssets));
    std::vector<BodyParts> parts;
    std::map<std::string, std::size_t, std::less<>> numbers;
    const auto add = [&](const Value& value, BodyParts body) {
      if (!numbers.emplace(body.name, parts.size()).second) value["name"].refuse("is that of another body");
      parts.push_back(std::move(body));
    };
    for (const Value& value : root["bodies"].list(scene_manifest::kMostBodies)) add(value, read_body(value, loader));
    if (root.has("links")) {
      for (const Value& value : root["links"].list(scene_manifest::kMostBodies)) add(value, read_link(value));
    }
    auto* const multibody_world = dynamic_cast<btMultiBodyDynamicsWorld*>(&world);
    if (root.has("joints")) {
      const std::vector<Joint> joints = read_joints(root["joints"], parts, numbers);
      if (options.multibodies && multibody_world == nullptr && !joints.empty()) {
        throw Refusal{"multibodies need a btMultiBodyDynamicsWorld"};
      }
      if (options.multibodies) contents.multibodies = make_multibodies(parts, joints);
    }
    std::map<std::string, btCollisionObject*, std::less<>> objects;
    std::vector<const BodyParts*> rigid;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].shape == nullptr) continue;
      const auto link = contents.multibodies.collider_of.find(i);
      btCollisionObject* object = nullptr;
      if (link != contents.multibodies.collider_of.end()) {
        object = contents.links[parts[i].name] = link->second;
      } else {
        contents.bodies.push_back(make_rigid(parts[i]));
        rigid.push_back(&parts[i]);
        object = contents.rigid[parts[i].name] = contents.bodies.back().get();
      }
      contents.frames.emplace(object, parts[i].frame);
      objects.emplace(parts[i].name, object);
    }
    for (const Value& pair : root["apart"].list()) keep_apart(pair, objects);
    if (root.has("gravity"))
      world.setGravity(root["gravity"].vector(-scene_manifest::kMostGravity, scene_manifest::kMostGravity));

    // Nothing fails from here on.
    contents.world = &world;
    for (std::size_t i = 0; i < contents.bodies.size(); ++i) {
      world.addRigidBody(contents.bodies[i].get(), rigid[i]->group, rigid[i]->mask);
    }
    if (multibody_world != nullptr) contents.multibodies.add_to(*multibody_world, parts);
    return scene;
  } catch (const Refusal& refusal) {
    return fail(refusal.reason);
  } catch (const std::exception& error) {
    return fail(std::string("the scene cannot be loaded: ") + error.what());
  }
}

}  // namespace vps::bullet
