// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the program end to end, as a user does.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "runtime/vps_runtime.h"
#include "tests/cli/program.h"
#include "tests/cli/schema.h"
#include "tests/support/shared.h"
#include "version.h"

namespace vps::test {
namespace {

TEST(Cli, BakesBesideTheMeshAndInfoReadsItBack) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(sample("torus"), folder / "torus.obj");
  const Outcome run = vpsbake(folder, "torus.obj --voxel 2mm");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");  // not a terminal: errors only
  EXPECT_TRUE(run.out.starts_with("torus.vps.hdf: 140 mm x 140 mm x 40 mm, voxel 2 mm, error up to ")) << run.out;
  EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 1) << run.out;
  EXPECT_EQ(vpsbake(folder, "torus.obj --voxel 2mm -q").out, "");
  const Outcome verbose = vpsbake(folder, "torus.obj --voxel 2mm -v");
  EXPECT_NE(verbose.out.find("torus.obj: grid of 80 x 80 x 32 voxels of 2 mm"), std::string::npos) << verbose.out;
  EXPECT_NE(verbose.out.find("voxelmap    80 x 80 x 32 voxels of 2 mm"), std::string::npos) << verbose.out;
  const Outcome info = vpsbake(folder, "info torus.vps.hdf");
  EXPECT_EQ(info.code, 0);
  EXPECT_NE(info.out.find("voxelmap    80 x 80 x 32 voxels of 2 mm"), std::string::npos) << info.out;
  EXPECT_NE(info.out.find("point_positions       u16  3 x "), std::string::npos) << info.out;
}

TEST(Cli, JsonSaysWhatTheFileHolds) {
  const TemporaryFolder folder;
  const Outcome run = vpsbake(
      folder, sample("gear") + " --voxel 0.5mm -o gear.vps.hdf --fields layers,scaled,real --branching 4 --json");
  ASSERT_EQ(run.code, 0) << run.err;
  const auto baked = nlohmann::json::parse(run.out);
  EXPECT_EQ(baked["output"], "gear.vps.hdf");
  EXPECT_EQ(baked["bytes"], std::filesystem::file_size(folder / "gear.vps.hdf"));
  EXPECT_EQ(baked["voxel_size"], 0.0005);
  EXPECT_EQ(baked["pointshell"]["branching"], 4);
  EXPECT_EQ(baked["pointshell"]["position_origin"].size(), 3U);
  for (const char* step : {"position_step", "area_step"}) EXPECT_GT(baked["pointshell"][step], 0) << step;
  EXPECT_GT(baked["seconds"]["distance_field"], 0);
  const auto& path = baked["critical_path"];
  ASSERT_GE(path.size(), 5U);
  EXPECT_EQ(path.front(), "import");
  EXPECT_EQ(path.back(), "write");
  for (const auto& stage : path) EXPECT_TRUE(baked["seconds"].contains(stage.get<std::string>())) << stage;
  EXPECT_GE(baked["plan"]["predicted_memory_bytes"], baked["bytes"].get<std::size_t>() / 10);
  for (const char* field : {"layers", "scaled", "real"}) EXPECT_GT(baked["certificate"][field]["max"], 0) << field;
  const Outcome info = vpsbake(folder, "info --json gear.vps.hdf");
  ASSERT_EQ(info.code, 0);
  const auto read = nlohmann::json::parse(info.out);
  for (const char* part : {"mesh", "mass", "voxel_size", "voxelmap", "certificate", "pointshell"})
    EXPECT_EQ(read[part], baked[part]);
  for (const char* field : {"scaled", "real"}) {
    EXPECT_GT(read["jumps"][field]["largest"], 0) << field;
    EXPECT_LE(read["jumps"][field]["largest"], 2 * read["certificate"][field]["bound"].get<double>()) << field;
  }
  EXPECT_EQ(read["sections"].size(), 23U) << "the record and the corners are one each, the hulls of flat nodes two";
}

