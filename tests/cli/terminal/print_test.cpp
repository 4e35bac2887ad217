// SPDX-License-Identifier: GPL-3.0-or-later
// Results fit a terminal, and verdicts have colours there.
#include <gtest/gtest.h>

#include <regex>
#include <sstream>

#include "tests/cli/program.h"
#include "tests/cli/terminal/terminal.h"

namespace vps::test {
namespace {

// What a terminal shows, without colours; each painting of the line of progress is a line.
std::vector<std::string> shown_lines(std::string text) {
  text = std::regex_replace(text, std::regex("\033\\[K"), "\n");
  text = std::regex_replace(text, std::regex("\033\\[[0-9;]*m"), "");
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(Print, NoLineOfACommandIsWiderThanATerminalOf100Columns) {
  const TemporaryFolder folder;
  for (const char* const name : {"nut", "cube"})
    ASSERT_EQ(vpsbake(folder, sample(name) + " --resolution 10 -o " + name + ".vps.hdf").code, 0);
  write_file(folder / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\n");
  std::filesystem::create_directory(folder / "meshes");
  for (const char* const name : {"thin_plate.obj", "gear.obj"})
    std::filesystem::copy_file(sample(std::string(name, std::string_view(name).find('.')).c_str()),
                               folder / "meshes" / name);
  std::size_t folded = 0;
  for (const std::string& command :
       {"check " + sample("nut"), std::string("check open.obj"), std::string("open.obj"),
        sample("thin_plate") + " --resolution 20 -v -o a.vps.hdf", std::string("info nut.vps.hdf"),
        "validate nut.vps.hdf --mesh " + sample("nut"), std::string("explain nut.vps.hdf"),
        std::string("compare nut.vps.hdf cube.vps.hdf"), std::string("slice nut.vps.hdf --at 9m"),
        std::string("batch meshes open.obj -o assets --resolution 10"), std::string("stress --list"),
        std::string("--help"), std::string("batch --help"), std::string("version"),
        std::string("nut.obj --repiar fill"), std::string("validate nut.vps.hdf --samples 10")}) {
    for (const std::string& line : shown_lines(on_terminal(folder, "TERM=xterm", command, 100))) {
      EXPECT_LE(line.size(), 100U) << command << ": " << line;
      folded += line.size() > 85 ? 1 : 0;
    }
  }
  EXPECT_GT(folded, 20U) << "the width is used";
}

TEST(Print, ContinuedLinesStandBelowTheirColumn) {
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("nut") + " --resolution 10 -o nut.vps.hdf").code, 0);
  const std::vector<std::string> lines =
      shown_lines(on_terminal(folder, "TERM=xterm", "validate nut.vps.hdf --mesh " + sample("nut"), 100));
  std::size_t continued = 0;
  for (const std::string& line : lines) {
    const std::size_t begin = line.find_first_not_of(' ');
    if (line.empty() || begin < 3) continue;
    EXPECT_EQ(begin, 26U) << line;
    ++continued;
  }
  EXPECT_GT(continued, 1U);
}

TEST(Print, VerdictsHaveColoursOnTerminalsThatWantThem) {
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --resolution 10 -o cube.vps.hdf").code, 0);
  write_file(folder / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\n");
  const std::string green = "\033[1;32m", yellow = "\033[1;33m", red = "\033[1;31m";
  const auto says = [&](const std::string& settings, const std::string& command, const std::string& text) {
    return on_terminal(folder, settings, command, 100).find(text) != std::string::npos;
  };
  EXPECT_TRUE(says("TERM=xterm", "validate cube.vps.hdf", green + "ok      \033[0m structure"));
  EXPECT_TRUE(says("TERM=xterm", "validate cube.vps.hdf", green + "valid\033[0m"));
  EXPECT_TRUE(says("TERM=xterm", "check " + sample("cube"), green + "it bakes\033[0m"));
  EXPECT_TRUE(says("TERM=xterm", "check open.obj", yellow + "4\033[0m edges with one triangle"));
  EXPECT_TRUE(says("TERM=xterm", "check open.obj", red + "error:\033[0m open.obj"));
  for (const std::string& command : {std::string("validate cube.vps.hdf"), std::string("check open.obj")}) {
    EXPECT_FALSE(says("TERM=xterm NO_COLOR=1", command, "\033[1;3")) << command;
    EXPECT_FALSE(says("TERM=dumb", command, "\033")) << command;
    EXPECT_EQ(vpsbake(folder, command).out.find('\033'), std::string::npos) << command;
  }
}

TEST(Print, QuietAndVerboseBatches) {
  const TemporaryFolder folder;
  const std::string batch = "batch " + sample("cube") + " " + sample("peg") + " -o assets --resolution 10";
  Outcome run = vpsbake(folder, batch + " -q");
  EXPECT_EQ(run.code, 0);
  EXPECT_EQ(run.out + run.err, "");
  EXPECT_EQ(on_terminal(folder, "TERM=xterm", batch + " -q"), "");
  EXPECT_EQ(vpsbake(folder, batch).out.find("unchanged    cube"), std::string::npos);
  EXPECT_NE(vpsbake(folder, batch + " -v").out.find("unchanged    cube.vps.hdf"), std::string::npos);
  EXPECT_EQ(vpsbake(folder, batch + " -q -v").code, 1);
  write_file(folder / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\n");
  run = vpsbake(folder, "batch open.obj -o open -q");
  EXPECT_EQ(run.code, 5);
  EXPECT_EQ(run.out, "");
  EXPECT_TRUE(run.err.starts_with("vpsbake: error: ./open.obj: ")) << run.err;
}

}  // namespace
}  // namespace vps::test
