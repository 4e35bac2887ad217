// SPDX-License-Identifier: GPL-3.0-or-later
// Drops a baked asset on a box, then on a fixed copy of itself, in an unpatched Bullet, and prints the measurements.
// Paper: Sec. 4.2 (1 kg, from 0.5 m, 200 Hz).
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <vector>

#include "tests/support/bullet_world.h"
#include "tests/support/motion_file.h"

namespace {

using Clock = std::chrono::steady_clock;
double microseconds_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
}

constexpr btScalar kStep = btScalar(1.0 / 200);
constexpr int kFirstTimed = 200;  // the steps whose narrowphase is reported, as in the paper
constexpr int kLastTimed = 600;
constexpr int kPlays = 5;          // of which each step's least time is taken
constexpr int kStepsPerFrame = 2;  // of a recorded motion

// Depth of the deepest shell point, found among all points, as the contact list may miss it.
class Depth {
 public:
  Depth(const vps::bullet::Shape& shape, const btBoxShape& ground, const btTransform& ground_at)
      : shape_(shape),
        ground_{vps::Vec3{float(ground.getHalfExtentsWithMargin().x()), float(ground.getHalfExtentsWithMargin().y()),
                          float(ground.getHalfExtentsWithMargin().z())}},
        ground_at_(ground_at) {}

  double in_ground(const btTransform& body) const {
    const btTransform to_ground = ground_at_.inverseTimes(body);
    double deepest = -1e30;
    for (std::uint32_t i = 0; i < shape_.pointshell().points; ++i) {
      deepest = std::max(deepest, double(vps::penetration(ground_, vec3(to_ground * point(i)))));
    }
    return deepest;
  }
  double in_other(const btTransform& body, const btTransform& other) const {
    const btTransform to_other = shape_.mesh_pose(other).inverseTimes(shape_.mesh_pose(body));
    const vps::PointshellView& shell = shape_.pointshell();
    double deepest = -1e30;
    for (std::uint32_t i = 0; i < shell.points; ++i) {
      const vps::Vec3 inward = vps::point_inward_normal(shell, i);
      const btVector3 normal(inward.x, inward.y, inward.z);
      const btVector3 at = to_other * to_bt(vps::point_position(shape_.pointshell(), i));
      deepest =
          std::max(deepest, double(vps::penetration(shape_.voxelmap(), vec3(at), vec3(to_other.getBasis() * normal))));
    }
    return deepest;
  }

 private:
  static vps::Vec3 vec3(const btVector3& v) { return {float(v.x()), float(v.y()), float(v.z())}; }
  static btVector3 to_bt(vps::Vec3 v) { return {v.x, v.y, v.z}; }
  btVector3 point(std::uint32_t i) const {
    return shape_.asset_frame() * to_bt(vps::point_position(shape_.pointshell(), i));
  }
  const vps::bullet::Shape& shape_;
  const vps::BoxField ground_;
  const btTransform ground_at_;
};

struct Outcome {
  std::vector<double> step_us;
  double deepest_ground = -1e30;
  double deepest_other = -1e30;
  double fastest = 0;
  bool broken = false;
  bool recorded = true;  ///< false: the file could not be written
  btTransform rest;
  double rest_speed = 0;
  double rest_spin = 0;
};

enum class Partner { box, itself };

// The file for a recorded motion and the asset's file; an empty `file` means no recording.
struct Recording {
  std::filesystem::path file, asset;
};

double largest_extent(const vps::AssetInfo& info) {
  double most = 0;
  for (int axis = 0; axis < 3; ++axis) most = std::max(most, info.bounds_max[axis] - info.bounds_min[axis]);
  return most;
}

struct Fall {
  const double size;
  btBoxShape ground;
  vps::test::World scene;
  const btRigidBody* floor = nullptr;
  const btRigidBody* fixed = nullptr;  // the copy; null: none
  btRigidBody* body = nullptr;