TEST(Cli, TheJsonOfABakeFollowsItsSchema) {
  VPS_SCHEMA_CHECK_OR_SKIP();
  const TemporaryFolder folder;
  for (const char* const options : {"", " --dry-run", " --parts pointshell", " --cache cache", " --cache cache"}) {
    write_file(folder / "bake.json",
               vpsbake(folder, sample("gear") + " --voxel 1mm -o a.vps.hdf --json" + options).out);
    EXPECT_TRUE(follows_schema(folder / "bake.json", "bake.schema.json")) << read_file(folder / "bake.json");
  }
  write_file(folder / "bake.json", R"({"output": "a.vps.hdf", "bytes": 1, "plan": {}, "voxel_size": 1})");
  EXPECT_FALSE(follows_schema(folder / "bake.json", "bake.schema.json"));
}

TEST(Cli, ABakeForABatchEndsWithAPlanIfItNeedsMoreMemoryThanSaid) {
  const TemporaryFolder folder;
  const std::string bake = sample("cube") + " --voxel 10mm -o cube.vps.hdf --json --dry-run-above ";
  const Outcome planned = vpsbake(folder, bake + "1MB");
  ASSERT_EQ(planned.code, 0) << planned.err;
  const auto plan = nlohmann::json::parse(planned.out);
  EXPECT_GT(plan["plan"]["predicted_memory_bytes"], 1'000'000);
  EXPECT_FALSE(plan.contains("bytes"));
  EXPECT_FALSE(std::filesystem::exists(folder / "cube.vps.hdf"));
  const Outcome baked = vpsbake(folder, bake + "1GB");
  ASSERT_EQ(baked.code, 0) << baked.err;
  EXPECT_EQ(nlohmann::json::parse(baked.out)["bytes"], std::filesystem::file_size(folder / "cube.vps.hdf"));
}

TEST(Cli, PartsLeaveOutWhatIsNotNeeded) {
  const TemporaryFolder folder;
  EXPECT_EQ(vpsbake(folder, sample("torus") + " --voxel 2mm -o both.vps.hdf").code, 0);
  EXPECT_EQ(vpsbake(folder, sample("torus") + " --voxel 2mm --parts voxelmap -o map.vps.hdf").code, 0);
  EXPECT_EQ(vpsbake(folder, sample("torus") + " --voxel 2mm --parts pointshell -o shell.vps.hdf").code, 0);
  Asset map;
  Asset shell;
  ASSERT_EQ(Asset::open((folder / "map.vps.hdf").c_str(), map), Status::ok);
  ASSERT_EQ(Asset::open((folder / "shell.vps.hdf").c_str(), shell), Status::ok);
  EXPECT_TRUE(map.has_voxelmap() && !map.has_pointshell());
  EXPECT_TRUE(!shell.has_voxelmap() && shell.has_pointshell());
  const auto size = [&](const char* name) { return std::filesystem::file_size(folder / name); };
  EXPECT_LT(size("map.vps.hdf") + size("shell.vps.hdf"), size("both.vps.hdf") + 16384);
}

TEST(Cli, TheSameMeshAndOptionsGiveTheSameBytes) {
  const TemporaryFolder folder;
  EXPECT_EQ(vpsbake(folder, sample("nut") + " --voxel 0.3mm -o a.vps.hdf --fields layers,scaled,real").code, 0);
  ::sleep(1);
  EXPECT_EQ(vpsbake(folder, sample("nut") + " --voxel 0.3mm -o b.vps.hdf --fields layers,scaled,real").code, 0);
  EXPECT_EQ(read_file(folder / "a.vps.hdf"), read_file(folder / "b.vps.hdf"));
}

TEST(Cli, PythonDecodesThePointsByTheFormatsFormulas) {
  std::string python;
  for (const char* candidate : {"python3", "/usr/bin/python3"}) {
    if (std::system((std::string(candidate) + " -c 'import h5py' 2>/dev/null").c_str()) == 0) python = candidate;
  }
  if (python.empty()) GTEST_SKIP() << "needs h5py (Debian's python3-h5py)";
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("icosphere") + " --voxel 4mm -o a.vps.hdf").code, 0);
  write_file(folder / "decode.py", R"(
import h5py, numpy as np
with h5py.File("a.vps.hdf") as f:
    facts, shell = f.attrs, f["pointshell"]
    points = facts["position_origin"] + facts["position_step"] * shell["positions"][:].T
    low, middle, high = shell["inward_normals"][:].astype(int).T
    u, v = ((low | middle % 16 << 8) - 2047) / 2047, ((middle >> 4 | high << 4) - 2047) / 2047
    z = 1 - abs(u) - abs(v)
    t = np.maximum(-z, 0)
    normals = np.stack([u - np.where(u >= 0, t, -t), v - np.where(v >= 0, t, -t), z], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    areas = facts["area_step"] * shell["areas"][:].astype(float) ** 2
    assert [shell[name].attrs["unit"] for name in ("positions", "inward_normals", "areas")] == \
        [b"position_step", b"1/2047", b"area_step"]
    assert len(points) == len(normals) == len(areas) == facts["points"]
    half = facts["position_step"] / 2 + 1e-8
    assert (points >= facts["bounds_min"] - half).all() and (points <= facts["bounds_max"] + half).all()
    assert (np.linalg.norm(points, axis=1) > 0.95 * facts["bounds_max"][2]).all()
    assert (-(normals * points).sum(axis=1) > 0.95 * facts["bounds_max"][2]).all()
    assert abs(areas.sum() / facts["surface_area"] - 1) < 1e-3
)");
  EXPECT_EQ(std::system(("cd " + folder.path().string() + " && " + python + " decode.py").c_str()), 0);
}

