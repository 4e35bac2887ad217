// SPDX-License-Identifier: GPL-3.0-or-later
// Bakes folders of meshes as a build engineer does.
#include "formats/fields.h"
#include "tests/cli/batch/batch_folder.h"
#include "tests/cli/schema.h"

namespace vps::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBake = "batch meshes -o out --voxel 10mm";

TEST(Batch, AFolderIsBakedAsEachMeshAloneWouldBe) {
  const BatchFolder folder;
  folder.add("cube.obj");
  folder.add("deep/er/hole.obj", "hole");
  folder.add("deep/peg.obj", "peg");
  folder.add(".hidden/cube.obj");
  folder.add_text("notes.txt", "no mesh");
  const BatchOutcome run = run_batch(folder, "batch meshes -o out --voxel 5mm");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.states,
            (States{{"cube.vps.hdf", "baked"}, {"deep/er/hole.vps.hdf", "baked"}, {"deep/peg.vps.hdf", "baked"}}));
  ASSERT_EQ(vpsbake(folder, sample("hole") + " --voxel 5mm -o alone.vps.hdf").code, 0);
  EXPECT_EQ(folder.asset("deep/er/hole.vps.hdf"), read_file(folder / "alone.vps.hdf"));
  for (const char* jobs : {"1", "3"}) {
    fs::rename(folder / "out", folder / "before");
    EXPECT_EQ(run_batch(folder, std::string("batch meshes -o out --voxel 5mm --jobs ") + jobs).code, 0);
    for (const char* name : {"cube.vps.hdf", "deep/er/hole.vps.hdf", "deep/peg.vps.hdf", "vpsbake.json"})
      EXPECT_EQ(folder.asset(name), read_file(folder / (std::string("before/") + name))) << name;
    fs::remove_all(folder / "before");
  }
}

TEST(Batch, OneBadFileStopsNothing) {
  const BatchFolder folder;
  folder.add("a/good.obj");
  folder.add_text("a/bad.obj", "junk");
  folder.add_text("empty.stl", "");
  folder.add("z.obj", "hole");
  const BatchOutcome run = run_batch(folder, kBake);
  EXPECT_EQ(run.code, 5);
  EXPECT_EQ(run.states, (States{{"a/bad.vps.hdf", "FAILED"},
                                {"a/good.vps.hdf", "baked"},
                                {"empty.vps.hdf", "FAILED"},
                                {"z.vps.hdf", "baked"}}));
  EXPECT_NE(run.err.find("vpsbake: error: meshes/empty.stl: the file is empty; export it again\n"), std::string::npos)
      << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 2) << run.err;
  const auto manifest = nlohmann::json::parse(folder.asset("vpsbake.json"));
  EXPECT_EQ(manifest["assets"].size(), 2U);
  EXPECT_EQ(manifest["missing"], (std::vector<std::string>{"a/bad.vps.hdf", "empty.vps.hdf"}));
}

