// SPDX-License-Identifier: GPL-3.0-or-later
// The name "-": meshes, assets and lists from standard input, outputs to standard output.
#include <filesystem>

#include "tests/cli/program.h"
#include "tests/cli/terminal/terminal.h"

namespace vps::test {
namespace {

namespace fs = std::filesystem;

// Runs a shell line in which $V is the program.
Outcome shell(const TemporaryFolder& folder, const std::string& line) {
  const std::string command =
      "cd " + folder.path().string() + " && V=" + VPSBAKE + "; { " + line + "; } >out.txt 2>err.txt";
  const int status = std::system(("unset VPSBAKE_CACHE; " + command).c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, read_file(folder / "out.txt"), read_file(folder / "err.txt")};
}

void expect_error(const Outcome& run, int code, const std::string& why) {
  EXPECT_EQ(run.code, code) << run.err;
  EXPECT_TRUE(run.err.starts_with("vpsbake: error: ")) << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_NE(run.err.find(why), std::string::npos) << run.err;
}

TEST(StandardStreams, APipeGivesTheBytesThatFilesGive) {
  const TemporaryFolder folder;
  const std::string wanted = file_baked(folder, sample("cube") + " --resolution 10");
  const Outcome baked = shell(folder, "cat " + sample("cube") + " | $V - --resolution 10 -o -");
  EXPECT_EQ(baked.code, 0) << baked.err;
  EXPECT_TRUE(baked.out == wanted);
  EXPECT_NE(baked.err.find("-: 100 mm x 100 mm x 100 mm, voxel"), std::string::npos) << baked.err;
  EXPECT_TRUE(shell(folder, "$V - --resolution 10 <" + sample("cube")).out == wanted) << "standard output by itself";
  EXPECT_EQ(shell(folder, "$V " + sample("cube") + " -q --resolution 10 -o -").err, "");
}

TEST(StandardStreams, CommandsReadAssetsFromAPipe) {
  const TemporaryFolder folder;
  write_file(folder / "a.vps.hdf", file_baked(folder, sample("cube") + " --resolution 10"));
  EXPECT_TRUE(shell(folder, "cat a.vps.hdf | $V info -").out.starts_with("-: format"));
  EXPECT_NE(shell(folder, "cat a.vps.hdf | $V validate -").out.find("-: valid"), std::string::npos);
  EXPECT_TRUE(shell(folder, "cat a.vps.hdf | $V explain -").out.starts_with("it was baked with\n"));
  EXPECT_EQ(shell(folder, "cat a.vps.hdf | $V compare - a.vps.hdf").code, 0);
  EXPECT_TRUE(shell(folder, "cat a.vps.hdf | $V slice -").out.starts_with("\x89PNG"));
  EXPECT_TRUE(shell(folder, "$V export --to ply -o - a.vps.hdf").out.starts_with("ply\n"));
  EXPECT_TRUE(shell(folder, "$V view -o - a.vps.hdf").out.starts_with("<!doctype html>"));
}

TEST(StandardStreams, ListsAndReportsOfBatchesGoThroughPipes) {
  const TemporaryFolder folder;
  const Outcome run =
      shell(folder, "$V plan " + sample("cube") + " --resolution 10 --into a -o - | $V run - --junit -");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(run.out.starts_with("<?xml")) << run.out;
  EXPECT_NE(run.err.find("1 mesh: 1 baked"), std::string::npos) << run.err;
  EXPECT_TRUE(fs::exists(folder / "a/cube.vps.hdf"));
}

TEST(StandardStreams, UnusableInputGetsOneLine) {
  const TemporaryFolder folder;
  write_file(folder / "junk", std::string(10'000, '\x17'));
  write_file(folder / "a.vps.hdf", "");
  expect_error(shell(folder, "$V - -o b.vps.hdf </dev/null"), 3, "standard input is empty");
  expect_error(shell(folder, "$V info - </dev/null"), 3, "standard input is empty");
  expect_error(shell(folder, "$V run - </dev/null"), 3, "standard input is empty");
  expect_error(shell(folder, "$V validate - <."), 2, "standard input cannot be");
  expect_error(shell(folder, "$V - -o b.vps.hdf --import-memory 5kB <junk"), 3, "standard input has more than 5 kB");
  expect_error(shell(folder, "sleep 1 | $V - -o b.vps.hdf --import-timeout 100ms"), 3, "did not end within 0.1 s");
  expect_error(shell(folder, "$V - -o b.vps.hdf <junk"), 3, "add --format");
  expect_error(shell(folder, "$V - -o b.vps.hdf --format stl <junk"), 3, "neither text that begins with 'solid'");
  expect_error(shell(folder, "$V info - <junk"), 3, "not a vpsbake asset");
  EXPECT_FALSE(fs::exists(folder / "b.vps.hdf"));
}

TEST(StandardStreams, WhatDoesNotGoTogetherIsRefused) {
  const TemporaryFolder folder;
  expect_refusal(folder, sample("cube") + " -o - --json", 1, "--json and the asset both go to standard output");
  expect_refusal(folder, "- -o a.vps.hdf --depfile d", 1, "--depfile needs a mesh");
  expect_refusal(folder, "batch " + sample("cube") + " -o -", 1, "takes a name, not -");
  expect_refusal(folder, "report " + sample("cube") + " -o -", 1, "takes a name, not -");
  expect_refusal(folder, "plan " + sample("cube") + " --into a -o - --emit slurm", 1, "--emit needs a file of jobs");
  const std::string text = on_terminal(folder, "TERM=xterm", sample("cube") + " --resolution 10 -o -", 100);
  EXPECT_NE(text.find("standard output is a terminal"), std::string::npos) << text;
}

// As other programs do. One that is started with SIGPIPE ignored reports an error.
TEST(StandardStreams, AClosedPipeEndsTheProgramQuietly) {
  const TemporaryFolder folder;
  const auto bake = [&](const char* before) {
    return shell(folder, std::string("rm -f code; { (") + before + "sleep 0.1; $V " + sample("cube") +
                             " -q --resolution 30 -o -; echo $? >part; mv part code) | true; }; "
                             "while ! [ -e code ]; do sleep 0.01; done; cat code");
  };
  EXPECT_EQ(bake("").err, "");
  const Outcome told = bake("trap '' PIPE; ");
  EXPECT_NE(told.err.find("vpsbake: error: standard output: "), std::string::npos) << told.err;
  EXPECT_EQ(std::count(told.err.begin(), told.err.end(), '\n'), 1) << told.err;
  EXPECT_EQ(told.out, "2\n");
}

}  // namespace
}  // namespace vps::test