TEST(Cli, AWrongCommandLineIsExitCodeOne) {
  const TemporaryFolder folder;
  const std::string cube = sample("cube");
  expect_refusal(folder, "", 1, "a mesh is required");
  expect_refusal(folder, cube + " --voxel 5", 1, "a length needs a unit; write 5mm or 5m");
  expect_refusal(folder, cube + " --voxel 5 --scale 2", 1, "command line: --voxel: a length needs a unit");
  expect_refusal(folder, cube + " --voxel nan", 1, "--voxel: 'nan' is not a length; write a number with a unit");
  expect_refusal(folder, cube + " --voxel ''", 1, "--voxel: '' is not a length; write a number with a unit");
  expect_refusal(folder, cube + " --voxel 5mm --voxel 6mm", 1, "command line: --voxel is given twice; give it once;");
  expect_refusal(folder, cube + " --voxel", 1, "command line: --voxel needs a value; run");
  expect_refusal(folder, "compare", 1, "ASSET is required");
  expect_refusal(folder, cube + " -voxel=5mm", 1, "there is no option -voxel; did you mean --voxel?");
  expect_refusal(folder, cube + " --voxel five", 1, "five' is not a length");
  expect_refusal(folder, cube + " --voxel 0x5mm", 1, "'0x5mm' is not a length");
  expect_refusal(folder, cube + " --voxel 5parsec", 1, "unknown unit 'parsec'; use one of");
  expect_refusal(folder, cube + " --voxel -5mm", 1, "not a positive length");
  expect_refusal(folder, cube + " --voxel nanmm", 1, "not a positive length");
  expect_refusal(folder, cube + " --voxel 5mm --resolution 9", 1, "excludes");
  expect_refusal(folder, cube + " --resolution 0", 1, "resolution");
  expect_refusal(folder, cube + " --voxel 5mm --unit parsec", 1, "unknown unit 'parsec'; use one of cm, in, m, mm");
  expect_refusal(folder, cube + " --voxel 5mm --fields colour", 1, "--fields");
  expect_refusal(folder, cube + " --voxel 5mm --parts wheels", 1, "--parts");
  expect_refusal(folder, cube + " --voxel 5mm --branching 1", 1, "--branching");
  expect_refusal(folder, cube + " --voxel 5mm --bogus", 1, "--bogus");
  expect_refusal(folder, "-- " + cube + " --voxel 5mm", 1, "'--voxel' is after --, which ends the options");
  expect_refusal(folder, "--bogus -- " + cube, 1, "there is no option --bogus");
  expect_refusal(folder, cube + " --voxel 5mm --import-timeout 5", 1, "a time needs a unit; write 5s or 5min");
  expect_refusal(folder, cube + " --voxel 5mm --import-timeout 5parsec", 1, "unknown unit 'parsec'; use one of");
  expect_refusal(folder, cube + " --voxel 5mm --import-timeout 0s", 1, "0s is not a positive time");
  expect_refusal(folder, cube + " --voxel 5mm --import-timeout soon", 1, "soon' is not a time; write a number");
  expect_refusal(folder, cube + " --voxel 5mm --import-memory much", 1, "much' is not a size");
  expect_refusal(folder, cube + " --voxel 5mm --import-memory 0", 1, "a size needs a unit");
  expect_refusal(folder, cube + " --voxel 5mm --import-memory -4GB", 1, "not a positive size");
  expect_refusal(folder, "info", 1, "ASSET... is required; run vpsbake info --help");
  expect_refusal(folder, "info " + cube, 3, "too short to be an asset; give a .vps.hdf file, or bake it again");
  expect_refusal(folder, "run .", 2, ".: this is a folder; give a file that vpsbake plan wrote");
  std::filesystem::copy_file(cube, folder / "cube.obj");
  expect_refusal(folder, "cube.obj --voxel 5mm -o ./cube.obj", 2, "its name is that of a mesh");
  std::filesystem::copy_file(cube, folder / "-a.obj");
  EXPECT_EQ(vpsbake(folder, "--voxel 5mm -o a.vps.hdf -- -a.obj").code, 0);
}

