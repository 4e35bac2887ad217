// SPDX-License-Identifier: GPL-3.0-or-later
// An asset of each format version, asset_MAJOR.MINOR.vps.hdf, gives the results in the text file beside it. These files
// never change. VPS_WRITE_GOLDEN=1 writes the files of a version that has none.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "formats/mesh/mesh_import.h"
#include "runtime/vps_runtime.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

namespace fs = std::filesystem;

// Results by the query's name. [m], [-], or a count
using Answers = std::map<std::string, std::vector<double>>;

// Points inside, on, near and far from the torus. [m]
constexpr Vec3 kPoints[] = {{0.05F, 0, 0},      {0.061F, 0.002F, 0.003F}, {-0.03F, 0.031F, 0.012F},
                            {0, 0.068F, 0.01F}, {0.02F, -0.02F, 0.0F},    {0.048F, -0.02F, 0.0215F},
                            {0, 0, 0},          {0.3F, -0.2F, 0.1F}};

std::string version_name(unsigned major, unsigned minor) {
  return "asset_" + std::to_string(major) + "." + std::to_string(minor);
}

void answer_info(const AssetInfo& info, Answers& answers) {
  answers["dims"] = {info.dims.begin(), info.dims.end()};
  answers["voxel_size"] = {info.voxel_size};
  answers["lambda"] = {info.lambda};
  answers["band"] = {info.band_inner, info.band_outer};
  answers["bounds_max"] = {info.bounds_max.begin(), info.bounds_max.end()};
  answers["volume"] = {info.volume};
  answers["inertia"] = {info.inertia.begin(), info.inertia.end()};
  answers["mesh"] = {static_cast<double>(info.vertices), static_cast<double>(info.triangles), info.surface_area};
  answers["shell"] = {static_cast<double>(info.points), static_cast<double>(info.levels),
                      static_cast<double>(info.branching), info.covering_radius};
  answers["certificate"] = {info.layers_error.bound, info.scaled_error.bound, info.real_error.bound};
}

void answer_field(const char* name, const VoxelmapView& map, Answers& answers) {
  std::vector<double>& values = answers[std::string("penetration_") + name];
  for (const Vec3& point : kPoints) values.push_back(double{penetration(map, point, {0, 0, 1})});
}

// The torus against itself, shifted and rotated about z and x. Contacts are in the order of the tree.
void answer_contacts(const char* name, const PointshellView& shell, const VoxelmapView& map, Answers& answers) {
  const Pose pose{{0.6, -0.64, 0.48, 0.8, 0.48, -0.36, 0, 0.6, 0.8}, {0.09, 0.01, 0.005}};
  Scratch scratch;
  std::vector<Contact> contacts(shell.points);
  QueryResult result;
  ASSERT_EQ(traverse(shell, map, pose, {}, scratch, contacts, result), Status::ok);
  const std::string prefix = std::string("contacts_") + name;
  answers[prefix] = {static_cast<double>(result.contacts), result.delta};
  answers[prefix + "_force"] = {result.force, result.force + 3};
  answers[prefix + "_torque"] = {result.torque, result.torque + 3};
  for (std::uint32_t i = 0; i < result.contacts; ++i) {
    const Contact& c = contacts[i];
    answers[prefix + "_point_" + std::to_string(c.point)] = {
        double{c.position.x},      double{c.position.y},      double{c.position.z}, double{c.inward_normal.x},
        double{c.inward_normal.y}, double{c.inward_normal.z}, double{c.area},       double{c.penetration}};
  }
}

Answers ask(const Asset& asset) {
  Answers answers;
  answer_info(asset.info(), answers);
  PointshellView shell;
  EXPECT_EQ(asset.pointshell(shell), Status::ok);
  for (const auto& [name, field] :
       {std::pair{"layers", Field::layers}, std::pair{"scaled", Field::scaled}, std::pair{"real", Field::real}}) {
    VoxelmapView map;
    EXPECT_EQ(asset.voxelmap(map, field), Status::ok) << name;
    answer_field(name, map, answers);
    answer_contacts(name, shell, map, answers);
  }
  return answers;
}

Answers read_answers(const fs::path& path) {
  Answers answers;
  std::istringstream file(read_file(path));
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    if (name.empty() || name[0] == '#') continue;
    for (double value = 0; words >> value;) answers[name].push_back(value);
  }
  return answers;
}

