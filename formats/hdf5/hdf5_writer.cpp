// SPDX-License-Identifier: GPL-3.0-or-later
// An asset as HDF5: contiguous datasets at known offsets, no time stamps, and the directory in the user block.
#include "formats/hdf5/hdf5_writer.h"

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <utility>

#include "formats/hdf5/section_names.h"

namespace vps {
namespace {

[[noreturn]] void fail_hdf5(const char* what) {
  throw WriteError(std::string("HDF5 could not ") + what + "; check the free memory");
}

// Owns an HDF5 identifier.
class Handle {
 public:
  Handle(hid_t id, herr_t (*closer)(hid_t), const char* what) : id_(id), close_(closer) {
    if (id_ < 0) fail_hdf5(what);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() { close(); }
  operator hid_t() const { return id_; }
  bool close() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

void require(herr_t result, const char* what) {
  if (result < 0) fail_hdf5(what);
}

// HDF5 prints its error stack by default; the exception says enough.
class SilentErrors {
 public:
  SilentErrors() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  SilentErrors(const SilentErrors&) = delete;
  SilentErrors& operator=(const SilentErrors&) = delete;
  ~SilentErrors() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

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

// Bytes on the disk first, then in place of the target, by way of a name nobody looks for where there is one: nothing
// half-written is ever visible, and what a killed process leaves has no name where the file system allows that.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& target) : target_(target) {
    std::error_code ignored;
    // Through a symbolic link, as every other tool writes.
    if (std::filesystem::is_symlink(target_, ignored)) target_ = std::filesystem::weakly_canonical(target_, ignored);
    if (std::filesystem::exists(target_, ignored) && !std::filesystem::is_regular_file(target_, ignored)) {
      throw WriteError(std::filesystem::is_directory(target_, ignored)
                           ? "the output is a folder; give a file name"
                           : "the output is not a regular file; choose another output");
    }
    folder_ = target_.has_parent_path() ? target_.parent_path() : ".";
    // Not every file system has nameless files, and without /proc they get no name.
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
      // Only a rename takes the place of what is there.
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

  // The file without a name, the caller's to close.
  [[nodiscard]] int take() {
    if (!name_.empty()) ::unlink(name_.c_str());
    name_.clear();
    return std::exchange(fd_, -1);
  }

 private:
  // Short: the target's own name may already be as long as names can be. Another container's process may have the same
  // number and use it in the same folder: callers try again.
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

// The bytes of HDF5's file in memory. It writes there, for it cannot close a file properly after the disk was full, and
// hands the bytes over when it closes the file: H5Fget_file_image spoils the superblock's checksum (HDF5 1.10).
class MemoryFile {
 public:
  MemoryFile() = default;
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { std::free(data_); }

  void receive_from(hid_t access) {
    H5FD_file_image_callbacks_t calls = {allocate, copy, resize, release, share, unshare, this};
    constexpr std::size_t kGrowth = 1;  // the file's size is a multiple of it
    require(H5Pset_fapl_core(access, kGrowth, false), "set up the file");
    require(H5Pset_file_image_callbacks(access, &calls), "set up the file");
  }
  void finish(Handle& file) {
    hsize_t size = 0;
    require(H5Fflush(file, H5F_SCOPE_GLOBAL), "finish the file");
    require(H5Fget_filesize(file, &size), "finish the file");
    if (!file.close() || data_ == nullptr) fail_hdf5("finish the file");
    bytes_ = {static_cast<std::byte*>(data_), static_cast<std::size_t>(size)};
  }
  [[nodiscard]] std::span<std::byte> bytes() const { return bytes_; }

 private:
  using Operation = H5FD_file_image_op_t;
  static void* allocate(std::size_t size, Operation, void*) { return std::malloc(size); }
  static void* copy(void* to, const void* from, std::size_t size, Operation, void*) {
    return std::memcpy(to, from, size);
  }
  static void* resize(void* at, std::size_t size, Operation, void*) { return std::realloc(at, size); }
  static herr_t release(void* at, Operation operation, void* self) {
    if (operation == H5FD_FILE_IMAGE_OP_FILE_CLOSE) {
      static_cast<MemoryFile*>(self)->data_ = at;
    } else {
      std::free(at);
    }
    return 0;
  }
  static void* share(void* self) { return self; }
  static herr_t unshare(void*) { return 0; }

  void* data_ = nullptr;
  std::span<std::byte> bytes_;
};

hid_t memory_type(ElementType type) {
  switch (type) {
    case ElementType::i8:
      return H5T_STD_I8LE;
    case ElementType::i16:
      return H5T_STD_I16LE;
    case ElementType::i32:
      return H5T_STD_I32LE;
    case ElementType::u16:
      return H5T_STD_U16LE;
    case ElementType::u32:
      return H5T_STD_U32LE;
    case ElementType::f32:
      return H5T_IEEE_F32LE;
    case ElementType::f64:
      return H5T_IEEE_F64LE;
  }
  throw WriteError("a section has an unknown element type; this is a defect, please report it");
}

Handle create_file(MemoryFile& memory) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "set up the file");
  const Handle create(H5Pcreate(H5P_FILE_CREATE), H5Pclose, "set up the file");
  require(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110), "set the file version");
  require(H5Pset_alignment(access, 1, kSectionAlignment), "set the alignment");
  require(H5Pset_userblock(create, kUserBlockBytes), "set the user block");
  memory.receive_from(access);
  require(H5Pset_obj_track_times(create, false), "leave out time stamps");
  return {H5Fcreate("asset", H5F_ACC_TRUNC, create, access), H5Fclose, "create the file"};
}

void write_text(hid_t object, const char* name, const char* text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "make an attribute");
  require(H5Tset_size(type, std::strlen(text) + 1), "make an attribute");
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, "make an attribute");
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         "make an attribute");
  require(H5Awrite(attribute, type, text), "write an attribute");
}

