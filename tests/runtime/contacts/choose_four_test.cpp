// SPDX-License-Identifier: GPL-3.0-or-later
#include "runtime/contacts/choose_four.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "tests/support/random.h"

namespace vps::test {
namespace {

using Vector = Eigen::Vector3d;

// Rows with garbage behind their end.
struct Rows {
  std::vector<float> position[3], penetration;
  std::vector<std::uint32_t> feature;
  detail::ContactRows rows;

  explicit Rows(const std::vector<std::array<float, 4>>& contacts) {
    constexpr float kGarbage = 1e30F;
    const std::size_t room = contacts.size() + detail::kLanePadding;
    penetration.assign(room, kGarbage);
    feature.assign(room, 0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      position[axis].assign(room, kGarbage);
      for (std::size_t i = 0; i < contacts.size(); ++i) position[axis][i] = contacts[i][axis];
      rows.position[axis] = position[axis].data();
    }
    for (std::size_t i = 0; i < contacts.size(); ++i) penetration[i] = contacts[i][3];
    std::iota(feature.begin(), feature.end(), 0U);
    rows.penetration = penetration.data();
    rows.feature = feature.data();
    rows.count = static_cast<std::uint32_t>(contacts.size());
  }
  [[nodiscard]] Vec3 at(std::uint32_t i) const { return {position[0][i], position[1][i], position[2][i]}; }
};

using Chosen = std::array<std::uint32_t, 4>;

std::size_t choose(const std::vector<std::array<float, 4>>& contacts, Chosen& chosen,
                   std::span<const std::uint32_t> previous = {}) {
  const Rows rows(contacts);
  return detail::choose_four(rows.rows, previous, 0, chosen);
}

TEST(ChooseFour, KeepsTheDeepestAndTheCorners) {
  std::vector<std::array<float, 4>> grid;
  for (int i = 0; i < 11; ++i) {
    for (int j = 0; j < 11; ++j) grid.push_back({static_cast<float>(i), static_cast<float>(j), 0, 0});
  }
  grid[3 * 11 + 4][3] = 1;
  Chosen chosen{};
  ASSERT_EQ(choose(grid, chosen), 4U);
  EXPECT_EQ(chosen[0], 3U * 11 + 4);
  for (std::size_t k = 1; k < 4; ++k) {
    const auto [x, y, z, v] = grid[chosen[k]];
    EXPECT_TRUE((x == 0 || x == 10) && (y == 0 || y == 10)) << x << ' ' << y;
  }
}

TEST(ChooseFour, FewOrDegenerateContactsGiveFewerPoints) {
  Chosen chosen{};
  EXPECT_EQ(choose({}, chosen), 0U);
  EXPECT_EQ(choose({{1, 1, 0, 0}}, chosen), 1U);
  EXPECT_EQ(choose({{1, 1, 0, 0}, {1, 1, 0, 0}}, chosen), 1U);
  EXPECT_EQ(choose({{0, 0, 0, 0}, {1, 0, 0, 0}, {2, 0, 0, 0}, {3, 0, 0, 0}}, chosen), 2U);
  EXPECT_EQ(choose({{0, 0, 0, 0}, {1, 0, 0, 0}, {0, 1, 0, 0}}, chosen), 3U);
}

TEST(ChooseFour, AContactOfTheStepBeforeIsKeptWhileItIsNearlyAsGood) {
  const std::vector<std::array<float, 4>> contacts = {{0, 0, 0, 1}, {10, 0, 0, 0}, {10.1F, 0.1F, 0, 0}, {0, 5, 0, 0}};
  Chosen chosen{};
  ASSERT_GE(choose(contacts, chosen), 2U);
  EXPECT_EQ(chosen[1], 2U);
  const std::array<std::uint32_t, 1> previous = {1};
  ASSERT_GE(choose(contacts, chosen, previous), 2U);
  EXPECT_EQ(chosen[1], 1U);
}

TEST(ChooseFour, AContactIsRecognisedByItsFeatureNotByItsPlace) {
  Rows rows({{0, 0, 0, 1}, {10, 0, 0, 0}, {10.1F, 0.1F, 0, 0}, {0, 5, 0, 0}});
  for (std::uint32_t i = 0; i < rows.rows.count; ++i) rows.feature[i] = 100 + i;
  Chosen chosen{};
  const std::array<std::uint32_t, 1> feature = {101};
  ASSERT_GE(detail::choose_four(rows.rows, feature, 0, chosen), 2U);
  EXPECT_EQ(chosen[1], 1U);
  const std::array<std::uint32_t, 1> place = {1};
  ASSERT_GE(detail::choose_four(rows.rows, place, 0, chosen), 2U);
  EXPECT_EQ(chosen[1], 2U);
}

// The rules again, in double and one contact after the other.
class Plain {
 public:
  Plain(const Rows& rows, std::span<const std::uint32_t> previous, double alike)
      : rows_(rows), previous_(previous), alike_(alike) {}
  double depth(std::uint32_t i) const { return rows_.penetration[i] + (is_old(i) ? alike_ : 0); }
  // Of contact `i` after the first `k`.
  double score(std::uint32_t i, const Chosen& chosen, std::size_t k) const {
    const Vector p = at(i), a = at(chosen[0]);
    double s = (p - a).squaredNorm();
    if (k > 1) {
      const Vector b = at(chosen[1]);
      s = (b - a).cross(p - a).norm();
      if (k > 2) {
        const Vector c = at(chosen[2]), n = (b - a).cross(c - a);
        s = std::max({(b - a).cross(a - p).dot(n), (c - b).cross(b - p).dot(n), (a - c).cross(c - p).dot(n)});
      }
    }
    const double v = rows_.penetration[i];
    s *= v >= 0 ? 1 : alike_ * alike_ / (alike_ * alike_ + v * v);
    return s > 0 && is_old(i) ? 1.2 * s : s;
  }

