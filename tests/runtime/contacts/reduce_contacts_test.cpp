// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "runtime/vps_contacts.h"
#include "tests/runtime/pair.h"

namespace vps::test {
namespace {

std::array<double, 6> wrench_of(std::span<const Contact> contacts, Vec3 centre) {
  Twist twist;
  twist.centre = centre;
  Wrench w;
  EXPECT_EQ(penalty_wrench(contacts, {1, 0}, twist, w), Status::ok);
  return {w.force[0], w.force[1], w.force[2], w.torque[0], w.torque[1], w.torque[2]};
}
double distance(const std::array<double, 6>& a, const std::array<double, 6>& b, std::size_t from) {
  return std::hypot(a[from] - b[from], a[from + 1] - b[from + 1], a[from + 2] - b[from + 2]);
}

TEST(ReduceContacts, FewContactsKeepTheForceAndTorqueOfAll) {
  Pair s;
  Random random;
  ReductionScratch scratch;
  int reduced = 0;
  int exact = 0;
  for (int n = 0; n < 200; ++n) {
    QueryOptions options;
    options.contact_distance = 0.0005F;
    QueryResult found;
    ASSERT_EQ(traverse(s.shell, s.map, random_pose(random, 0.12), options, s.scratch, s.contacts, found), Status::ok);
    const std::span<const Contact> all = std::span(s.contacts).first(found.contacts);
    for (const std::size_t wished : {1U, 4U, 8U, 16U}) {
      std::vector<Contact> kept(wished);
      const Vec3 centre{0.01F, 0.02F, 0.03F};
      Reduction result;
      ASSERT_EQ(reduce_contacts(all, centre, kept, scratch, result), Status::ok);
      ASSERT_EQ(result.kept, std::min(wished, all.size()));
      if (all.empty()) continue;
      const std::span<const Contact> few = std::span(kept).first(result.kept);
      for (const Contact& c : few) {
        ASSERT_GE(c.area, 0);
        const auto same = std::find_if(all.begin(), all.end(), [&](const Contact& a) { return a.point == c.point; });
        ASSERT_NE(same, all.end());
        ASSERT_EQ(c.penetration, same->penetration);
        ASSERT_EQ(c.node, same->node);
      }
      ASSERT_EQ(few[0].penetration, static_cast<float>(found.delta)) << "the deepest first";
      // The residual is relative to the sums of the lengths, as documented.
      double force = 0;
      double torque = 0;
      for (const Contact& c : all) {
        const auto w = wrench_of({&c, 1}, centre);
        force += distance(w, {}, 0);
        torque += distance(w, {}, 3);
      }
      if (force == 0) continue;
      const auto before = wrench_of(all, centre);
      const auto after = wrench_of(few, centre);
      ASSERT_NEAR(distance(before, after, 0), result.force_residual * force, 1e-5 * force);
      ASSERT_NEAR(distance(before, after, 3), result.torque_residual * torque, 1e-5 * torque);
      if (wished >= 8 && all.size() > wished) {
        ++reduced;
        exact += result.force_residual < 1e-3 && result.torque_residual < 1e-3;
        ASSERT_LT(result.force_residual, 0.1);
        ASSERT_LT(result.torque_residual, 0.1);
      }
    }
  }
  // Most reductions are exact, even on the curved patches between a sphere and a torus.
  EXPECT_GT(reduced, 100);
  EXPECT_GT(exact, 0.9 * reduced) << exact << " of " << reduced;
}

std::vector<Contact> plate(int edge) {
  std::vector<Contact> all;
  for (int i = 0; i < edge; ++i) {
    for (int k = 0; k < edge; ++k) {
      Contact c;
      c.position = {0.01F * static_cast<float>(i), 0.01F * static_cast<float>(k), 0};
      c.inward_normal = {0, 0, 1};
      c.penetration = 0.001F + 0.0001F * static_cast<float>(i);
      c.area = 1e-4F;
      c.point = static_cast<std::uint32_t>(all.size());
      all.push_back(c);
    }
  }
  return all;
}

TEST(ReduceContacts, ThreeCarryATiltedPlate) {
  const std::vector<Contact> all = plate(20);
  for (const std::size_t wished : {3U, 4U, 6U}) {
    std::vector<Contact> kept(wished);
    ReductionScratch scratch;
    Reduction result;
    ASSERT_EQ(reduce_contacts(all, {}, kept, scratch, result), Status::ok);
    EXPECT_LT(result.force_residual, 1e-5) << wished;
    EXPECT_LT(result.torque_residual, 1e-5) << wished;
  }
}

TEST(ReduceContacts, AllThatFitAreKeptAsTheyAre) {
  const std::vector<Contact> all = plate(3);
  std::vector<Contact> kept(20);
  ReductionScratch scratch;
  Reduction result;
  ASSERT_EQ(reduce_contacts(all, {}, kept, scratch, result), Status::ok);
  ASSERT_EQ(result.kept, 9U);
  for (std::uint32_t i = 0; i < result.kept; ++i) EXPECT_FLOAT_EQ(kept[i].area, 1e-4F);
}

TEST(ReduceContacts, TheSameContactsGiveTheSameBits) {
  const std::vector<Contact> all = plate(12);
  std::vector<Contact> first(5);
  std::vector<Contact> second(5);
  ReductionScratch scratch;
  Reduction result;
  ASSERT_EQ(reduce_contacts(all, {}, first, scratch, result), Status::ok);
  ASSERT_EQ(reduce_contacts(plate(30), {}, second, scratch, result), Status::ok);
  ASSERT_EQ(reduce_contacts(all, {}, second, scratch, result), Status::ok);
  EXPECT_EQ(std::memcmp(first.data(), second.data(), sizeof(Contact) * first.size()), 0);
}

TEST(ReduceContacts, ContactsWithoutDepthKeepTheirAreas) {
  std::vector<Contact> all = plate(10);
  for (Contact& c : all) c.penetration -= 0.01F;
  std::vector<Contact> kept(4);
  ReductionScratch scratch;
  Reduction result;
  ASSERT_EQ(reduce_contacts(all, {}, kept, scratch, result), Status::ok);
  ASSERT_EQ(result.kept, 4U);
  double area = 0;
  for (const Contact& c : kept) area += c.area;
  EXPECT_NEAR(area, 0.01, 1e-6);
  EXPECT_EQ(result.force_residual, 0);
}

TEST(ReduceContacts, BadUseGetsAStatusAndNonsenseAnEnd) {
  std::vector<Contact> all = plate(4);
  std::vector<Contact> kept(3);
  ReductionScratch scratch;
  Reduction result;
  EXPECT_EQ(reduce_contacts(all, {}, {}, scratch, result), Status::bad_argument);
  EXPECT_EQ(reduce_contacts(all, {0, std::nanf(""), 0}, kept, scratch, result), Status::bad_argument);
  EXPECT_EQ(reduce_contacts({}, {}, kept, scratch, result), Status::ok);
  EXPECT_EQ(result.kept, 0U);
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity(), -1.0F, 0.0F}) {
    std::vector<Contact> odd = all;
    odd[5].penetration = bad;
    EXPECT_EQ(reduce_contacts(odd, {}, kept, scratch, result), Status::ok);
    odd = all;
    odd[5].area = bad;
    EXPECT_EQ(reduce_contacts(odd, {}, kept, scratch, result), Status::ok);
    odd = all;
    odd[5].position.x = bad;
    EXPECT_EQ(reduce_contacts(odd, {}, kept, scratch, result), Status::ok);
    EXPECT_LE(result.kept, 3U);
  }
}

}  // namespace
}  // namespace vps::test