void write_numbers(hid_t object, const char* name, hid_t type, hid_t stored, hsize_t count, const void* values) {
  const Handle space(count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr), H5Sclose,
                     "make an attribute");
  const Handle attribute(H5Acreate2(object, name, stored, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         "make an attribute");
  require(H5Awrite(attribute, type, values), "write an attribute");
}
void write_real(hid_t object, const char* name, std::span<const double> values) {
  write_numbers(object, name, H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE, values.size(), values.data());
}
void write_real(hid_t object, const char* name, double value) {
  write_real(object, name, std::span(&value, 1));
}
void write_count(hid_t object, const char* name, std::uint64_t value) {
  write_numbers(object, name, H5T_NATIVE_UINT64, H5T_STD_U64LE, 1, &value);
}

void write_certificate(hid_t root, const std::string& field, const FieldCertificate& c) {
  write_real(root, (field + "_error_max").c_str(), c.max);
  write_real(root, (field + "_error_rms").c_str(), c.rms);
  write_real(root, (field + "_error_p99").c_str(), c.p99);
  write_real(root, (field + "_error_worst_at").c_str(), c.worst_at);
  write_real(root, (field + "_error_bound").c_str(), c.bound);
}

// The header's scalars again, for people and for tools that only know HDF5. All SI.
void write_facts(hid_t root, const AssetInfo& info) {
  write_text(root, "format", "vpsbake asset; see the user block and docs/format.md");
  write_text(root, "generator", info.generator.data());
  write_text(root, "units", "SI: m, m^2, m^3, m^5");
  write_real(root, "voxel_size", info.voxel_size);
  write_real(root, "origin", info.origin);
  write_numbers(root, "dims", H5T_NATIVE_UINT32, H5T_STD_U32LE, 3, info.dims.data());
  write_numbers(root, "precision", H5T_NATIVE_INT32, H5T_STD_I32LE, 1, &info.precision);
  write_real(root, "lambda", info.lambda);
  write_real(root, "band_inner", info.band_inner);
  write_real(root, "band_outer", info.band_outer);
  write_count(root, "surface_voxels", info.surface_voxels);
  write_count(root, "inner_voxels", info.inner_voxels);
  write_real(root, "bounds_min", info.bounds_min);
  write_real(root, "bounds_max", info.bounds_max);
  write_count(root, "triangles", info.triangles);
  write_count(root, "vertices", info.vertices);
  write_real(root, "surface_area", info.surface_area);
  write_count(root, "mesh_hash", info.mesh_hash);
  write_real(root, "volume", info.volume);
  write_real(root, "centre_of_mass", info.centre_of_mass);
  write_real(root, "inertia_xx_yy_zz_xy_xz_yz", info.inertia);
  write_real(root, "spacing", info.spacing);
  write_real(root, "covering_radius", info.covering_radius);
  write_real(root, "normal_error_mean", info.normal_error_mean);
  write_real(root, "normal_error_max", info.normal_error_max);
  write_real(root, "position_origin", info.position_origin);
  write_real(root, "position_step", info.position_step);
  write_real(root, "area_step", info.area_step);
  write_count(root, "points", info.points);
  write_count(root, "branching", info.branching);
  write_count(root, "levels", info.levels);
  write_certificate(root, "layers", info.layers_error);
  write_certificate(root, "scaled", info.scaled_error);
  write_certificate(root, "real", info.real_error);
  write_count(root, "certificate_samples", info.certificate_samples);
}

