// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <cstring>
#include <memory>

#include "formats/check_directory.h"
#include "tests/support/baked.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

void write_sphere(const std::filesystem::path& path, const bake::BakeOptions& options) {
  const bake::BakedAsset result = bake::bake(make_sphere(0.1, 3), options);
  write_asset(path, result.info, result.sections);
}

using Bytes = std::vector<std::byte>;

// The bytes of a baked sphere's asset file.
Bytes sphere_bytes(const bake::BakeOptions& options) {
  const TemporaryFolder folder;
  write_sphere(folder / "s.vps.hdf", options);
  const std::string text = read_file(folder / "s.vps.hdf");
  Bytes bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

Directory directory_of(const Bytes& bytes) {
  Directory directory;
  EXPECT_EQ(decode_directory(bytes, directory), Status::ok);
  return directory;
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
  const Bytes bytes = sphere_bytes(all_fields(0.02));
  const Directory directory = directory_of(bytes);
  const std::pair<SectionKind, Use> users[] = {{SectionKind::brick_index, Use::layers},
                                               {SectionKind::field_roots, Use::scaled},
                                               {SectionKind::field_roots, Use::real},
                                               {SectionKind::children, Use::pointshell}};
  for (const auto& [kind, user] : users) {
    Bytes wrong = bytes;
    for (std::uint64_t i = 0; i < 4; ++i) wrong[directory.find(kind)->offset + i] = std::byte{0xFD};
    for (const Use use : {Use::layers, Use::scaled, Use::real, Use::pointshell}) {
      Asset opened;
      const bool shares = kind == SectionKind::field_roots && (use == Use::scaled || use == Use::real);
      EXPECT_EQ(Asset::open(wrong, opened, use), use == user || shares ? Status::bad_index : Status::ok);
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

TEST(Asset, ATruncatedFileIsRefused) {
  const TemporaryFolder folder;
  write_sphere(folder / "s.vps.hdf", all_fields(0.02));
  const std::string bytes = read_file(folder / "s.vps.hdf");
  Asset asset;
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{4095}, std::size_t{4096}, bytes.size() / 2, bytes.size() - 1}) {
    write_file(folder / "cut", bytes.substr(0, size));
    ASSERT_NE(Asset::open((folder / "cut").c_str(), asset), Status::ok) << size;
  }
}

TEST(Asset, EveryTruncationInMemoryIsRefused) {
  const Bytes bytes = sphere_bytes(all_fields(0.02));
  Asset asset;
  ASSERT_EQ(Asset::open(bytes, asset), Status::ok);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ASSERT_NE(Asset::open(std::span(bytes).first(size), asset), Status::ok) << size;
    ASSERT_FALSE(asset.is_open());
  }
}

TEST(Asset, ACorruptPayloadIsCaughtByVerify) {
  Bytes bytes = sphere_bytes(all_fields(0.02));
  bytes[directory_of(bytes).find(SectionKind::scaled)->offset + 100] ^= std::byte{1};
  Asset asset;
  ASSERT_EQ(Asset::open(bytes, asset), Status::ok);
  EXPECT_EQ(asset.verify(), Status::corrupt_payload);
}

// Compares pointers into two assets by their offset from the asset's first byte.
class Places {
 public:
  Places(const Asset& first, const Asset& second) : first_(first), second_(second) {}
  [[nodiscard]] bool same(const void* of_first, const void* of_second) const {
    if (of_first == nullptr || of_second == nullptr) return of_first == of_second;
    return static_cast<const std::byte*>(of_first) - first_.bytes().data() ==
           static_cast<const std::byte*>(of_second) - second_.bytes().data();
  }

 private:
  const Asset& first_;
  const Asset& second_;
};

TEST(Asset, InMemoryIsWhatItIsInAFile) {
  const TemporaryFolder folder;
  write_sphere(folder / "s.vps.hdf", all_fields(0.01));
  const Bytes bytes = sphere_bytes(all_fields(0.01));
  Asset file;
  Asset memory;
  ASSERT_EQ(Asset::open((folder / "s.vps.hdf").c_str(), file), Status::ok);
  ASSERT_EQ(Asset::open(bytes, memory), Status::ok);
  EXPECT_EQ(memory.bytes().data(), bytes.data()) << "a copy";
  EXPECT_TRUE(std::ranges::equal(file.bytes(), memory.bytes()));
  EXPECT_EQ(memory.verify(), Status::ok);
  const Places places(file, memory);
  for (const Field field : {Field::none, Field::layers, Field::scaled, Field::real}) {
    VoxelmapView a;
    VoxelmapView b;
    ASSERT_EQ(file.voxelmap(a, field), Status::ok);
    ASSERT_EQ(memory.voxelmap(b, field), Status::ok);
    EXPECT_EQ(a.field, b.field);
    EXPECT_EQ(a.element, b.element);
    EXPECT_EQ(a.error, b.error);
    EXPECT_TRUE(places.same(a.values, b.values));
    EXPECT_TRUE(places.same(a.gradients, b.gradients));
    EXPECT_TRUE(places.same(a.brick_index, b.brick_index));
    EXPECT_TRUE(places.same(a.field_roots, b.field_roots));
    EXPECT_TRUE(places.same(a.field_nodes, b.field_nodes));
    EXPECT_TRUE(places.same(a.coarse_layers, b.coarse_layers));
  }
  PointshellView a;
  PointshellView b;
  ASSERT_EQ(file.pointshell(a), Status::ok);
  ASSERT_EQ(memory.pointshell(b), Status::ok);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.nodes, b.nodes);
  EXPECT_EQ(a.levels, b.levels);
  for (int row = 0; row < 3; ++row) EXPECT_TRUE(places.same(a.position[row], b.position[row]));
  EXPECT_TRUE(places.same(a.inward_normal, b.inward_normal));
  for (int row = 0; row < 4; ++row) EXPECT_TRUE(places.same(a.sphere[row], b.sphere[row]));
  EXPECT_TRUE(places.same(a.area, b.area));
  EXPECT_TRUE(places.same(a.children, b.children));
  EXPECT_TRUE(places.same(a.parent_point, b.parent_point));
  EXPECT_TRUE(places.same(a.level_offsets, b.level_offsets));
}