TEST(Batch, WhatIsUpToDateKeepsItsTimeStamp) {
  const BatchFolder folder;
  for (const char* name : {"same.obj", "touched.obj", "changed.obj", "damaged.obj", "older.obj", "removed.obj"})
    folder.add(name);
  // The meshes differ only in a comment, so that each has its own asset.
  for (const auto& entry : fs::directory_iterator(folder / "meshes"))
    write_file(entry.path(), read_file(entry.path()) + "# " + entry.path().filename().string() + "\n");
  ASSERT_EQ(run_batch(folder, kBake).code, 0);
  const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(1000);
  for (const auto& entry : fs::directory_iterator(folder / "out")) fs::last_write_time(entry.path(), long_ago);
  fs::last_write_time(folder / "meshes/touched.obj", fs::file_time_type::clock::now() + std::chrono::hours(1));
  // The old time stamp is restored: only the bytes show the change.
  const auto before = fs::last_write_time(folder / "meshes/changed.obj");
  write_file(folder / "meshes/changed.obj", read_file(folder / "meshes/changed.obj") + "# edited\n");
  fs::last_write_time(folder / "meshes/changed.obj", before);
  std::string damaged = folder.asset("damaged.vps.hdf");
  damaged[damaged.size() / 2] ^= 1;
  write_file(folder / "out/damaged.vps.hdf", damaged);
  std::string older = folder.asset("older.vps.hdf");
  older[detail::kMajorOffset] ^= 1;
  write_file(folder / "out/older.vps.hdf", older);
  fs::remove(folder / "out/removed.vps.hdf");
  const BatchOutcome again = run_batch(folder, kBake);
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(again.states, (States{{"changed.vps.hdf", "baked"},
                                  {"damaged.vps.hdf", "baked"},
                                  {"older.vps.hdf", "baked"},
                                  {"removed.vps.hdf", "baked"},
                                  {"same.vps.hdf", "unchanged"},
                                  {"touched.vps.hdf", "unchanged"}}));
  EXPECT_EQ(again.said.at("changed.vps.hdf"), "the mesh changed; ");
  EXPECT_NE(again.said.at("damaged.vps.hdf").find("damaged"), std::string::npos);
  EXPECT_TRUE(again.said.at("older.vps.hdf").starts_with("the asset has another format version;"));
  EXPECT_EQ(again.said.at("removed.vps.hdf"), "there is no asset yet; ");
  for (const char* name : {"same", "touched"})
    EXPECT_EQ(fs::last_write_time(folder / ("out/" + std::string(name) + ".vps.hdf")), long_ago) << name;
  EXPECT_GT(fs::last_write_time(folder / "out/changed.vps.hdf"), long_ago);
  EXPECT_GT(fs::last_write_time(folder / "out/vpsbake.json"), long_ago) << "make compares it with the meshes";
  const BatchOutcome finer = run_batch(folder, "batch meshes -o out --voxel 9mm --fields scaled,layers --dry-run");
  EXPECT_EQ(finer.said.at("same.vps.hdf"), "voxel was 10 mm, is 9 mm; field layers was off, is on; ");
}

TEST(Batch, IdenticalMeshesAreBakedOnce) {
  const BatchFolder folder;
  for (const char* name : {"a.obj", "b.obj", "c/d.obj"}) folder.add(name);
  folder.add("e.obj", "hole");
  for (const std::string cache : {"", "cache"}) {
    BatchOutcome run = run_batch(folder, std::string(kBake) + " --jobs 3", cache);
    EXPECT_EQ(run.code, 0);
    std::map<std::string, int> counts;
    for (const auto& [name, state] : run.states) ++counts[state];
    EXPECT_EQ(counts, (std::map<std::string, int>{{"baked", 2}, {"copied", 2}}));
    EXPECT_EQ(folder.asset("a.vps.hdf"), folder.asset("c/d.vps.hdf"));
    fs::remove_all(folder / "out");
  }
  const BatchOutcome cached = run_batch(folder, kBake, "cache");
  EXPECT_EQ(cached.json["counts"], (nlohmann::json{{"copied", 2}, {"from cache", 2}}));
  folder.add("f.obj");
  const BatchOutcome one_more = run_batch(folder, std::string(kBake) + " --jobs 1");
  EXPECT_EQ(one_more.json["counts"], (nlohmann::json{{"copied", 1}, {"unchanged", 4}}));
}

TEST(Batch, AFileWithAControlCharacterInItsNameIsNamedOnce) {
  const BatchFolder folder;
  folder.add_text("new\nline.obj", "");
  EXPECT_EQ(vpsbake(folder, "batch meshes -o out --resolution 20").err,
            "vpsbake: error: meshes/new?line.obj: the file is empty; export it again\n");
}

TEST(Batch, AnAssetThatCannotBeWrittenIsNamed) {
  const BatchFolder folder;
  folder.add("cube.obj");
  fs::create_directories(folder / "out/cube.vps.hdf");
  for (const char* const how : {"", " --dry-run"}) {
    EXPECT_EQ(vpsbake(folder, std::string("batch meshes -o out --resolution 20") + how).err,
              "vpsbake: error: meshes/cube.obj: out/cube.vps.hdf: this is a folder; give the name of a file\n");
  }
}

