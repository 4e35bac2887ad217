// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cli/lab/fcl.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

using lab::GroundTruth;
using lab::PairAnswer;
using lab::PoseKind;

constexpr double kBallRadius = 0.05;

// A ball on a ball: depth, direction and position are known up to the facets.
GroundTruth ball_on_ball(const TemporaryFolder& folder) {
  const TriangleMesh ball = make_sphere(kBallRadius, 4);
  lab::TruthOptions options = lab::truth_options_for(ball, 9);
  return lab::find_truth(ball, options, lab::Wrenches::exact, folder.path());
}

std::vector<PairAnswer> right_answers(const GroundTruth& truth) {
  std::vector<PairAnswer> answers;
  for (const lab::TruePose& p : truth.poses) {
    PairAnswer& a = answers.emplace_back();
    a.depth = p.pose.depth;
    a.contacts = p.pose.depth < 0 ? 0 : 1;
    a.force = p.wrench.force;
    a.torque = p.wrench.torque;
    a.lower = a.depth - 1e-6;
    a.upper = a.depth + 1e-6;
    // The deepest point lies on the line between the centres; the direction is along it.
    const double* const t = p.pose.first_in_second.translation;
    const double apart = std::hypot(t[0], t[1], t[2]);
    for (std::size_t i = 0; i < 3; ++i) {
      a.direction[i] = t[i] / apart;
      a.position[i] = t[i] - a.direction[i] * kBallRadius;
    }
  }
  return answers;
}

TEST(Errors, OfForcesAreNotToldWhereTheExactOnesAreNotExact) {
  const TemporaryFolder folder;
  GroundTruth truth = ball_on_ball(folder);
  ASSERT_TRUE(truth.wrenches_exact());
  truth.wrench_error = 2 * truth.options.wrench.tolerance;
  const lab::Errors errors = lab::contact_errors(truth, right_answers(truth), 2 * kBallRadius);
  for (const lab::ContactErrors& e : {errors.contact, errors.deep}) {
    EXPECT_EQ(e.penetration.told, 3U);
    EXPECT_EQ(e.force.told + e.force_direction.told + e.torque.told, 0U);
  }
}

TEST(Errors, OfRightAnswersAreNone) {
  const TemporaryFolder folder;
  const GroundTruth truth = ball_on_ball(folder);
  const std::vector<PairAnswer> answers = right_answers(truth);
  const lab::Errors errors = lab::contact_errors(truth, answers, 2 * kBallRadius);
  for (const lab::ContactErrors& e : {errors.contact, errors.deep}) {
    EXPECT_EQ(e.penetration.told, 3U);
    EXPECT_EQ(e.penetration.max, 0);
    EXPECT_EQ(e.force.max, 0);
    EXPECT_EQ(e.torque.max, 0);
    EXPECT_LT(e.force_direction.max, 1e-6);
    EXPECT_LT(e.normal.max, 4);  // facets
  }
  EXPECT_EQ(lab::distance_errors(truth, answers).max, 0);
  EXPECT_EQ(lab::bounds_held(truth, answers).held, 9U);
}

TEST(Errors, AreWhatAnswersAreOff) {
  const TemporaryFolder folder;
  const GroundTruth truth = ball_on_ball(folder);
  std::vector<PairAnswer> answers = right_answers(truth);
  for (PairAnswer& a : answers) {
    a.depth += 0.001;
    for (double& f : a.force) f *= -1;
    a.upper = a.depth - 0.0015;
  }
  answers.back().depth = lab::kNotTold;
  const lab::Errors errors = lab::contact_errors(truth, answers, 2 * kBallRadius);
  EXPECT_NEAR(errors.contact.penetration.rms, 0.001, 1e-12);
  EXPECT_NEAR(errors.contact.force_direction.p50, 180, 1e-6);
  EXPECT_NEAR(errors.contact.force.rms, 200, 1e-6);  // the RMS of twice the force over the RMS of the force
  EXPECT_EQ(errors.deep.penetration.asked, 3U);
  EXPECT_EQ(errors.deep.penetration.told, 2U);
  EXPECT_EQ(lab::bounds_held(truth, answers).held, 0U);
  for (PairAnswer& a : answers) {
    a.upper = 1;
    a.lower = 0.1;
  }
  EXPECT_EQ(lab::bounds_held(truth, answers).held, 0U);
}

TEST(Errors, AMissedContactCountsWithItsWholeDepthAndIsCounted) {
  const TemporaryFolder folder;
  const GroundTruth truth = ball_on_ball(folder);
  std::vector<PairAnswer> answers = right_answers(truth);
  std::vector<double> depths;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    if (truth.poses[i].range != PoseKind::contact) continue;
    depths.push_back(truth.poses[i].pose.depth);
    answers[i].contacts = 0;
    answers[i].depth = lab::kNotTold;
  }
  const lab::ContactErrors missed = lab::contact_errors(truth, answers, 2 * kBallRadius).contact;
  EXPECT_EQ(missed.missed, 3U);
  EXPECT_EQ(missed.penetration.told, 3U);
  EXPECT_EQ(missed.penetration.rms, lab::spread_of(depths).rms);
  // If an answer states a distance apart, that distance adds to the error.
  for (PairAnswer& a : answers) a.depth = a.contacts == 0 ? -0.001 : a.depth;
  const lab::ContactErrors apart = lab::contact_errors(truth, answers, 2 * kBallRadius).contact;
  EXPECT_EQ(apart.missed, 3U);
  EXPECT_NEAR(apart.penetration.max, missed.penetration.max + 0.001, 1e-12);
  // A contact without a depth is not missed, and its depth is not counted.
  for (PairAnswer& a : answers) {
    a.contacts = 2;
    a.depth = lab::kNotTold;
  }
  const lab::ContactErrors untold = lab::contact_errors(truth, answers, 2 * kBallRadius).contact;
  EXPECT_EQ(untold.missed, 0U);
  EXPECT_EQ(untold.penetration.told, 0U);
}