TEST(Asset, InMemoryItsAddressMustBeAligned) {
  bake::BakeOptions options;
  options.voxel_size = 0.02;
  const Bytes bytes = sphere_bytes(options);
  Bytes room(bytes.size() + 64);
  Asset asset;
  for (std::size_t shift = 0; shift < 32; ++shift) {
    std::memcpy(room.data() + shift, bytes.data(), bytes.size());
    const Status expected = shift % Asset::kMemoryAlignment == 0 ? Status::ok : Status::bad_argument;
    ASSERT_EQ(Asset::open(std::span<const std::byte>(room).subspan(shift, bytes.size()), asset), expected) << shift;
    ASSERT_EQ(asset.is_open(), expected == Status::ok);
  }
  EXPECT_EQ(Asset::open(std::span<const std::byte>(), asset), Status::too_short);
}

// The bytes fill whole pages: an asset that mistook them for its own mapping would unmap them.
TEST(Asset, InMemoryTheBytesStayTheCallers) {
  bake::BakeOptions options;
  options.voxel_size = 0.02;
  const Bytes bytes = sphere_bytes(options);
  constexpr std::size_t kPage = 4096;
  const std::unique_ptr<void, decltype(&std::free)> pages(
      std::aligned_alloc(kPage, (bytes.size() + kPage - 1) / kPage * kPage), &std::free);
  std::memcpy(pages.get(), bytes.data(), bytes.size());
  const std::span<const std::byte> given(static_cast<const std::byte*>(pages.get()), bytes.size());
  {
    Asset first;
    ASSERT_EQ(Asset::open(given, first), Status::ok);
    Asset second = std::move(first);
    EXPECT_FALSE(first.is_open());  // NOLINT(bugprone-use-after-move)
    EXPECT_FALSE(first.has_pointshell());
    EXPECT_EQ(second.verify(), Status::ok);
    // An asset in memory is swapped with a mapped one.
    const TemporaryFolder folder;
    write_sphere(folder / "s.vps.hdf", options);
    Asset mapped;
    ASSERT_EQ(Asset::open((folder / "s.vps.hdf").c_str(), mapped), Status::ok);
    std::swap(mapped, second);
    EXPECT_EQ(mapped.bytes().data(), given.data());
    EXPECT_EQ(mapped.verify(), Status::ok);
    EXPECT_EQ(second.verify(), Status::ok);
  }
  EXPECT_TRUE(std::ranges::equal(given, bytes));
}

TEST(Asset, CoarseLayersMustEndWithAWordOfTheFile) {
  const Bytes bytes = sphere_bytes(all_fields(0.007));
  Directory directory = directory_of(bytes);
  const Section* const found = directory.find(SectionKind::coarse_layers);
  ASSERT_EQ(found->bytes % 4, 2U) << "an even number of blocks proves nothing";
  Section& coarse = directory.sections[static_cast<std::size_t>(found - directory.sections.data())];
  coarse.offset = (bytes.size() + kSectionAlignment - 1) / kSectionAlignment * kSectionAlignment;
  directory.file_bytes = coarse.offset + coarse.bytes;
  EXPECT_EQ(detail::check_directory(directory), Status::bad_section);
  directory.file_bytes += 2;
  EXPECT_EQ(detail::check_directory(directory), Status::ok);
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
  // Opening another file releases the old mapping, even if opening fails.
  EXPECT_EQ(Asset::open("/nonexistent", first), Status::cannot_open);
  EXPECT_FALSE(first.is_open());
}

}  // namespace
}  // namespace vps::test