TEST(Cli, MistypedNamesAreSuggested) {
  const TemporaryFolder folder;
  expect_refusal(folder, "chek cube.obj", 1, "there is no command 'chek'; did you mean check?");
  expect_refusal(folder, "vlidate", 1, "there is no command 'vlidate'; did you mean validate?");
  expect_refusal(folder, "help bacth", 1, "there is no command 'bacth'; did you mean batch?");
  expect_refusal(folder, "wobble cube.obj", 1, "there is no command 'wobble'; run vpsbake --help");
  for (const char* const bake : {"bake cube.obj", "help bake"})
    expect_refusal(folder, bake, 1, "there is no command 'bake'; a mesh alone is baked: vpsbake mesh.obj");
  expect_refusal(folder, "- --voxle 5mm", 1, "there is no option --voxle; did you mean --voxel?");
  expect_refusal(folder, "cache stat", 1, "there is no command 'stat'; did you mean stats?");
  expect_refusal(folder, sample("cube") + " --voxle 5mm", 1, "there is no option --voxle; did you mean --voxel?");
  expect_refusal(folder, "check a.obj --rezolution=9", 1,
                 "there is no option --rezolution; did you mean --resolution?");
  expect_refusal(folder, sample("cube") + " --res 10", 1, "there is no option --res; did you mean --resolution?");
  expect_refusal(folder, sample("cube") + " --nope", 1, "there is no option --nope; run vpsbake --help");
  expect_refusal(folder, sample("cube") + " --voxel 1,5mm", 1, "a number has a decimal point, not a comma: ',5mm'");
  EXPECT_EQ(vpsbake(folder, "help help-files").code, 0);
  expect_refusal(folder, "info a b --nothing-like-it", 1, "no option --nothing-like-it; run vpsbake info --help");
}

TEST(Cli, FilesThatCannotBeReadOrWrittenAreExitCodeTwo) {
  const TemporaryFolder folder;
  expect_refusal(folder, "none.obj --voxel 5mm", 2, "none.obj: the file does not exist");
  expect_refusal(folder, ". --voxel 5mm -o a.vps.hdf", 2, "or bake all of its meshes with vpsbake batch");
  expect_refusal(folder, sample("cube") + " --voxel 5mm -o missing/a.vps.hdf", 2, "the folder does not exist");
  expect_refusal(folder, sample("cube") + " --voxel 5mm -o .", 2, "this is a folder");
  for (const std::string name : {"/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"})
    expect_refusal(folder, sample("cube") + " --voxel 5mm -o " + name, 2, "write - for standard output");
  expect_refusal(folder, "info none.vps.hdf", 2, "none.vps.hdf: the file does not exist");
}

