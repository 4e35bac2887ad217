// SPDX-License-Identifier: GPL-3.0-or-later
// Files made to crash or to stop the program get one line that says why.
#include <filesystem>
#include <functional>
#include <span>

#include "cli/tools/toml_keys.h"
#include "formats/vps_format.h"
#include "tests/cli/program.h"

namespace vps::test {
namespace {

namespace fs = std::filesystem;
using cli::line_of_deep_key;

std::string dotted(std::size_t parts) {
  std::string key = "a";
  for (std::size_t i = 1; i < parts; ++i) key += ".a";
  return key;
}

TEST(HostileInput, DeepKeysAreFoundWhereverTheyStand) {
  const std::string deep = dotted(17);
  EXPECT_EQ(line_of_deep_key(dotted(16) + " = 1"), 0);
  EXPECT_EQ(line_of_deep_key(deep + " = 1"), 1);
  EXPECT_EQ(line_of_deep_key("# comment\n\n[" + deep + "]"), 3);
  EXPECT_EQ(line_of_deep_key("[[" + deep + "]]"), 1);
  EXPECT_EQ(line_of_deep_key("b = [{c = {" + deep + " = 1}}]"), 1);
  EXPECT_EQ(line_of_deep_key("b = \"\"\"\ntext\"\"\"\n" + deep), 3);
  // Quotes at the end of a string belong to it.
  EXPECT_EQ(line_of_deep_key("b = {c = \"\"\"x\"\"\"\", " + deep + " = 1}"), 1);
  EXPECT_EQ(line_of_deep_key("b = {c = '''x''''', " + deep + " = 1}"), 1);
  EXPECT_EQ(line_of_deep_key("b = \"x\\\"\"\n" + deep), 2);
  EXPECT_EQ(line_of_deep_key("'b'. \"c\" ." + dotted(15) + " = 1"), 1);
  for (const std::string& harmless :
       {"b = \"" + deep + "\"", "b = '" + deep + "'", "b = \"\"\"\n" + deep + "\n\"\"\"", "# " + deep,
        std::string("b = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0, "
                    "17.0]"),
        std::string("\""), std::string("'''"), std::string()}) {
    EXPECT_EQ(line_of_deep_key(harmless), 0) << harmless;
  }
}

TEST(HostileInput, KeysOfManyPartsAreRefusedInScenesAndFolders) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "meshes");
  fs::copy_file(sample("cube"), folder / "meshes/cube.obj");
  for (const std::string& text : {dotted(40'000) + " = 1\n", "[" + dotted(40'000) + "]\n"}) {
    write_file(folder / "scene.toml", text);
    expect_refusal(folder, "scene scene.toml", 3, "scene.toml:1: a key has more than 16 parts");
    write_file(folder / "meshes/vpsbake.toml", text);
    expect_refusal(folder, "batch meshes --voxel 10mm -o assets", 3, "vpsbake.toml:1: a key has more than 16 parts");
  }
}

// Changes a scalar of an asset's header, and the hash with it.
template <class Change>
void change_info(const fs::path& file, const Change& change) {
  std::string text = read_file(file);
  const std::span<std::byte> bytes = std::as_writable_bytes(std::span(text));
  Directory directory;
  ASSERT_EQ(decode_directory(bytes, directory), Status::ok);
  change(directory.info);
  encode_directory(directory, bytes.first<kUserBlockBytes>());
  write_file(file, text);
}

TEST(HostileInput, AssetsWithAbsurdScalarsAreRefusedByEveryCommand) {
  const TemporaryFolder folder;
  const std::string bytes = file_baked(folder, sample("cube") + " --voxel 10mm");
  const std::function<void(AssetInfo&)> changes[] = {
      [](AssetInfo& info) { info.band_outer = 1e300; },  // the picture's number of colours
      [](AssetInfo& info) { info.bounds_max[0] = 1e9; },
      [](AssetInfo& info) { info.voxel_size = 1e-12; },
  };
  for (const auto& change : changes) {
    write_file(folder / "a.vps.hdf", bytes);
    change_info(folder / "a.vps.hdf", change);
    for (const char* const command : {"slice", "export --to obj", "export --to cdf", "export --to vtkhdf", "view"}) {
      expect_refusal(folder, std::string(command) + " a.vps.hdf", 3, "a value in the header is out of range");
    }
  }
}

TEST(HostileInput, AGeneratorThatIsNoUtf8IsCompared) {
  const TemporaryFolder folder;
  const std::string bytes = file_baked(folder, sample("cube") + " --voxel 10mm");
  write_file(folder / "a.vps.hdf", bytes);
  write_file(folder / "b.vps.hdf", bytes);
  change_info(folder / "b.vps.hdf", [](AssetInfo& info) { info.generator = {'\xFF', '\x01'}; });
  const Outcome run = vpsbake(folder, "compare a.vps.hdf b.vps.hdf");
  EXPECT_NE(run.code, 4) << run.err;
  EXPECT_EQ(run.err.find("internal error"), std::string::npos) << run.err;
}

TEST(HostileInput, ACdfThatReachesFartherThanItsCellsCanBeCountedIsRefused) {
  const TemporaryFolder folder;
  write_file(folder / "a.vps.hdf", file_baked(folder, sample("cube") + " --voxel 10mm"));
  for (const char* const reach : {"1e6km", "1e20km", "1e200m"}) {
    expect_refusal(folder, std::string("export a.vps.hdf --to cdf --reach ") + reach, 3,
                   "cells are too many for this format");
  }
}

#ifndef VPS_SANITIZE  // sanitizers need all addresses
// Pairs grow with the square of the bodies.
TEST(HostileInput, ASceneOfManyBodiesIsPlannedInLittleMemory) {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 8000; ++i)
    text += "[[body]]\nname = \"" + std::to_string(i) + "\"\nshape = \"sphere\"\nradius = \"1cm\"\nmass = \"1g\"\n";
  write_file(folder / "scene.toml", text);
  const std::string limited = "ulimit -v 2000000; exec " VPSBAKE " scene scene.toml --dry-run >out.txt 2>err.txt";
  EXPECT_EQ(std::system(("cd " + folder.path().string() + " && " + limited).c_str()), 0)
      << read_file(folder / "err.txt");
  EXPECT_NE(read_file(folder / "out.txt").find("31996000 of 31996000 pairs can meet"), std::string::npos);
}
#endif

TEST(HostileInput, AReportOfTheCacheThatHasNoEndIsNoReport) {
  const TemporaryFolder folder;
  const std::string bake = sample("cube") + " --voxel 10mm --cache cache -o a.vps.hdf";
  ASSERT_EQ(vpsbake(folder, bake).code, 0);
  for (const fs::path& file : files_of_entries(folder / "cache")) {
    if (file.extension() != ".json") continue;
    fs::remove(file);
    fs::create_symlink("/dev/zero", file);
  }
  const Outcome verified = vpsbake(folder, "cache verify --cache cache");
  EXPECT_EQ(verified.code, 5) << verified.err;
  EXPECT_NE((verified.out + verified.err).find("its report is missing or damaged"), std::string::npos);
  const Outcome again = vpsbake(folder, bake);
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_NE(again.out.find("cache: miss"), std::string::npos) << again.out;
}

}  // namespace
}  // namespace vps::test
