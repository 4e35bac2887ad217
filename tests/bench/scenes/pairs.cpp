// SPDX-License-Identifier: GPL-3.0-or-later
// Bunny on bunny through Bullet in fresh poses: no contact is kept from one to the next.
#include "cli/lab/poses.h"
#include "tests/bench/scenes/scenes.h"

namespace vps::bench {

std::vector<Scene> pair_scenes(Bodies& bodies) {
  const std::size_t count = bodies.options().length == Length::quick ? 40 : 400;
  Scene scene;
  scene.name = "bunny on bunny";
  scene.phases = {{"fresh poses", 0, count}};
  scene.sides = [&bodies, count] {
    lab::PoseOptions options;
    options.ranges[0].count = count;
    const auto poses = std::make_shared<std::vector<lab::PairPose>>(
        lab::pair_poses(bodies.bunny_mesh(), options, bodies.options().work));
    std::vector<Side> sides;
    for (const BodySide& side : bodies.get("bunny").sides) {
      lab::BulletShape shape = side.part->hulls;
      if (side.kind == Kind::baked) shape = {{}, {side.part, side.part->baked.get()}};
      const std::shared_ptr<lab::PairPeer> pair = lab::bullet_pair(shape);
      sides.push_back({side.name, side.kind, bodies.get("bunny").voxel, [=](int, Quality*) {
                         std::vector<double> us;
                         for (const lab::PairPose& pose : *poses)
                           us.push_back(pair->query(pose.first_in_second).microseconds);
                         return us;
                       }});
    }
    return sides;
  };
  return {scene};
}

}  // namespace vps::bench