  Fall(vps::bullet::Shape& shape, Partner partner)
      : size(largest_extent(shape.asset().info())), ground({btScalar(10 * size), btScalar(size), btScalar(10 * size)}) {
    scene.world.setGravity({0, btScalar(-9.81), 0});
    // With one friction direction bodies at rest creep.
    scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
    const auto& info = shape.asset().info();
    const auto below =
        btScalar(info.centre_of_mass[1] - info.bounds_min[1]);  // from the centre of mass to the lowest point
    floor = &scene.add(ground, 0, {0, btScalar(-size), 0});
    btVector3 start(0, below + btScalar(0.5), 0);
    if (partner == Partner::itself) {
      fixed = &scene.add(shape, 0, {0, below, 0});
      // Shifted by a fifth of the size, so that it lands on a slope and slides off instead of balancing.
      const auto height = btScalar(info.bounds_max[1] - info.bounds_min[1]);
      start = {btScalar(0.2 * size), height + below + btScalar(0.5), btScalar(0.05 * size)};
    }
    body = &scene.add(shape, 1, start);
  }

  void step() { scene.world.stepSimulation(kStep, 0); }
  [[nodiscard]] bool is_broken() const {
    constexpr btScalar kFastest = 10;  // a fall from 0.5 m reaches 3.1 m/s
    return !(body->getLinearVelocity().length() < kFastest) ||
           body->getWorldTransform().getOrigin().y() < -btScalar(size);
  }
};

// Each step's narrowphase, the least of some plays: a play repeats to the bit, and other programs only add time. Not
// while depths are measured, which would leave nothing of the assets in the caches.
std::vector<double> time_steps(vps::bullet::Shape& shape, Partner partner, int steps) {
  std::vector<double> least(std::max(std::min(steps, kLastTimed) - kFirstTimed + 1, 0),
                            std::numeric_limits<double>::max());
  for (int play = 0; play < kPlays; ++play) {
    Fall fall(shape, partner);
    for (int step = 1; step < kFirstTimed; ++step) fall.step();
    for (double& us : least) {
      fall.step();
      us = std::min(us, fall.scene.dispatcher.last_us);
    }
  }
  return least;
}

Outcome drop(vps::bullet::Shape& shape, Partner partner, int steps, const Recording& recording = {}) {
  Outcome out;
  out.step_us = time_steps(shape, partner, steps);
  Fall fall(shape, partner);
  vps::test::World& scene = fall.scene;
  const btRigidBody* const fixed = fall.fixed;
  btRigidBody& body = *fall.body;

  vps::test::MotionFile motion;
  motion.add("dropped", body, shape, recording.asset);
  if (fixed != nullptr) motion.add("standing", *fixed, shape, recording.asset);
  motion.add("floor", *fall.floor, fall.ground);
  motion.record(0, {});

  const Depth depth(shape, fall.ground, fall.floor->getWorldTransform());
  for (int step = 1; step <= steps; ++step) {
    fall.step();
    if (!recording.file.empty() && step % kStepsPerFrame == 0) motion.record(step * double(kStep), scene.points());
    out.fastest = std::max(out.fastest, double(body.getLinearVelocity().length()));
    if (fall.is_broken()) {
      out.broken = true;
      break;
    }
    out.deepest_ground = std::max(out.deepest_ground, depth.in_ground(body.getWorldTransform()));
    if (fixed != nullptr) {
      out.deepest_other =
          std::max(out.deepest_other, depth.in_other(body.getWorldTransform(), fixed->getWorldTransform()));
    }
  }
  if (!recording.file.empty()) out.recorded = motion.write(recording.file, "Dropped on a copy of itself", 'y');
  out.rest = body.getWorldTransform();
  out.rest_speed = double(body.getLinearVelocity().length());
  out.rest_spin = double(body.getAngularVelocity().length());
  return out;
}