 private:
  Vector at(std::uint32_t i) const {
    const Vec3 p = rows_.at(i);
    return {p.x, p.y, p.z};
  }
  bool is_old(std::uint32_t i) const { return std::find(previous_.begin(), previous_.end(), i) != previous_.end(); }
  const Rows& rows_;
  const std::span<const std::uint32_t> previous_;
  const double alike_;
};

TEST(ChooseFour, FollowsItsRulesAmongAnyNumberOfContactsWithEveryInstructionSet) {
  Random random(5);
  for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    for (std::uint32_t count = 1; count < 90; ++count) {
      std::vector<std::array<float, 4>> contacts(count);
      for (auto& contact : contacts) {
        for (std::size_t axis = 0; axis < 3; ++axis) contact[axis] = static_cast<float>(random.between(-1, 1));
        contact[3] = static_cast<float>(random.between(-0.02, 0.02));
      }
      const Rows rows(contacts);
      const auto any = [&] { return static_cast<std::uint32_t>(random.between(0, count)) % count; };
      const std::array<std::uint32_t, 4> previous = {any(), any(), any(), any()};
      constexpr float kAlike = 0.01F;
      const Plain plain(rows, previous, kAlike);
      Chosen chosen{};
      const std::size_t found = detail::choose_four(rows.rows, previous, kAlike, chosen);
      ASSERT_LE(found, std::min(count, 4U));
      ASSERT_GE(found, std::min(count, 3U));  // a fourth may lie in the triangle of three
      for (std::size_t k = 1; k < found; ++k) {
        ASSERT_EQ(std::count(chosen.begin(), chosen.begin() + k, chosen[k]), 0);
      }
      for (std::uint32_t i = 0; i < count; ++i) {
        ASSERT_LE(plain.depth(i), plain.depth(chosen[0]) + 1e-7);
        for (std::size_t k = 1; k < found; ++k) {
          ASSERT_LE(plain.score(i, chosen, k), plain.score(chosen[k], chosen, k) * (1 + 1e-5)) << count << ' ' << k;
        }
      }
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(ChooseFour, KeepsTheDeeperContactsInTheirOrder) {
  Random random(6);
  for (std::uint32_t count = 0; count < 70; ++count) {
    std::vector<std::array<float, 4>> contacts(count), wanted;
    for (auto& contact : contacts) {
      for (float& number : contact) number = static_cast<float>(random.between(-1, 1));
      if (contact[3] > 0.25F) wanted.push_back(contact);
    }
    Rows rows(contacts);
    detail::keep_deeper(0.25F, rows.rows);
    ASSERT_EQ(rows.rows.count, wanted.size());
    for (std::uint32_t i = 0; i < rows.rows.count; ++i) {
      const Vec3 p = rows.at(i);
      EXPECT_EQ((std::array<float, 4>{p.x, p.y, p.z, rows.penetration[i]}), wanted[i]);
      EXPECT_EQ(contacts[rows.feature[i]], wanted[i]);
    }
  }
}

}  // namespace
}  // namespace vps::test
