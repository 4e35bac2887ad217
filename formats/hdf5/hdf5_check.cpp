// SPDX-License-Identifier: GPL-3.0-or-later
// Everything in the HDF5 file has to be what the writer would have put there for the directory.
#include "formats/hdf5/hdf5_check.h"

#include <algorithm>
#include <set>

#include "formats/hdf5/facts.h"
#include "formats/hdf5/hdf5_handle.h"
#include "formats/hdf5/section_names.h"

namespace vps {
namespace {

using detail::Handle;
using detail::stored_type;

constexpr std::size_t kMostFindings = 20;
constexpr std::size_t kLongestText = 4096;  // of an attribute. [bytes]

const detail::SectionName* find_name(SectionKind kind) {
  for (const detail::SectionName& name : detail::kSectionNames) {
    if (name.kind == kind) return &name;
  }
  return nullptr;
}

class Check {
 public:
  Check(hid_t file, const Directory& directory) : file_(file), directory_(directory) {}

  std::vector<std::string> run() {
    check_root();
    for (std::uint32_t i = 0; i < directory_.section_count; ++i) check_section(directory_.sections[i]);
    if (H5Lvisit(file_, H5_INDEX_NAME, H5_ITER_INC, visit, this) < 0) note("the groups cannot be listed");
    if (findings_.size() > kMostFindings) findings_.resize(kMostFindings);
    return std::move(findings_);
  }

 private:
  void note(std::string finding) { findings_.push_back(std::move(finding)); }

  void check_root() {
    const Handle root(H5Gopen2(file_, "/", H5P_DEFAULT), H5Gclose, "open the root group");
    hsize_t count = 0;
    detail::for_each_fact(directory_.info, [&](const char* name, const auto& value) {
      ++count;
      if (!attribute_is(root, name, value)) note(std::string("the attribute ") + name + " is not the directory's");
    });
    check_attribute_count(root, "/", count);
  }

  void check_attribute_count(hid_t object, const std::string& path, hsize_t wanted) {
    H5O_info_t info;
    if (H5Oget_info2(object, &info, H5O_INFO_NUM_ATTRS) < 0 || info.num_attrs != wanted) {
      note(path + " has attributes that vpsbake does not write, or lacks some");
    }
  }

  void check_section(const Section& section) {
    const detail::SectionName* const name = find_name(section.kind);
    if (name == nullptr) return;  // of a later version
    const std::string path = name->path;
    known_.insert(path.substr(1));
    // Only through hard links: soft and external ones may lead anywhere.
    const hid_t opened = is_hard(path) ? H5Dopen2(file_, name->path, H5P_DEFAULT) : H5I_INVALID_HID;
    if (opened < 0) return note(path + " is missing");
    const Handle dataset(opened, H5Dclose, "open a dataset");
    const Handle create(H5Dget_create_plist(dataset), H5Pclose, "read a dataset");
    if (H5Pget_layout(create) != H5D_CONTIGUOUS || H5Pget_external_count(create) != 0) {
      return note(path + " is not stored in one piece");
    }
    if (H5Dget_offset(dataset) != section.offset) note(path + " lies elsewhere than the directory says");
    if (H5Dget_storage_size(dataset) != section.bytes) note(path + " has another size than the directory says");
    const Handle type(H5Dget_type(dataset), H5Tclose, "read a dataset");
    if (H5Tequal(type, stored_type(section.element)) <= 0) note(path + " has another type than the directory says");
    if (!shape_is(dataset, section)) note(path + " has another shape than the directory says");
    for (const auto& [attribute, text] :
         {std::pair{"unit", name->unit}, std::pair{"meaning", name->meaning}, std::pair{"equation", name->equation}}) {
      if (*text != '\0' && !attribute_is(dataset, attribute, text)) {
        note(path + ": the attribute " + attribute + " is not what vpsbake writes");
      }
    }
    check_attribute_count(dataset, path, name->equation[0] != '\0' ? 3 : 2);
  }

