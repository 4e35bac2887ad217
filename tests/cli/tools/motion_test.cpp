// SPDX-License-Identifier: GPL-3.0-or-later
// `vpsbake view --motion`: the page that plays a recorded motion.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "tests/cli/pages.h"
#include "tests/cli/schema.h"

namespace vps::test {
namespace {

using Json = nlohmann::json;

// A gear that rises by 20 mm and makes half a turn about z in a second; a ball and a floor that stay.
Json sample_motion() {
  Json motion = {{"format", "vps-motion 1"},
                 {"title", "A gear </script> rises"},
                 {"up", "z"},
                 {"bodies",
                  {{{"name", "gear"}, {"asset", "a.vps.hdf"}},
                   {{"name", "ball"}, {"sphere", 0.005}},
                   {{"name", "floor"}, {"box", {0.1, 0.1, 0.01}}}}}};
  constexpr int kFrames = 11;
  for (int i = 0; i < kFrames; ++i) {
    const double t = i / 10.0, half_angle = 0.5 * 3.14159265358979 * t;
    motion["times"].push_back(5 + t);
    motion["poses"].push_back({{0, 0, 0.02 * t, 0, 0, std::sin(half_angle), std::cos(half_angle)},
                               {0.03, 0, 0.005, 0, 0, 0, 1},
                               {0, 0, -0.01, 0, 0, 0, 1}});
    motion["contacts"].push_back(i < 5 ? Json::array() : Json::array({{0.03, 0, 0}, {0.01, 0.01, 0}}));
  }
  return motion;
}

class Motion : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(vpsbake(folder_, sample("gear") + " --voxel 1mm -o a.vps.hdf").code, 0); }
  void write(const Json& motion) { write_file(folder_ / "motion.json", motion.dump()); }
  // The motion with one value replaced is refused with this reason.
  void expect_refused(const char* place, const Json& value, const std::string& why) {
    Json motion = sample_motion();
    motion[Json::json_pointer(place)] = value;
    write(motion);
    expect_refusal(folder_, "view --motion motion.json", 3, why);
  }
  TemporaryFolder folder_;
};

TEST_F(Motion, ThePageShowsEveryBodyWhereItWasAtAnyTime) {
  VPS_BROWSER_OR_SKIP();
  write(sample_motion());
  const Outcome run = vpsbake(folder_, "view --motion motion.json");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_NE(run.out.find("motion.html"), std::string::npos);
  // Poses are interpolated between frames: 0.25 s lies between the third and the fourth.
  const PageVisit visit =
      visit_everywhere(folder_ / "motion.html",
                       "(state.go(0.25), state.meshes.map(m => [...m.position.toArray(), ...m.quaternion.toArray()]))");
  ASSERT_EQ(visit.value.size(), 3U);
  const double half_angle = 0.5 * 3.14159265358979 * 0.25;
  EXPECT_NEAR(visit.value[0][2].get<double>(), 0.005, 1e-6);
  EXPECT_NEAR(visit.value[0][5].get<double>(), std::sin(half_angle), 1e-4);
  EXPECT_NEAR(visit.value[0][6].get<double>(), std::cos(half_angle), 1e-4);
  EXPECT_NEAR(visit.value[1][0].get<double>(), 0.03, 1e-6);
  EXPECT_NE(visit.text.find("A gear </script> rises"), std::string::npos) << visit.text;
  EXPECT_NE(visit.text.find("0.250 s"), std::string::npos) << visit.text;
  EXPECT_NE(visit.text.find("floor: box of 200 mm × 200 mm × 20 mm, fixed"), std::string::npos) << visit.text;
  EXPECT_NE(visit.text.find("contact points\n(0)"), std::string::npos) << visit.text;
}

TEST_F(Motion, EveryBodyIsPainted) {
  VPS_BROWSER_OR_SKIP();
  for (const bool still : {false, true}) {
    Json motion = sample_motion();
    if (still) {
      for (const char* const frames : {"times", "poses", "contacts"}) motion[frames] = Json::array({motion[frames][0]});
    }
    write(motion);
    ASSERT_EQ(vpsbake(folder_, "view --motion motion.json").code, 0);
    const PageVisit visit =
        visit_small(folder_ / "motion.html",
                    std::string("(async () => { state.go(0.3); const shares = [];"
                                "for (let i = 0; i <= 3; ++i) {"
                                "  state.meshes.forEach((mesh, j) => mesh.visible = i === j);"
                                "  state.view.paint();"
                                "  await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));"
                                "  shares.push(") +
                        kPaintedShare + "); } return shares; })()");
    const double least[] = {0.02, 0.001, 0.1};  // gear, ball, floor
    const double contacts = visit.value[3];
    for (std::size_t i = 0; i < 3; ++i) EXPECT_GT(visit.value[i].get<double>() - contacts, least[i]) << i << still;
    EXPECT_LT(contacts, 0.01);
  }
}

