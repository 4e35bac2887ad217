// SPDX-License-Identifier: GPL-3.0-or-later
// A ball dropped on a plane. Paper: Sec. 4.1, Fig. 6, Table 1.
#include <algorithm>
#include <cmath>

#include "runtime/bullet/vps_bullet.h"
#include "tests/paper/paper.h"
#include "tests/paper/scene.h"

namespace vps::paper {
namespace {

constexpr double kRestitutions[] = {0.1, 0.5, 0.9};
// Drop heights of the ball's lowest point: 1 m for that point, and 1 m for the centre. The paper's "from a height of 1
// m" may mean either. [m]
constexpr double kDrops[] = {1, 0.5};
constexpr int kSteps = 800;
constexpr SceneOptions kScene{10, 200, kCoarseVoxel};
// Number of drop heights, spread over one step's travel: the depth at the first contact depends on the moment within
// the step at which the ball arrives.
constexpr int kPhases = 20;

struct Bounce {
  std::vector<double> heights;   // of the centre, per step. [m]
  double deepest = 0;            // of the real ball. [m]
  double deepest_point = 0;      // of the pointshell. [m]
  double drift = 0;              // sideways, at the end. [m]
  double rebound = kBallRadius;  // largest height of the centre after the first bounce. [m]
};

std::vector<btVector3> shell_points(const btCollisionShape& shape) {
  std::vector<btVector3> points;
  if (const auto* baked = dynamic_cast<const bullet::Shape*>(&shape)) {
    for (std::uint32_t i = 0; i < baked->pointshell().points; ++i) {
      const Vec3 p = point_position(baked->pointshell(), i);
      points.push_back(btVector3(p.x, p.y, p.z) - baked->centre_of_mass());
    }
  }
  return points;
}

struct BallOptions {
  double restitution = 0;  ///< of the ball; the floor's is 1, and Bullet multiplies the two. [-]
  double drop = 1;         ///< of the ball's lowest point. [m]
};

Bounce bounce(const Side& side, const Floor& floor, const BallOptions& options) {
  Scene scene(floor, side.motion, kScene);
  scene.set_floor_restitution(1);
  btRigidBody& body =
      scene.add(side.body, btTransform(btQuaternion::getIdentity(), {0, btScalar(options.drop + kBallRadius), 0}));
  body.setRestitution(btScalar(options.restitution));
  const std::vector<btVector3> points = shell_points(*side.body.shape);
  Bounce out;
  bool risen = false;
  for (int step = 0; step < kSteps; ++step) {
    scene.step();
    const btTransform& at = body.getWorldTransform();
    const auto height = double(at.getOrigin().y());
    out.heights.push_back(height);
    out.deepest = std::max(out.deepest, kBallRadius - height);
    risen = risen || body.getLinearVelocity().y() > 0;
    if (risen) out.rebound = std::max(out.rebound, height);
    if (height > 1.1 * kBallRadius) continue;  // no point can be below the floor
    const btVector3 up = at.getBasis().getRow(1);
    for (const btVector3& p : points) out.deepest_point = std::max(out.deepest_point, -double(up.dot(p)) - height);
  }
  const btVector3 end = body.getWorldTransform().getOrigin();
  out.drift = std::hypot(double(end.x()), double(end.z()));
  return out;
}

std::vector<Side> ball_sides(const Balls& balls, const Floor& floor) {
  std::vector<Side> sides{ours("ours, low", balls.low), ours("ours, high", balls.high)};
  for (const Side& side : {sides[0], sides[1]}) sides.push_back(advanced(side));
  // Bullet's sphere has no points for contacts with a voxelmap.
  if (floor.name != "baked") {
    sides.insert(sides.begin(), {"Bullet", {{}, std::make_shared<btSphereShape>(btScalar(kBallRadius))}});
  }
  return sides;
}

nlohmann::json measure(const Side& side, const Floor& floor, double drop, double restitution) {
  const Bounce bounced = bounce(side, floor, {restitution, drop});
  const double travel = std::sqrt(2 * kScene.gravity * drop) / kScene.rate;
  std::vector<double> deepest;
  std::vector<double> rebound_errors;
  for (int phase = 0; phase < kPhases; ++phase) {
    const double height = drop + travel * phase / kPhases;
    const Bounce one = bounce(side, floor, {restitution, height});
    deepest.push_back(one.deepest);
    rebound_errors.push_back(one.rebound - (kBallRadius + restitution * restitution * height));
  }
  return {{"floor", floor.name},
          {"side", side.name},
          {"drop", drop},
          {"restitution", restitution},
          {"deepest", bounced.deepest},
          {"deepest_point", bounced.deepest_point},
          {"drift", bounced.drift},
          {"deepest_of_phases", deepest},
          {"rebound_errors", rebound_errors},
          {"heights", bounced.heights}};
}

}  // namespace

nlohmann::json run_ball(const Balls& balls, const std::vector<Floor>& floors) {
  nlohmann::json runs = nlohmann::json::array();
  for (const Floor& floor : floors) {
    for (const Side& side : ball_sides(balls, floor)) {
      for (const double drop : kDrops) {
        for (const double restitution : kRestitutions) runs.push_back(measure(side, floor, drop, restitution));
      }
    }
  }
  return {{"runs", runs},
          {"rate", kScene.rate},
          {"phases", kPhases},
          {"points", {balls.low.asset->info().points, balls.high.asset->info().points}},
          {"covering_radius", {balls.low.asset->info().covering_radius, balls.high.asset->info().covering_radius}}};
}

}  // namespace vps::paper