void write_answers(const fs::path& path, const Answers& answers) {
  std::string text = "# What the asset of the same name answers. Lengths in m, areas in m^2, masses at unit density.\n";
  for (const auto& [name, values] : answers) {
    text += name;
    for (const double value : values) {
      char word[32];
      std::snprintf(word, sizeof word, " %.7g", value);
      text += word;
    }
    text += "\n";
  }
  write_file(path, text);
}

// Writes only the files that are missing for the present version of the format.
void write_missing(const fs::path& asset) {
  if (!fs::exists(asset)) {
    bake::BakeOptions options;
    options.resolution = 20;
    options.layers = options.scaled = options.real = true;
    options.field_error = 0.5;
    options.alpha = 2.5;
    options.band_inside = options.band_outside = 2;
    const bake::BakedAsset baked = bake::bake(import_mesh(fs::path(VPS_SAMPLE_MESHES) / "torus.obj"), options);
    write_asset(asset, baked.info, baked.sections);
  }
  const fs::path text = fs::path(asset).replace_extension().replace_extension(".txt");
  Asset opened;
  ASSERT_EQ(Asset::open(asset.c_str(), opened), Status::ok);
  if (!fs::exists(text)) write_answers(text, ask(opened));
}

// The names of all golden assets, without ".vps.hdf".
std::vector<std::string> golden_names() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(VPS_GOLDEN)) {
    if (entry.path().extension() == ".hdf") names.push_back(entry.path().stem().stem().string());
  }
  return names;
}

void expect_same(const Answers& now, const Answers& then) {
  for (const auto& [name, values] : then) {
    const auto found = now.find(name);
    ASSERT_NE(found, now.end()) << name;
    ASSERT_EQ(found->second.size(), values.size()) << name;
    // The tolerance covers differences between instruction sets in float.
    double largest = 0;
    for (const double value : values) largest = std::max(largest, std::abs(value));
    for (std::size_t i = 0; i < values.size(); ++i)
      EXPECT_NEAR(found->second[i], values[i], 1e-5 * std::abs(values[i]) + 1e-6 * largest) << name << " " << i;
  }
  EXPECT_EQ(now.size(), then.size());
}

TEST(GoldenAsset, TodaysVersionOfTheFormatHasOne) {
  const std::string name = version_name(kFormatMajor, kFormatMinor);
  const fs::path asset = fs::path(VPS_GOLDEN) / (name + ".vps.hdf");
  if (std::getenv("VPS_WRITE_GOLDEN") != nullptr) write_missing(asset);
  EXPECT_TRUE(fs::exists(asset)) << "VPS_WRITE_GOLDEN=1 golden_test writes it";
  EXPECT_TRUE(fs::exists(fs::path(VPS_GOLDEN) / (name + ".txt")));
}

TEST(GoldenAsset, ThoseOfThisMajorVersionOpenAndAnswerAsTheyDid) {
  int opened = 0;
  for (const std::string& name : golden_names()) {
    if (!name.starts_with("asset_" + std::to_string(kFormatMajor) + ".")) continue;
    SCOPED_TRACE(name);
    Asset asset;
    ASSERT_EQ(Asset::open((fs::path(VPS_GOLDEN) / (name + ".vps.hdf")).c_str(), asset), Status::ok);
    EXPECT_EQ(asset.verify(), Status::ok);
    const Answers then = read_answers(fs::path(VPS_GOLDEN) / (name + ".txt"));
    for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
      const std::int64_t target = left & -left;
      SCOPED_TRACE(hwy::TargetName(target));
      hwy::SetSupportedTargetsForTest(target);
      expect_same(ask(asset), then);
      hwy::SetSupportedTargetsForTest(0);
    }
    ++opened;
  }
  EXPECT_GT(opened, 0);
}

TEST(GoldenAsset, ThoseOfAnotherMajorVersionAreRefusedByTheirVersion) {
  constexpr std::size_t kMajorOffset = 8;  // behind the magic: docs/internals/format.md
  for (const std::string& name : golden_names()) {
    std::string bytes = read_file(fs::path(VPS_GOLDEN) / (name + ".vps.hdf"));
    if (name.starts_with("asset_" + std::to_string(kFormatMajor) + ".")) ++bytes.at(kMajorOffset);
    Asset asset;
    EXPECT_EQ(Asset::open(std::as_bytes(std::span(bytes)), asset), Status::wrong_version) << name;
  }
}

}  // namespace
}  // namespace vps::test
