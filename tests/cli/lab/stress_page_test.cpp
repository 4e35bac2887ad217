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
                              "--without hacd,gimpact -o s");
  ASSERT_EQ(run.code, 0) << run.err;
  for (const Theme theme : {Theme::light, Theme::dark}) {
    VisitOptions options;
    options.theme = theme;
    if (theme == Theme::dark) {
      options.width = 390;
      options.height = 844;
    }
    options.script =
        "(charts.forEach(draw), {articles: document.querySelectorAll('article').length, charts: charts.length,"
        " broken: document.querySelectorAll('td.broken').length > 0,"
        " axes: charts.map(c => c.config.options.scales.y.title.text)})";
    const PageVisit visit = visit_page(folder / "s.html", options);
    expect_sound(visit);
    EXPECT_EQ(visit.value["articles"], 8);
    EXPECT_GE(visit.value["charts"], 8);
    EXPECT_EQ(visit.value["broken"], true);
    const auto& axes = visit.value["axes"];
    EXPECT_NE(std::find(axes.begin(), axes.end(), "off the plane [vx]"), axes.end()) << axes;
    EXPECT_EQ(std::find(axes.begin(), axes.end(), "value"), axes.end()) << axes;
    EXPECT_NE(visit.text.find("vx before the wall's back"), std::string::npos) << visit.text;
    EXPECT_NE(visit.text.find("vx: voxels"), std::string::npos) << visit.text;
    EXPECT_NE(visit.text.find("Of 8 cases the baked assets hold 8"), std::string::npos) << visit.text;
    EXPECT_NE(visit.text.find("vpsbake stress gear.vps.hdf --quick"), std::string::npos);
  }
}

}  // namespace
}  // namespace vps::test
