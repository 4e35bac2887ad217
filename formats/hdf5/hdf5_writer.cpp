// SPDX-License-Identifier: GPL-3.0-or-later
// An asset as HDF5: contiguous datasets at known offsets, no time stamps, and the directory in the user block.
#include "formats/hdf5/hdf5_writer.h"

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <string>
#include <utility>

#include "formats/hdf5/facts.h"
#include "formats/hdf5/hdf5_handle.h"
#include "formats/hdf5/section_names.h"

namespace vps {
namespace {

using detail::create_group;
using detail::Handle;
using detail::MemoryFile;
using detail::require;
using detail::stored_type;

std::string system_reason(int error) {
  switch (error) {
    case ENOENT:
      return "the folder does not exist; create it or choose another output";
    case EACCES:
    case EPERM:
    case EROFS:
      return "the folder may not be written; choose another output";
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return "no space is left for the file; free some or choose another output";
    case ENOTDIR:
      return "a part of the path is not a folder; choose another output";
    case ENAMETOOLONG:
      return "the name is too long; choose another output";
    case EISDIR:
      return "the output is a folder; give a file name";
    default:
      return std::string(std::strerror(error)) + "; choose another output";
  }
}

[[noreturn]] void fail_system(int error) {
  throw WriteError(system_reason(error));
}

// Writes the bytes to a temporary file on the disk, then puts that in place of the target. So no half-written target is
// ever visible. The temporary file has no name where the file system allows that: then a killed process leaves no file.
class OutputFile {
 public:
  // Follows a symbolic link by default, as every other tool does.
  explicit OutputFile(const std::filesystem::path& target, Links links = Links::follow)
      : target_(links == Links::follow ? link_target(target) : target) {
    std::error_code ignored;
    const bool is_link = std::filesystem::is_symlink(target_, ignored);
    if (is_link && links == Links::follow) fail_system(ELOOP);
    if (!is_link && std::filesystem::exists(target_, ignored) && !std::filesystem::is_regular_file(target_, ignored)) {
      throw WriteError(std::filesystem::is_directory(target_, ignored)
                           ? "the output is a folder; give a file name"
                           : "the output is not a regular file; choose another output");
    }
    folder_ = target_.has_parent_path() ? target_.parent_path() : ".";
    // Not every file system has nameless files, and without /proc they cannot be given a name.
    if (::access("/proc/self/fd", X_OK) == 0) {
      fd_ = ::open(folder_.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
    } else {
      errno = EOPNOTSUPP;
    }
    if (fd_ < 0 && errno != EACCES && errno != ENOENT && errno != EROFS && errno != ENOSPC) {
      do {
        name_ = unused_name();
        fd_ = ::open(name_.c_str(), O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0666);
      } while (fd_ < 0 && errno == EEXIST);
    }
    if (fd_ < 0) {
      const int error = errno;
      name_.clear();
      fail_system(error);
    }
  }
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile() {
    if (fd_ >= 0) ::close(fd_);
    if (!name_.empty()) ::unlink(name_.c_str());
  }

  void write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) fail_system(written < 0 ? errno : ENOSPC);
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
  }

  void move_into_place() {
    if (::fsync(fd_) != 0) fail_system(errno);
    if (name_.empty() && !link_as(target_)) {
      // Only a rename replaces an existing file.
      std::string name;
      do {
        name = unused_name();
      } while (!link_as(name));
      name_ = std::move(name);
    }
    if (!name_.empty() && ::rename(name_.c_str(), target_.c_str()) != 0) fail_system(errno);
    name_.clear();
    const int folder = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder >= 0) {
      ::fsync(folder);
      ::close(folder);
    }
  }

 private:
  // Short, because the target's own name may already have the largest length. A process in another container may have
  // the same number and use the name in the same folder, so callers try again.
  [[nodiscard]] std::string unused_name() const {
    static std::atomic<unsigned> count = 0;
    return (folder_ / (std::string(kTemporaryPrefix) + std::to_string(::getpid()) + "." + std::to_string(count++)))
        .string();
  }

