// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/rows.h"

#include <gtest/gtest.h>

#include "cli/lab/units.h"

namespace vps::test {
namespace {

using lab::Cost;
using RowsFront = lab::Front;
using lab::Row;
using lab::Way;

struct Numbers {
  Way way = Way::query;
  double us = 0;
  double noise = 0;
  double error = 0;
};

Row row(const std::string& name, const Numbers& n) {
  Row out;
  out.name = name;
  out.way = n.way;
  out.contacts = {2, n.us, n.us, n.us, n.noise, n.noise, n.noise};
  out.errors.contact.penetration = {5, 5, n.error, n.error, n.error, n.error};
  return out;
}

const RowsFront& front_of(const std::vector<RowsFront>& fronts, Way way, Cost cost) {
  for (const RowsFront& front : fronts) {
    if (front.way == way && front.cost == cost) return front;
  }
  throw std::out_of_range("front");
}

TEST(Rows, OnlyRowsThatAreAskedInOneWayCompare) {
  const std::vector<Row> rows = {row("ours", {Way::query, 1, 0.1, 1e-3}), row("hull", {Way::bullet, 2, 0.1, 2e-3}),
                                 row("ours in Bullet", {Way::bullet, 9, 0.1, 1e-3})};
  const std::vector<RowsFront> fronts = lab::find_fronts(rows);
  ASSERT_EQ(front_of(fronts, Way::query, Cost::time).members.size(), 1U);
  const RowsFront& bullet = front_of(fronts, Way::bullet, Cost::time);
  ASSERT_EQ(bullet.members.size(), 2U);  // although the bare query is more accurate and faster than both
  EXPECT_EQ(bullet.members[0].row, 1U);
  EXPECT_EQ(bullet.members[1].row, 2U);
}

TEST(Rows, NeighboursWithinTheNoiseOfBothAreTied) {
  const std::vector<Row> rows = {row("a", {Way::query, 1, 0.1, 3e-3}), row("b", {Way::query, 1.15, 0.1, 2e-3}),
                                 row("c", {Way::query, 1.5, 0.1, 1e-3})};
  const std::vector<RowsFront> fronts = lab::find_fronts(rows);
  const RowsFront& front = front_of(fronts, Way::query, Cost::time);
  ASSERT_EQ(front.members.size(), 3U);
  EXPECT_FALSE(front.members[0].tied);
  EXPECT_TRUE(front.members[1].tied);
  EXPECT_FALSE(front.members[2].tied);
}

TEST(Rows, WhatIsNotComparedIsToldWithItsReason) {
  std::vector<Row> rows = {row("fine", {Way::query, 5, 0, 1e-3}),   row("clock", {Way::query, 1, 0, 1e-4}),
                           row("partly", {Way::query, 1, 0, 1e-4}), row("untimed", {Way::query, 1, 0, 1e-4}),
                           row("silent", {Way::query, 1, 0, 1e-4}), row("blind", {Way::query, 1, 0, 1e-4})};
  rows[1].setting.emplace().max_microseconds = 5;
  rows[2].errors.contact.penetration.told = 4;
  rows[3].contacts = {};
  rows[4].errors.contact.penetration.told = 0;
  rows[0].errors.contact.missed = 2;
  rows[5].errors.contact.missed = 3;
  const std::vector<RowsFront> fronts = lab::find_fronts(rows);
  const RowsFront& front = front_of(fronts, Way::query, Cost::time);
  ASSERT_EQ(front.members.size(), 1U);
  EXPECT_EQ(front.members[0].row, 0U);
  ASSERT_EQ(front.left_out.size(), 5U);
  EXPECT_NE(front.left_out[0].why.find("a clock decides"), std::string::npos);
  EXPECT_NE(front.left_out[1].why.find("4 of 5"), std::string::npos);
  EXPECT_EQ(front.left_out[2].why, "not timed");
  EXPECT_EQ(front.left_out[3].why, "tells no depth");
  EXPECT_NE(front.left_out[4].why.find("misses 3 of 5 contacts"), std::string::npos);
}

TEST(Rows, FilesAreComparedBySizeWhereThereIsOne) {
  std::vector<Row> rows = {row("large", {Way::query, 1, 0, 1e-3}), row("small", {Way::query, 9, 0, 2e-3}),
                           row("without", {Way::query, 1, 0, 1e-9})};
  rows[0].bytes = 2000;
  rows[1].bytes = 1000;
  const std::vector<RowsFront> fronts = lab::find_fronts(rows);
  const RowsFront& front = front_of(fronts, Way::query, Cost::bytes);
  ASSERT_EQ(front.members.size(), 2U);
  EXPECT_EQ(front.members[0].row, 1U);
  EXPECT_FALSE(front.members[1].tied);
}

TEST(Rows, WholeStepsAreComparedByTheSlowestSceneOfRowsInBulletThatStayOnTheBox) {
  std::vector<Row> rows = {row("bare", {Way::query, 1, 0, 1e-4}), row("slow", {Way::bullet, 1, 0, 1e-3}),
                           row("fast", {Way::bullet, 9, 0, 2e-3}), row("falls", {Way::bullet, 1, 0, 1e-4}),
                           row("not played", {Way::bullet, 1, 0, 1e-4})};
  const auto played = [](double resting, double flat) {
    lab::SceneTimes steps;
    steps.scenes[std::size_t(lab::Scene::resting)].whole = {1, 1, resting, resting, 0, 0, 0};
    steps.scenes[std::size_t(lab::Scene::flat)].whole = {1, 1, flat, flat, 0, 0, 0};
    return steps;
  };
  rows[1].steps = played(1, 30);
  rows[2].steps = played(20, 10);
  rows[3].steps = played(1, 1);
  rows[3].steps.failure = "falls through a box";
  const std::vector<RowsFront> fronts = lab::find_fronts(rows);
  const RowsFront& front = front_of(fronts, Way::bullet, Cost::step);
  ASSERT_EQ(front.members.size(), 2U);
  EXPECT_EQ(front.members[0].row, 2U);
  EXPECT_EQ(front.members[1].row, 1U);
  ASSERT_EQ(front.left_out.size(), 2U);
  EXPECT_EQ(front.left_out[0].why, "falls through a box");
  EXPECT_EQ(front.left_out[1].why, "not timed");
}

TEST(Units, OfManyLengthsIsThatOfTheMiddleOne) {
  EXPECT_STREQ(lab::unit_for({5e-5, 2e-4, 3e-3}).name, "mm");
  EXPECT_STREQ(lab::unit_for({5e-5, 8e-5, 3e-3}).name, "um");
  EXPECT_STREQ(lab::unit_for({0, 0.0, 15}).name, "m");
  EXPECT_STREQ(lab::unit_for({}).name, "m");
  EXPECT_EQ(lab::unit_for({5e-4}).text(2.5e-4), "0.25 mm");
}

}  // namespace
}  // namespace vps::test
