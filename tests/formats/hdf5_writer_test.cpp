// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/hdf5/hdf5_writer.h"

#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>

#include "formats/hdf5/section_names.h"
#include "tests/formats/tiny_asset.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

std::string refusal(const std::filesystem::path& path) {
  const TinyAsset tiny;
  try {
    write_asset(path, tiny.info, tiny.sections);
  } catch (const WriteError& error) {
    return error.what();
  }
  return "";
}

TEST(Hdf5Writer, TheSameAssetGivesTheSameBytesAnyTime) {
  const TemporaryFolder folder;
  const TinyAsset tiny;
  const std::size_t bytes = write_asset(folder / "a.vps.hdf", tiny.info, tiny.sections);
  EXPECT_EQ(bytes, std::filesystem::file_size(folder / "a.vps.hdf"));
  ::sleep(1);  // time stamps have a resolution of one second
  write_asset(folder / "b_with_another_name.vps.hdf", tiny.info, tiny.sections);
  EXPECT_EQ(read_file(folder / "a.vps.hdf"), read_file(folder / "b_with_another_name.vps.hdf"));
}

TEST(Hdf5Writer, TheBytesInMemoryAreThoseOfTheFile) {
  const TemporaryFolder folder;
  const TinyAsset tiny;
  write_asset(folder / "a.vps.hdf", tiny.info, tiny.sections);
  const std::string file = read_file(folder / "a.vps.hdf");
  const std::vector<std::byte> bytes = asset_bytes(tiny.info, tiny.sections);
  EXPECT_TRUE(std::ranges::equal(bytes, std::as_bytes(std::span(file))));
}

TEST(Hdf5Writer, TheDirectoryAgreesWithHdf5) {
  const TemporaryFolder folder;
  const TinyAsset tiny;
  write_asset(folder / "a.vps.hdf", tiny.info, tiny.sections);
  const std::string bytes = read_file(folder / "a.vps.hdf");
  Directory d;
  ASSERT_EQ(decode_directory(std::as_bytes(std::span(bytes)), d), Status::ok);

  const hid_t file = H5Fopen((folder / "a.vps.hdf").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  for (const SectionData& section : tiny.sections) {
    const detail::SectionName* name = nullptr;
    for (const auto& candidate : detail::kSectionNames) {
      if (candidate.kind == section.kind) name = &candidate;
    }
    ASSERT_NE(name, nullptr);
    const hid_t dataset = H5Dopen2(file, name->path, H5P_DEFAULT);
    ASSERT_GE(dataset, 0) << name->path;
    const Section* entry = d.find(section.kind);
    ASSERT_NE(entry, nullptr);
    EXPECT_EQ(H5Dget_offset(dataset), entry->offset);
    EXPECT_EQ(H5Dget_storage_size(dataset), entry->bytes);
    EXPECT_EQ(std::memcmp(bytes.data() + entry->offset, section.bytes.data(), section.bytes.size()), 0);
    const hid_t space = H5Dget_space(dataset);
    hsize_t shape[6];
    EXPECT_EQ(H5Sget_simple_extent_dims(space, shape, nullptr), static_cast<int>(section.shape.size()));
    for (std::size_t axis = 0; axis < section.shape.size(); ++axis) EXPECT_EQ(shape[axis], section.shape[axis]);
    EXPECT_GT(H5Aexists(dataset, "unit"), 0);
    EXPECT_GT(H5Aexists(dataset, "meaning"), 0);
    EXPECT_EQ(H5Aexists(dataset, "equation") > 0, name->equation[0] != '\0');
    H5Sclose(space);
    H5Dclose(dataset);
  }
  double voxel_size = 0;
  const hid_t attribute = H5Aopen_by_name(file, "/", "voxel_size", H5P_DEFAULT, H5P_DEFAULT);
  EXPECT_GE(H5Aread(attribute, H5T_NATIVE_DOUBLE, &voxel_size), 0);
  EXPECT_EQ(voxel_size, tiny.info.voxel_size);
  H5Aclose(attribute);
  H5Fclose(file);
}

TEST(Hdf5Writer, AFileRewrittenByAnotherToolIsNamed) {
  if (std::system("command -v h5repack >/dev/null") != 0) GTEST_SKIP() << "needs h5repack (Debian's hdf5-tools)";
  const TemporaryFolder folder;
  const TinyAsset tiny;
  write_asset(folder / "a.vps.hdf", tiny.info, tiny.sections);
  const std::string command = "h5repack " + (folder / "a.vps.hdf").string() + " " + (folder / "b.vps.hdf").string();
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string bytes = read_file(folder / "b.vps.hdf");
  Directory d;
  const Status status = decode_directory(std::as_bytes(std::span(bytes)), d);
  EXPECT_TRUE(status == Status::rewritten || status == Status::wrong_size) << describe(status);
}

TEST(Hdf5Writer, TemporaryNamesThatAnotherProcessTookAreLeftAlone) {
  const TemporaryFolder folder;
  // Names that a process with the same id in another container has taken.
  std::vector<std::filesystem::path> taken;
  for (int i = 0; i < 1000; ++i) {
    taken.push_back(folder / (".vps." + std::to_string(::getpid()) + "." + std::to_string(i)));
    write_file(taken.back(), "theirs");
  }
  const std::string bytes = "ours";
  write_whole(folder / "file", std::as_bytes(std::span(bytes)));
  EXPECT_EQ(read_file(folder / "file"), bytes);
  for (const auto& name : taken) EXPECT_EQ(read_file(name), "theirs");
  EXPECT_EQ(folder.names().size(), taken.size() + 1);
}

TEST(Hdf5Writer, AFailedWriteSaysWhyAndLeavesNothing) {
  const TemporaryFolder folder;
  EXPECT_NE(refusal(folder / "missing/a.vps.hdf").find("the folder does not exist"), std::string::npos);
  write_file(folder / "file", "x");
  EXPECT_NE(refusal(folder / "file/a.vps.hdf").find("not a folder"), std::string::npos);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"file"});
  TinyAsset wrong;
  wrong.sections[0].bytes.pop_back();
  EXPECT_THROW(write_asset(folder / "a.vps.hdf", wrong.info, wrong.sections), WriteError);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"file"});
}

TEST(Hdf5Writer, AFullDiskLeavesTheOldFileAndNothingElse) {
  const TemporaryFolder folder;
  write_file(folder / "a.vps.hdf", "old");
  const pid_t child = ::fork();
  if (child == 0) {
    // A limit on file size fails as a full disk does.
    const rlimit limit{6000, 6000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::signal(SIGXFSZ, SIG_IGN);
    const std::string why = refusal(folder / "a.vps.hdf");
    ::_exit(why.find("space") != std::string::npos ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.vps.hdf"});
  EXPECT_EQ(read_file(folder / "a.vps.hdf"), "old");
}

}  // namespace
}  // namespace vps::test