  // Gives the nameless file a name. @return false when it is taken
  [[nodiscard]] bool link_as(const std::filesystem::path& name) const {
    const std::string nameless = "/proc/self/fd/" + std::to_string(fd_);
    if (::linkat(AT_FDCWD, nameless.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0) return true;
    if (errno != EEXIST) fail_system(errno);
    return false;
  }

  std::filesystem::path target_;
  std::filesystem::path folder_;
  std::string name_;  // empty while the file has none
  int fd_ = -1;
};

// Writes the header's scalars again, for people and for tools that only know HDF5. All SI.
void write_facts(hid_t root, const AssetInfo& info) {
  detail::for_each_fact(info, [&](const char* name, const auto& value) { detail::write_attribute(root, name, value); });
}

const detail::SectionName& name_of(SectionKind kind) {
  for (const detail::SectionName& name : detail::kSectionNames) {
    if (name.kind == kind) return name;
  }
  throw WriteError("a section has an unknown kind; this is a defect, please report it");
}

Section write_section(hid_t file, const SectionData& data) {
  const detail::SectionName& name = name_of(data.kind);
  Section section;
  section.kind = data.kind;
  section.element = data.element;
  // Readers that do not know these may go without.
  constexpr SectionKind kOptional[] = {SectionKind::record, SectionKind::far, SectionKind::planes,
                                       SectionKind::corners};
  const bool is_optional = std::find(std::begin(kOptional), std::end(kOptional), data.kind) != std::end(kOptional);
  section.flags = is_optional ? 0 : kSectionRequired;
  section.rank = static_cast<std::uint32_t>(data.shape.size());
  std::uint64_t count = 1;
  for (std::size_t axis = 0; axis < data.shape.size() && axis < section.shape.size(); ++axis) {
    section.shape[axis] = data.shape[axis];
    count *= data.shape[axis];
  }
  section.bytes = data.bytes.size();
  section.hash = data.hash ? *data.hash : hash_bytes(data.bytes);
  if (count * element_bytes(data.element) != section.bytes || section.bytes == 0) {
    throw WriteError(std::string("the size of ") + name.path + " is wrong; this is a defect, please report it");
  }

  const Handle create(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "set up a dataset");
  require(H5Pset_layout(create, H5D_CONTIGUOUS), "set up a dataset");
  // Offsets exist only once space is allocated.
  require(H5Pset_alloc_time(create, H5D_ALLOC_TIME_EARLY), "set up a dataset");
  require(H5Pset_fill_time(create, H5D_FILL_TIME_NEVER), "set up a dataset");
  require(H5Pset_obj_track_times(create, false), "set up a dataset");
  const std::vector<hsize_t> shape(data.shape.begin(), data.shape.end());
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose,
                     "set up a dataset");
  const hid_t type = stored_type(data.element);
  if (type == H5I_INVALID_HID)
    throw WriteError("a section has an unknown element type; this is a defect, please report it");
  const Handle dataset(H5Dcreate2(file, name.path, type, space, H5P_DEFAULT, create, H5P_DEFAULT), H5Dclose,
                       "create a dataset");
  require(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data.bytes.data()), "write a dataset");
  detail::write_attribute(dataset, "unit", name.unit);
  detail::write_attribute(dataset, "meaning", name.meaning);
  if (name.equation[0] != '\0') detail::write_attribute(dataset, "equation", name.equation);
  section.offset = H5Dget_offset(dataset);
  if (section.offset == HADDR_UNDEF || section.offset % kSectionAlignment != 0) {
    throw WriteError(std::string("HDF5 placed ") + name.path +
                     " where it cannot be mapped; this is a defect, please report it");
  }
  return section;
}

// Without it the file is copied whenever it grows. [bytes]
constexpr std::size_t kRoomForMetadata = 1 << 16;

// The bytes of the file.
std::vector<std::byte> encode(const AssetInfo& info, std::span<const SectionData> sections) {
  if (sections.size() > kMaxSections) throw WriteError("too many sections; this is a defect, please report it");
  const std::lock_guard lock(detail::one_at_a_time);
  const detail::SilentErrors silent;
  std::size_t room = kRoomForMetadata;
  for (const SectionData& section : sections) room += section.bytes.size() + kSectionAlignment;
  MemoryFile memory(room);
  Directory directory;
  directory.info = info;
  {
    Handle file = detail::create_file(memory, kUserBlockBytes);
    {
      const Handle root(H5Gopen2(file, "/", H5P_DEFAULT), H5Gclose, "open the root group");
      write_facts(root, info);
    }
    if (info.dims[0] > 0) create_group(file, "/voxelmap");
    if (info.points > 0) {
      create_group(file, "/pointshell");
      create_group(file, "/pointshell/tree");
    }
    for (const SectionData& section : sections) {
      directory.sections[directory.section_count++] = write_section(file, section);
    }
    memory.finish(file);
  }
  // The user block goes in last, when the file's size and every offset are known.
  const std::span<std::byte> image = memory.bytes();
  directory.file_bytes = image.size();
  directory.metadata_hash = hash_metadata(image, directory);
  encode_directory(directory, image.first<kUserBlockBytes>());
  return memory.take();
}

}  // namespace

std::size_t write_asset(const std::filesystem::path& path, const AssetInfo& info,
                        std::span<const SectionData> sections) {
  OutputFile output(path);
  const std::vector<std::byte> image = encode(info, sections);
  output.write(image);
  output.move_into_place();
  return image.size();
}

std::vector<std::byte> asset_bytes(const AssetInfo& info, std::span<const SectionData> sections) {
  return encode(info, sections);
}

std::filesystem::path link_target(std::filesystem::path path) {
  constexpr int kMostLinks = 40;  // as Linux follows
  std::error_code failed;
  for (int links = 0; links < kMostLinks && std::filesystem::is_symlink(path, failed); ++links) {
    const std::filesystem::path next = std::filesystem::read_symlink(path, failed);
    if (failed) break;
    path = path.parent_path() / next;
  }
  return path;
}

void write_whole(const std::filesystem::path& path, std::span<const std::byte> bytes, Links links) {
  OutputFile output(path, links);
  output.write(bytes);
  output.move_into_place();
}

}  // namespace vps