  [[nodiscard]] bool is_hard(const std::string& path) const {
    for (std::size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
      H5L_info_t link;
      const std::string part = path.substr(0, end);
      if (H5Lget_info(file_, part.c_str(), &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD) return false;
      if (end == std::string::npos) return true;
    }
  }

  static bool shape_is(hid_t dataset, const Section& section) {
    const Handle space(H5Dget_space(dataset), H5Sclose, "read a dataset");
    hsize_t shape[H5S_MAX_RANK] = {};
    const int rank = H5Sget_simple_extent_dims(space, shape, nullptr);
    return rank == static_cast<int>(section.rank) && std::equal(shape, shape + rank, section.shape.begin());
  }

  static bool attribute_is(hid_t object, const char* name, const char* wanted) {
    if (H5Aexists(object, name) <= 0) return false;
    const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose, "read an attribute");
    const Handle type(H5Aget_type(attribute), H5Tclose, "read an attribute");
    const std::size_t size = std::strlen(wanted) + 1;
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || H5Tget_size(type) != size ||
        size > kLongestText || count_of(attribute) != 1) {
      return false;
    }
    std::string text(size, '\0');
    return H5Aread(attribute, type, text.data()) >= 0 && std::memcmp(text.data(), wanted, size) == 0;
  }
  template <class Number, std::size_t n>
  static bool attribute_is(hid_t object, const char* name, const std::array<Number, n>& wanted) {
    if (H5Aexists(object, name) <= 0) return false;
    const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose, "read an attribute");
    const Handle type(H5Aget_type(attribute), H5Tclose, "read an attribute");
    std::array<Number, n> values{};
    if (H5Tequal(type, detail::stored_type<Number>()) <= 0 || count_of(attribute) != n ||
        H5Aread(attribute, detail::native_type<Number>(), values.data()) < 0) {
      return false;
    }
    // Compares bits, so that a forged NaN equals itself. NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
    return std::memcmp(values.data(), wanted.data(), sizeof values) == 0;
  }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  static bool attribute_is(hid_t object, const char* name, Number wanted) {
    return attribute_is(object, name, std::array<Number, 1>{wanted});
  }
  static hssize_t count_of(hid_t attribute) {
    const Handle space(H5Aget_space(attribute), H5Sclose, "read an attribute");
    return H5Sget_simple_extent_npoints(space);
  }

  // Called for every link in the file.
  static herr_t visit(hid_t, const char* path, const H5L_info_t* link, void* self) {
    auto& check = *static_cast<Check*>(self);
    if (link->type != H5L_TYPE_HARD) {
      check.note(std::string("/") + path + " is a link, which vpsbake does not write");
    } else if (!check.known_.contains(path) && !check.is_expected(path)) {
      check.note(std::string("/") + path + " is not in the directory");
    }
    return check.findings_.size() > kMostFindings ? 1 : 0;
  }

  // A group that vpsbake makes, or an optional section of a later version.
  [[nodiscard]] bool is_expected(const std::string& path) const {
    const Handle object(H5Oopen(file_, path.c_str(), H5P_DEFAULT), H5Oclose, "open an object");
    if (H5Iget_type(object) == H5I_GROUP) return true;  // what is in it is visited too
    if (H5Iget_type(object) != H5I_DATASET) return false;
    const haddr_t offset = H5Dget_offset(object);
    return std::any_of(directory_.sections.begin(), directory_.sections.begin() + directory_.section_count,
                       [&](const Section& s) { return find_name(s.kind) == nullptr && s.offset == offset; });
  }

  hid_t file_;
  const Directory& directory_;
  std::vector<std::string> findings_;
  std::set<std::string> known_;  // paths without the first slash
};

hid_t open_file(const std::filesystem::path& file) {
  // HDF5's default driver refuses files without a place in the file system, such as a copy of standard input.
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "set up the file");
  if (H5Pset_fapl_stdio(access) < 0) return -1;
  return H5Fopen(file.c_str(), H5F_ACC_RDONLY, access);
}

}  // namespace

std::vector<std::string> compare_with_hdf5(const std::filesystem::path& file, const Directory& directory) {
  const std::lock_guard lock(detail::one_at_a_time);
  const detail::SilentErrors silent;
  const hid_t opened = open_file(file);
  if (opened < 0) return {"HDF5 cannot open the file"};
  const Handle hdf5(opened, H5Fclose, "open the file");
  try {
    return Check(hdf5, directory).run();
  } catch (const WriteError&) {
    return {"HDF5 cannot read the file"};
  }
}

bool hdf5_holds_sections(const std::filesystem::path& file) {
  const std::lock_guard lock(detail::one_at_a_time);
  const detail::SilentErrors silent;
  const hid_t opened = open_file(file);
  if (opened < 0) return false;
  const Handle hdf5(opened, H5Fclose, "open the file");
  for (const SectionKind kind : {SectionKind::coarse_layers, SectionKind::point_positions}) {
    const hid_t dataset = H5Dopen2(hdf5, find_name(kind)->path, H5P_DEFAULT);
    if (dataset < 0) continue;
    H5Dclose(dataset);
    return true;
  }
  return false;
}

}  // namespace vps