TEST(Batch, FailuresAreRememberedUntilMeshOrSettingsChange) {
  const BatchFolder folder;
  folder.add("cube.obj");
  const std::string sheet = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
  folder.add_text("open.obj", sheet);
  const auto bake = [&](const std::string& more = "") {
    return vpsbake(folder, "batch meshes -o out --resolution 20" + more);
  };
  const Outcome first = bake();
  EXPECT_EQ(first.code, 5);
  EXPECT_EQ(std::count(first.err.begin(), first.err.end(), '\n'), 1) << first.err;
  EXPECT_EQ(first.out.find("the mesh is open"), std::string::npos) << "errors once: " << first.out;
  EXPECT_NE(first.out.find("2 meshes: 1 baked, 1 FAILED; "), std::string::npos) << first.out;
  EXPECT_NE(first.out.find("\nto bake those that failed: try 1 with --repair fill\n"), std::string::npos) << first.out;
  const Outcome second = bake();
  EXPECT_EQ(second.code, 5);
  EXPECT_EQ(second.err, first.err);
  EXPECT_NE(second.out.find("1 unchanged, 1 FAILED (1 as before, not tried again); "), std::string::npos) << second.out;
  EXPECT_NE(vpsbake(folder, "explain out/open.vps.hdf").out.find("now: the same batch would not try it again"),
            std::string::npos);
  EXPECT_NE(bake().out.find("as before"), std::string::npos) << "remembered from the second run";
  folder.add_text("open.obj", sheet + "# touched\n");
  EXPECT_NE(vpsbake(folder, "explain out/open.vps.hdf").out.find("now: the same batch would bake it again"),
            std::string::npos);
  EXPECT_EQ(bake().out.find("as before"), std::string::npos);
  EXPECT_EQ(bake(" --repair fill").code, 0);
  EXPECT_EQ(bake(" --repair none").code, 5);
}

TEST(Batch, ALogOfJunkIsNoFailure) {
  const BatchFolder folder;
  folder.add("cube.obj");
  for (const char* const junk : {"{", "[]", R"({"items": 3})", R"({"items": [1, {"exit_code": "x"}]})",
                                 R"({"items": [{"exit_code": 3, "key": 1, "error": []}]})"}) {
    fs::create_directories(folder / "out");
    write_file(folder / "out/.vpsbake-run.json", junk);
    EXPECT_EQ(vpsbake(folder, "batch meshes -o out --resolution 20").code, 0) << junk;
  }
}

TEST(Batch, FailuresForWantOfTimeAreTriedAgain) {
  const BatchFolder folder;
  folder.add("cube.obj");
  const std::string bake = "batch meshes -o out --voxel 10mm";
  EXPECT_EQ(vpsbake(folder, bake + " --timeout 1ms").code, 5);
  EXPECT_EQ(vpsbake(folder, bake).code, 0);
}

TEST(Batch, AMeshThatIsGivenTwiceIsBakedOnce) {
  const BatchFolder folder;
  folder.add("cube.obj");
  const BatchOutcome run = run_batch(folder, "batch meshes meshes/cube.obj ./meshes -o out --voxel 10mm");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.json["items"].size(), 1U);
}

TEST(Batch, WhatFailsIsMissingThoughAnOlderAssetIsLeft) {
  const BatchFolder folder;
  folder.add("cube.obj");
  folder.add("hole.obj", "hole");
  ASSERT_EQ(run_batch(folder, kBake).code, 0);
  write_file(folder / "meshes/cube.obj", "junk");
  EXPECT_EQ(run_batch(folder, kBake).code, 5);
  const auto manifest = nlohmann::json::parse(folder.asset("vpsbake.json"));
  EXPECT_EQ(manifest["missing"], std::vector<std::string>{"cube.vps.hdf"});
  EXPECT_EQ(manifest["assets"].size(), 1U);
}

