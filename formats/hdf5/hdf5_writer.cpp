// SPDX-License-Identifier: GPL-3.0-or-later
// An asset as HDF5: contiguous datasets at known offsets, no time stamps, and the directory in the user block.
#include "formats/hdf5/hdf5_writer.h"

#include <fcntl.h>
#include <hdf5.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include "formats/hdf5/section_names.h"

namespace vps {
namespace {

[[noreturn]] void fail_hdf5(const char* what) {
  throw WriteError(std::string("HDF5 could not ") + what + "; check the free space of the disk");
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
    case EISDIR:
      return "the output is a folder; give a file name";
    default:
      return std::string(std::strerror(error)) + "; choose another output";
  }
}

[[noreturn]] void fail_system(int error) {
  throw WriteError(system_reason(error));
}

// A unique file beside the target that vanishes unless it is moved into place.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target)
      : target_(target), name_((target.parent_path() / ("." + target.filename().string() + ".XXXXXX")).string()) {
    const int fd = ::mkstemp(name_.data());
    if (fd < 0) {
      const int error = errno;
      name_.clear();
      fail_system(error);
    }
    // mkstemp makes files private; an asset should be as readable as any other output.
    const mode_t mask = ::umask(0);
    ::umask(mask);
    ::fchmod(fd, 0666 & ~mask);
    ::close(fd);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (!name_.empty()) ::unlink(name_.c_str());
  }
  [[nodiscard]] const char* name() const { return name_.c_str(); }

  // On disk first, then visible, then the folder's entry on disk.
  void move_into_place() {
    if (::rename(name_.c_str(), target_.c_str()) != 0) fail_system(errno);
    name_.clear();
    const std::filesystem::path folder = target_.has_parent_path() ? target_.parent_path() : ".";
    const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
      ::fsync(fd);
      ::close(fd);
    }
  }

 private:
  std::filesystem::path target_;
  std::string name_;
};

hid_t memory_type(ElementType type) {
  switch (type) {
    case ElementType::i8:
      return H5T_STD_I8LE;
    case ElementType::i16:
      return H5T_STD_I16LE;
    case ElementType::i32:
      return H5T_STD_I32LE;
    case ElementType::u32:
      return H5T_STD_U32LE;
    case ElementType::f32:
      return H5T_IEEE_F32LE;
    case ElementType::f64:
      return H5T_IEEE_F64LE;
  }
  throw WriteError("a section has an unknown element type; this is a defect, please report it");
}

Handle create_file(const char* name) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "set up the file");
  const Handle create(H5Pcreate(H5P_FILE_CREATE), H5Pclose, "set up the file");
  require(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110), "set the file version");
  require(H5Pset_alignment(access, 1, kSectionAlignment), "set the alignment");
  require(H5Pset_userblock(create, kUserBlockBytes), "set the user block");
  require(H5Pset_obj_track_times(create, false), "leave out time stamps");
  return {H5Fcreate(name, H5F_ACC_TRUNC, create, access), H5Fclose, "create the file"};
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
  section.flags = kSectionRequired;
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

// The user block goes in last, when the file's size and every offset are known; then everything goes to the disk.
void write_user_block(const char* name, Directory& directory) {
  const int fd = ::open(name, O_RDWR | O_CLOEXEC);
  if (fd < 0) fail_system(errno);
  struct stat facts {};
  int error = ::fstat(fd, &facts) == 0 ? 0 : errno;
  if (error == 0) {
    directory.file_bytes = static_cast<std::uint64_t>(facts.st_size);
    std::array<std::byte, kUserBlockBytes> block;
    encode_directory(directory, block);
    const ssize_t written = ::pwrite(fd, block.data(), block.size(), 0);
    if (written != static_cast<ssize_t>(block.size())) error = written < 0 ? errno : ENOSPC;
  }
  if (error == 0 && ::fsync(fd) != 0) error = errno;
  if (::close(fd) != 0 && error == 0) error = errno;
  if (error != 0) fail_system(error);
}

}  // namespace

std::size_t write_asset(const std::filesystem::path& path, const AssetInfo& info,
                        std::span<const SectionData> sections) {
  if (sections.size() > kMaxSections) throw WriteError("too many sections; this is a defect, please report it");
  const SilentErrors silent;
  TemporaryFile temporary(path);
  Directory directory;
  directory.info = info;
  {
    Handle file = create_file(temporary.name());
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
    if (!file.close()) fail_hdf5("finish the file");
  }
  write_user_block(temporary.name(), directory);
  temporary.move_into_place();
  return directory.file_bytes;
}

}  // namespace vps
