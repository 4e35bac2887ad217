// SPDX-License-Identifier: GPL-3.0-or-later
// --depfile, checked with make.
#include <gtest/gtest.h>

#include "tests/cli/program.h"

namespace vps::test {
namespace {

TEST(Depfile, MakeReadsEveryNameAsItIs) {
  const TemporaryFolder folder;
  for (const char* name : {"cube", "my cube", "a#b", "a$b", "it's", "back\\slash", "end\\ here"}) {
    const std::string mesh = std::string(name) + ".obj", asset = std::string(name) + ".vps.hdf";
    std::filesystem::copy_file(sample("cube"), folder / mesh);
    ASSERT_EQ(vpsbake(folder, "\"$(printf '%s' '" + (mesh == "it's.obj" ? "it'\\''s.obj" : mesh) +
                                  "')\" --voxel 9mm --depfile d.mk")
                  .code,
              0);
    // Make knows the asset and its mesh. The second rule is for removed meshes: without it make stops at a missing one.
    const std::string rules = read_file(folder / "d.mk");
    const std::size_t second = rules.find('\n', rules.find(" \\\n") + 3) + 1;
    EXPECT_EQ(std::count(rules.begin() + second, rules.end(), '\n'), 1) << rules;
    write_file(folder / "rule.mk", rules.substr(0, second));
    const auto outdated = [&](const char* file = "rule.mk") {
      write_file(folder / "Makefile", std::string("all:\ninclude ") + file + "\n");
      const std::string quoted = asset == "it's.vps.hdf" ? "it'\\''s.vps.hdf" : asset;
      return std::system(("cd " + folder.path().string() + " && make -q '" + quoted + "' >make.txt 2>&1").c_str()) != 0;
    };
    EXPECT_FALSE(outdated()) << name << "\n" << read_file(folder / "d.mk") << read_file(folder / "make.txt");
    std::filesystem::remove(folder / mesh);
    EXPECT_TRUE(outdated()) << name << "\n" << rules;
    EXPECT_FALSE(outdated("d.mk")) << name << "\n" << rules << read_file(folder / "make.txt");
  }
}

TEST(Depfile, BuffersAreListedAndCacheHitsWriteItToo) {
  const TemporaryFolder folder;
  const std::string meshes = std::string(VPS_DOCS) + "/examples/cmake_project/meshes/";
  for (const char* name : {"wedge.gltf", "wedge.bin"}) std::filesystem::copy_file(meshes + name, folder / name);
  const std::string expected = "out.vps.hdf: \\\n  wedge.gltf \\\n  wedge.bin\nwedge.gltf:\nwedge.bin:\n";
  for (const char* state : {"miss", "hit"}) {
    std::filesystem::remove(folder / "d");
    const Outcome run = vpsbake(folder, "wedge.gltf --voxel 1mm -o out.vps.hdf --depfile d --cache kept --json");
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_NE(run.out.find(std::string("\"cache\": \"") + state), std::string::npos) << run.out;
    EXPECT_EQ(read_file(folder / "d"), expected);
  }
}

TEST(Depfile, NamesOfBuffersMayBePercentEncoded) {
  const TemporaryFolder folder;
  const std::string meshes = std::string(VPS_DOCS) + "/examples/cmake_project/meshes/";
  std::string text = read_file(meshes + "wedge.gltf");
  text.replace(text.find("wedge.bin"), 9, "a%20w%65dge%2.bin");
  write_file(folder / "w.gltf", text);
  expect_refusal(folder, "w.gltf --voxel 1mm", 3, "could not open referenced file");
  std::filesystem::copy_file(meshes + "wedge.bin", folder / "a wedge%2.bin");
  ASSERT_EQ(vpsbake(folder, "w.gltf --voxel 1mm -o out.vps.hdf --depfile d").code, 0);
  EXPECT_EQ(read_file(folder / "d"), "out.vps.hdf: \\\n  w.gltf \\\n  a\\ wedge%2.bin\nw.gltf:\na\\ wedge%2.bin:\n");
}

TEST(Depfile, NothingIsOverwrittenNorWrittenWithoutAnAsset) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(sample("cube"), folder / "cube.obj");
  const std::string bake = "cube.obj --voxel 9mm --depfile ";
  expect_refusal(folder, bake + "cube.obj", 2, "cube.obj: this is a file of the mesh");
  expect_refusal(folder, bake + "$PWD/cube.vps.hdf", 2, "this is written already");
  for (const char* text : {"precious\n", "services:\n  web:\n", "all: \\\n  a\n"}) {
    write_file(folder / "notes.txt", text);
    expect_refusal(folder, bake + "notes.txt", 2, "the file exists and is not a depfile");
  }
  expect_refusal(folder, bake + "no/d", 2, "the folder does not exist");
  expect_refusal(folder, "no.obj --voxel 9mm --depfile d", 2, "no.obj: the file does not exist");
  expect_refusal(folder, "cube.obj --voxel 9mm --depfile d -o \"a\nb\"", 2, "make knows no names with line breaks");
  expect_refusal(folder, "cube.obj --voxel 9mm --depfile d -o a%b.vps.hdf", 2, "make knows no names with %");
  for (const char* name : {"a=b", "a;b", "a|b"}) {
    std::filesystem::rename(folder / "cube.obj", folder / (std::string(name) + ".obj"));
    expect_refusal(folder, "'" + std::string(name) + ".obj' --voxel 9mm --depfile d -o o.vps.hdf", 2,
                   std::string("make knows no names with ") + name[1] + "; rename " + name + ".obj");
    std::filesystem::rename(folder / (std::string(name) + ".obj"), folder / "cube.obj");
  }
}

}  // namespace
}  // namespace vps::test
