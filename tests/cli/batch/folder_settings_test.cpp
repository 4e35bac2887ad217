// SPDX-License-Identifier: GPL-3.0-or-later
// Settings of folders and files: vpsbake.toml.
#include "tests/cli/batch/batch_folder.h"

namespace vps::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBakeAll = "batch meshes -o out --voxel 10mm";

TEST(FolderSettings, TheNearestSettingsWin) {
  const BatchFolder folder;
  folder.add("cube.obj");
  folder.add("fine/cube.obj");
  folder.add("fine/deeper/cube.obj");
  folder.add("fine/deeper/special_1.obj");
  folder.add("fine/deeper/old.obj");
  folder.add_text("fine/vpsbake.toml", "voxel = \"5mm\"\nfields = [\"scaled\", \"layers\"]\n");
  folder.add_text("fine/deeper/vpsbake.toml",
                  "resolution = 12\n[[files]]\nmatch = \"special_*\"\nvoxel = \"4mm\"\noutput = \"named.vps.hdf\"\n"
                  "[[files]]\nmatch = [\"old.obj\", \"older.obj\"]\nskip = true\n");
  const BatchOutcome run = run_batch(folder, kBakeAll);
  EXPECT_EQ(run.code, 0) << run.err;
  std::map<std::string, std::string> options;
  for (const auto& item : run.json["items"]) options[item["asset"]] = item["options"].dump();
  EXPECT_EQ(options, (std::map<std::string, std::string>{
                         {"out/cube.vps.hdf", R"({"voxel":"10mm"})"},
                         {"out/fine/cube.vps.hdf", R"({"fields":"scaled,layers","voxel":"5mm"})"},
                         {"out/fine/deeper/cube.vps.hdf", R"({"fields":"scaled,layers","resolution":"12"})"},
                         {"out/fine/deeper/named.vps.hdf", R"({"fields":"scaled,layers","voxel":"4mm"})"}}));
}

TEST(FolderSettings, AGlobThatMatchesNoMeshIsNoted) {
  const BatchFolder folder;
  folder.add("cube.obj");
  folder.add("parts/cube.obj");
  folder.add_text("vpsbake.toml", "[[files]]\nmatch = [\"gear*.obj\", \"parts/cube.obj\"]\nskip = true\n");
  folder.add_text("parts/vpsbake.toml", "[[files]]\nmatch = \"cube.obj\"\nvoxel = \"20mm\"\n");
  const std::string note = "vpsbake: note: meshes/vpsbake.toml: no mesh matches 'gear*.obj'; check the glob\n";
  EXPECT_EQ(vpsbake(folder, kBakeAll).err, note);
  EXPECT_EQ(vpsbake(folder, "plan meshes -o jobs.jsonl --into out --voxel 10mm").err, note);
  EXPECT_EQ(vpsbake(folder, std::string(kBakeAll) + " -q").err, "");
  EXPECT_EQ(vpsbake(folder, std::string(kBakeAll) + " --include '*.obj'").err, "") << "others may match it";
  EXPECT_EQ(vpsbake(folder, "batch meshes/cube.obj -o out --voxel 10mm").err, "") << "others may match it";
  EXPECT_EQ(vpsbake(folder, std::string(kBakeAll) + " --include '*.obj' --exclude 'parts/' --exclude '*.stl'").err,
            "vpsbake: note: command line: no mesh matches '*.stl'; check the glob\n");
}

TEST(FolderSettings, WrongSettingsNameTheirLine) {
  const BatchFolder folder;
  folder.add("cube.obj");
  const auto expect_line = [&](const char* text, const char* why) {
    folder.add_text("vpsbake.toml", text);
    expect_refusal(folder, kBakeAll, 3, why);
  };
  expect_line("\nvoxl = \"5mm\"\n", "vpsbake.toml:2: there is no key 'voxl' here; did you mean 'voxel'?");
  expect_line("voxel = 5\n", "vpsbake.toml:1: voxel: a length needs a unit");
  expect_line("voxel = \n", "vpsbake.toml:1: this is not TOML");
  expect_line("[[files]]\nvoxel = \"1mm\"\n", "an entry of [[files]] says which, with match");
  expect_line("[[files]]\nmatch = \"*\"\noutput = \"../x.vps.hdf\"\n", "vpsbake.toml:3: output is a name below");
  expect_line("exclude = [1]\n", "vpsbake.toml:1: exclude is a list of texts");
  expect_line("voxel = \"\"\n", "vpsbake.toml:1: voxel is empty; give a value");
  expect_line("voxel = true\n", "vpsbake.toml:1: voxel: 'true' is not a length");
  expect_line("voxel = \"1mm\"\nresolution = 10\n", "vpsbake.toml:1: --voxel excludes --resolution");
  expect_line("\n[[files]]\nmatch = \"*\"\nvoxel = \"1mm\"\nmax-error = \"1mm\"\n", "vpsbake.toml:2: ");
}

TEST(FolderSettings, FlagsAreTrueOrFalse) {
  const BatchFolder folder;
  folder.add("cube.obj");
  for (const char* const flag : {"true", "false"}) {
    folder.add_text("vpsbake.toml", std::string("voxel = \"10mm\"\nprove-bound = ") + flag + '\n');
    ASSERT_EQ(vpsbake(folder, "batch meshes -o out").code, 0);
    const std::string info = vpsbake(folder, "explain out/cube.vps.hdf -o .").out;
    const std::string state = std::string("prove-bound ") + (flag[0] == 't' ? "on" : "off");
    EXPECT_NE(info.find(state), std::string::npos) << info;
  }
}

TEST(FolderSettings, SettingsThatAreNoFileAreRefused) {
  const BatchFolder folder;
  folder.add("cube.obj");
  fs::create_symlink("absent", folder / "meshes/vpsbake.toml");
  expect_refusal(folder, kBakeAll, 3, "vpsbake.toml: it is no regular file");
  fs::remove(folder / "meshes/vpsbake.toml");
  expect_refusal(folder, std::string(kBakeAll) + " --parts pointshell --fields real", 3, "--fields needs the voxelmap");
}

}  // namespace
}  // namespace vps::test