TEST_F(Motion, ThePagePlaysToTheEndAndStops) {
  VPS_BROWSER_OR_SKIP();
  write(sample_motion());
  ASSERT_EQ(vpsbake(folder_, "view --motion motion.json").code, 0);
  VisitOptions options;
  options.width = 800;
  options.height = 500;
  options.script =
      "(async () => { const seen = new Set(); $('loop').click(); $('speed').value = '0.25'; state.go(0); "
      "state.play(true);"
      "while (playing) { seen.add(now); await new Promise(requestAnimationFrame); }"
      "return [seen.size, now, document.getElementById('play').textContent]; })()";
  const PageVisit visit = visit_page(folder_ / "motion.html", options);
  expect_sound(visit, 0.05);
  EXPECT_GT(visit.value[0], 3);
  EXPECT_NEAR(visit.value[1].get<double>(), 1, 1e-9);
  EXPECT_EQ(visit.value[2], "Again");
  EXPECT_NE(visit.text.find("contact points\n(2)"), std::string::npos) << visit.text;
}

TEST_F(Motion, AShortClipPlaysSlowlyAgainAndAgainWithShadows) {
  VPS_BROWSER_OR_SKIP();
  write(sample_motion());
  ASSERT_EQ(vpsbake(folder_, "view --motion motion.json").code, 0);
  // It begins by itself. Near the end it goes on from the start; the shadow of the gear changes the picture.
  const PageVisit visit = visit_small(
      folder_ / "motion.html",
      "(async () => { const frame = () => new Promise(requestAnimationFrame);"
      "const speed = $('speed').value; let again = false; $('speed').value = '2'; now = 0.9; let before = now;"
      "for (let i = 0; i < 300 && !again; ++i) { await frame(); again = now < before; before = now; }"
      "state.go(0.5); const picture = async () => { state.view.paint(); await frame(); await frame();"
      "  return document.querySelector('#view canvas').toDataURL(); };"
      "const lit = await picture(); state.sun.castShadow = false; const bare = await picture();"
      "return [speed, again, lit !== bare]; })()");
  EXPECT_EQ(visit.value, nlohmann::json({"0.25", true, true}));
}

// A ball of 10 mm that flies 20 m, and one that stays, above a floor.
Json long_motion() {
  Json motion = {{"format", "vps-motion 1"},
                 {"bodies", {{{"sphere", 0.01}}, {{"sphere", 0.01}}, {{"box", {100, 100, 0.1}}}}}};
  for (int i = 0; i <= 20; ++i) {
    motion["times"].push_back(0.1 * i);
    motion["poses"].push_back({{double(i), 0, 0, 0, 0, 0, 1}, {0, 0.05, 0, 0, 0, 0, 1}, {0, 0, -0.2, 0, 0, 0, 1}});
  }
  return motion;
}

TEST_F(Motion, BodiesOnALongWayAreFollowedAndTheWholeWayCanBeShown) {
  VPS_BROWSER_OR_SKIP();
  write(long_motion());
  ASSERT_EQ(vpsbake(folder_, "view --motion motion.json").code, 0);
  // The flying ball's height in the picture, whose full height is 2, and whether the ends of its path are visible.
  const PageVisit visit =
      visit_small(folder_ / "motion.html",
                  "(() => {"
                  "const {view, meshes, go} = state;"
                  "const seen = (x, y) => { view.camera.updateMatrixWorld(); const p = new THREE.Vector3(x, y, "
                  "0).project(view.camera);"
                  "  return Math.abs(p.x) < 1 && Math.abs(p.y) < 1 && Math.abs(p.z) < 1; };"
                  "const height = () => 2 * 0.01 / Math.tan(view.camera.fov * Math.PI / 360) /"
                  "  view.camera.position.distanceTo(meshes[0].position);"
                  "go(0); const begin = [height(), seen(0, 0), seen(0, 0.05)];"
                  "go(2); const end = [height(), seen(20, 0), seen(0, 0)];"
                  "$('path').click(); const path = [seen(0, 0), seen(20, 0), $('follow').checked];"
                  "$('reset').click(); go(1); const again = [height(), seen(10, 0), $('follow').checked];"
                  "return [...begin, ...end, ...path, ...again]; })()");
  const auto& v = visit.value;
  for (const int height : {0, 3, 9}) EXPECT_GT(v[std::size_t(height)], 0.15);
  EXPECT_EQ(v[1], true);
  EXPECT_EQ(v[2], true);
  EXPECT_EQ(v[4], true);
  EXPECT_EQ(v[5], false);
  EXPECT_EQ(nlohmann::json(v.begin() + 6, v.begin() + 9), nlohmann::json({true, true, false}));
  EXPECT_EQ(v[10], true);
  EXPECT_EQ(v[11], true);
}