void print(const char* title, Outcome& out, Partner partner, int steps) {
  std::printf("%s\n", title);
  if (!out.step_us.empty()) {
    std::sort(out.step_us.begin(), out.step_us.end());
    std::printf(
        "  collision step      %.1f us median, %.1f us 99 %%, %.1f us max (narrowphase of steps %d to %d, least of %d "
        "plays)\n",
        out.step_us[out.step_us.size() / 2], out.step_us[out.step_us.size() * 99 / 100], out.step_us.back(),
        kFirstTimed, std::min(steps, kLastTimed), kPlays);
  }
  std::printf("  deepest penetration %.3f mm in the box", 1000 * std::max(0.0, out.deepest_ground));
  if (partner == Partner::itself) std::printf(", %.3f mm in the other body", 1000 * std::max(0.0, out.deepest_other));
  const btVector3& at = out.rest.getOrigin();
  std::printf("\n  fastest             %.2f m/s\n", out.fastest);
  std::printf("  after %.1f s         centre of mass at (%.4f, %.4f, %.4f) m, %.2f mm/s, %.3f rad/s\n\n",
              steps * double(kStep), double(at.x()), double(at.y()), double(at.z()), 1000 * out.rest_speed,
              out.rest_spin);
}

int usage() {
  std::fprintf(stderr, "usage: bunny_drop ASSET [--steps N] [--motion FILE.json]\n");
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  int steps = 2000;
  Recording recording;
  if (argc < 2 || argc % 2 != 0) return usage();
  recording.asset = argv[1];
  for (int i = 2; i < argc; i += 2) {
    if (std::strcmp(argv[i], "--steps") == 0 && (steps = std::atoi(argv[i + 1])) > 0) continue;
    if (std::strcmp(argv[i], "--motion") != 0) return usage();
    recording.file = argv[i + 1];
  }
  auto asset = std::make_shared<vps::Asset>();
  const auto begin = Clock::now();
  const vps::Status status = vps::Asset::open(argv[1], *asset);
  const double open_us = microseconds_since(begin);
  if (status != vps::Status::ok) {
    std::fprintf(stderr, "bunny_drop: error: %s: %s\n", argv[1], vps::describe(status));
    return 3;
  }
  if (!asset->has_voxelmap() || !asset->has_pointshell()) {
    std::fprintf(stderr, "bunny_drop: error: %s: %s\n", argv[1], vps::describe(vps::Status::missing_part));
    return 3;
  }
  const vps::AssetInfo& info = asset->info();
  std::printf("%s\n", argv[1]);
  std::printf("  voxels              %u x %u x %u of %g mm, %llu on the surface, %llu inside\n", info.dims[0],
              info.dims[1], info.dims[2], 1000 * info.voxel_size, static_cast<unsigned long long>(info.surface_voxels),
              static_cast<unsigned long long>(info.inner_voxels));
  std::printf("  points              %llu, every surface point within %.3g mm of one\n",
              static_cast<unsigned long long>(info.points), 1000 * info.covering_radius);
  std::printf("  tree                %u levels, K = %u\n", info.levels, info.branching);
  std::printf("  file                %.2f MB, opened and validated in %.0f us\n\n",
              double(asset->directory().file_bytes) / 1e6, open_us);

  vps::bullet::Shape shape(asset);
  Outcome on_box = drop(shape, Partner::box, steps);
  print("dropped from 0.5 m on a box, 1 kg, 200 Hz", on_box, Partner::box, steps);
  Outcome on_itself = drop(shape, Partner::itself, steps, recording);
  print("dropped from 0.5 m on a fixed copy of itself that stands on the box", on_itself, Partner::itself, steps);

  if (!on_itself.recorded) {
    std::fprintf(stderr, "bunny_drop: error: %s: it cannot be written\n", recording.file.c_str());
    return 2;
  }
  for (const Outcome* out : {&on_box, &on_itself}) {
    if (out->broken || out->rest_speed > 0.01 || shape.status() != vps::Status::ok) {
      std::fprintf(stderr, "bunny_drop: error: the body %s\n",
                   out->broken                         ? "fell through or flew off"
                   : shape.status() != vps::Status::ok ? "met a pair without an answer"
                                                       : "did not come to rest");
      return 4;
    }
  }
  return 0;
}
