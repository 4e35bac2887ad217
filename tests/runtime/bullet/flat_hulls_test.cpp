// SPDX-License-Identifier: GPL-3.0-or-later
// A face on the face of a convex hull costs its corners. Hulls are rounded by their margin, which their planes do not
// know.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "runtime/fields/penetration.h"
#include "tests/runtime/bullet/found_contacts.h"
#include "tests/runtime/bullet/world.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

constexpr double kHalfPlate = 0.008;  // of the thickness. [m]
constexpr float kRounding = 1e-6F;    // of V at a distance of kRounded. [m]
constexpr float kRounded = 0.04F;     // Bullet's default. [m]

// A hull that is a rounded box, and its exact V.
struct RoundedBox {
  BoxField core;
  btConvexHullShape hull;

  explicit RoundedBox(Vec3 half) : core{half} {
    for (int i = 0; i < 8; ++i) {
      hull.addPoint(
          {btScalar(i & 1 ? half.x : -half.x), btScalar(i & 2 ? half.y : -half.y), btScalar(i & 4 ? half.z : -half.z)});
    }
    hull.setMargin(btScalar(kRounded));
  }
  [[nodiscard]] float v(Vec3 p) const { return penetration(core, p) + kRounded; }
};

float support(const std::vector<Vec3>& places, Vec3 along) {
  float most = -1e9F;
  for (const Vec3& p : places) most = std::max(most, detail::dot(p, along));
  return most;
}

TEST(FlatHulls, CornersHaveTheDepthAndTheExtentOfAllPointsInContact) {
  const bullet::Shape plate(baked_at(make_box({0.06, 0.05, kHalfPlate}), 0.001));
  const PointshellView& shell = plate.pointshell();
  ASSERT_NE(shell.hull_offsets, nullptr);
  const float bent = 4 * static_cast<float>(kHullTolerance) * shell.covering_radius;
  const float off = bent / 2 + 3 * shell.position_step;
  btCollisionObject object;
  const bullet::PairBody body(&plate, &object, btTransform::getIdentity());
  const float touching = bullet::in_step({body, body}).touching();
  Random random;
  // The second one ends below the plate.
  const std::pair<RoundedBox, double> grounds[] = {{RoundedBox({0.2F, 0.2F, 0.05F}), 0},
                                                   {RoundedBox({0.2F, 0.2F, 0.05F}), -0.19}};
  for (const auto& [ground, shift] : grounds) {
    std::size_t few = 0;
    std::size_t all = 0;
    for (int n = 0; n < 600; ++n) {
      constexpr double kTilts[] = {0, 1e-5, 1e-4, 1e-3, 1e-2, 0.1};
      const double axis = random.between(0, 6.3);
      btTransform at(btQuaternion({btScalar(std::cos(axis)), btScalar(std::sin(axis)), 0}, btScalar(kTilts[n % 6])) *
                     btQuaternion({0, 0, 1}, btScalar(random.between(0, 6.3))));
      const double depth = random.between(-2, n % 2 == 0 ? 3 : 60) * double{touching};
      at.setOrigin({btScalar(random.between(-0.01, 0.01) - shift), btScalar(random.between(-0.01, 0.01)),
                    btScalar(0.05 + double{kRounded} + kHalfPlate - depth)});
      const bullet::Pair pair{bullet::PairBody(&plate, &object, at),
                              bullet::PairBody(&ground.hull, &object, btTransform::getIdentity())};
      QueryOptions options;
      options.contact_distance = touching;
      PairSearch search;
      ASSERT_EQ(search.find(pair, options), Status::ok);
      const detail::FoundContacts& found = search.found;
      const detail::Transform to_hull(bullet::to_pose(at, plate.asset_frame()));
      std::map<std::uint32_t, float> by_point;
      std::vector<Vec3> everywhere;
      float deepest = -1;
      for (std::uint32_t point = 0; point < shell.points; ++point) {
        const Vec3 p = to_hull.apply(point_position(shell, point));
        const float v = ground.v(p);
        by_point[point] = v;
        if (v < -touching + kRounding) continue;
        everywhere.push_back(p);
        deepest = std::max(deepest, v);
      }
      few += found.hits.count;
      all += everywhere.size();
      std::vector<Vec3> places;
      float deepest_hit = -1;
      for (std::uint32_t i = 0; i < found.hits.count; ++i) {
        ASSERT_NEAR(found.hits.penetration[i], by_point[found.hits.feature[i]], kRounding) << n;
        deepest_hit = std::max(deepest_hit, found.hits.penetration[i]);
        places.push_back({found.hits.position[0][i], found.hits.position[1][i], found.hits.position[2][i]});
      }
      if (everywhere.empty()) continue;
      ASSERT_GE(deepest_hit, deepest - bent) << n;
      for (int k = 0; k < 30; ++k) {
        const double angle = k * 0.21;
        const Vec3 along{static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0};
        ASSERT_GE(support(places, along), support(everywhere, along) - off) << n;
      }
    }
    EXPECT_GT(few, 1000U);
    EXPECT_LT(2 * few, all) << shift;
  }
}

}  // namespace
}  // namespace vps::test
