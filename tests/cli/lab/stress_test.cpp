// SPDX-License-Identifier: GPL-3.0-or-later
// Compares stability cases with theory. A case that must break is reported as broken.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "cli/lab/stress/penalty.h"
#include "cli/lab/stress/report.h"
#include "cli/lab/stress/rest_poses.h"
#include "cli/lab/stress/world.h"
#include "tests/support/baked.h"
#include "tests/support/shapes.h"

namespace vps::stress {
namespace {

constexpr double kVoxel = 0.001;
const std::array<double, 3> kHalf{0.05, 0.04, 0.03};

Subject box_subject() {
  bake::BakeOptions options;
  options.voxel_size = kVoxel;
  SubjectOptions subject;
  subject.mass = 2;
  subject.without = {"hacd", "gimpact"};
  return make_subject("box", test::baked(test::make_box(kHalf), options), subject);
}

const Subject& box() {
  static const Subject subject = box_subject();
  return subject;
}

const Case& find(const std::string& name) {
  for (const Case& one : all_cases()) {
    if (one.name == name) return one;
  }
  throw std::logic_error(name);
}

// Runs a case with this function as its trial, in the first column only.
CaseResult run_alone(Case& one, std::function<Trial(const Subject&, const Column&, std::span<const double>)> run) {
  one.name = "made_up";
  one.run = std::move(run);
  Subject subject = box();
  subject.columns.resize(1);
  return run_case(one, subject, Effort::full);
}

// The description of each case is complete and concerns the case's own quantity.
TEST(Stress, EachCaseStatesItsOwnLimit) {
  std::set<std::string> names;
  for (const Case& one : all_cases()) {
    EXPECT_TRUE(names.insert(one.name).second) << one.name;
    for (const std::string* const text :
         {&one.family, &one.question, &one.setup, &one.measured, &one.quantity, &one.limit, &one.limit_from})
      EXPECT_FALSE(text->empty()) << one.name;
    EXPECT_FALSE(one.axes.empty()) << one.name;
    EXPECT_TRUE(one.run) << one.name;
    // The limit has the unit of the measured quantity, unless it is stated in words.
    const bool in_words = one.limit.starts_with("the ") || one.limit.starts_with("a ") || one.limit.starts_with("k ");
    if (!one.unit.empty() && !in_words) {
      EXPECT_NE(one.limit.find(one.unit), std::string::npos) << one.name;
    }
  }
  EXPECT_NE(find("wedge").limit_from, find("rest_jitter").limit_from);
  EXPECT_TRUE(find("penalty_bounce").trace.empty());
  EXPECT_FALSE(find("deep_overlap").needs_continuous);
}

TEST(Stress, ABoxStandsOnItsSixFaces) {
  const auto poses = rest_poses(box().corners, 0.1 * kVoxel, 24);
  ASSERT_EQ(poses.size(), 6U);
  // It is most stable on its largest face, and tips over the nearer edge.
  EXPECT_NEAR(poses[0].height, kHalf[2], 0.02 * kHalf[2]);
  EXPECT_NEAR(poses[0].tilt, std::atan2(kHalf[1], kHalf[2]), 0.03);
  EXPECT_NEAR(poses[0].flat, kHalf[1], 0.03 * kHalf[1]);
  EXPECT_NEAR(poses[5].height, kHalf[0], 0.02 * kHalf[0]);
}

// A face on a foundation of 1 N/m^3: the stiffness against lifting is its area. Rocking has the stiffness
// area * half^2 / 3 and the moment of inertia m (half^2 + height^2) / 3, a smaller ratio. The area of points on the
// edges includes a strip of the sides.
TEST(Stress, EffectiveMassOfABoxOnAFaceIsItsMass) {
  const PressedBody body(box(), Ground::plane);
  ASSERT_EQ(body.refusal(), "");
  const double face = 4 * kHalf[0] * kHalf[1];
  EXPECT_NEAR(body.effective_mass() / body.area(), box().mass / face, 0.02 * box().mass / face);
}

TEST(Stress, TheLoopIsStableUpToTheBoundOfSymplecticEuler) {
  for (const Ground ground : {Ground::plane, Ground::voxelmap}) {
    const PressedBody body(box(), ground);
    ASSERT_EQ(body.refusal(), "");
    EXPECT_NEAR(measured_over_theory(body, 1e-3, 0), 1, 0.01) << int(ground);
  }
}

TEST(Stress, AStiffnessBeyondTheBoundGrowsAndOneBelowDoesNot) {
  const PressedBody body(box(), Ground::plane);
  PressedBody::LoopOptions options;
  options.step = 1.0 / 60;
  const double bound = 4 * body.effective_mass() / (options.step * options.step);
  options.stiffness = 0.95 * bound;
  EXPECT_LT(body.run(options).growth, 20);
  options.stiffness = 1.05 * bound;
  EXPECT_TRUE(std::isinf(body.run(options).growth));
}

TEST(Stress, SettingsFarBeyondTheBoundAreTriedAndAgreeWithTheory) {
  const CaseResult result = run_case(find("penalty_sweep"), box(), Effort::quick);
  ASSERT_EQ(result.outcomes.size(), 1U);
  EXPECT_EQ(result.outcomes[0].verdict, Verdict::held);
  for (const Trial& trial : result.outcomes[0].trials) EXPECT_EQ(trial.value < 100, trial.at[1] < 1) << trial.at[1];
  // The worst trial is the stable setting nearest to the bound.
  const Trial& worst = result.outcomes[0].trials[result.outcomes[0].worst];
  EXPECT_EQ(worst.at[1], 0.95) << worst.value;
}

TEST(Stress, ANaNIsSeenInTheStepItComesAndNamed) {
  Arena arena(box(), {});
  arena.add_plane();
  btRigidBody& body = arena.add(box().columns[0].body, 1, standing(box().corners, 0.1));
  EXPECT_TRUE(arena.step(1.0 / 240));
  body.applyCentralForce({0, std::numeric_limits<btScalar>::quiet_NaN(), 0});
  EXPECT_FALSE(arena.step(1.0 / 240));
  EXPECT_NE(arena.failure().find("body 1 is not a number after step 2"), std::string::npos) << arena.failure();
  EXPECT_FALSE(arena.step(1.0 / 240));
}

TEST(Stress, ALargestValueThatIsNoNumberStaysOne) {
  double most = 0;
  keep_largest(most, 2);
  keep_largest(most, 1);
  EXPECT_EQ(most, 2);
  keep_largest(most, std::numeric_limits<double>::quiet_NaN());
  keep_largest(most, 3);
  EXPECT_TRUE(std::isnan(most));
}

// Simulates a ball that bounces without loss, in steps of 10 us.
int bounces_by_simulation(double height, double seconds) {
  constexpr double kStep = 1e-5;
  double speed = 0;
  int bounces = 0;
  for (double t = 0, at = height; t < seconds; t += kStep) {
    speed -= 9.81 * kStep;
    at += speed * kStep;
    if (at > 0 || speed > 0) continue;
    speed = std::sqrt(2 * 9.81 * height);
    ++bounces;
  }
  return bounces;
}

TEST(Stress, TheBouncesThatTheLimitOfRestitutionAllowsAreThoseOfABall) {
  for (const double height : {0.02, 0.044, 0.1, 0.155, 0.5, 1.0, 3.0}) {
    EXPECT_EQ(bounces_of_a_ball(height, 2), bounces_by_simulation(height, 2)) << height;
  }
  EXPECT_EQ(bounces_of_a_ball(100, 2), 1);  // even a ball still falling is allowed one
}

TEST(Stress, ALateBounceMayLiftABallByAStepsWay) {
  // The ball bounces at the depth that it reaches one step after the ground, with the speed that it had at the ground.
  constexpr double kHeight = 0.1;
  constexpr double kRate = 240;
  const double speed = std::sqrt(2 * 9.81 * kHeight);
  EXPECT_NEAR(gain_of_a_late_bounce(kHeight, kRate), speed / kRate / kHeight, 1e-12);
  EXPECT_NEAR(gain_of_a_late_bounce(kHeight, 2 * kRate), gain_of_a_late_bounce(kHeight, kRate) / 2, 1e-12);
}

// A gain up to the limit is held and a larger gain is broken, whatever the body does in between.
TEST(Stress, TheLimitOfRestitutionDependsOnHeightAndStepAlone) {
  const CaseResult result = run_case(find("restitution"), box(), Effort::full);
  ASSERT_EQ(result.outcomes.size(), 3U);
  const double height = box().size;
  const double fall = std::sqrt(2 * height / 9.81);
  const double bounces = 1 + std::floor((2 - fall) / (2 * fall));
  for (const Outcome& outcome : result.outcomes) {
    for (const Trial& trial : outcome.trials) {
      const double limit = 100 * bounces * 9.81 * fall / trial.at[0] / height;
      EXPECT_NEAR(trial.limit, limit, 1e-9 * limit) << outcome.column;
      EXPECT_EQ(trial.verdict, trial.value <= limit ? Verdict::held : Verdict::broken) << outcome.column;
    }
  }
}

TEST(Stress, ADropIsPlayedOnceAndJudgedTwice) {
  Subject subject = box();
  subject.columns.resize(1);
  subject.rests = std::make_shared<Rests>();
  const CaseResult depth = run_case(find("rest_depth"), subject, Effort::quick);
  EXPECT_EQ(depth.outcomes[0].verdict, Verdict::held);
  ASSERT_EQ(subject.rests->size(), depth.outcomes[0].trials.size());
  subject.rests->begin()->second.kinetic = 1e9;  // only visible if the second case simulates nothing again
  const CaseResult jitter = run_case(find("rest_jitter"), subject, Effort::quick);
  EXPECT_EQ(jitter.outcomes[0].verdict, Verdict::broken);
  EXPECT_EQ(jitter.outcomes[0].trials[0].trace, depth.outcomes[0].trials[0].trace);
}

// The box without collisions: it falls through everything.
void let_fall(Column& column) {
  column.body = {{}, std::make_shared<btEmptyShape>()};
}

// The box is what breaks the limit, so that Bullet's own hull decides the verdict.
TEST(Stress, TheSolverIsToBlameWhereBulletsHullOfTheBodyBreaksTheLimitToo) {
  Subject subject = box();
  subject.columns.resize(1);
  let_fall(subject.columns[0]);
  for (const char* const name : {"rest_jitter", "deep_overlap", "mass_ratio"}) {
    Subject one = subject;
    one.rests = std::make_shared<Rests>();
    const CaseResult beside_hull = run_case(find(name), one, Effort::quick);
    EXPECT_EQ(beside_hull.outcomes[0].verdict, Verdict::broken) << to_line(beside_hull, Strictness::promised);
    one.rests = std::make_shared<Rests>();
    let_fall(one.hull);
    const CaseResult as_hull = run_case(find(name), one, Effort::quick);
    EXPECT_EQ(as_hull.outcomes[0].verdict, Verdict::solver) << to_line(as_hull, Strictness::promised);
    EXPECT_NE(as_hull.outcomes[0].trials[0].remark.find("hull"), std::string::npos) << name;
    // The hull is no control of itself.
    one.columns[0].name = "hull";
    one.rests = std::make_shared<Rests>();
    EXPECT_EQ(run_case(find(name), one, Effort::quick).outcomes[0].verdict, Verdict::broken) << name;
  }
}

TEST(Stress, EverySeedDisturbsInItsOwnWay) {
  PressedBody::LoopOptions options;
  options.step = 1e-3;
  std::vector<std::vector<double>> traces;
  for (const std::uint64_t seed : {1ULL, 1001ULL, 99999999ULL}) {
    Subject subject = box();
    subject.seed = seed;
    const PressedBody body(subject, Ground::plane);
    options.stiffness = body.effective_mass() / (options.step * options.step);
    traces.push_back(body.run(options).trace);
  }
  EXPECT_NE(traces[0], traces[1]);
  EXPECT_NE(traces[1], traces[2]);
}

TEST(Stress, ANaNBreaksTheCase) {
  Case one;
  const CaseResult result = run_alone(one, [](const Subject& subject, const Column& column, std::span<const double>) {
    Arena arena(subject, {column.detection});
    arena.add(column.body, 1, btTransform::getIdentity())
        .setAngularVelocity({std::numeric_limits<btScalar>::quiet_NaN(), 0, 0});
    if (!arena.step(1.0 / 240)) return broken(arena);
    Trial trial;
    judge(trial, lowest(btTransform::getIdentity(), subject.corners), 1);
    return trial;
  });
  EXPECT_TRUE(is_broken(result, Strictness::promised));
  const std::string line = to_line(result, Strictness::promised);
  EXPECT_NE(line.find("NaN: the angular velocity of body 0"), std::string::npos) << line;
  EXPECT_NE(to_junit({{"a", 1, 1, 1, 1, {result}}}, {{"seed", 1}}, Strictness::promised).find("<failure"),
            std::string::npos);
}

TEST(Stress, AValueThatIsNoNumberIsBroken) {
  Trial trial;
  judge(trial, std::numeric_limits<double>::quiet_NaN(), 1);
  EXPECT_EQ(trial.verdict, Verdict::broken);
  judge(trial, 1, 1);
  EXPECT_EQ(trial.verdict, Verdict::held);
  trial.least = 2;
  judge(trial, 1, 3);
  EXPECT_EQ(trial.verdict, Verdict::broken);
}

TEST(Stress, TheSolverIsToBlameOnlyWhereBulletsBoxesBreakTheLimitToo) {
  const auto verdict = [](double value, double of_boxes) {
    Trial trial;
    judge_beside(trial, value, 1, of_boxes);
    return trial.verdict;
  };
  EXPECT_EQ(verdict(0.5, 2), Verdict::held);
  EXPECT_EQ(verdict(2, 2), Verdict::solver);
  EXPECT_EQ(verdict(2, 0.5), Verdict::broken);
  EXPECT_EQ(verdict(2.9, 2), Verdict::solver);
  EXPECT_EQ(verdict(3.1, 2), Verdict::broken);
  EXPECT_EQ(verdict(NAN, NAN), Verdict::solver);
  EXPECT_EQ(verdict(NAN, 2), Verdict::broken);
}

TEST(Stress, TheNumberBesideAVerdictIsOfATrialThatHasIt) {
  Case one;
  one.axes = {{"trial", "", {0, 1, 2}, {}}};
  const CaseResult result = run_alone(one, [](const Subject&, const Column&, std::span<const double> at) {
    Trial trial;
    judge(trial, 2 - at[0], 1);
    if (at[0] == 0) trial.verdict = Verdict::solver;  // farthest beyond its limit
    if (at[0] == 2) trial.verdict = Verdict::broken;  // by another limit
    return trial;
  });
  EXPECT_EQ(result.outcomes[0].verdict, Verdict::broken);
  EXPECT_EQ(result.outcomes[0].worst, 2U);
}

TEST(Stress, AStackThatFallsIsTheSolversOnlyWhereBulletsBoxesStandHardlyLonger) {
  const auto verdict = [](double seconds, double of_boxes) {
    Trial trial;
    judge_standing(trial, seconds, 10, of_boxes);
    return trial.verdict;
  };
  EXPECT_EQ(verdict(10, 1), Verdict::held);
  EXPECT_EQ(verdict(2.4, 3.5), Verdict::solver);
  EXPECT_EQ(verdict(2.3, 3.5), Verdict::broken);
  EXPECT_EQ(verdict(9, 10), Verdict::broken);
}

TEST(Stress, WhatIsNotPromisedBreaksOnlyWhenStrict) {
  Case one;
  one.needs_continuous = true;
  const CaseResult result = run_alone(one, [](const Subject&, const Column&, std::span<const double>) {
    Trial trial;
    judge(trial, 2, 1);
    return trial;
  });
  EXPECT_FALSE(is_broken(result, Strictness::promised));
  EXPECT_EQ(verdict_of(result, Strictness::promised), Verdict::shown);
  EXPECT_TRUE(is_broken(result, Strictness::strict));
  EXPECT_EQ(verdict_of(result, Strictness::strict), Verdict::broken);
}

TEST(Stress, LinesCertificateAndJUnitCountAsTheExitCodeDoes) {
  for (const Verdict of_ours : {Verdict::solver, Verdict::broken}) {
    Case one;
    one.needs_continuous = of_ours == Verdict::broken;
    const CaseResult result = run_alone(one, [&](const Subject&, const Column&, std::span<const double>) {
      Trial trial;
      judge(trial, 2, 1);
      trial.verdict = of_ours;
      return trial;
    });
    const AssetResult asset{"a", 1, 1, 1, 1, {result}};
    EXPECT_EQ(to_line(result, Strictness::strict).rfind("broken ", 0), 0U);
    EXPECT_NE(certificate(asset, Strictness::strict).find("1 of 1 cases broken"), std::string::npos);
    const std::string strict = to_junit({asset}, {{"seed", 1}}, Strictness::strict);
    EXPECT_NE(strict.find("failures=\"1\" errors=\"0\" skipped=\"0\""), std::string::npos) << strict;
    EXPECT_NE(strict.find("ours: 2 of 1"), std::string::npos) << strict;
    EXPECT_NE(certificate(asset, Strictness::promised).find("0 of 1 cases broken"), std::string::npos);
    const std::string promised = to_junit({asset}, {{"seed", 1}}, Strictness::promised);
    EXPECT_NE(promised.find("failures=\"0\" errors=\"0\" skipped=\"0\""), std::string::npos) << promised;
  }
}

TEST(Stress, JUnitSaysWithWhatItWasMeasured) {
  const std::string xml = to_junit(
      {{"a", 1, 1, 1, 1, {}}}, {{"machine", {{"processor", "A&B"}, {"cores", 2}}}, {"seed", 7}}, Strictness::promised);
  EXPECT_NE(xml.find("<property name=\"machine.processor\" value=\"A&amp;B\""), std::string::npos) << xml;
  EXPECT_NE(xml.find("<property name=\"machine.cores\" value=\"2\""), std::string::npos) << xml;
  EXPECT_NE(xml.find("<property name=\"seed\" value=\"7\""), std::string::npos) << xml;
}

TEST(Stress, BytesThatAreNotUtf8AreReplacedInJUnit) {
  const std::string xml = to_junit({{"a\xC3\"\xFF", 1, 1, 1, 1, {}}}, {{"seed", 1}}, Strictness::promised);
  EXPECT_NE(xml.find("\"a\xEF\xBF\xBD&quot;\xEF\xBF\xBD\""), std::string::npos) << xml;
}

// A result of the column "ours" with the given verdicts.
CaseResult made_up(const Case& one, const std::vector<std::pair<std::vector<double>, Verdict>>& trials) {
  Outcome outcome;
  outcome.column = "ours";
  outcome.ours = outcome.promised = true;
  for (const auto& [at, verdict] : trials) {
    Trial trial;
    trial.at = at;
    trial.value = trial.limit = 1;
    trial.verdict = verdict;
    outcome.trials.push_back(trial);
    outcome.verdict = Verdict::held;
  }
  return {&one, one.axes, {outcome}};
}

TEST(Stress, TheCertificateNamesWhatWasTriedAndRestsOnlyWithoutJitter) {
  constexpr Verdict kHeld = Verdict::held;
  constexpr Verdict kBroken = Verdict::broken;
  AssetResult asset{"a", 1, 1, 1, 1, {}};
  asset.cases.push_back(made_up(find("rest_depth"), {{{1000}, kHeld}, {{60}, kHeld}, {{10}, kHeld}, {{5}, kBroken}}));
  EXPECT_EQ(certificate(asset, Strictness::promised).find("rests"), std::string::npos);
  asset.cases.push_back(made_up(find("rest_jitter"), {{{1000}, kHeld}, {{60}, kBroken}, {{10}, kHeld}, {{5}, kHeld}}));
  asset.cases.push_back(
      made_up(find("impact_baked"), {{{1, 0.5}, kHeld}, {{1, 4}, kHeld}, {{10, 0.5}, kBroken}, {{10, 4}, kHeld}}));
  const std::string text = certificate(asset, Strictness::promised);
  EXPECT_NE(text.find("rests in Bullet at 1000 and 10 Hz, not at 60 and 5 Hz: up to a step of 1 ms;"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("is stopped at 1 and 10 m/s by walls of 4 voxels as bodies"), std::string::npos) << text;
}

TEST(Stress, ABodyThatBouncesIsThrownThroughAWall) {
  Subject subject = box();
  subject.columns.erase(subject.columns.begin() + 1, subject.columns.end());
  const CaseResult result = run_case(find("impact_bouncing"), subject, Effort::quick);
  EXPECT_EQ(result.outcomes[0].verdict, Verdict::broken);
  EXPECT_FALSE(result.outcomes[0].promised);
  EXPECT_NE(result.outcomes[0].trials[0].remark.find("through in"), std::string::npos);
}

TEST(Stress, WithContinuousMotionItIsStopped) {
  Subject subject = box();
  subject.columns.erase(subject.columns.begin());
  subject.columns.resize(1);
  const CaseResult result = run_case(find("impact_bouncing"), subject, Effort::quick);
  EXPECT_EQ(result.outcomes[0].verdict, Verdict::held) << to_line(result, Strictness::promised);
  EXPECT_TRUE(result.outcomes[0].promised);
}

TEST(Stress, NamesOfCasesAreDistinctAndEveryCaseSaysWhatItAsks) {
  std::vector<std::string> names;
  for (const Case& one : all_cases()) {
    EXPECT_EQ(std::count(names.begin(), names.end(), one.name), 0) << one.name;
    names.push_back(one.name);
    for (const std::string& text :
         {one.family, one.question, one.setup, one.measured, one.quantity, one.limit, one.limit_from}) {
      EXPECT_FALSE(text.empty()) << one.name;
    }
    EXPECT_TRUE(one.question.ends_with("?")) << one.name;  // one that makes sense alone: a page sorts them
    EXPECT_FALSE(one.question.starts_with("And ")) << one.name;
    EXPECT_TRUE(one.run) << one.name;
  }
  EXPECT_GE(names.size(), 20U);
}

}  // namespace
}  // namespace vps::stress
