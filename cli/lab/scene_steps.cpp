// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/scene_steps.h"

#include <algorithm>
#include <cmath>

#include "cli/lab/random.h"
#include "cli/lab/stress/rest_poses.h"
#include "cli/lab/stress/world.h"

namespace vps::lab {
namespace {

constexpr double kRate = 240;     // [Hz]
constexpr int kTimed = 120;       // steps of a run: enough for a 99th percentile
constexpr int kSettle = 240;      // steps before a body lies at rest
constexpr int kMostSteps = 1000;  // of a run
constexpr double kHighest = 1;    // of a fall. [m]

// One start of the body.
struct Run {
  Scene scene;
  btMatrix3x3 rotation;
  double height = 0;  // of the lowest corner. [m]
  double speed = 0;   // sideways. [m/s]
  int settle = 0;     // steps that are not timed
};

// Times of the steps in one round, by scene. [us]
struct Steps {
  std::array<std::vector<double>, kScenes.size()> whole, narrowphase;
  std::string failure;
};

class Stage {
 public:
  explicit Stage(const SceneOptions& options) : options_(options) {
    btVector3 low = options.corners.at(0);
    btVector3 high = low;
    for (const btVector3& corner : options.corners) {
      low.setMin(corner);
      high.setMax(corner);
    }
    size_ = double((high - low)[(high - low).maxAxis()]);
    speed_ = std::sqrt(stress::kGravity * size_) / 2;
    const double wide = 10 * size_ + speed_ * kMostSteps / kRate;  // it does not roll off
    box_.shape = std::make_shared<btBoxShape>(btVector3(btScalar(wide), btScalar(wide), btScalar(size_)));
    plan();
  }

  [[nodiscard]] Steps play(const BulletShape& shape) const {
    Steps out;
    for (const Run& run : runs_) {
      out.failure = play(run, shape, out);
      if (!out.failure.empty()) break;
    }
    return out;
  }

 private:
  void plan() {
    Random random(options_.seed);
    for (int i = 0; i < options_.rotations; ++i) {
      const std::array<double, 9> r = random.rotation();
      const btMatrix3x3 rotation{btScalar(r[0]), btScalar(r[1]), btScalar(r[2]), btScalar(r[3]), btScalar(r[4]),
                                 btScalar(r[5]), btScalar(r[6]), btScalar(r[7]), btScalar(r[8])};
      runs_.push_back({Scene::landing, rotation, std::min(size_ / 4, kHighest), speed_, 0});
      runs_.push_back({Scene::resting, rotation, 0, 0, kSettle});
    }
    const auto rest = stress::rest_poses(options_.corners, 0.1 * options_.voxel, 1);
    constexpr double kFlat = 0.1;  // radius of a flat side over the body's length
    if (!rest.empty() && rest[0].flat > kFlat * size_) runs_.push_back({Scene::flat, rest[0].rotation, 0, 0, kSettle});
  }

  // @return why the run does not count; empty when it does
  std::string play(const Run& run, const BulletShape& shape, Steps& out) const {
    stress::Subject subject;
    subject.voxel = options_.voxel;
    stress::Arena arena(subject, {});
    arena.add(box_, 0, btTransform(btMatrix3x3::getIdentity(), {0, 0, -btScalar(size_)}));
    btTransform at(run.rotation);
    at.getOrigin().setZ(btScalar(run.height - stress::lowest(at, options_.corners)));
    btRigidBody& body = arena.add(shape, 1, at);
    body.setLinearVelocity({btScalar(run.speed), 0, 0});
    int timed = 0;
    for (int step = 0; step < kMostSteps && timed < kTimed; ++step) {
      const auto begin = Clock::now();
      if (!arena.step(1 / kRate)) return arena.failure();
      const double whole = microseconds_since(begin);
      const bool begun = timed > 0 || arena.dispatcher().for_each_contact([](const auto&...) {}) > 0;
      if (step < run.settle || !begun) continue;
      out.whole[std::size_t(run.scene)].push_back(whole);
      out.narrowphase[std::size_t(run.scene)].push_back(arena.dispatcher().last_us);
      ++timed;
    }
    constexpr double kThrough = 0.1;
    const bool through = stress::lowest(body, options_.corners) < -kThrough * size_;
    return timed < kTimed || through ? "falls through a box" : "";
  }

  const SceneOptions& options_;
  double size_ = 0;   // longest side of the body. [m]
  double speed_ = 0;  // of a throw. [m/s]
  BulletShape box_;
  std::vector<Run> runs_;
};

void keep_shorter(Steps& steps, const Steps& again) {
  for (std::size_t scene = 0; scene < kScenes.size(); ++scene) {
    for (std::size_t i = 0; i < steps.whole[scene].size(); ++i) {
      steps.whole[scene][i] = std::min(steps.whole[scene][i], again.whole[scene][i]);
      steps.narrowphase[scene][i] = std::min(steps.narrowphase[scene][i], again.narrowphase[scene][i]);
    }
  }
}

SceneTimes scene_times(const std::vector<Steps>& rounds) {
  SceneTimes out;
  if (rounds.empty()) return out;
  out.failure = rounds[0].failure;
  if (!out.failure.empty()) return out;
  for (std::size_t scene = 0; scene < kScenes.size(); ++scene) {
    std::vector<std::vector<double>> whole;
    std::vector<std::vector<double>> narrowphase;
    for (const Steps& round : rounds) {
      whole.push_back(round.whole[scene]);
      narrowphase.push_back(round.narrowphase[scene]);
    }
    out.scenes[scene] = {times_of(whole), times_of(narrowphase)};
  }
  return out;
}

}  // namespace

const char* describe(Scene scene) {
  constexpr std::array kNames = {"landing", "resting", "flat"};
  return kNames[std::size_t(scene)];
}

const Times& SceneTimes::dearest() const {
  const auto p99 = [](const StepTimes& scene) { return scene.whole.rounds > 0 ? scene.whole.p99 : 0; };
  return std::max_element(scenes.begin(), scenes.end(),
                          [&](const StepTimes& a, const StepTimes& b) { return p99(a) < p99(b); })
      ->whole;
}

std::vector<SceneTimes> play_in_turn(std::span<const Player> players, const SceneOptions& options) {
  constexpr double kSlow = 1e6;  // [us]
  const Stage stage(options);
  std::vector<std::vector<Steps>> rounds(players.size());
  std::vector<bool> done(players.size());
  for (int round = 0; round < options.rounds; ++round) {
    for (std::size_t i = 0; i < players.size(); ++i) {
      if (!players[i].make || done[i]) continue;
      if (options.progress) {
        options.progress(players[i].name,
                         (double(round) + double(i) / double(players.size())) / double(options.rounds));
      }
      const BulletShape shape = players[i].make();
      const auto begin = Clock::now();
      Steps steps = stage.play(shape);
      done[i] = microseconds_since(begin) > kSlow || !steps.failure.empty();
      if (!done[i]) keep_shorter(steps, stage.play(shape));
      rounds[i].push_back(std::move(steps));
    }
  }
  std::vector<SceneTimes> out;
  for (const auto& of_player : rounds) out.push_back(scene_times(of_player));
  return out;
}

}  // namespace vps::lab
