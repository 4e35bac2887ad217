// SPDX-License-Identifier: GPL-3.0-or-later
#include "runtime/contacts/traverse/fill_contacts.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <vector>

#include "runtime/fields/penetration.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

// Also the last points of the rows, and normals on both sides of the octahedron.
TEST(FillContacts, GivesThePointsOfTheShellToTheBitForEachInstructionSet) {
  const auto asset = baked(make_torus(0.03, 0.012, 40, 24), all_fields(0.002));
  PointshellView shell;
  ASSERT_EQ(asset->pointshell(shell), Status::ok);
  for (std::int64_t target = 1; target > 0; target <<= 1) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    hwy::SetSupportedTargetsForTest(target);
    Random random;
    for (std::uint32_t count = 0; count <= 40; ++count) {
      const detail::Transform transform(random_pose(random, 0.1));
      std::vector<std::uint32_t> points(count + 1, shell.points - 1);
      std::vector<std::uint32_t> leaves(count + 1, 7);
      std::vector<float> penetrations(count + detail::kLanePadding);
      for (std::uint32_t i = 0; i < count; ++i) {
        if (i > 0) points[i] = static_cast<std::uint32_t>(random.between(0, shell.points - 1));
        leaves[i] = i + 3;
        penetrations[i] = static_cast<float>(random.between(-1, 1));
      }
      std::vector<Contact> contacts(count + 1);
      contacts[count].point = 12345;
      detail::fill_contacts(shell, transform, {points.data(), leaves.data(), penetrations.data(), 0.002F}, count,
                            contacts.data());
      for (std::uint32_t i = 0; i < count; ++i) {
        const Contact& contact = contacts[i];
        const Vec3 position = transform.apply(point_position(shell, points[i]));
        const Vec3 normal = transform.rotate(point_inward_normal(shell, points[i]));
        ASSERT_EQ(contact.position.x, position.x) << i;
        ASSERT_EQ(contact.position.y, position.y) << i;
        ASSERT_EQ(contact.position.z, position.z) << i;
        ASSERT_EQ(contact.inward_normal.x, normal.x) << i;
        ASSERT_EQ(contact.inward_normal.y, normal.y) << i;
        ASSERT_EQ(contact.inward_normal.z, normal.z) << i;
        ASSERT_EQ(contact.penetration, 0.002F * penetrations[i]);
        ASSERT_EQ(contact.area, point_area(shell, points[i]));
        ASSERT_EQ(contact.point, points[i]);
        ASSERT_EQ(contact.node, leaves[i]);
      }
      ASSERT_EQ(contacts[count].point, 12345U);
    }
    hwy::SetSupportedTargetsForTest(0);
  }
}

}  // namespace
}  // namespace vps::test
