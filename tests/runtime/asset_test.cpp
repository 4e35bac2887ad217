// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstring>

#include "tests/support/baked.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

void write_sphere(const std::filesystem::path& path, const bake::BakeOptions& options) {
  const bake::BakedAsset result = bake::bake(make_sphere(0.1, 3), options);
  write_asset(path, result.info, result.sections);
}

TEST(Asset, OpensAndTellsWhatItHolds) {
  const TemporaryFolder folder;
  write_sphere(folder / "s.vps.hdf", all_fields(0.01));
  Asset asset;
  ASSERT_EQ(Asset::open((folder / "s.vps.hdf").c_str(), asset), Status::ok);
  EXPECT_TRUE(asset.is_open());
  EXPECT_TRUE(asset.has_voxelmap());
  EXPECT_TRUE(asset.has_pointshell());
  EXPECT_EQ(asset.verify(), Status::ok);
  VoxelmapView map;
  ASSERT_EQ(asset.voxelmap(map), Status::ok);
  EXPECT_EQ(map.field, Field::real);
  for (const Field field : {Field::layers, Field::scaled, Field::real}) {
    ASSERT_EQ(asset.voxelmap(map, field), Status::ok);
    EXPECT_EQ(map.field, field);
  }
  PointshellView shell;
  ASSERT_EQ(asset.pointshell(shell), Status::ok);
  EXPECT_EQ(shell.points, asset.info().points);
  EXPECT_EQ(shell.level_offsets[shell.levels], shell.nodes);
}

TEST(Asset, AMissingPartOrFieldIsAStatus) {
  const TemporaryFolder folder;
  bake::BakeOptions options;
  options.voxel_size = 0.01;
  options.pointshell = false;
  write_sphere(folder / "map.vps.hdf", options);
  options.pointshell = true;
  options.voxelmap = false;
  write_sphere(folder / "shell.vps.hdf", options);
  Asset map;
  Asset shell;
  ASSERT_EQ(Asset::open((folder / "map.vps.hdf").c_str(), map), Status::ok);
  ASSERT_EQ(Asset::open((folder / "shell.vps.hdf").c_str(), shell), Status::ok);
  VoxelmapView map_view;
  PointshellView shell_view;
  EXPECT_EQ(map.pointshell(shell_view), Status::missing_part);
  EXPECT_EQ(map.voxelmap(map_view, Field::real), Status::missing_part);
  EXPECT_EQ(shell.voxelmap(map_view), Status::missing_part);
  EXPECT_EQ(map_view.field, Field::none);
}

TEST(Asset, WhatItWasNotOpenedForIsMissing) {
  const TemporaryFolder folder;
  write_sphere(folder / "s.vps.hdf", all_fields(0.01));
  const std::string path = folder / "s.vps.hdf";
  VoxelmapView map;
  PointshellView shell;
  Asset asset;
  ASSERT_EQ(Asset::open(path.c_str(), asset, Use::pointshell), Status::ok);
  EXPECT_TRUE(asset.has_pointshell() && !asset.has_voxelmap());
  EXPECT_EQ(asset.pointshell(shell), Status::ok);
  for (const Field field : {Field::none, Field::layers, Field::scaled, Field::real})
    EXPECT_EQ(asset.voxelmap(map, field), Status::missing_part);
  ASSERT_EQ(Asset::open(path.c_str(), asset, Use::scaled), Status::ok);
  const Asset moved = std::move(asset);
  EXPECT_TRUE(moved.has_voxelmap() && !moved.has_pointshell());
  EXPECT_EQ(moved.pointshell(shell), Status::missing_part);
  ASSERT_EQ(moved.voxelmap(map), Status::ok);
  EXPECT_EQ(map.field, Field::scaled);  // not the finest stored
  EXPECT_EQ(moved.voxelmap(map, Field::real), Status::missing_part);
  ASSERT_EQ(Asset::open(path.c_str(), asset, Use::layers | Use::pointshell), Status::ok);
  EXPECT_TRUE(asset.has_pointshell());
  ASSERT_EQ(asset.voxelmap(map), Status::ok);
  EXPECT_EQ(map.field, Field::layers);
}