TEST(Batch, GlobsChooseMeshes) {
  const BatchFolder folder;
  for (const char* name : {"a.obj", "b.obj", "lod/a.obj", "parts/lod/c.obj", "parts/d.obj"}) folder.add(name);
  const auto chosen = [&](const std::string& globs) {
    std::string names;
    for (const auto& [name, state] : run_batch(folder, std::string(kBake) + " --dry-run " + globs).states)
      names += name.substr(0, name.find('.')) + " ";
    return names;
  };
  EXPECT_EQ(chosen(""), "a b lod/a parts/d parts/lod/c ");
  EXPECT_EQ(chosen("--exclude lod"), "a b parts/d ");
  EXPECT_EQ(chosen("--exclude 'parts/*'"), "a b lod/a ");
  EXPECT_EQ(chosen("--include 'a.*' --include d.obj"), "a lod/a parts/d ");
  EXPECT_EQ(chosen("--include '**/a.obj' --exclude '[l]*'"), "a ");
  expect_refusal(folder, std::string(kBake) + " --include nothing", 3, "no mesh is found");
}

TEST(Batch, TwoMeshesOfOneAssetAreRefusedAndTheOthersBaked) {
  const BatchFolder folder;
  folder.add("part.obj");
  fs::copy_file(std::string(VPS_SAMPLE_MESHES) + "/cube.obj", folder / "meshes/other.obj");
  folder.add_text("part.off", "OFF\n");
  const BatchOutcome run = run_batch(folder, kBake);
  EXPECT_EQ(run.code, 5);
  EXPECT_EQ(run.states, (States{{"other.vps.hdf", "baked"}, {"part.vps.hdf", "FAILED"}}));
  EXPECT_NE(run.err.find("meshes/part.obj: meshes/part.off would be written to out/part.vps.hdf as well"),
            std::string::npos)
      << run.err;
  EXPECT_FALSE(fs::exists(folder / "out/part.vps.hdf"));
}

TEST(Batch, ADryRunSaysWhyAndHowLargeAndWritesNothing) {
  const BatchFolder folder;
  folder.add("cube.obj");
  folder.add_text("bad.obj", "junk");
  const BatchOutcome run = run_batch(folder, std::string(kBake) + " --dry-run", "cache");
  EXPECT_EQ(run.code, 5);
  EXPECT_EQ(run.states, (States{{"bad.vps.hdf", "FAILED"}, {"cube.vps.hdf", "to bake"}}));
  EXPECT_EQ(run.said.at("cube.vps.hdf"), "there is no asset yet; ");
  EXPECT_GT(run.json["items"][1]["bytes"], 10000);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"meshes"});
  fs::create_directories(folder / "out/cube.vps.hdf");
  EXPECT_EQ(run_batch(folder, std::string(kBake) + " --dry-run").states,
            (States{{"bad.vps.hdf", "FAILED"}, {"cube.vps.hdf", "FAILED"}}));
  expect_refusal(folder, std::string(kBake) + " --dry-run --depfile d", 1, "--dry-run excludes --depfile");
}

TEST(Batch, ListsNameTheirMeshes) {
  const BatchFolder folder;
  folder.add("a/cube.obj");
  folder.add("b/cube.obj");
  write_file(folder / "list.toml",
             "voxel = \"10mm\"\n[[files]]\nmesh = \"meshes/a/cube.obj\"\n[[files]]\nmesh = \"meshes/b/cube.obj\"\n"
             "voxel = \"20mm\"\noutput = \"b.vps.hdf\"\n[[files]]\nmesh = \"absent.obj\"\n");
  const BatchOutcome run = run_batch(folder, "batch list.toml -o out");
  EXPECT_EQ(run.code, 5);
  EXPECT_EQ(run.states,
            (States{{"absent.vps.hdf", "FAILED"}, {"b.vps.hdf", "baked"}, {"meshes/a/cube.vps.hdf", "baked"}}));
}