TEST_F(Motion, APageOfSeveralHasAChoice) {
  VPS_BROWSER_OR_SKIP();
  write(long_motion());
  std::filesystem::rename(folder_ / "motion.json", folder_ / "long.json");
  write(sample_motion());
  ASSERT_EQ(vpsbake(folder_, "view --motion motion.json long.json -o both.html").code, 0);
  const PageVisit visit = visit_small(folder_ / "both.html",
                                      "[motions.length, $('scene').options.length, $('scene').offsetParent !== null,"
                                      " motions[1].bodies.length, motion.title]");
  EXPECT_EQ(visit.value, nlohmann::json({2, 2, true, 3, "A gear </script> rises"}));
  EXPECT_EQ(vpsbake(folder_, "view --motion motion.json absent.json -o none.html").code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "none.html"));
}

TEST_F(Motion, ABodyThatIsLostIsNotFollowed) {
  VPS_BROWSER_OR_SKIP();
  Json motion = {{"format", "vps-motion 1"}, {"bodies", {{{"sphere", 0.01}}, {{"sphere", 0.01}}}}};
  for (int i = 0; i <= 20; ++i) {
    motion["times"].push_back(0.1 * i);
    motion["poses"].push_back({{0, 0, 0.001 * i, 0, 0, 0, 1}, {0.05, 0, -1.0 * i, 0, 0, 0, 1}});
  }
  write(motion);
  ASSERT_EQ(vpsbake(folder_, "view --motion motion.json").code, 0);
  const PageVisit visit = visit_small(folder_ / "motion.html",
                                      "(() => { const before = state.view.controls.target.clone(); state.go(2);"
                                      "return [$('follow').checked, state.view.controls.target.equals(before)]; })()");
  EXPECT_EQ(visit.value, nlohmann::json({false, true}));
}

TEST_F(Motion, OnAShortWayTheWholeOfItIsInThePicture) {
  VPS_BROWSER_OR_SKIP();
  write(sample_motion());
  ASSERT_EQ(vpsbake(folder_, "view --motion motion.json").code, 0);
  EXPECT_EQ(visit_small(folder_ / "motion.html", "[$('follow').checked, $('path').offsetParent === null]").value,
            nlohmann::json({false, true}));
}

TEST_F(Motion, ALongRecordingIsThinnedAndSaysSo) {
  VPS_BROWSER_OR_SKIP();
  constexpr int kFrames = 1500, kContacts = 560;
  std::string times, poses, contacts, frame;
  for (int i = 0; i < kContacts; ++i) frame += i == 0 ? "[0,0,0]" : ",[0,0,0]";
  for (int f = 0; f < kFrames; ++f) {
    const char* const comma = f == 0 ? "" : ",";
    times += comma + std::to_string(0.01 * f);
    poses += std::string(comma) + "[[0,0,0,0,0,0,1]]";
    contacts += comma + ("[" + frame + "]");
  }
  write_file(folder_ / "motion.json", R"({"format":"vps-motion 1","bodies":[{"sphere":0.1}],"times":[)" + times +
                                          R"(],"poses":[)" + poses + R"(],"contacts":[)" + contacts + "]}");
  ASSERT_EQ(vpsbake(folder_, "view --motion motion.json").code, 0);
  EXPECT_LT(std::filesystem::file_size(folder_ / "motion.html"), 12e6);
  const PageVisit visit = visit_small(folder_ / "motion.html", "[times.length, times[1], times[times.length - 1]]");
  EXPECT_NE(visit.text.find("1500; one in 2 is on this page"), std::string::npos) << visit.text;
  EXPECT_EQ(visit.value, nlohmann::json({751, 0.02, 14.99}));
}

TEST_F(Motion, ABodyThinnerThanItsVoxelsIsDrawnAsItsBox) {
  VPS_BROWSER_OR_SKIP();
  ASSERT_EQ(vpsbake(folder_, sample("thin_plate") + " --voxel 10mm --parts voxelmap -o a.vps.hdf").code, 0);
  Json motion = sample_motion();
  motion["bodies"] = Json::array({motion["bodies"][0]});
  for (Json& frame : motion["poses"]) frame = Json::array({frame[0]});
  write(motion);
  ASSERT_EQ(vpsbake(folder_, "view --motion motion.json").code, 0);
  const PageVisit visit = visit_small(folder_ / "motion.html", "");
  EXPECT_NE(visit.text.find("its bounding box is drawn"), std::string::npos) << visit.text;
}