TEST(Asset, IndicesAreCheckedWhereTheyAreInUse) {
  const TemporaryFolder folder;
  write_sphere(folder / "s.vps.hdf", all_fields(0.02));
  const std::string bytes = read_file(folder / "s.vps.hdf");
  Asset asset;
  ASSERT_EQ(Asset::open((folder / "s.vps.hdf").c_str(), asset), Status::ok);
  const std::pair<SectionKind, Use> users[] = {{SectionKind::brick_index, Use::layers},
                                               {SectionKind::field_roots, Use::scaled},
                                               {SectionKind::field_roots, Use::real},
                                               {SectionKind::children, Use::pointshell}};
  for (const auto& [kind, user] : users) {
    std::string wrong = bytes;
    for (std::uint64_t i = 0; i < 4; ++i) wrong[asset.directory().find(kind)->offset + i] = char(0x7F);
    write_file(folder / "wrong.vps.hdf", wrong);
    for (const Use use : {Use::layers, Use::scaled, Use::real, Use::pointshell}) {
      Asset opened;
      const bool shares = kind == SectionKind::field_roots && (use == Use::scaled || use == Use::real);
      EXPECT_EQ(Asset::open((folder / "wrong.vps.hdf").c_str(), opened, use),
                use == user || shares ? Status::bad_index : Status::ok);
    }
  }
}

TEST(Asset, WhatIsNoAssetIsRefused) {
  const TemporaryFolder folder;
  const auto status = [&](const std::string& name) {
    Asset asset;
    const Status s = Asset::open((folder / name).c_str(), asset);
    EXPECT_FALSE(asset.is_open());
    return s;
  };
  EXPECT_EQ(status("none"), Status::cannot_open);
  EXPECT_EQ(status("."), Status::cannot_open);
  ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
  EXPECT_EQ(status("fifo"), Status::cannot_open);
  write_file(folder / "empty", "");
  EXPECT_EQ(status("empty"), Status::too_short);
  write_file(folder / "text", std::string(10000, 'x'));
  EXPECT_EQ(status("text"), Status::wrong_magic);
  Asset asset;
  EXPECT_EQ(Asset::open(nullptr, asset), Status::bad_argument);
  EXPECT_EQ(asset.verify(), Status::cannot_open);
}

TEST(Asset, ATruncatedFileIsRefusedAndACorruptOneIsCaughtByVerify) {
  const TemporaryFolder folder;
  write_sphere(folder / "s.vps.hdf", all_fields(0.02));
  const std::string bytes = read_file(folder / "s.vps.hdf");
  Asset asset;
  for (std::size_t size = 0; size < bytes.size(); size += 997) {
    write_file(folder / "cut", bytes.substr(0, size));
    ASSERT_NE(Asset::open((folder / "cut").c_str(), asset), Status::ok) << size;
  }
  ASSERT_EQ(Asset::open((folder / "s.vps.hdf").c_str(), asset), Status::ok);
  const std::uint64_t offset = asset.directory().find(SectionKind::scaled)->offset;
  std::string corrupt = bytes;
  corrupt[offset + 100] = static_cast<char>(corrupt[offset + 100] ^ 1);
  write_file(folder / "corrupt", corrupt);
  ASSERT_EQ(Asset::open((folder / "corrupt").c_str(), asset), Status::ok);
  EXPECT_EQ(asset.verify(), Status::corrupt_payload);
}

TEST(Asset, MovingHandsTheMappingOver) {
  const TemporaryFolder folder;
  write_sphere(folder / "s.vps.hdf", all_fields(0.02));
  Asset first;
  ASSERT_EQ(Asset::open((folder / "s.vps.hdf").c_str(), first), Status::ok);
  Asset second = std::move(first);
  EXPECT_FALSE(first.is_open());  // NOLINT(bugprone-use-after-move)
  EXPECT_FALSE(first.has_voxelmap());
  EXPECT_TRUE(second.is_open());
  first = std::move(second);
  EXPECT_EQ(first.verify(), Status::ok);
  // Opening something else lets go of the old mapping, also when that fails.
  EXPECT_EQ(Asset::open("/nonexistent", first), Status::cannot_open);
  EXPECT_FALSE(first.is_open());
}

}  // namespace
}  // namespace vps::test
