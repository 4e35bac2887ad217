// SPDX-License-Identifier: GPL-3.0-or-later
// Runs `vpsbake report` end to end, as a user does.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/cli/lab/cracked_cube.h"
#include "tests/cli/program.h"
#include "tests/cli/schema.h"
#include "tests/support/browser.h"

namespace vps::test {
namespace {

using Json = nlohmann::json;

const char* const kQuick = " --quick --resolution 40 --poses 6 --rounds 1 --without hacd --cache cache";

// One report, shared by all tests that only read it.
struct Reported {
  TemporaryFolder folder;
  Outcome run;
  Json json;
  Reported() {
    run = vpsbake(folder, "report " + sample("icosphere") + kQuick + " -o first");
    if (run.code == 0) json = Json::parse(read_file(folder / "first.json"));
  }
};
const Reported& reported() {
  static const Reported once;
  return once;
}

const Json& row_of(const Json& report, const std::string& knob) {
  for (const Json& row : report["meshes"][0]["rows"]) {
    if (row["knob"] == knob) return row;
  }
  throw std::out_of_range(knob);
}

TEST(Report, WritesAPageATableAndJsonAndNamesTheFront) {
  const Reported& r = reported();
  ASSERT_EQ(r.run.code, 0) << r.run.err;
  EXPECT_EQ(r.run.err, "");
  for (const char* const file : {"first.html", "first.csv", "first.json"}) {
    EXPECT_NE(r.run.out.find(std::string("\n") + file + ": "), std::string::npos) << r.run.out;
  }
  const Json& mesh = r.json["meshes"][0];
  ASSERT_EQ(mesh["fronts"].size(), 4U);
  for (const Json& front : mesh["fronts"]) {
    const std::string line = front["line"];
    EXPECT_NE(r.run.out.find(line), std::string::npos) << r.run.out;
    EXPECT_FALSE(front["members"].empty());
    for (const Json& member : front["members"]) {
      EXPECT_NE(line.find(member["name"].get<std::string>()), std::string::npos) << member;
    }
  }
  const std::string page = read_file(r.folder / "first.html");
  EXPECT_NE(page.find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(page.find("<!-- data -->"), std::string::npos);
}

TEST(Report, SaysHowToRepeatIt) {
  const Json& json = reported().json;
  EXPECT_EQ(json["command"], "vpsbake report " + sample("icosphere") + kQuick + " -o first");
  EXPECT_EQ(json["seed"], 1);
  EXPECT_GT(json["machine"]["cores"], 0);
  EXPECT_FALSE(json["versions"]["vpsbake"].get<std::string>().empty());
}

TEST(Report, ErrorsAreThoseOfABallAndBoundsHold) {
  const Json& base = row_of(reported().json, "base");
  const double voxel = base["setting"]["voxel_size"];
  EXPECT_LT(base["errors"]["penetration"]["max"], voxel / 2);
  EXPECT_LT(base["errors"]["distance"]["max"], voxel / 2);
  EXPECT_LT(base["errors"]["normal_deg"]["max"], 15);
  EXPECT_LT(base["errors"]["force_percent"]["max"], 30);
  for (const Json& row : reported().json["meshes"][0]["rows"]) {
    for (const Json& bound : row["bounds"]) {
      if (!bound.is_null()) {
        EXPECT_EQ(bound["held"], bound["asked"]) << row["name"];
      }
    }
  }
  // A coarser level has larger errors.
  EXPECT_GT(row_of(reported().json, "level")["errors"]["force_percent"]["rms"], base["errors"]["force_percent"]["rms"]);
}

TEST(Report, WhatAPeerDoesNotTellIsNullAndWhatWasNotTimedHasNoTime) {
  std::set<std::string> told;
  for (const Json& row : reported().json["meshes"][0]["rows"]) {
    told.insert(row["series"].get<std::string>());
    if (row["series"] == "FCL") {
      EXPECT_EQ(row["depth_of"], "pairs of triangles");
      EXPECT_EQ(row["way"], "bare query");
      EXPECT_TRUE(row["errors"]["distance"].is_null());  // FCL is the reference for distances
      EXPECT_FALSE(row["distances_us"].is_null());
    }
    if (row["kind"] == "peer") {
      EXPECT_TRUE(row["errors"]["force_percent"].is_null() && row["bytes"].is_null());
    }
    if (row["kind"] == "ours") {
      EXPECT_FALSE(row["errors"]["penetration"].is_null()) << row["name"];
    }
    const bool other = !row["setting"].is_null() && row["setting"]["reading"] != "queries";
    EXPECT_EQ(row["contacts_us"].is_null(), other) << row["name"];
  }
  EXPECT_FALSE(told.contains("HACD, no margin"));
  EXPECT_TRUE(told.contains("GImpact"));
  EXPECT_EQ(reported().json["meshes"][0]["left_out"][0]["name"], "hacd");
}

TEST(Report, HasAFrontOfBareQueriesAndOneOfCollisionsInBullet) {
  const Json& mesh = reported().json["meshes"][0];
  std::map<std::string, Json> rows;
  for (const Json& row : mesh["rows"]) rows[row["name"]] = row;
  std::set<std::string> kinds_in_bullet;
  for (const auto& [name, row] : rows) {
    if (row["way"] == "in Bullet") kinds_in_bullet.insert(row["kind"].get<std::string>());
  }
  EXPECT_EQ(kinds_in_bullet, (std::set<std::string>{"ours", "peer"}));
  for (const Json& front : mesh["fronts"]) {
    for (const Json& member : front["members"]) EXPECT_EQ(rows.at(member["name"])["way"], front["way"]);
    for (const Json& one : front["left_out"]) EXPECT_EQ(rows.at(one["name"])["way"], front["way"]);
  }
  // The report says that settings decided by a clock and settings that were not timed are left out.
  std::string why;
  for (const Json& one : mesh["fronts"][0]["left_out"]) why += one["why"].get<std::string>() + "\n";
  EXPECT_NE(why.find("a clock decides"), std::string::npos) << why;
  EXPECT_NE(why.find("not timed"), std::string::npos) << why;
}

TEST(Report, TimesWholeStepsOfEveryRowInBullet) {
  std::size_t played = 0;
  for (const Json& row : reported().json["meshes"][0]["rows"]) {
    const Json& steps = row["steps"];
    // A ball of 5120 triangles is too much for GImpact.
    ASSERT_EQ(steps.is_null(), row["way"] != "in Bullet" || row["name"] == "GImpact") << row["name"];
    if (steps.is_null()) continue;
    ++played;
    EXPECT_TRUE(steps["flat"]["whole_us"].is_null()) << row["name"];  // a ball
    for (const char* const scene : {"landing", "resting"}) {
      EXPECT_GT(steps[scene]["whole_us"]["p50"], steps[scene]["narrowphase_us"]["p50"]) << row["name"];
      EXPECT_GE(steps["dearest_us"]["p99"], steps[scene]["whole_us"]["p99"]) << row["name"];
    }
  }
  EXPECT_GT(played, 6U);
}

TEST(Report, SixPosesHaveNoNinetyNinthPercentile) {
  const Json& base = row_of(reported().json, "base");
  EXPECT_TRUE(base["errors"]["penetration"]["p99"].is_null());
  EXPECT_TRUE(base["contacts_us"]["p99"].is_null());
  EXPECT_TRUE(reported().json["meshes"][0]["bake_noise"].is_null());
}

TEST(Report, AQuickOneSaysHowExactItsForcesAre) {
  const Json& mesh = reported().json["meshes"][0];
  EXPECT_EQ(mesh["oracle"]["force_tolerance"], 0.01);
  EXPECT_LE(mesh["oracle"]["force_error"], 0.01);
  EXPECT_NE(mesh["notes"].dump().find("exact forces and torques are known to 1 %"), std::string::npos) << mesh["notes"];
}

// The depth of its pose of contact takes more than 60,000 points of the oracle.
TEST(Report, AQuickOneFindsPosesOfContactOfAPeg) {
  const TemporaryFolder folder;
  const Outcome run = vpsbake(
      folder, "report " + sample("peg") + " --quick --poses 3 --rounds 1 --without hull,hacd,gimpact,fcl -o peg");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_GT(Json::parse(read_file(folder / "peg.json"))["meshes"][0]["poses"]["contact"]["count"], 0);
}

TEST(Report, LeavesNothingBehindWhenItIsEnded) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "tmp");
  const std::string command = "cd " + folder.path().string() + " && TMPDIR=tmp timeout --signal=TERM 3 " + VPSBAKE +
                              " report " + sample("torus") + " --without hacd >out.txt 2>&1 </dev/null";
  const int status = std::system(command.c_str());
  ASSERT_EQ(WEXITSTATUS(status), 124) << read_file(folder / "out.txt");  // ended by `timeout`
  EXPECT_TRUE(std::filesystem::is_empty(folder / "tmp"));
  EXPECT_FALSE(std::filesystem::exists(folder / "report.html"));
}

TEST(Report, TheSameRunTwiceGivesTheSameErrorsToTheLastDigit) {
  const Reported& r = reported();
  ASSERT_EQ(r.run.code, 0);
  const TemporaryFolder other;  // holds nothing from the first run
  ASSERT_EQ(vpsbake(other, "report " + sample("icosphere") + kQuick + " -o second").code, 0);
  const Json second = Json::parse(read_file(other / "second.json"));
  const Json& rows = r.json["meshes"][0]["rows"];
  ASSERT_EQ(second["meshes"][0]["rows"].size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Json& again = second["meshes"][0]["rows"][i];
    EXPECT_EQ(again["name"], rows[i]["name"]);
    if (!rows[i]["repeatable"]) continue;
    for (const char* key : {"errors", "bytes", "points", "bounds", "field_bound"})
      EXPECT_EQ(again[key], rows[i][key]) << rows[i]["name"];
  }
}

TEST(Report, HoldsToItsSchema) {
  VPS_SCHEMA_CHECK_OR_SKIP();
  ASSERT_EQ(reported().run.code, 0);
  EXPECT_TRUE(follows_schema(reported().folder / "first.json", "report.schema.json"));
}

// Cells of a CSV line. Text may be quoted; quotes within it are doubled.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

TEST(Report, CsvHasWhatJsonHas) {
  std::istringstream csv(read_file(reported().folder / "first.csv"));
  std::string line;
  std::getline(csv, line);
  const std::vector<std::string> head = cells_of(line);
  EXPECT_EQ(std::set(head.begin(), head.end()).size(), head.size());
  std::size_t numbers = 0;
  for (const Json& row : reported().json["meshes"][0]["rows"]) {
    ASSERT_TRUE(std::getline(csv, line));
    const std::vector<std::string> cells = cells_of(line);
    ASSERT_EQ(cells.size(), head.size());
    EXPECT_EQ(cells[0], sample("icosphere"));
    for (std::size_t i = 1; i < head.size(); ++i) {
      std::string pointer = "/" + head[i];
      std::replace(pointer.begin(), pointer.end(), '.', '/');
      const Json::json_pointer at(pointer);
      const Json value = row.contains(at) ? row[at] : Json();
      if (value.is_number()) {
        EXPECT_EQ(std::stod(cells[i]), value.get<double>()) << head[i];
        ++numbers;
      } else {
        EXPECT_EQ(cells[i], value.is_null()     ? ""
                            : value.is_string() ? value.get<std::string>()
                                                : value.dump())
            << head[i];
      }
    }
    // The JSON holds nothing more.
    const Json flat = row.flatten();
    for (const auto& [key, value] : flat.items()) {
      std::string column = key.substr(1);
      std::replace(column.begin(), column.end(), '/', '.');
      if (!value.is_null()) {
        EXPECT_NE(std::find(head.begin(), head.end(), column), head.end()) << column;
      }
    }
  }
  EXPECT_FALSE(std::getline(csv, line));
  EXPECT_GT(numbers, 500U);
}

Json names_of(const Json& front) {
  Json names = Json::array();
  for (const Json& member : front["members"]) names.push_back(member["name"]);
  return names;
}

TEST(Report, ThePageShowsTheSameFrontAndEveryRowAndAnswersItsControls) {
  VPS_BROWSER_OR_SKIP();
  ASSERT_EQ(reported().run.code, 0);
  VisitOptions options;
  options.height = 2400;
  options.script = R"((async () => {
    const order = [...document.querySelector('main').children], folded = !$('terms').open && !$('measured').open;
    const heads = [...document.querySelectorAll('#fronts th, #table th')].map(h => h.textContent);
    const lineOf = way => charts[0].data.datasets.find(set => set.isFront && set.way === way).data.map(p => p.row.name);
    const front = ways.map(lineOf);
    const rows = document.querySelectorAll('#table tbody tr').length;
    const plots = document.querySelectorAll('#knobs canvas').length;
    const pick = (id, value) => { $(id).value = value; $(id).dispatchEvent(new Event('change')); };
    const axes = [];
    for (const y of Object.keys(report.measures)) {
      pick('y', y);
      axes.push(charts[0].options.scales.y.title.text);
    }
    pick('y', 'penetration');
    pick('x', 'bytes');
    const bytes = lineOf(ways[0]);
    pick('x', 'steps.dearest_us.p99');
    const steps = lineOf(ways[1]);
    const tables = [...document.querySelectorAll('#fronts table')].map(t => t.tBodies[0].rows.length);
    document.querySelectorAll('#table thead tr:nth-child(2) button')[1].click();
    const points = [...document.querySelectorAll('#table tbody tr')].map(tr => tr.cells[1].textContent).filter(t => t);
    $('measured').open = true;
    return {front, rows, plots, axes, bytes, steps, tables, points, folded, first: order[0].textContent, picture: order.indexOf(
              document.querySelector('.plot')), statistics: $('statistic').options.length, head: heads.join('|'),
            code: [...document.querySelectorAll('code')].map(c => c.textContent)};
  })())";
  const PageVisit visit = visit_page(reported().folder / "first.html", options);
  expect_sound(visit, 0.03);
  const Json& mesh = reported().json["meshes"][0];
  const Json& fronts = mesh["fronts"];
  EXPECT_EQ(visit.value["front"][0], names_of(fronts[0]));
  EXPECT_EQ(visit.value["front"][1], names_of(fronts[1]));
  EXPECT_EQ(visit.value["bytes"], names_of(fronts[2]));
  EXPECT_EQ(visit.value["steps"], names_of(fronts[3]));
  EXPECT_EQ(visit.value["tables"],
            (Json{fronts[0]["members"].size(), fronts[1]["members"].size(), fronts[3]["members"].size()}));
  EXPECT_EQ(visit.value["rows"], mesh["rows"].size());
  EXPECT_EQ(visit.value["plots"], 6);
  EXPECT_EQ(visit.value["axes"].size(), reported().json["measures"].size());
  EXPECT_EQ(visit.value["code"], (Json{mesh["bake_command"], reported().json["command"]}));
  EXPECT_EQ(mesh["bake_command"], "vpsbake " + sample("icosphere") + " --voxel 2.5mm");
  // The verdict in one sentence, then the plot.
  const std::string first = visit.value["first"];
  EXPECT_TRUE(first.starts_with("icosphere.obj, baked with voxels of 2.5 mm, answers in ")) << first;
  EXPECT_NE(first.find("of the other shapes, "), std::string::npos) << first;
  EXPECT_LE(visit.value["picture"], 3);
  EXPECT_EQ(visit.value["folded"], true);
  // Two poses of contact have no 99th percentile: it is neither offered nor a column. Steps are hundreds.
  EXPECT_EQ(visit.value["statistics"], 3);
  EXPECT_EQ(visit.value["head"].get<std::string>().find("99 %, mm"), std::string::npos) << visit.value["head"];
  EXPECT_NE(visit.value["head"].get<std::string>().find("99 %, us"), std::string::npos) << visit.value["head"];
  // Rows are sorted by points; rows without points come last.
  double last = 0;
  for (std::string points : visit.value["points"]) {
    std::erase(points, ',');
    EXPECT_GE(std::stod(points), last);
    last = std::stod(points);
  }
}

