// SPDX-License-Identifier: GPL-3.0-or-later
// One body falls from 16 rotations, lands, rolls and rests, on Bullet's box, plane and triangles, and on a baked slab.
#include <cmath>
#include <numbers>

#include "sample_meshes/shapes.h"
#include "tests/bench/scenes/scenes.h"

namespace vps::bench {
namespace {

constexpr double kFallGravity = 9.81;      // [m/s^2]
constexpr double kLandSeconds = 1;         // from the first touch on
constexpr double kSettleSeconds = 3;       // from the first touch to the end
constexpr double kGroundHalf = 0.8;        // of slab and triangles. [m]
constexpr double kGroundThickness = 0.06;  // of box and slab. [m]
constexpr double kSlabVoxel = 0.004;       // [m]
constexpr int kCells = 100;                // along a side of the grid of triangles
constexpr const char* kSlabName = "slab";

struct Floor {
  std::string name;
  std::shared_ptr<btCollisionShape> shape;
  btVector3 at{0, 0, 0};
  std::shared_ptr<void> parts{};  // outlives the shape
};

Floor box_floor() {
  const auto half = btScalar(kGroundThickness / 2);
  return {"box",
          std::make_shared<btBoxShape>(btVector3(btScalar(kGroundHalf), btScalar(kGroundHalf), half)),
          {0, 0, -half}};
}

Floor slab_floor() {
  bake::BakeOptions options;
  options.voxel_size = kSlabVoxel;
  options.pointshell = false;
  const TriangleMesh mesh = samples::make_box({kGroundHalf, kGroundHalf, kGroundThickness / 2});
  return {kSlabName,
          std::make_shared<bullet::Shape>(lab::bake_in_memory(mesh, options)),
          {0, 0, btScalar(-kGroundThickness / 2)}};
}

Floor grid_floor() {
  const auto mesh = std::make_shared<btTriangleMesh>();
  const auto at = [](int i, int j) {
    return btVector3(btScalar(kGroundHalf * (2.0 * i / kCells - 1)), btScalar(kGroundHalf * (2.0 * j / kCells - 1)), 0);
  };
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      mesh->addTriangle(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      mesh->addTriangle(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return {"triangles", std::make_shared<btBvhTriangleMeshShape>(mesh.get(), true), {0, 0, 0}, mesh};
}

Floor make_floor(const std::string& name) {
  if (name == "box") return box_floor();
  if (name == kSlabName) return slab_floor();
  if (name == "triangles") return grid_floor();
  return {name, std::make_shared<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0))};
}

// Spread evenly over all rotations: M. Alexa, Super-Fibonacci spirals, CVPR 2022.
btQuaternion rotation(int play, int plays) {
  constexpr double kPsi = 1.533751168755204288118041;
  const double s = play + 0.5;
  const double t = s / plays;
  const double a = 2 * std::numbers::pi * s / std::numbers::sqrt2;
  const double b = 2 * std::numbers::pi * s / kPsi;
  const double r = std::sqrt(t), q = std::sqrt(1 - t);
  return {btScalar(r * std::sin(a)), btScalar(r * std::cos(a)), btScalar(q * std::sin(b)), btScalar(q * std::cos(b))};
}

// Of the body's own surface: Bullet's box is another body than the part inside it.
std::vector<btVector3> surface_points(const BodySide& side) {
  if (side.kind != Kind::box) return shell_points(*side.part->baked);
  btVector3 low, high;
  side.part->shape().getAabb(btTransform::getIdentity(), low, high);
  std::vector<btVector3> corners;
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back((i & 1) != 0 ? low.x() : high.x(), (i & 2) != 0 ? low.y() : high.y(),
                         (i & 4) != 0 ? low.z() : high.z());
  }
  return corners;
}

double lowest(const std::vector<btVector3>& points, const btTransform& at) {
  const btVector3 up = at.getBasis()[2];
  btScalar least = up.dot(points[0]);
  for (const btVector3& p : points) least = std::min(least, up.dot(p));
  return double(least + at.getOrigin().z());
}

struct Fall {
  double rate = 0;    // [Hz]
  double height = 0;  // of the lowest point. [m]
  int plays = 0;
  double voxel = 0;  // [m]
  double mass = 0;   // [kg]
  [[nodiscard]] std::size_t steps_of(double seconds) const { return std::size_t(std::lround(seconds * rate)); }
  [[nodiscard]] double seconds() const { return std::sqrt(2 * height / kFallGravity); }
};

Side fall_of(const Fall& fall, const BodySide& side, const std::shared_ptr<Floor>& ground) {
  const auto points = std::make_shared<std::vector<btVector3>>(surface_points(side));
  const auto play = [=](int number, Quality* quality) {
    test::World world;
    const scenes::Options none;
    scenes::Run run(world, 1 / fall.rate, none);
    world.add(*ground->shape, 0, ground->at);
    btTransform at(rotation(number, fall.plays));
    at.setOrigin({0, 0, btScalar(fall.height - lowest(*points, at))});
    const btTransform to_mesh(btQuaternion::getIdentity(), -side.part->baked->centre_of_mass());
    const btRigidBody& body = run.add_mass(*side.part, fall.mass, at * to_mesh);
    prepare(world, fall.voxel);
    Script script;
    script.step = 1 / fall.rate;
    script.steps = fall.steps_of(fall.seconds() + kSettleSeconds);
    script.depth = [&] { return std::max(0.0, -lowest(*points, body.getWorldTransform())); };
    script.depth_every = 2;
    return record(world, run, script, quality);
  };
  return {side.name, side.kind, fall.voxel, play};
}

Scene drop_scene(Bodies& bodies, const std::string& body, const std::string& floor) {
  Fall fall;
  fall.rate = body == "bunny" ? 200 : 240;
  fall.height = body == "bunny" ? 0.5 : 0.1;
  fall.plays = bodies.options().length == Length::quick ? 4 : 16;
  Scene scene;
  scene.name = body + " on " + floor;
  scene.plays = fall.plays;
  const std::size_t touch = fall.steps_of(fall.seconds()) - 1;
  const std::size_t end = fall.steps_of(fall.seconds() + kSettleSeconds);
  scene.phases = {{"lands", touch, touch + fall.steps_of(kLandSeconds)}, {"rests", end - fall.steps_of(1), end}};
  scene.sides = [=, &bodies]() mutable {
    const Body& falling = bodies.get(body);
    fall.voxel = falling.voxel;
    fall.mass = falling.mass;
    const auto ground = std::make_shared<Floor>(make_floor(floor));
    // Bullet's own shapes lie on Bullet's box where the baked ones lie on a baked slab.
    const auto other = floor == kSlabName ? std::make_shared<Floor>(box_floor()) : ground;
    std::vector<Side> sides;
    for (const BodySide& side : falling.sides) {
      sides.push_back(fall_of(fall, side, side.kind == Kind::baked ? ground : other));
    }
    return sides;
  };
  return scene;
}

}  // namespace

std::vector<Scene> drop_scenes(Bodies& bodies) {
  std::vector<Scene> scenes;
  for (const char* body : {"bunny", "gear", "nut", "brick"}) {
    for (const char* floor : {"box", "plane", kSlabName, "triangles"}) {
      scenes.push_back(drop_scene(bodies, body, floor));
    }
  }
  return scenes;
}

}  // namespace vps::bench
