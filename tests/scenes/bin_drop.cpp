// SPDX-License-Identifier: GPL-3.0-or-later
// Drops baked assets into a bin, one above the other, in an unpatched Bullet; prints times and depth, and records the
// motion.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/bullet_world.h"
#include "tests/support/motion_file.h"

namespace {

constexpr btScalar kStep = btScalar(1.0 / 240);
constexpr int kSteps = 4 * 240;
constexpr int kStepsPerFrame = 4;
constexpr btScalar kDensity = 500;  // [kg/m^3]
constexpr btScalar kWall = btScalar(0.01);

struct Item {
  std::filesystem::path file;
  std::string name;
  std::unique_ptr<vps::bullet::Shape> shape;
  btRigidBody* body = nullptr;
};

int drop(std::vector<Item>& items, const std::filesystem::path& motion_file) {
  btScalar size = 0;
  for (const Item& item : items) {
    const vps::AssetInfo& info = item.shape->asset().info();
    for (int axis = 0; axis < 3; ++axis) size = std::max(size, btScalar(info.bounds_max[axis] - info.bounds_min[axis]));
  }
  vps::test::World scene;
  scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  vps::test::MotionFile motion;

  // The bin has room for two of the longest body. Its walls are not recorded, so that one sees into it.
  const btScalar half = btScalar(1.05) * size;
  btBoxShape floor({half, half, kWall}), high_x({kWall, half, 100 * size}), high_y({half, kWall, 100 * size});
  const btRigidBody& ground = scene.add(floor, 0, {0, 0, -kWall});
  motion.add("floor", ground, floor);
  for (const btScalar side : {-half - kWall, half + kWall}) {
    scene.add(high_x, 0, {side, 0, 100 * size});
    scene.add(high_y, 0, {0, side, 100 * size});
  }

  // Two columns of bodies, each body turned by another 40 degrees.
  btScalar above[] = {btScalar(0.02), btScalar(0.02)};
  for (std::size_t i = 0; i < items.size(); ++i) {
    Item& item = items[i];
    btTransform at(btQuaternion({1, 0, 0}, btScalar(0.7) * btScalar(i)));
    btVector3 low, high;
    item.shape->getAabb(at, low, high);
    const std::size_t column = i % 2;
    at.setOrigin(btVector3(column == 0 ? -half / 2 : half / 2, 0, above[column]) -
                 btVector3((low.x() + high.x()) / 2, (low.y() + high.y()) / 2, low.z()));
    above[column] += high.z() - low.z() + btScalar(0.01);
    item.body = &scene.add(*item.shape, kDensity * btScalar(item.shape->asset().info().volume), at);
    item.body->setFriction(btScalar(0.7));
    motion.add(item.name.c_str(), *item.body, *item.shape, item.file);
  }

  motion.record(0, {});
  std::vector<double> step_us;
  btScalar deepest = 0;
  for (int step = 1; step <= kSteps; ++step) {
    scene.world.stepSimulation(kStep, 0);
    step_us.push_back(scene.dispatcher.last_us);
    if (step % kStepsPerFrame != 0) continue;
    const std::vector<btManifoldPoint> points = scene.points();
    motion.record(step * double(kStep), points);
    deepest = 0;
    for (const btManifoldPoint& point : points) deepest = std::max(deepest, -point.getDistance());
  }
  std::sort(step_us.begin(), step_us.end());
  std::printf("%zu bodies dropped into a bin, 240 Hz\n", items.size());
  std::printf("  collision step      %.0f us median, %.0f us 99 %%, %.0f us max (narrowphase of all pairs)\n",
              step_us[step_us.size() / 2], step_us[step_us.size() * 99 / 100], step_us.back());
  std::printf("  after %.1f s         deepest contact %.3f mm\n\n", kSteps * double(kStep), 1000 * double(deepest));

  if (!motion.write(motion_file, "Dropped into a bin", 'z')) {
    std::fprintf(stderr, "bin_drop: error: %s: it cannot be written\n", motion_file.c_str());
    return 2;
  }
  for (const Item& item : items) {
    const btVector3& at = item.body->getWorldTransform().getOrigin();
    if (at.z() < 0 || std::max(std::abs(at.x()), std::abs(at.y())) > half) {
      std::fprintf(stderr, "bin_drop: error: %s left the bin\n", item.name.c_str());
      return 4;
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: bin_drop MOTION.json ASSET...\n");
    return 1;
  }
  std::vector<Item> items;
  for (int i = 2; i < argc; ++i) {
    Item item;
    item.file = argv[i];
    item.name = "body " + std::to_string(i - 1);
    auto asset = std::make_shared<vps::Asset>();
    if (const vps::Status status = vps::Asset::open(argv[i], *asset); status != vps::Status::ok) {
      std::fprintf(stderr, "bin_drop: error: %s: %s\n", argv[i], vps::describe(status));
      return 3;
    }
    item.shape = std::make_unique<vps::bullet::Shape>(asset);
    items.push_back(std::move(item));
  }
  return drop(items, argv[1]);
}
