// SPDX-License-Identifier: GPL-3.0-or-later
// `vpsbake validate`: correct assets pass, and every kind of wrong content is reported.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "formats/cell_plane.h"
#include "sample_meshes/shapes.h"
#include "tests/cli/program.h"
#include "tests/cli/schema.h"
#include "tests/support/baked.h"

namespace vps::test {
namespace {

using Json = nlohmann::json;

// Results by the checks' names.
std::map<std::string, std::string> results(const Json& file) {
  std::map<std::string, std::string> by_name;
  for (const Json& check : file["checks"]) by_name[check["name"]] = check["result"];
  return by_name;
}

class Validate : public ::testing::Test {
 protected:
  // A sphere with all fields, as the program bakes it.
  void SetUp() override {
    const TriangleMesh sphere = samples::make_sphere(0.02, 4);
    std::string text;
    for (const auto& [x, y, z] : sphere.vertices)
      text += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
    for (const auto& [a, b, c] : sphere.triangles)
      text += "f " + std::to_string(a + 1) + " " + std::to_string(b + 1) + " " + std::to_string(c + 1) + "\n";
    write_file(folder_ / "a.obj", text);
    static const std::string asset = file_baked(folder_, "a.obj --voxel 1.5mm --fields layers,scaled,real");
    write_file(folder_ / "a.vps.hdf", asset);
  }

  // Writes the asset again with wrong content but correct hashes.
  void forge(const std::function<void(AssetInfo&, std::vector<SectionData>&)>& change) {
    Asset asset;
    ASSERT_EQ(Asset::open((folder_ / "a.vps.hdf").c_str(), asset), Status::ok);
    AssetInfo info = asset.info();
    std::vector<SectionData> sections;
    for (std::uint32_t i = 0; i < asset.directory().section_count; ++i) {
      const Section& s = asset.directory().sections[i];
      const auto bytes = asset.bytes().subspan(s.offset, s.bytes);
      sections.push_back(
          {s.kind, s.element, {s.shape.begin(), s.shape.begin() + s.rank}, {bytes.begin(), bytes.end()}});
    }
    change(info, sections);
    write_asset(folder_ / "forged.vps.hdf", info, sections);
  }
  // Changes the header in a file's bytes and updates its hash.
  static std::string with_directory(std::string bytes, const std::function<void(Directory&)>& change) {
    Directory directory;
    EXPECT_EQ(decode_directory(std::as_bytes(std::span(bytes)), directory), Status::ok);
    change(directory);
    std::array<std::byte, kUserBlockBytes> block;
    encode_directory(directory, block);
    std::memcpy(bytes.data(), block.data(), block.size());
    return bytes;
  }

  std::map<std::string, std::string> check_forged() {
    const Outcome run = vpsbake(folder_, "validate forged.vps.hdf --mesh a.obj --samples 3000 --json");
    EXPECT_EQ(run.code, 3) << run.out;
    return results(Json::parse(run.out)["files"][0]);
  }