TEST_F(Motion, TheExampleOfTheDocumentationFollowsTheSchemaAndMakesAPage) {
  VPS_SCHEMA_CHECK_OR_SKIP();
  const std::string page = read_file(std::string(VPS_DOCS) + "/motion.md");
  const std::size_t begin = page.find("```json\n") + 8;
  write_file(folder_ / "motion.json", page.substr(begin, page.find("```", begin) - begin));
  std::filesystem::rename(folder_ / "a.vps.hdf", folder_ / "gear.vps.hdf");
  EXPECT_TRUE(follows_schema(folder_ / "motion.json", "motion.schema.json"));
  const Outcome run = vpsbake(folder_, "view --motion motion.json");
  EXPECT_EQ(run.code, 0) << run.err;
}

TEST_F(Motion, TheSchemaRefusesWhatTheProgramRefuses) {
  VPS_SCHEMA_CHECK_OR_SKIP();
  write(sample_motion());
  EXPECT_TRUE(follows_schema(folder_ / "motion.json", "motion.schema.json"));
  for (const char* const place : {"/format", "/bodies/1/sphere", "/poses/2/1", "/times/3"}) {
    Json motion = sample_motion();
    motion[Json::json_pointer(place)] = "x";
    write(motion);
    EXPECT_FALSE(follows_schema(folder_ / "motion.json", "motion.schema.json")) << place;
  }
  for (const char* const place : {"/contact", "/bodies/1/radius"}) {
    Json motion = sample_motion();
    motion[Json::json_pointer(place)] = Json::array();
    write(motion);
    EXPECT_FALSE(follows_schema(folder_ / "motion.json", "motion.schema.json")) << place;
  }
}

TEST_F(Motion, WhatCannotBePlayedIsRefusedInOneLine) {
  expect_refused("/format", "vps-motion 2", "\"vps-motion 1\"");
  expect_refused("/up", "w", "not x, y or z");
  expect_refused("/bodies", Json::array(), "has not 1 to 10000 bodies");
  expect_refused("/bodies/1", 7, "body 2 is not an object");
  expect_refused("/bodies/1/box", Json::array({1, 1, 1}), "body 2 has not one of");
  expect_refused("/bodies/1/sphere", -1, "not positive");
  expect_refused("/bodies/2/box", Json::array({1, 1}), "three half extents");
  expect_refused("/times/3", 5.0, "frame 4: its time is not after");
  expect_refused("/times", Json::array({1}), "\"times\" has 1 frames and \"poses\" has 11");
  expect_refused("/times", Json::array(), "\"times\" is empty");
  expect_refused("/contact", Json::array(), "it has an unknown key \"contact\"; there are format, title");
  expect_refused("/bodies/1/radius", 1, "body 2 has an unknown key \"radius\"; there are name, asset, box, sphere");
  expect_refused("/poses/2", Json::array(), "frame 3 has not a pose for each body");
  expect_refused("/poses/2/1", Json::array({0, 0, 0}), "frame 3, body 2: a pose is seven numbers");
  expect_refused("/poses/2/1/0", nullptr, "frame 3, body 2: a pose is not a number");
  expect_refused("/poses/2/1/6", 2, "not of unit length");
  expect_refused("/contacts/6/1", Json::array({1}), "frame 7: a contact is three numbers");
  expect_refused("/contacts", Json::array(), "not as many frames");
  expect_refused("/bodies/0/asset", "motion.json", "body 1: asset motion.json");
  Json motion = sample_motion();
  write(motion);
  expect_refusal(folder_, "view --motion motion.json -o .", 2, "folder");
  motion["bodies"][0]["asset"] = "absent.vps.hdf";
  write(motion);
  expect_refusal(folder_, "view --motion motion.json", 2, "absent.vps.hdf");
  ASSERT_EQ(vpsbake(folder_, sample("gear") + " --voxel 1mm --parts pointshell -o a.vps.hdf").code, 0);
  write(sample_motion());
  expect_refusal(folder_, "view --motion motion.json", 3, "no voxelmap");
  expect_refusal(folder_, "view --motion absent/x.json", 2, "absent/x.json: the file does not exist");
  expect_refusal(folder_, "view --motion .", 2, "this is a folder; give a recorded motion");
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  expect_refusal(folder_, "view --motion pipe", 2, "this is not a regular file; give a recorded motion");
  expect_refusal(folder_, "view --motion a.vps.hdf", 3, "not JSON");
  expect_refusal(folder_, "view a.vps.hdf --motion motion.json", 1, "excludes");
  expect_refusal(folder_, "view --motion motion.json --mesh x.obj", 1, "excludes");
}

}  // namespace
}  // namespace vps::test