// Made by hand, for groups that HDF5 makes on the way carry time stamps.
void create_group(hid_t file, const char* path) {
  const Handle create(H5Pcreate(H5P_GROUP_CREATE), H5Pclose, "set up a group");
  require(H5Pset_obj_track_times(create, false), "set up a group");
  const Handle group(H5Gcreate2(file, path, H5P_DEFAULT, create, H5P_DEFAULT), H5Gclose, "create a group");
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
  section.flags = data.kind == SectionKind::record ? 0 : kSectionRequired;
  section.rank = static_cast<std::uint32_t>(data.shape.size());
  std::uint64_t count = 1;
  for (std::size_t axis = 0; axis < data.shape.size() && axis < section.shape.size(); ++axis) {
    section.shape[axis] = data.shape[axis];
    count *= data.shape[axis];
  }
  section.bytes = data.bytes.size();
  section.hash = hash_bytes(data.bytes);
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
  const hid_t type = memory_type(data.element);
  const Handle dataset(H5Dcreate2(file, name.path, type, space, H5P_DEFAULT, create, H5P_DEFAULT), H5Dclose,
                       "create a dataset");
  require(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data.bytes.data()), "write a dataset");
  write_text(dataset, "unit", name.unit);
  write_text(dataset, "meaning", name.meaning);
  if (name.equation[0] != '\0') write_text(dataset, "equation", name.equation);
  section.offset = H5Dget_offset(dataset);
  if (section.offset == HADDR_UNDEF || section.offset % kSectionAlignment != 0) {
    throw WriteError(std::string("HDF5 placed ") + name.path +
                     " where it cannot be mapped; this is a defect, please report it");
  }
  return section;
}

// Returns the file's size.
std::size_t write_into(OutputFile& output, const AssetInfo& info, std::span<const SectionData> sections) {
  if (sections.size() > kMaxSections) throw WriteError("too many sections; this is a defect, please report it");
  // libhdf5 is seldom built for threads.
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  const SilentErrors silent;
  Directory directory;
  directory.info = info;
  MemoryFile memory;
  {
    Handle file = create_file(memory);
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
  output.write(image);
  return image.size();
}

}  // namespace

std::size_t write_asset(const std::filesystem::path& path, const AssetInfo& info,
                        std::span<const SectionData> sections) {
  OutputFile output(path);
  const std::size_t bytes = write_into(output, info, sections);
  output.move_into_place();
  return bytes;
}

int write_nameless_asset(const std::filesystem::path& folder, const AssetInfo& info,
                         std::span<const SectionData> sections) {
  OutputFile output(folder / "asset");
  (void)write_into(output, info, sections);
  return output.take();
}

void write_whole(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  OutputFile output(path);
  output.write(bytes);
  output.move_into_place();
}

}  // namespace vps