TEST(Batch, TimeAndMemoryAreLimited) {
  const BatchFolder folder;
  folder.add("cube.obj");
  const BatchOutcome slow = run_batch(folder, "batch meshes -o out --voxel 0.3mm --timeout 20ms");
  EXPECT_EQ(slow.code, 5);
  EXPECT_NE(slow.said.at("cube.vps.hdf").find("not baked in 0.02 s; raise --timeout"), std::string::npos)
      << slow.said.at("cube.vps.hdf");
  for (const char* jobs : {"1", "2"}) {
    const BatchOutcome large =
        run_batch(folder, std::string("batch meshes -o out --voxel 0.3mm --memory 30MB --jobs ") + jobs);
    EXPECT_EQ(large.code, 5);
    EXPECT_NE(large.said.at("cube.vps.hdf").find("memory"), std::string::npos) << large.said.at("cube.vps.hdf");
  }
  for (const auto& [name, bytes] : files_below(folder / "out")) EXPECT_FALSE(name.ends_with(".hdf")) << name;
}

TEST(Batch, ReportsFollowTheirSchemas) {
  VPS_SCHEMA_CHECK_OR_SKIP();
  const BatchFolder folder;
  folder.add("cube & co.obj");
  folder.add_text("bad.obj", "junk");
  const Outcome run = vpsbake(folder, std::string(kBake) + " --json --junit bake.xml");
  EXPECT_EQ(run.code, 5);
  write_file(folder / "run.json", run.out);
  EXPECT_TRUE(follows_schema(folder / "run.json", "batch.schema.json"));
  EXPECT_TRUE(follows_schema(folder / "out/vpsbake.json", "batch_manifest.schema.json"));
  const std::string xml = read_file(folder / "bake.xml");
  EXPECT_NE(xml.find("tests=\"2\" failures=\"1\""), std::string::npos) << xml;
  EXPECT_NE(xml.find("name=\"cube &amp; co.vps.hdf\""), std::string::npos) << xml;
  const std::string parse = "/usr/bin/python3 -c 'import sys, xml.dom.minidom as m; m.parse(sys.argv[1])' ";
  EXPECT_EQ(std::system((parse + (folder / "bake.xml").string()).c_str()), 0);
}

TEST(Batch, ReportsAndManifestsReplaceNothingElse) {
  const BatchFolder folder;
  folder.add("cube.obj");
  write_file(folder / "model.xml", "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model/>\n");
  fs::create_directory(folder / "out");
  expect_refusal(folder, std::string(kBake) + " --junit model.xml", 2, "the file exists and is not a JUnit report");
  expect_refusal(folder, std::string(kBake) + " --junit ./out/cube.vps.hdf", 2, "this is an asset");
  write_file(folder / "out/vpsbake.json", "{}\n");
  const char* const why = "vpsbake.json: the file exists and is not a manifest of vpsbake batch";
  expect_refusal(folder, kBake, 2, why);
  ASSERT_EQ(vpsbake(folder, "plan meshes -o jobs.jsonl --into out --voxel 10mm").code, 0);
  expect_refusal(folder, "merge jobs.jsonl", 2, why);
  EXPECT_EQ(read_file(folder / "out/vpsbake.json"), "{}\n");
  EXPECT_FALSE(fs::exists(folder / "out/cube.vps.hdf"));
  fs::remove(folder / "out/vpsbake.json");
  for (int i = 0; i < 2; ++i) EXPECT_EQ(vpsbake(folder, std::string(kBake) + " --junit bake.xml").code, 0);
  EXPECT_EQ(vpsbake(folder, "batch meshes -o new --voxel 10mm --junit new/bake.xml --depfile new/bake.d").code, 0);
}

