// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Shared by the users of libhdf5: owned identifiers, files in memory, attributes. Internal.
#pragma once

#include <hdf5.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <new>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "formats/hdf5/hdf5_writer.h"

namespace vps::detail {

/// Held during every use of libhdf5, which is seldom built thread-safe.
inline std::mutex one_at_a_time;

[[noreturn]] inline void fail_hdf5(const char* what) {
  throw WriteError(std::string("HDF5 could not ") + what + "; check the free memory");
}

/// Owns an HDF5 identifier.
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

inline void require(herr_t result, const char* what) {
  if (result < 0) fail_hdf5(what);
}

/// HDF5 prints its error stack by default; the exception says enough.
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

/// The bytes of HDF5's file in memory. HDF5 writes to memory, because it cannot close a file properly after the disk
/// was full. It hands over the bytes when it closes the file, because H5Fget_file_image spoils the superblock's
/// checksum (HDF5 1.10).
class MemoryFile {
 public:
  /// @param expected  size of the file, about. [bytes]
  explicit MemoryFile(std::size_t expected = 0) { bytes_.reserve(expected); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

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
    if (!file.close() || bytes_.size() < size) fail_hdf5("finish the file");
    bytes_.resize(static_cast<std::size_t>(size));
  }
  [[nodiscard]] std::span<std::byte> bytes() { return bytes_; }
  /// Moves the bytes out.
  [[nodiscard]] std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  using Operation = H5FD_file_image_op_t;
  // HDF5 holds one buffer at a time: `bytes_`. It never copies it, for the file begins without an image.
  static void* allocate(std::size_t size, Operation operation, void* self) {
    return resize(nullptr, size, operation, self);
  }
  static void* copy(void*, const void*, std::size_t, Operation, void*) { return nullptr; }
  static void* resize(void*, std::size_t size, Operation, void* self) {
    std::vector<std::byte>& bytes = static_cast<MemoryFile*>(self)->bytes_;
    try {
      bytes.resize(size);
    } catch (const std::bad_alloc&) {
      return nullptr;
    }
    return bytes.data();
  }
  static herr_t release(void*, Operation, void*) { return 0; }
  static void* share(void* self) { return self; }
  static herr_t unshare(void*) { return 0; }

  std::vector<std::byte> bytes_;
};

/// A new file in memory, without time stamps. @param user_block  [bytes]
inline Handle create_file(MemoryFile& memory, hsize_t user_block) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "set up the file");
  const Handle create(H5Pcreate(H5P_FILE_CREATE), H5Pclose, "set up the file");
  require(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110), "set the file version");
  require(H5Pset_alignment(access, 1, kSectionAlignment), "set the alignment");
  require(H5Pset_userblock(create, user_block), "set the user block");
  memory.receive_from(access);
  require(H5Pset_obj_track_times(create, false), "leave out time stamps");
  return {H5Fcreate("asset", H5F_ACC_TRUNC, create, access), H5Fclose, "create the file"};
}

inline void write_attribute(hid_t object, const char* name, const char* text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "make an attribute");
  require(H5Tset_size(type, std::strlen(text) + 1), "make an attribute");
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, "make an attribute");
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         "make an attribute");
  require(H5Awrite(attribute, type, text), "write an attribute");
}

/// The type in which a number is stored: little-endian on every machine.
template <class Number>
hid_t stored_type() {
  if constexpr (std::is_same_v<Number, double>) return H5T_IEEE_F64LE;
  if constexpr (std::is_same_v<Number, std::uint64_t>) return H5T_STD_U64LE;
  if constexpr (std::is_same_v<Number, std::uint32_t>) return H5T_STD_U32LE;
  if constexpr (std::is_same_v<Number, std::int32_t>) return H5T_STD_I32LE;
}
template <class Number>
hid_t native_type() {
  if constexpr (std::is_same_v<Number, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<Number, std::uint64_t>) return H5T_NATIVE_UINT64;
  if constexpr (std::is_same_v<Number, std::uint32_t>) return H5T_NATIVE_UINT32;
  if constexpr (std::is_same_v<Number, std::int32_t>) return H5T_NATIVE_INT32;
}

template <class Number>
void write_numbers(hid_t object, const char* name, std::span<const Number> values) {
  const hsize_t count = values.size();
  const Handle space(count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr), H5Sclose,
                     "make an attribute");
  const Handle attribute(H5Acreate2(object, name, stored_type<Number>(), space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         "make an attribute");
  require(H5Awrite(attribute, native_type<Number>(), values.data()), "write an attribute");
}
template <class Number, std::size_t n>
void write_attribute(hid_t object, const char* name, const std::array<Number, n>& values) {
  write_numbers(object, name, std::span<const Number>(values));
}
template <class Number>
requires std::is_arithmetic_v<Number>
void write_attribute(hid_t object, const char* name, Number value) {
  write_numbers(object, name, std::span<const Number>(&value, 1));
}

/// Creates a group without time stamps. Groups that HDF5 creates implicitly carry them.
inline void create_group(hid_t file, const char* path) {
  const Handle create(H5Pcreate(H5P_GROUP_CREATE), H5Pclose, "set up a group");
  require(H5Pset_obj_track_times(create, false), "set up a group");
  const Handle group(H5Gcreate2(file, path, H5P_DEFAULT, create, H5P_DEFAULT), H5Gclose, "create a group");
}

/// Invalid for a value that is not an ElementType.
inline hid_t stored_type(ElementType type) {
  switch (type) {
    case ElementType::i8:
      return H5T_STD_I8LE;
    case ElementType::i16:
      return H5T_STD_I16LE;
    case ElementType::i32:
      return H5T_STD_I32LE;
    case ElementType::u8:
      return H5T_STD_U8LE;
    case ElementType::u16:
      return H5T_STD_U16LE;
    case ElementType::u32:
      return H5T_STD_U32LE;
    case ElementType::f32:
      return H5T_IEEE_F32LE;
    case ElementType::f64:
      return H5T_IEEE_F64LE;
  }
  return H5I_INVALID_HID;
}

}  // namespace vps::detail