TEST(Errors, PosesWhoseDepthTakesTooLongAreLeftOutTheSameEveryTime) {
  const TemporaryFolder folder;
  const TemporaryFolder other;
  const TriangleMesh ball = make_sphere(kBallRadius, 4);
  lab::TruthOptions options = lab::truth_options_for(ball, 30);
  const GroundTruth all = lab::find_truth(ball, options, lab::Wrenches::none, folder.path());
  EXPECT_EQ(all.poses.size(), 30U);
  options.most_work = 12000;
  const GroundTruth some = lab::find_truth(ball, options, lab::Wrenches::none, folder.path());
  EXPECT_LT(some.poses.size(), 30U);
  EXPECT_EQ(some.poses.size(), some.found[0] + some.found[1] + some.found[2]);
  for (const auto& where : {other.path(), folder.path(), std::filesystem::path()}) {  // computed, read, computed
    const GroundTruth again = lab::find_truth(ball, options, lab::Wrenches::none, where);
    ASSERT_EQ(again.poses.size(), some.poses.size());
    for (std::size_t i = 0; i < some.poses.size(); ++i) {
      EXPECT_EQ(again.poses[i].range, some.poses[i].range);
      EXPECT_EQ(again.poses[i].pose.depth, some.poses[i].pose.depth);
    }
  }
  options.most_work = 1;
  EXPECT_THROW((void)lab::find_truth(ball, options, lab::Wrenches::none, {}), lab::MeasureError);
}

TEST(Errors, OfBallsDepthsAreThoseOfTheLineBetweenTheirCentres) {
  const TemporaryFolder folder;
  const GroundTruth truth = ball_on_ball(folder);
  ASSERT_EQ(truth.poses.size(), 9U);
  constexpr double kFacets = 0.0004;  // up to two facets below the spheres
  for (const lab::TruePose& p : truth.poses) {
    const double* const t = p.pose.first_in_second.translation;
    EXPECT_NEAR(p.pose.depth, 2 * kBallRadius - std::hypot(t[0], t[1], t[2]), kFacets);
    EXPECT_EQ(p.range == PoseKind::apart, p.pose.depth < 0);
    // The force acts along that line and therefore has no torque.
    if (p.range != PoseKind::deep) continue;
    const auto& f = p.wrench.force;
    const double along = (f[0] * t[0] + f[1] * t[1] + f[2] * t[2]) / std::hypot(t[0], t[1], t[2]);
    EXPECT_NEAR(along, std::hypot(f[0], f[1], f[2]), 1e-3 * along);
  }
}

TEST(Errors, TheSameSeedGivesTheSameTruthAndAnotherAnother) {
  const TemporaryFolder folder;
  const TemporaryFolder other;
  const TriangleMesh ball = make_sphere(kBallRadius, 1);
  lab::TruthOptions options = lab::truth_options_for(ball, 3);
  const auto depths = [&](const TemporaryFolder& where) {
    std::vector<double> out;
    for (const auto& p : lab::find_truth(ball, options, lab::Wrenches::exact, where.path()).poses) {
      out.push_back(p.pose.first_in_second.translation[0]);
      out.push_back(p.wrench.force[1]);
    }
    return out;
  };
  const std::vector<double> first = depths(folder);
  EXPECT_EQ(first, depths(other));   // computed
  EXPECT_EQ(first, depths(folder));  // read back
  options.seed = 2;
  EXPECT_NE(first, depths(folder));
}

TEST(Errors, BodiesThatShareAnEdgeAreRefused) {
  TriangleMesh mesh = make_box({0.1, 0.1, 0.1});
  const TriangleMesh other = make_box({0.1, 0.1, 0.1}, {0.2, 0.2, 0});
  // Corners 3 and 7 of the first box are corners 0 and 4 of the second.
  for (const auto& t : other.triangles) {
    auto& copy = mesh.triangles.emplace_back(t);
    for (auto& v : copy) v = v == 0 ? 3 : v == 4 ? 7 : v + 8;
  }
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  EXPECT_THROW((void)lab::Oracle(mesh), lab::MeasureError);
}

TEST(Errors, ThinBodiesAreAskedForDepthsThatTheyHave) {
  const TriangleMesh plate = make_box({0.1, 0.1, 0.0005});
  const lab::TruthOptions options = lab::truth_options_for(plate, 6);
  EXPECT_LT(options.deep, 0.0005);
  EXPECT_GT(options.contact, 0);
  const TemporaryFolder folder;
  EXPECT_EQ(lab::find_truth(plate, options, lab::Wrenches::none, folder.path()).poses.size(), 6U);
}

// Each depth of two pegs side by side takes tens of thousands of points.
TEST(Errors, PosesOfContactOfALongBodyAreFoundNearTheDepthsThatAreSought) {
  const TriangleMesh peg = samples::make_peg();
  lab::TruthOptions options = lab::truth_options_for(peg, 9);
  options.poses[0] = options.poses[2] = 0;
  const TemporaryFolder folder;
  const GroundTruth truth = lab::find_truth(peg, options, lab::Wrenches::none, folder.path());
  ASSERT_EQ(truth.poses.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const double sought = options.contact * (double(i) + 0.5) / 3;
    EXPECT_LE(truth.poses[i].pose.depth, sought);
    EXPECT_GE(truth.poses[i].pose.depth, sought - options.contact / 30);
  }
}

}  // namespace
}  // namespace vps::test