  TemporaryFolder folder_;
};

template <class Number>
Number* numbers(std::vector<SectionData>& sections, SectionKind kind) {
  for (SectionData& section : sections) {
    if (section.kind == kind) return reinterpret_cast<Number*>(section.bytes.data());
  }
  return nullptr;
}

TEST_F(Validate, AnAssetIsTrueToItsMesh) {
  const Outcome run = vpsbake(folder_, "validate a.vps.hdf --mesh a.obj --strict --json");
  EXPECT_EQ(run.code, 0) << run.err << run.out;
  const Json j = Json::parse(run.out);
  const Json& file = j["files"][0];
  EXPECT_TRUE(file["valid"]);
  for (const auto& [name, result] : results(file)) EXPECT_EQ(result, "ok") << name;
  for (const char* const name : {"structure", "hashes", "hdf5", "values", "faces scaled", "faces real", "spheres",
                                 "areas", "mesh", "mass", "field layers", "field scaled", "field real", "far",
                                 "coarse layers", "planes", "covering", "points", "normals"}) {
    EXPECT_TRUE(results(file).contains(name)) << name;
  }
  const Outcome text = vpsbake(folder_, "validate a.vps.hdf --mesh a.obj");
  EXPECT_NE(text.out.find("a.vps.hdf: valid, 19 checks\n"), std::string::npos) << text.out;
}

// Some points lie exactly on a sphere, by hypot 1e-19 m outside.
TEST_F(Validate, FreshAssetsOfSampleMeshesAreValid) {
  for (const char* const name : {"gear", "nut"}) {
    ASSERT_EQ(vpsbake(folder_, sample(name) + " -o fresh.vps.hdf").code, 0);
    const Outcome run = vpsbake(folder_, "validate fresh.vps.hdf");
    EXPECT_EQ(run.code, 0) << name << ": " << run.out;
  }
}

// Their walls and gaps are thinner than rounding, and their far grid is 20 voxels wide.
TEST_F(Validate, FreshAssetsOfSliversAndSlitsAreValid) {
  write_file(folder_ / "sliver.obj",
             "v 8.85889 1.81478 0.529605\nv 8.91428 1.81353 0.529602\nv 8.88592 1.81417 0.531\n"
             "v 8.87815 1.81434 0.530602\nf 4 3 1\nf 2 4 1\nf 2 1 3\nf 3 4 2\n");
  // Two plates, a micrometre apart.
  std::ostringstream plates;
  plates.precision(9);
  for (const int side : {-1, 1}) {
    const TriangleMesh plate = samples::make_box({0.05, 0.05, 0.005}, {0, 0, side * 0.0050005});
    for (const auto& [x, y, z] : plate.vertices) plates << "v " << x << ' ' << y << ' ' << z << '\n';
    const std::uint32_t first = side < 0 ? 1 : 9;
    for (const auto& [i, j, k] : plate.triangles) {
      plates << "f " << first + i << ' ' << first + j << ' ' << first + k << '\n';
    }
  }
  write_file(folder_ / "plates.obj", plates.str());
  for (const std::string name : {"sliver", "plates"}) {
    ASSERT_EQ(vpsbake(folder_, name + ".obj --resolution 64 --unit m --fields layers,scaled,real -o f.vps.hdf").code,
              0);
    const Outcome run = vpsbake(folder_, "validate f.vps.hdf --mesh " + name + ".obj --unit m");
    EXPECT_EQ(run.code, 0) << name << run.err << run.out;
  }
}

TEST_F(Validate, NoErrorIsAboveTheBoundOfAField) {
  ASSERT_EQ(
      vpsbake(folder_, sample("nut") + " --resolution 40 --parts voxelmap --fields layers,scaled,real -o n.vps.hdf")
          .code,
      0);
  const Outcome run = vpsbake(folder_, "validate n.vps.hdf --mesh " + sample("nut") + " --samples 40000 --json");
  EXPECT_EQ(run.code, 0) << run.out;
  int fields = 0;
  const Json report = Json::parse(run.out);
  for (const Json& check : report["files"][0]["checks"]) {
    if (!check.contains("figures") || !check["figures"].contains("above_bound")) continue;
    EXPECT_LE(check["figures"]["max"], check["figures"]["bound"].get<double>()) << check;
    ++fields;
  }
  EXPECT_EQ(fields, 3);
}

TEST_F(Validate, TheSameCommandFindsTheSameErrors) {
  const auto figures = [&] {
    return Json::parse(vpsbake(folder_, "validate a.vps.hdf --mesh a.obj --json").out)["files"].dump();
  };
  EXPECT_EQ(figures(), figures());
}

TEST_F(Validate, JsonFollowsItsSchema) {
  VPS_SCHEMA_CHECK_OR_SKIP();
  write_file(folder_ / "cut.vps.hdf", read_file(folder_ / "a.vps.hdf").substr(0, 9000));
  for (const char* const arguments :
       {"validate a.vps.hdf --mesh a.obj --json", "validate a.vps.hdf cut.vps.hdf --json"}) {
    write_file(folder_ / "a.json", vpsbake(folder_, arguments).out);
    EXPECT_TRUE(follows_schema(folder_ / "a.json", "validate.schema.json")) << read_file(folder_ / "a.json");
  }
}

TEST_F(Validate, WhatIsNotTrueOfTheMeshIsNamed) {
  struct Untruth {
    const char* check;
    std::function<void(AssetInfo&, std::vector<SectionData>&)> change;
  };
  const Untruth untruths[] = {
      {"field scaled", [](AssetInfo& info, auto&) { info.scaled_error.bound = info.scaled_error.max /= 4; }},
      {"field real", [](AssetInfo& info, auto&) { info.real_error.bound = info.real_error.max /= 4; }},
      {"field layers", [](AssetInfo& info, auto&) { info.layers_error.bound = info.layers_error.max /= 2; }},
      {"covering", [](AssetInfo& info, auto&) { info.covering_radius /= 2; }},
      {"mass", [](AssetInfo& info, auto&) { info.volume *= 0.99; }},
      {"areas", [](AssetInfo& info, auto&) { info.area_step *= 1.01; }},
      {"spheres",
       [](AssetInfo&, auto& sections) {
         for (SectionData& section : sections) {
           if (section.kind != SectionKind::spheres) continue;
           auto* const radii = reinterpret_cast<std::uint16_t*>(section.bytes.data()) + 3 * section.shape[1];
           radii[section.shape[1] - 1] = static_cast<std::uint16_t>(0.9 * radii[section.shape[1] - 1]);
         }
       }},
      {"points",
       [](AssetInfo&, auto& sections) { numbers<std::uint16_t>(sections, SectionKind::point_positions)[5] ^= 0x4000; }},
      {"normals",
       [](AssetInfo& info, auto& sections) {
         // Reverses every normal.
         auto* const codes = numbers<NormalCode>(sections, SectionKind::point_inward_normals);
         for (std::uint64_t i = 0; i < info.points; ++i) {
           const auto n = decode_normal<double>(unpack(codes[i].data()));
           codes[i] = pack(encode_normal({-n[0], -n[1], -n[2]}));
         }
       }},
      {"coarse layers",
       [](AssetInfo&, auto& sections) { numbers<std::int16_t>(sections, SectionKind::coarse_layers)[0] += 4; }},
      {"planes",
       [](AssetInfo&, auto& sections) {
         // Lowers every plane near the surface by two voxels or more.
         for (SectionData& section : sections) {
           if (section.kind != SectionKind::planes) continue;
           auto* const codes = reinterpret_cast<std::uint32_t*>(section.bytes.data());
           for (std::size_t i = 0; i < section.bytes.size() / sizeof(*codes); ++i) {
             CellPlane plane = decode_plane(codes[i]);
             plane.height = std::max(plane.height - 128, -kLargestHeight);
             codes[i] = encode(plane);
           }
         }
       }},
      {"faces scaled",
       [](AssetInfo&, auto& sections) {
         // Moves the surface by half a voxel in some bricks.
         for (SectionData& section : sections) {
           if (section.kind != SectionKind::scaled) continue;
           auto* const codes = reinterpret_cast<std::int8_t*>(section.bytes.data());
           for (std::size_t i = 0; i < section.bytes.size(); ++i) {
             if (i / kFieldSamples % 2 != 0) codes[i] = static_cast<std::int8_t>(std::min(codes[i] + 25, 127));
           }
         }
       }},
      {"values", [](AssetInfo&, auto& sections) { numbers<double>(sections, SectionKind::real)[7] = std::nan(""); }},
  };
  for (const Untruth& untruth : untruths) {
    forge(untruth.change);
    const auto by_name = check_forged();
    EXPECT_EQ(by_name.at(untruth.check), "failed") << untruth.check;
  }
}

TEST_F(Validate, AnErrorThatRandomPointsMissIsFoundByClimbing) {
  const Outcome run = vpsbake(folder_, "validate a.vps.hdf --mesh a.obj --samples 3000 --json");
  double between = 0;
  const Json report = Json::parse(run.out);
  for (const Json& check : report["files"][0]["checks"]) {
    if (check["name"] != "field scaled") continue;
    const double max = check["figures"]["max"], max_of_random = check["figures"]["max_of_random"];
    EXPECT_LT(max_of_random, max);
    between = (max_of_random + max) / 2;
  }
  forge([&](AssetInfo& info, auto&) { info.scaled_error.bound = info.scaled_error.max = between; });
  EXPECT_EQ(check_forged().at("field scaled"), "failed");
}

TEST_F(Validate, CornersThatDoNotSpanTheirPointsAreNamed) {
  ASSERT_EQ(vpsbake(folder_, sample("cube") + " --resolution 64 --parts pointshell -o a.vps.hdf").code, 0);
  EXPECT_EQ(results(Json::parse(vpsbake(folder_, "validate a.vps.hdf --json").out)["files"][0]).at("hulls"), "ok");
  forge([](AssetInfo&, auto& sections) {
    // Each node's corners become one of them.
    const auto* const offsets = numbers<std::uint32_t>(sections, SectionKind::hull_offsets);
    auto* const corners = numbers<std::uint32_t>(sections, SectionKind::hull_points);
    for (const SectionData& section : sections) {
      if (section.kind != SectionKind::hull_offsets) continue;
      for (std::size_t node = 0; node + 1 < section.shape[0]; ++node) {
        for (std::uint32_t i = offsets[node]; i < offsets[node + 1]; ++i) corners[i] = corners[offsets[node]];
      }
    }
  });
  EXPECT_EQ(check_forged().at("hulls"), "failed");
}

TEST_F(Validate, AnotherMeshIsAWarningAndItsErrorsAreFailures) {
  ASSERT_EQ(vpsbake(folder_, sample("cube") + " --voxel 5mm -o cube.vps.hdf").code, 0);
  const Outcome run = vpsbake(folder_, "validate cube.vps.hdf --mesh a.obj --json");
  EXPECT_EQ(run.code, 3);
  const auto by_name = results(Json::parse(run.out)["files"][0]);
  EXPECT_EQ(by_name.at("mesh"), "warning");
  EXPECT_NE(run.err.find("; check that this is its mesh, with the --unit"), std::string::npos) << run.err;
  for (const char* const name : {"mass", "field scaled", "points"}) EXPECT_EQ(by_name.at(name), "failed") << name;
  expect_refusal(folder_, "validate cube.vps.hdf --quiet --unit mm --mesh " + sample("cube"), 3,
                 "its bounds are 49.95 mm off, 100 um x");
}

TEST_F(Validate, AnOpenMeshIsToldOfAsTheMeshAfterTheOtherChecks) {
  std::string text = read_file(sample("cube"));
  text.resize(text.rfind("f "));
  write_file(folder_ / "open.obj", text);
  ASSERT_EQ(vpsbake(folder_, sample("cube") + " --voxel 5mm -o cube.vps.hdf").code, 0);
  const Outcome open = vpsbake(folder_, "validate cube.vps.hdf --mesh open.obj --repair none");
  EXPECT_EQ(open.code, 3);
  EXPECT_TRUE(open.err.starts_with("vpsbake: error: open.obj: the mesh is open")) << open.err;
  EXPECT_NE(open.out.find("  ok       hashes"), std::string::npos) << open.out;
}

TEST_F(Validate, TheDirectoryAndHdf5HaveToAgree) {
  const std::string bytes = read_file(folder_ / "a.vps.hdf");
  write_file(folder_ / "forged.vps.hdf", with_directory(bytes, [](Directory& d) { d.info.volume /= 2; }));
  EXPECT_EQ(check_forged().at("hdf5"), "failed");
  Outcome run = vpsbake(folder_, "validate forged.vps.hdf");
  EXPECT_NE(run.out.find("the attribute volume is not the directory's"), std::string::npos) << run.out;
  // A section of a later version.
  write_file(folder_ / "forged.vps.hdf", with_directory(bytes, [](Directory& d) {
               d.sections[d.section_count - 1].kind = SectionKind{77};
               d.sections[d.section_count - 1].flags = 0;
             }));
  run = vpsbake(folder_, "validate forged.vps.hdf --strict");
  EXPECT_EQ(run.code, 3);
  EXPECT_NE(run.out.find("warning  sections       kind 77"), std::string::npos) << run.out;
}

// The exit code of HDF5's own tool and everything that it reads from a file except the values and the file's name.
std::string metadata_by_h5dump(const TemporaryFolder& folder, const std::string& file) {
  const std::string command =
      "cd " + folder.path().string() + " && h5dump -A -p " + file + " >dump.txt 2>/dev/null </dev/null";
  const int status = std::system(command.c_str());
  const std::string text = read_file(folder / "dump.txt");
  return std::to_string(status) + text.substr(std::min(text.size(), text.find('\n')));
}

// HDF5's bytes between the sections are damaged. The asset's hashes are updated, HDF5's own checksums are not.
TEST_F(Validate, DamagedMetadataIsRefusedWhereverHdf5ReadsIt) {
  if (std::system("command -v h5dump >/dev/null") != 0) GTEST_SKIP() << "needs h5dump (Debian's hdf5-tools)";
  const std::string bytes = read_file(folder_ / "a.vps.hdf");
  Directory directory;
  ASSERT_EQ(decode_directory(std::as_bytes(std::span(bytes)), directory), Status::ok);
  const std::string undamaged = metadata_by_h5dump(folder_, "a.vps.hdf");
  int read = 0, unread = 0;
  for (std::size_t at = kUserBlockBytes + 8; at < kUserBlockBytes + 1200; at += 61) {
    std::string forged = bytes;
    forged[at] = static_cast<char>(forged[at] ^ 0x55);
    const auto all = std::as_bytes(std::span(forged));
    bool in_section = false;
    for (std::uint32_t i = 0; i < directory.section_count; ++i) {
      const Section& s = directory.sections[i];
      in_section = in_section || (at >= s.offset && at < s.offset + s.bytes);
    }
    if (in_section) continue;
    forged = with_directory(forged, [&](Directory& d) { d.metadata_hash = hash_metadata(all, d); });
    write_file(folder_ / "forged.vps.hdf", forged);
    const bool same = metadata_by_h5dump(folder_, "forged.vps.hdf") == undamaged;
    ++(same ? unread : read);
    // HDF5 leaves gaps between its blocks, whose bytes have no effect.
    const Outcome run = vpsbake(folder_, "validate forged.vps.hdf");
    EXPECT_EQ(run.code, same ? 0 : 3) << "at " << at << ": " << run.out << run.err;
    if (!same) {
      EXPECT_NE(run.err.find("not valid: hdf5"), std::string::npos) << "at " << at << ": " << run.err;
    }
  }
  EXPECT_GT(read, 0);
  EXPECT_GT(unread, 0);
}

TEST_F(Validate, WhatOtherHdf5ToolsHaveWrittenIsNamed) {
  if (std::system("command -v h5repack >/dev/null") != 0) GTEST_SKIP() << "needs h5repack (Debian's hdf5-tools)";
  const std::string repack =
      "h5repack " + (folder_ / "a.vps.hdf").string() + " " + (folder_ / "repacked.vps.hdf").string();
  ASSERT_EQ(std::system(repack.c_str()), 0);
  Outcome run = vpsbake(folder_, "validate repacked.vps.hdf");
  EXPECT_EQ(run.code, 3);
  EXPECT_NE(run.out.find("another HDF5 tool has written it"), std::string::npos) << run.out;
  // A truncated asset is not reported as written by another tool.
  write_file(folder_ / "cut.vps.hdf", read_file(folder_ / "a.vps.hdf").substr(0, 20000));
  run = vpsbake(folder_, "validate cut.vps.hdf");
  EXPECT_EQ(run.code, 3);
  EXPECT_EQ(run.out.find("another HDF5 tool"), std::string::npos) << run.out;
  EXPECT_TRUE(run.err.starts_with("vpsbake: error: cut.vps.hdf: not valid: the file is truncated")) << run.err;
  if (std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") != 0) GTEST_SKIP() << "needs python3-h5py";
  const std::string edit = "/usr/bin/python3 -c \"import h5py; h5py.File('" + (folder_ / "a.vps.hdf").string() +
                           "', 'r+').attrs.modify('volume', 3.0)\"";
  ASSERT_EQ(std::system(edit.c_str()), 0);
  run = vpsbake(folder_, "validate a.vps.hdf");
  EXPECT_EQ(run.code, 3);
  EXPECT_NE(run.out.find("another HDF5 tool"), std::string::npos) << run.out;
}

TEST_F(Validate, DamagedSectionsAreNamed) {
  std::string bytes = read_file(folder_ / "a.vps.hdf");
  Directory directory;
  ASSERT_EQ(decode_directory(std::as_bytes(std::span(bytes)), directory), Status::ok);
  for (const SectionKind kind : {SectionKind::scaled, SectionKind::point_areas})
    bytes[directory.find(kind)->offset] ^= 1;
  write_file(folder_ / "b.vps.hdf", bytes);
  const Outcome run = vpsbake(folder_, "validate b.vps.hdf");
  EXPECT_EQ(run.code, 3);
  EXPECT_NE(run.out.find("damaged: scaled, point_areas\n"), std::string::npos) << run.out;
  EXPECT_TRUE(run.err.starts_with("vpsbake: error: b.vps.hdf: not valid: hashes; copy or")) << run.err;
}

TEST_F(Validate, WithoutARecordItIsValidButNotStrictly) {
  forge([](AssetInfo&, std::vector<SectionData>& sections) {
    std::erase_if(sections, [](const SectionData& s) { return s.kind == SectionKind::record; });
  });
  EXPECT_EQ(vpsbake(folder_, "validate forged.vps.hdf").code, 0);
  const Outcome run = vpsbake(folder_, "validate forged.vps.hdf --strict");
  EXPECT_EQ(run.code, 3);
  EXPECT_NE(run.err.find("not valid: record"), std::string::npos) << run.err;
}

TEST_F(Validate, OfSeveralFilesEachIsCheckedAndOneFailureIsExitCodeFive) {
  std::filesystem::copy_file(folder_ / "a.vps.hdf", folder_ / "b.vps.hdf");
  EXPECT_EQ(vpsbake(folder_, "validate a.vps.hdf b.vps.hdf").code, 0);
  const Outcome run = vpsbake(folder_, "validate missing.vps.hdf a.obj b.vps.hdf");
  EXPECT_EQ(run.code, 5);
  EXPECT_NE(run.out.find("b.vps.hdf: valid"), std::string::npos);
  expect_refusal(folder_, "validate missing.vps.hdf", 2, "missing.vps.hdf");
  expect_refusal(folder_, "validate .", 2, "this is a folder; give a .vps.hdf file");
  expect_refusal(folder_, "validate a.vps.hdf --mesh missing.obj", 2, "missing.obj");
  expect_refusal(folder_, "validate a.vps.hdf --unit mm", 1, "--mesh");
}

}  // namespace
}  // namespace vps::test
