// SPDX-License-Identifier: GPL-3.0-or-later
// The page of `vpsbake stress` in a browser.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/cli/program.h"
#include "tests/support/browser.h"

namespace vps::test {
namespace {

TEST(StressPage, ShowsEveryCaseItsVerdictsAndPlots) {
  VPS_BROWSER_OR_SKIP();
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("gear") + " --voxel 1mm -o gear.vps.hdf").code, 0);
  const Outcome run = vpsbake(folder,
                              "stress gear.vps.hdf --quick --cases 'penalty_*,tip,rest_depth,impact_bouncing' "
                              "--strict --without hacd,gimpact -o s");
  ASSERT_EQ(run.code, 5) << run.err;
  for (const Theme theme : {Theme::light, Theme::dark}) {
    VisitOptions options;
    options.theme = theme;
    if (theme == Theme::dark) {
      options.width = 390;
      options.height = 844;
    }
    options.script =
        "({first: document.querySelector('main').firstElementChild.textContent, height: "
        "document.documentElement.scrollHeight,"
        " groups: [...document.querySelectorAll('.group')].map(g => [g.firstChild.textContent, g.open]),"
        " linked: (location.hash = '#a0c0', unfold(), document.getElementById('a0c0').checkVisibility()),"
        " drawn: charts.forEach(draw), tiles: document.querySelectorAll('.map a').length,"
        " articles: document.querySelectorAll('article').length, charts: charts.length,"
        " asked: [...document.querySelectorAll('.question > summary')].map(s => s.textContent),"
        " text: document.body.textContent,"
        " broken: document.querySelectorAll('td.broken').length > 0,"
        " axes: charts.map(c => c.config.options.scales.y.title.text)})";
    const PageVisit visit = visit_page(folder / "s.html", options);
    expect_sound(visit);
    EXPECT_EQ(visit.value["first"], "gear.vps.hdf passes 7 of 8 tests and fails 1.");
    EXPECT_LT(visit.value["height"], 2400) << "what passed is folded";
    EXPECT_EQ(visit.value["groups"], nlohmann::json::parse(R"([["Failed: 1", true], ["Passed: 7", false]])"));
    EXPECT_EQ(visit.value["linked"], true);
    EXPECT_EQ(visit.value["tiles"], 8);
    EXPECT_EQ(visit.value["articles"], 8);
    EXPECT_NE(visit.value["asked"].dump().find("Does it stay on the ground?yes"), std::string::npos);
    EXPECT_GE(visit.value["charts"], 8);
    EXPECT_EQ(visit.value["broken"], true);
    const auto& axes = visit.value["axes"];
    EXPECT_NE(std::find(axes.begin(), axes.end(), "off the plane [vx]"), axes.end()) << axes;
    EXPECT_EQ(std::find(axes.begin(), axes.end(), "value"), axes.end()) << axes;
    const std::string text = visit.value["text"];
    EXPECT_NE(text.find("vx before the wall's back"), std::string::npos) << text;
    EXPECT_NE(text.find("vx: voxels"), std::string::npos) << text;
    EXPECT_NE(visit.text.find("vpsbake stress gear.vps.hdf --quick"), std::string::npos);
  }
}

}  // namespace
}  // namespace vps::test