TEST(Batch, TheTableSaysOnlyWhatMatters) {
  const BatchFolder folder;
  folder.add("cube.obj");
  folder.add("hole.obj", "hole");
  const Outcome first = vpsbake(folder, kBake);
  EXPECT_EQ(first.code, 0);
  EXPECT_NE(first.out.find("baked        cube.vps.hdf"), std::string::npos) << first.out;
  EXPECT_NE(first.out.find("2 meshes: 2 baked; "), std::string::npos) << first.out;
  EXPECT_EQ(first.err, "") << "no progress where nobody looks";
  const Outcome second = vpsbake(folder, kBake);
  EXPECT_TRUE(second.out.starts_with("2 meshes: 2 unchanged; ")) << second.out;
  fs::remove(folder / "meshes/hole.obj");
  const Outcome third = vpsbake(folder, kBake);
  EXPECT_NE(third.err.find("out/hole.vps.hdf: an earlier batch baked this asset, this one does not"), std::string::npos)
      << third.err;
}

TEST(Batch, TheCacheKeepsItsLimit) {
  const BatchFolder folder;
  for (const char* mesh : {"cube", "hole", "peg"}) folder.add(std::string(mesh) + ".obj", mesh);
  EXPECT_EQ(run_batch(folder, std::string(kBake) + " --cache-size 1kB", "cache").code, 0);
  std::size_t kept = 0;
  for (const auto& [name, bytes] : files_below(folder / "cache")) kept += name.ends_with(".vps.hdf") ? 1 : 0;
  EXPECT_EQ(kept, 0U) << "no asset is as small";
  ::setenv("VPSBAKE_CACHE_SIZE", "large", 1);
  expect_refusal(folder, kBake, 1, "VPSBAKE_CACHE_SIZE: 'large' is not a size");
  fs::remove_all(folder / "out");
  EXPECT_EQ(run_batch(folder, std::string(kBake) + " --jobs 2 --cache-size 1GB", "other").code, 0);
  ::unsetenv("VPSBAKE_CACHE_SIZE");
}

TEST(Batch, OneAssetIsOneWhateverItIsCalled) {
  const BatchFolder folder;
  folder.add("cube.obj");
  folder.add("peg.obj", "peg");
  folder.add_text("vpsbake.toml", "[[files]]\nmatch = \"peg.obj\"\noutput = \"./cube.vps.hdf\"\n");
  EXPECT_EQ(run_batch(folder, kBake).code, 5);
  EXPECT_FALSE(fs::exists(folder / "out/cube.vps.hdf"));
}

TEST(Batch, ATwinIsBakedWhereTheFirstCannotBeWritten) {
  const BatchFolder folder;
  folder.add("a.obj");
  folder.add("cube.obj");
  fs::create_directories(folder / "out/a.vps.hdf");
  for (const char* jobs : {"1", "2"}) {
    fs::remove(folder / "out/cube.vps.hdf");
    EXPECT_EQ(run_batch(folder, std::string(kBake) + " --jobs " + jobs).states,
              (States{{"a.vps.hdf", "FAILED"}, {"cube.vps.hdf", "baked"}}));
  }
}

TEST(Batch, WhatIsExcludedStopsNothing) {
  const BatchFolder folder;
  for (const char* mesh : {"cube.obj", "bad/a.obj", "old/b.obj", "old/c/d.obj"}) folder.add(mesh);
  for (const char* place : {"bad", "old/c"}) folder.add_text(std::string(place) + "/vpsbake.toml", "junk\n");
  expect_refusal(folder, kBake, 3, "vpsbake.toml");
  folder.add_text("old/vpsbake.toml",
                  "exclude = [\"c/\"]\n[[files]]\nmatch = \"b.obj\"\nskip = true\n"
                  "[[files]]\nmatch = \"*.obj\"\nvoxel = \"20mm\"\n");
  EXPECT_EQ(run_batch(folder, std::string(kBake) + " --exclude bad").states, (States{{"cube.vps.hdf", "baked"}}));
}

TEST(Batch, FoldersMayHaveAnyName) {
  const BatchFolder folder;
  folder.add("cube.obj");
  fs::rename(folder / "meshes", folder / "[m,n]");
  EXPECT_EQ(run_batch(folder, "batch '[m,n]' -o out --voxel 10mm").states, (States{{"cube.vps.hdf", "baked"}}));
}