TEST(Cli, MeshesThatCannotBeBakedAreExitCodeThree) {
  const TemporaryFolder folder;
  write_file(folder / "empty.obj", "");
  expect_refusal(folder, "empty.obj --voxel 5mm", 3, "empty.obj: the file is empty");
  write_file(folder / "mesh.step", "x");
  expect_refusal(folder, "mesh.step --voxel 5mm", 3, "unknown mesh format .step");
  write_file(folder / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  expect_refusal(folder, "open.obj --voxel 5mm", 3, "the mesh is open: it leaks through 1 hole");
  write_file(folder / "points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  expect_refusal(folder, "points.obj --voxel 5mm", 3, "points.obj: ");
  write_file(folder / "nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  expect_refusal(folder, "nan.obj --voxel 5mm", 3, "nan.obj: vertex");
  write_file(folder / "inf.obj", "v 0 0 1e999\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  expect_refusal(folder, "inf.obj --voxel 5mm", 3, "inf.obj: vertex");
  expect_refusal(folder, sample("cube") + " --voxel 5mm --unit mm -o a.vps.hdf", 3,
                 "is the mesh's unit right? (--unit)");
  expect_refusal(folder, sample("cube") + " --voxel 0.1mm --memory 10MB -o a.vps.hdf", 3,
                 "more than the limit of 10 MB; is the mesh's unit right (--unit)?");
}

TEST(Cli, LimitsOfTheImportAreOptionsAndTheErrorsNameThem) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(sample("gear"), folder / "gear.obj");
  expect_refusal(folder, "gear.obj --voxel 0.5mm --import-timeout 0.001ms", 3, "needs a higher --import-timeout");
#ifndef VPS_SANITIZE  // sanitizers cannot run under a memory limit
  expect_refusal(folder, sample("bolt") + " --voxel 0.5mm --import-memory 100kB", 3, "needs a higher --import-memory");
#endif
  EXPECT_EQ(vpsbake(folder, "gear.obj --voxel 0.5mm --import-memory 1GB --import-timeout 2min").code, 0);
}

TEST(Cli, AHeaderThatPromisesTooMuchIsExitCodeThree) {
  const TemporaryFolder folder;
  write_file(folder / "bomb.off", "OFF\n353535235358 6 0\n0 0 0\n");
  expect_refusal(folder, "bomb.off --voxel 5mm", 3, "bomb.off: the header promises 353535235358 vertices");
  VPS_SHARED_FILE_OR_SKIP(bomb, "meshes/invalid/huge_vertex_count.off");
  expect_refusal(folder, bomb.string() + " --voxel 5mm -o a.vps.hdf", 3, "the header promises 353535235358 vertices");
}

TEST(Cli, ALossOfPrecisionIsNoted) {
  const TemporaryFolder folder;
  write_file(folder / "strange.obj", "some unknown words\n" + read_file(sample("cube")));
  const std::string note = "read in single precision: line 1: unknown word 'some'";
  const Outcome run = vpsbake(folder, "strange.obj --voxel 5mm");
  EXPECT_NE(run.out.find("note: " + note + "\n"), std::string::npos) << run.out << run.err;
  const auto json = nlohmann::json::parse(vpsbake(folder, "strange.obj --voxel 5mm --json").out);
  EXPECT_EQ(json["notes"][0], note);
}

TEST(Cli, CheckSaysWhatIsWrongAndWhetherItWouldBake) {
  const TemporaryFolder folder;
  const Outcome good = vpsbake(folder, "check " + sample("thin_plate") + " --voxel 2mm");
  EXPECT_EQ(good.code, 0) << good.err;
  EXPECT_NE(good.out.find("open        none"), std::string::npos) << good.out;
  EXPECT_NE(good.out.find("% is thinner than two voxels"), std::string::npos) << good.out;
  // A tetrahedron with one face missing and one reversed.
  write_file(folder / "bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 4 3\n");
  const Outcome bad = vpsbake(folder, "check bad.obj --voxel 1cm --json");
  EXPECT_EQ(bad.code, 3);
  EXPECT_EQ(std::count(bad.err.begin(), bad.err.end(), '\n'), 1) << bad.err;
  const auto j = nlohmann::json::parse(bad.out);
  EXPECT_EQ(j["open_edges"], 3);
  EXPECT_EQ(j["inconsistent_edges"], 2);
  EXPECT_EQ(j["usable"], false);
  const Outcome filled = vpsbake(folder, "check bad.obj --voxel 1cm --json --repair fill");
  EXPECT_EQ(filled.code, 0) << filled.err;
  EXPECT_NEAR(nlohmann::json::parse(filled.out)["volume"].get<double>(), 1.0 / 6, 1e-9);
  EXPECT_EQ(nlohmann::json::parse(filled.out)["repair"], "fill");
  // Three faces of 1/2 m^2, one of them new, and the slanted one.
  EXPECT_NEAR(nlohmann::json::parse(filled.out)["filled_share"].get<double>(), 0.5 / (1.5 + std::sqrt(0.75)), 1e-12);
  for (const char* grid : {"--voxel 1km", "--voxel 0.001mm", "--resolution 8192"})
    EXPECT_EQ(vpsbake(folder, "check " + sample("cube") + " " + grid).code, 3) << grid;
  EXPECT_EQ(folder.names().size(), 1U);  // a check writes nothing
}

TEST(Cli, RepairAndThickeningAreOptions) {
  const TemporaryFolder folder;
  write_file(folder / "sheet.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  const Outcome run = vpsbake(folder, "sheet.obj --voxel 1cm --open-surface thicken=4cm --json -o a.vps.hdf");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_NEAR(nlohmann::json::parse(run.out)["mass"]["volume"].get<double>(), 0.04, 1e-12);
  expect_refusal(folder, "sheet.obj --voxel 1cm --open-surface 4cm", 1, "--open-surface takes thicken=2mm");
  expect_refusal(folder, "sheet.obj --voxel 1cm --repair magic", 1, "none, weld, stitch, fill or wrap");
}

TEST(Cli, NumbersAreReadAsTheyAreWritten) {
  const TemporaryFolder folder;
  const std::string cube = sample("cube") + " -o a.vps.hdf ";
  expect_refusal(folder, cube + "--resolution 010x", 1, "--resolution takes a whole number from 1 to 8192");
  for (const char* scale : {"nan", "inf", "0", "-1", "1,5", "''"}) {
    expect_refusal(folder, cube + "--resolution 10 --scale " + scale, 1, "--scale takes a positive number");
  }
  expect_refusal(folder, cube + "--resolution 10 --memory=-1", 1, "a size needs a unit");
  expect_refusal(folder, cube + "--voxel 5mm --precision 2", 3, "a precision of 2 stores steps of 10 mm");
  expect_refusal(folder, cube + "--voxel 5mm --parts pointshell --fields real", 1, "--fields needs the voxelmap");
  expect_refusal(folder, "--voxel 3mm info a.vps.hdf", 1, "--voxel does not go before info");
  expect_refusal(folder, sample("cube") + " --voxel 5mm -o ''", 1, "is empty");
  // 010 is ten, not eight, and the list option --fields takes one word only.
  const Outcome run = vpsbake(folder, "--fields scaled " + cube + "--resolution 010 --json");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_NEAR(nlohmann::json::parse(run.out)["voxel_size"].get<double>(), 0.01, 1e-9);
}

TEST(Cli, FieldErrorAndSpacingAreOptions) {
  const TemporaryFolder folder;
  const std::string bolt = sample("bolt") + " --voxel 1mm -o a.vps.hdf ";
  const auto baked = [&](const std::string& options) {
    const Outcome run = vpsbake(folder, bolt + "--json " + options);
    EXPECT_EQ(run.code, 0) << run.err;
    return nlohmann::json::parse(run.out);
  };
  const auto standard = baked("");
  const auto tight = baked("--field-error 0.03vx");
  const auto loose = baked("--field-error 1vx");
  const auto error = [](const nlohmann::json& j) { return j["certificate"]["scaled"]["p99"].get<double>(); };
  EXPECT_LT(error(tight), error(standard));
  EXPECT_LT(error(standard), error(loose));
  EXPECT_GT(tight["bytes"], standard["bytes"]);
  EXPECT_GT(standard["bytes"], loose["bytes"]);
  EXPECT_EQ(baked("--field-error 0.1vx")["certificate"], standard["certificate"]);
  const auto coarse = baked("--alpha 3")["pointshell"];
  EXPECT_NEAR(coarse["spacing"].get<double>(), 0.003, 1e-12);
  EXPECT_LT(coarse["points"], standard["pointshell"]["points"]);
  const auto thin = baked("--thin-faces 4")["pointshell"];
  EXPECT_LT(thin["points"], standard["pointshell"]["points"]);
  EXPECT_EQ(thin["feature_covering_radius"], standard["pointshell"]["covering_radius"]);

  expect_refusal(folder, bolt + "--field-error 0.1", 1, "a number of voxels needs a unit; write 0.1vx");
  expect_refusal(folder, bolt + "--field-error 0.1mm", 1, "unknown unit 'mm'; use one of vx");
  expect_refusal(folder, bolt + "--field-error little", 1,
                 "little' is not a number of voxels; write a number with a "
                 "unit, such as 0.1vx");
  expect_refusal(folder, bolt + "--field-error -1vx", 1, "not a positive number of voxels");
  expect_refusal(folder, bolt + "--field-error 0.1vx --parts pointshell", 1, "--field-error needs the voxelmap");
  for (const char* size : {"0.009vx", "1.1vx"})
    expect_refusal(folder, bolt + "--field-error " + size, 1, "the field error is out of range; choose 0.01 to 1");
  for (const char* alpha : {"nan", "0", "-1", "2vx"})
    expect_refusal(folder, bolt + "--alpha " + alpha, 1, "--alpha takes a positive number");
  for (const char* alpha : {"0.2", "65"})
    expect_refusal(folder, bolt + "--alpha " + alpha, 1, "alpha is out of range; choose 0.25 to 64");
  expect_refusal(folder, "batch " VPS_SAMPLE_MESHES " -o all --alpha 65", 1, "alpha is out of range");
  expect_refusal(folder, bolt + "--thin-faces 5", 1, "thin-faces is out of range; choose 1 to 4");
  expect_refusal(folder, bolt + "--thin-faces 4 --parts pointshell", 1, "thin faces need both parts");
}

TEST(Cli, EachNoneOfACheckHasItsName) {
  const TemporaryFolder folder;
  const std::string out = vpsbake(folder, "check " + sample("cube")).out;
  EXPECT_NE(out.find("\nnonmanifold none\nwinding     none\n"), std::string::npos) << out;
}

TEST(Cli, OnlyAssetsAndNewNamesAreWritten) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(sample("cube"), folder / "cube.obj");
  write_file(folder / "cube.mtl", "newmtl red");
  expect_refusal(folder, "cube.obj --voxel 5mm -o cube.mtl", 2, "exists and is not an asset");
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  expect_refusal(folder, "cube.obj --voxel 5mm -o pipe", 2, "not a regular file");
  expect_refusal(folder, "info pipe", 2, "not a regular file");
  expect_refusal(folder, "info .", 2, "this is a folder");
  expect_refusal(folder, "cube.obj --voxel 5mm -o " + std::string(300, 'x'), 2, "name is too long");
  expect_refusal(folder, "nofolder/x.obj --voxel 5mm", 2, "nofolder/x.obj: the file does not exist");
  // Writes through a link and replaces an asset.
  ASSERT_EQ(vpsbake(folder, "cube.obj --voxel 5mm -o a.vps.hdf").code, 0);
  std::filesystem::create_symlink("a.vps.hdf", folder / "link.vps.hdf");
  ASSERT_EQ(vpsbake(folder, "cube.obj --voxel 10mm -o link.vps.hdf").code, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.vps.hdf"));
  EXPECT_NE(vpsbake(folder, "info a.vps.hdf").out.find("voxels of 10 mm"), std::string::npos);
  // Also where the file is not there yet.
  std::filesystem::create_directory(folder / "disk");
  std::filesystem::create_symlink("disk/new.vps.hdf", folder / "new.vps.hdf");
  EXPECT_EQ(vpsbake(folder, "cube.obj --resolution 20 -o new.vps.hdf").code, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "new.vps.hdf"));
  EXPECT_TRUE(std::filesystem::is_regular_file(folder / "disk/new.vps.hdf"));
  std::filesystem::create_symlink("absent/b.vps.hdf", folder / "b.vps.hdf");
  expect_refusal(folder, "cube.obj --resolution 20 -o b.vps.hdf", 2, "the folder does not exist");
  std::filesystem::create_symlink("loop.vps.hdf", folder / "loop.vps.hdf");
  expect_refusal(folder, "cube.obj --resolution 20 -o loop.vps.hdf", 2, "its symbolic links form a loop");
}

TEST(Cli, OutputThatCannotBePrintedOrWrittenIsExitCodeTwo) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(sample("cube"), folder / "cube.obj");
  ASSERT_EQ(vpsbake(folder, "cube.obj --voxel 5mm -o a.vps.hdf").code, 0);
  const auto code_of = [&](const std::string& line) {
    const int status = std::system(("cd " + folder.path().string() + " && " + line + " 2>err.txt").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  };
  const std::string program = VPSBAKE;
  EXPECT_EQ(code_of(program + " info --json a.vps.hdf >/dev/full"), 2);
  EXPECT_EQ(code_of(program + " cube.obj --voxel 5mm --json >/dev/full"), 2);
  EXPECT_EQ(code_of(program + " --help >/dev/full"), 2);
  // A limit on the size of files, in blocks of 512 bytes.
  EXPECT_EQ(code_of("ulimit -f 8; " + program + " cube.obj --voxel 5mm -o b.vps.hdf >/dev/null"), 2);
  EXPECT_NE(read_file(folder / "err.txt").find("no space is left"), std::string::npos);
  EXPECT_EQ(folder.names().size(), 4U);  // cube.obj, a.vps.hdf, cube.vps.hdf, err.txt
  // Without standard descriptors.
  EXPECT_EQ(code_of(program + " cube.obj -q --voxel 5mm -o b.vps.hdf <&- >&-"), 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "b.vps.hdf"));
  for (const char* const result : {" cube.obj --voxel 5mm -o -", " info --json a.vps.hdf", " view -o - a.vps.hdf"}) {
    EXPECT_EQ(code_of(program + result + " >&-"), 2) << result;
    EXPECT_NE(read_file(folder / "err.txt").find("error: standard output: "), std::string::npos) << result;
  }
}

TEST(Cli, NamesThatAreNotTextStillGiveOneLineAndValidJson) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(sample("cube"), folder / "cube\xff.obj");
  const Outcome run = vpsbake(folder, "cube\xff.obj --voxel 5mm --json");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(nlohmann::json::accept(run.out));
  const Outcome info = vpsbake(folder, "info --json cube\xff.vps.hdf");
  EXPECT_EQ(info.code, 0);
  EXPECT_TRUE(nlohmann::json::accept(info.out));
  expect_refusal(folder, "\"x\ny.obj\" --voxel 5mm", 2, "x?y.obj: the file does not exist");
  std::filesystem::copy_file(sample("cube"), folder / "a\nb\x1b.obj");
  for (const char* const command : {"a\nb\x1b.obj\" --voxel 5mm", "a\nb\x1b.obj\" --voxel 5mm -v"}) {
    const Outcome baked = vpsbake(folder, std::string("\"") + command);
    EXPECT_NE(baked.out.find("a?b?.vps.hdf: "), std::string::npos) << baked.out;
    EXPECT_EQ(baked.out.find("a\nb"), std::string::npos) << baked.out;
  }
  for (const char* const command : {"info", "validate", "view"}) {
    const std::string out = vpsbake(folder, command + std::string(" \"a\nb\x1b.vps.hdf\"")).out;
    EXPECT_TRUE(out.starts_with("a?b?.")) << out;
  }
}

TEST(Cli, DamagedAssetsAreExitCodeThree) {
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --voxel 5mm -o a.vps.hdf").code, 0);
  const std::string bytes = read_file(folder / "a.vps.hdf");
  write_file(folder / "cut.vps.hdf", bytes.substr(0, bytes.size() / 2));
  expect_refusal(folder, "info cut.vps.hdf", 3, "cut.vps.hdf: the file is truncated");
  std::string flipped = bytes;
  flipped[100] = static_cast<char>(flipped[100] ^ 4);
  write_file(folder / "header.vps.hdf", flipped);
  expect_refusal(folder, "info header.vps.hdf", 3, "the header is damaged");
  flipped = bytes;
  const std::size_t payload = bytes.size() * 3 / 4;
  flipped[payload] = static_cast<char>(flipped[payload] ^ 4);
  write_file(folder / "payload.vps.hdf", flipped);
  expect_refusal(folder, "info payload.vps.hdf", 3, "payload.vps.hdf: ");
  expect_refusal(folder, "info " + sample("icosphere"), 3, "this is not a vpsbake asset");
}

TEST(Cli, HelpAndVersionAreNotErrors) {
  const TemporaryFolder folder;
  const Outcome help = vpsbake(folder, "--help");
  EXPECT_EQ(help.code, 0);
  EXPECT_NE(help.out.find("--voxel LENGTH"), std::string::npos);
  for (const char* words : {"Import:", "--import-memory SIZE", "--import-timeout TIME"})
    EXPECT_NE(help.out.find(words), std::string::npos) << words;
  EXPECT_TRUE(vpsbake(folder, "--version").out.starts_with("vpsbake " VPSBAKE_VERSION "\n"));
}

}  // namespace
}  // namespace vps::test