TEST(Report, ThePageFitsAPhoneInTheDark) {
  VPS_BROWSER_OR_SKIP();
  ASSERT_EQ(reported().run.code, 0);
  VisitOptions options;
  options.width = 390;
  options.height = 2400;
  options.theme = Theme::dark;
  expect_sound(visit_page(reported().folder / "first.html", options), 0.03);
}

TEST(Report, RefusesWhatItCannotMeasureInOneLineBeforeItMeasures) {
  const TemporaryFolder folder;
  const std::string ball = sample("icosphere");
  write_file(folder / "junk.obj", "v 0 0 nonsense\nf 1 2 3\n");
  write_file(folder / "open.obj", "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nf 1 3 4\nf 1 4 2\n");
  expect_refusal(folder, "report absent.obj", 2, "absent.obj");
  expect_refusal(folder, "report " + ball + " junk.obj", 3, "junk.obj");
  expect_refusal(folder, "report " + ball + " open.obj", 3, "open.obj");
  expect_refusal(folder, "report " + ball + " --poses 0", 1, "--poses takes a whole number from 3");
  expect_refusal(folder, "report " + ball + " --without vhacd", 1, "vhacd");
  expect_refusal(folder, "report " + ball + " -o nowhere/report", 2, "the folder does not exist");
  for (const std::string ending : {"json", "csv", "html"}) {
    write_file(folder / ("mine." + ending), "not a report, and not to be lost");
    expect_refusal(folder, "report " + ball + " -o mine", 2, "mine." + ending + ": the file exists and is not");
    std::filesystem::remove(folder / ("mine." + ending));
  }
  write_file(folder / "mine.html", "<!doctype html>\n<title>not a report</title>");
  expect_refusal(folder, "report " + ball + " -o mine", 2, "mine.html: the file exists and is not a report's page");
  expect_refusal(folder, "report " + ball + " --cache junk.obj/cache", 2, "choose another folder for --cache");
  expect_refusal(folder, "report " + ball + " --voxel 10m", 3, "is larger than the mesh");
  expect_refusal(folder, "report", 1, "MESH... is required");
}

TEST(Report, ASettingWhoseBakeLeavesACrackOpenIsLeftOut) {
  const TemporaryFolder folder;
  write_cracked_cube(folder / "crack.obj");
  const Outcome run = vpsbake(
      folder, "report crack.obj --repair stitch --voxel 2.2mm --poses 3 --rounds 1 --without hull,hacd,gimpact,fcl");
  ASSERT_EQ(run.code, 0) << run.err;
  const Json mesh = Json::parse(read_file(folder / "report.json"))["meshes"][0];
  std::size_t leaks = 0;
  for (const Json& one : mesh["left_out"]) leaks += one["why"].get<std::string>().find("leaks") != std::string::npos;
  EXPECT_GT(leaks, 0U);
  for (const Json& row : mesh["rows"]) {
    if (!row["setting"].is_null()) {
      EXPECT_GT(row["setting"]["voxel_size"], 0.0018) << row["name"];
    }
  }
}

}  // namespace
}  // namespace vps::test
