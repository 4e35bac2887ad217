// SPDX-License-Identifier: GPL-3.0-or-later
#include "runtime/contacts/side_contacts.h"

#include <gtest/gtest.h>

#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

// What is apart and stands still is asked for its distance once, and not for contacts in each step.
TEST(SideContacts, APairThatStandsStillLearnsHowFarApartItIs) {
  bake::BakeOptions options;
  options.voxel_size = 0.001;
  const auto ball = baked(make_sphere(0.02, 5), options);
  PointshellView shell;
  VoxelmapView map;
  ASSERT_EQ(ball->pointshell(shell), Status::ok);
  ASSERT_EQ(ball->voxelmap(map), Status::ok);
  const double gap = 0.0008;
  const StepMotion still;
  const detail::StepPair pair{
      shell,  map,   pose_at(0, 0, 0.04 + gap), pose_at(0, 0, 0), 0.001, 0.001, 0, StepUse::constraints, 0,
      &still, &still};
  const detail::Partner partner{map};
  detail::SideQuery query;
  query.distance = detail::touching_distance(0.001);
  detail::PairMemory memory;
  detail::Workspace space;
  detail::SideContacts found;
  for (int step = 0; step < 2; ++step) {
    ASSERT_EQ(detail::contacts_of_side(pair, partner, query, memory, space, found), Status::ok);
    EXPECT_TRUE(found.contacts.empty());
  }
  EXPECT_GT(memory.known_distance(pair), 0.9 * gap);
  EXPECT_LT(memory.known_distance(pair), 1.1 * gap);
}

}  // namespace
}  // namespace vps::test