TEST(Batch, BuffersThatNothingUsesMayBeAbsent) {
  const BatchFolder folder;
  const std::string meshes = std::string(VPS_DOCS) + "/examples/cmake_project/meshes/";
  const std::string text = read_file(meshes + "wedge.gltf");
  const auto add = [&](const char* name, const std::string& buffer, const std::string& more = "") {
    std::string changed = text;
    changed.replace(changed.find("\"wedge.bin\", \"byteLength\": 120}"), 31,
                    "\"" + buffer + "\", \"byteLength\": 120}" + more);
    folder.add_text(name, changed);
  };
  fs::create_directories(folder / "meshes/sub");
  fs::copy_file(meshes + "wedge.bin", folder / "meshes/sub/d.bin");
  add("unused.gltf", "sub/d.bin", R"(, {"uri": "absent.bin", "byteLength": 1})");
  add("back.gltf", R"(sub\\d.bin)");
  add("elsewhere.gltf", "file://" + (folder / "meshes/sub/d.bin").string());
  add("lost.gltf", "other/d.bin");
  add("latin.gltf", "sub/d.bin", ", {\"uri\": \"\xe4.bin\", \"byteLength\": 1}");
  const std::string bake = "batch meshes -o out --voxel 2mm";
  for (const char* state : {"baked", "unchanged"}) {
    const BatchOutcome run = run_batch(folder, bake);
    EXPECT_EQ(run.code, 5);
    EXPECT_EQ(run.states, (States{{"back.vps.hdf", state},
                                  {"elsewhere.vps.hdf", "FAILED"},
                                  {"latin.vps.hdf", "FAILED"},
                                  {"lost.vps.hdf", "FAILED"},
                                  {"unused.vps.hdf", state}}))
        << run.err;
  }
}

TEST(Batch, FilesAreWrittenBeforeWhatNobodyMayRead) {
  const BatchFolder folder;
  folder.add("cube.obj");
  const std::string program = "cd " + folder.path().string() + " && " VPSBAKE " ";
  EXPECT_NE(std::system((program + kBake + " --json --junit j.xml >/dev/full 2>&1").c_str()), 0);
  for (const char* name : {"out/cube.vps.hdf", "out/vpsbake.json", "out/.vpsbake-run.json", "j.xml"})
    EXPECT_TRUE(fs::exists(folder / name)) << name;
}

TEST(Batch, SeveralMeshesMaySearchForTheirVoxelSize) {
  const BatchFolder folder;
  folder.add("cube.obj");
  folder.add("peg.obj", "peg");
  EXPECT_EQ(run_batch(folder, "batch meshes -o out --max-error 1mm --jobs 2").states,
            (States{{"cube.vps.hdf", "baked"}, {"peg.vps.hdf", "baked"}}));
}

TEST(Batch, ADepfileNamesWhatTheAssetsDependOn) {
  const BatchFolder folder;
  folder.add("a b.obj");
  folder.add_text("vpsbake.toml", "voxel = \"20mm\"\n");
  ASSERT_EQ(vpsbake(folder, std::string(kBake) + " --depfile bake.d").code, 0);
  EXPECT_EQ(
      read_file(folder / "bake.d"),
      "out/vpsbake.json: \\\n  meshes/a\\ b.obj \\\n  meshes/vpsbake.toml\nmeshes/a\\ b.obj:\nmeshes/vpsbake.toml:\n");
  ASSERT_EQ(vpsbake(folder, std::string(kBake) + " --depfile bake.d").code, 0) << "its own";
  for (const char* other : {"meshes/vpsbake.toml", "meshes/a\\ b.obj", "out/vpsbake.json", "out/a\\ b.vps.hdf",
                            "$PWD/out/.vpsbake-run.json"}) {
    const auto before = files_below(folder.path());
    expect_refusal(folder, std::string(kBake) + " --depfile " + other, 2, "choose another --depfile");
    EXPECT_EQ(files_below(folder.path()), before);
  }
}

}  // namespace
}  // namespace vps::test
