// SPDX-License-Identifier: Zlib
// Maps a baked asset read-only, or takes it from memory, and hands out views. Nothing is interpreted before the
// directory and every index is checked.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "runtime/vps_runtime.h"

namespace vps {
namespace {

struct FileDescriptor {
  int fd = -1;
  ~FileDescriptor() {
    if (fd >= 0) ::close(fd);
  }
};

template <class T>
const T* section_data(const std::byte* data, const Section* section) noexcept {
  return section == nullptr ? nullptr : reinterpret_cast<const T*>(data + section->offset);
}

// The uses that read a section.
Use readers_of(SectionKind kind) noexcept {
  switch (kind) {
    case SectionKind::brick_index:
    case SectionKind::layers:
      return Use::layers;
    case SectionKind::field_roots:
    case SectionKind::field_nodes:
      return Use::scaled | Use::real;
    case SectionKind::coarse_layers:
    case SectionKind::far:
    case SectionKind::corners:
      return Use::voxelmap;
    case SectionKind::scaled:
    case SectionKind::planes:
      return Use::scaled;
    case SectionKind::real:
    case SectionKind::real_gradient:
      return Use::real;
    case SectionKind::point_positions:
    case SectionKind::point_inward_normals:
    case SectionKind::point_areas:
    case SectionKind::facet_points:
    case SectionKind::facet_corners:
    case SectionKind::face_points:
    case SectionKind::spheres:
    case SectionKind::children:
    case SectionKind::parent_points:
    case SectionKind::level_offsets:
    case SectionKind::hull_offsets:
    case SectionKind::hull_points:
      return Use::pointshell;
    case SectionKind::record:
      break;
  }
  return Use{};
}

const std::byte* map_whole(int fd, std::size_t bytes) noexcept {
  void* const mapped = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, fd, 0);
  return mapped == MAP_FAILED ? nullptr : static_cast<const std::byte*>(mapped);
}

// Linux maps up to 2 MB around a page that is read, if the page cache holds it in one piece. It leaves out ranges that
// have their own advice, so that unused sections take no memory of the process.
void keep_apart(const std::byte* data, std::size_t bytes, const Directory& directory, Use use) noexcept {
#ifdef MADV_NOHUGEPAGE
  std::array<const Section*, kMaxSections> used{};
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    if (overlap(readers_of(directory.sections[i].kind), use)) used[count++] = &directory.sections[i];
  }
  std::sort(used.begin(), used.begin() + count, [](auto* a, auto* b) { return a->offset < b->offset; });
  const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  std::uint64_t end = kUserBlockBytes;
  for (std::size_t i = 0; i <= count; ++i) {
    const std::uint64_t next = i < count ? used[i]->offset : bytes;
    const std::uint64_t first = (end + page - 1) / page * page;
    const std::uint64_t last = next / page * page;
    // A failure is harmless: it only means that unused pages are mapped.
    if (first < last) (void)::madvise(const_cast<std::byte*>(data) + first, last - first, MADV_NOHUGEPAGE);
    if (i < count) end = used[i]->offset + used[i]->bytes;
  }
#endif
}

}  // namespace

Asset::Asset(Asset&& other) noexcept
    : owns_mapping_(std::exchange(other.owns_mapping_, false)),
      data_(std::exchange(other.data_, nullptr)),
      bytes_(std::exchange(other.bytes_, 0)),
      directory_(std::exchange(other.directory_, Directory{})),
      use_(other.use_) {}

Asset& Asset::operator=(Asset&& other) noexcept {
  if (this != &other) {
    release();
    owns_mapping_ = std::exchange(other.owns_mapping_, false);
    data_ = std::exchange(other.data_, nullptr);
    bytes_ = std::exchange(other.bytes_, 0);
    directory_ = std::exchange(other.directory_, Directory{});
    use_ = other.use_;
  }
  return *this;
}

Asset::~Asset() {
  release();
}

void Asset::release() noexcept {
  if (owns_mapping_) ::munmap(const_cast<std::byte*>(data_), bytes_);
  owns_mapping_ = false;
  data_ = nullptr;
  bytes_ = 0;
  directory_ = {};
}

Status Asset::open(const char* path, Asset& out, Use use) noexcept {
  out.release();
  if (path == nullptr) return Status::bad_argument;
  // O_NONBLOCK: opening a FIFO by mistake must not hang.
  const FileDescriptor file{::open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  struct stat facts {};
  if (file.fd < 0 || ::fstat(file.fd, &facts) != 0 || !S_ISREG(facts.st_mode)) return Status::cannot_open;
  const auto bytes = static_cast<std::size_t>(facts.st_size);
  if (bytes < kUserBlockBytes) return Status::too_short;

  Asset asset;
  asset.data_ = map_whole(file.fd, bytes);
  if (!asset.is_open()) return Status::cannot_map;
  asset.owns_mapping_ = true;
  asset.bytes_ = bytes;
  asset.use_ = use;
  if (const Status status = decode_directory(asset.bytes(), asset.directory_); status != Status::ok) return status;
  if (use != Use::everything) {
    // Maps the file again, because reading the directory may have mapped other pages, too.
    ::munmap(const_cast<std::byte*>(asset.data_), bytes);
    asset.data_ = map_whole(file.fd, bytes);
    asset.owns_mapping_ = asset.is_open();
    if (!asset.is_open()) return Status::cannot_map;
    keep_apart(asset.data_, bytes, asset.directory_, use);
  }
  if (const Status status = validate_indices(asset.bytes(), asset.directory_, use); status != Status::ok) return status;
  out = std::move(asset);
  return Status::ok;
}

Status Asset::open(std::span<const std::byte> bytes, Asset& out, Use use) noexcept {
  out.release();
  if (bytes.size() < kUserBlockBytes) return Status::too_short;
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % kMemoryAlignment != 0) return Status::bad_argument;
  Asset asset;
  asset.data_ = bytes.data();
  asset.bytes_ = bytes.size();
  asset.use_ = use;
  if (const Status status = decode_directory(bytes, asset.directory_); status != Status::ok) return status;
  if (const Status status = validate_indices(bytes, asset.directory_, use); status != Status::ok) return status;
  out = std::move(asset);
  return Status::ok;
}

Status Asset::verify() const noexcept {
  if (!is_open()) return Status::cannot_open;
  return verify_hashes({data_, bytes_}, directory_);
}

bool Asset::has_voxelmap() const noexcept {
  VoxelmapView ignored;
  return voxelmap(ignored) == Status::ok;
}
bool Asset::has_pointshell() const noexcept {
  return overlap(use_, Use::pointshell) && directory_.find(SectionKind::point_positions) != nullptr;
}

Status Asset::voxelmap(VoxelmapView& out, Field field, double scale) const noexcept {
  out = {};
  if (const Status status = check_scale(scale); status != Status::ok) return status;
  struct Candidate {
    Field field;
    SectionKind kind;
    Use use;
  };
  constexpr Candidate kFinestFirst[] = {{Field::real, SectionKind::real, Use::real},
                                        {Field::scaled, SectionKind::scaled, Use::scaled},
                                        {Field::layers, SectionKind::layers, Use::layers}};
  const Section* values = nullptr;
  for (const auto& [candidate, kind, use] : kFinestFirst) {
    if (values == nullptr && overlap(use_, use) && (field == Field::none || field == candidate)) {
      values = directory_.find(kind);
      out.field = values == nullptr ? Field::none : candidate;
    }
  }
  if (values == nullptr) return Status::missing_part;
  out.element = values->element;
  out.values = data_ + values->offset;
  if (out.field == Field::real) {
    out.gradients = section_data<float>(data_, directory_.find(SectionKind::real_gradient));
  }
  if (out.field == Field::layers) {
    out.brick_index = section_data<std::uint32_t>(data_, directory_.find(SectionKind::brick_index));
  } else {
    out.field_roots = section_data<std::uint32_t>(data_, directory_.find(SectionKind::field_roots));
    out.field_nodes = section_data<std::uint32_t>(data_, directory_.find(SectionKind::field_nodes));
  }
  out.coarse_layers = section_data<std::int16_t>(data_, directory_.find(SectionKind::coarse_layers));
  if (out.field == Field::scaled) {
    out.planes = section_data<std::uint32_t>(data_, directory_.find(SectionKind::planes));
  }
  if (const Section* const corners = directory_.find(SectionKind::corners); corners != nullptr) {
    out.corners = static_cast<std::uint32_t>(corners->shape[0]);
    out.corner_places = section_data<float>(data_, corners);
  }
  out.scale = static_cast<float>(scale);
  const AssetInfo facts = scaled(info(), scale);
  for (int axis = 0; axis < 3; ++axis) {
    out.dims[axis] = facts.dims[axis];
    out.brick_dims[axis] = facts.dims[axis] / kBrickEdge;
    out.root_dims[axis] = (facts.dims[axis] + kRootCells - 1) / kRootCells;
    out.origin[axis] = facts.origin[axis];
    out.bounds_min[axis] = static_cast<float>(facts.bounds_min[axis]);
    out.bounds_max[axis] = static_cast<float>(facts.bounds_max[axis]);
  }
  out.voxel_size = static_cast<float>(facts.voxel_size);
  out.lambda = static_cast<float>(facts.lambda);
  out.band_inner = static_cast<float>(facts.band_inner);
  out.band_outer = static_cast<float>(facts.band_outer);
  const FieldCertificate& certificate = out.field == Field::real     ? facts.real_error
                                        : out.field == Field::scaled ? facts.scaled_error
                                                                     : facts.layers_error;
  out.error = static_cast<float>(certificate.bound);
  if (const Section* const far = directory_.find(SectionKind::far); far != nullptr) {
    out.far.values = section_data<std::int8_t>(data_, far);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out.far.dims[axis] = static_cast<std::uint32_t>(far->shape[2 - axis]);
      out.far.origin[axis] = facts.far_origin[axis];
    }
    out.far.spacing = static_cast<float>(facts.far_spacing);
    out.far.step_inner = static_cast<float>(facts.far_step_inner);
    out.far.step_outer = static_cast<float>(facts.far_step_outer);
    out.far.range = static_cast<float>(facts.far_range);
    out.far.error = static_cast<float>(facts.far_error.bound);
  }
  return Status::ok;
}

Status Asset::pointshell(PointshellView& out, double scale) const noexcept {
  out = {};
  if (const Status status = check_scale(scale); status != Status::ok) return status;
  if (!has_pointshell()) return Status::missing_part;
  out.scale = static_cast<float>(scale);
  const AssetInfo facts = scaled(info(), scale);
  out.points = static_cast<std::uint32_t>(facts.points);
  out.levels = facts.levels;
  const auto* positions = section_data<std::uint16_t>(data_, directory_.find(SectionKind::point_positions));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.position[axis] = positions + axis * out.points;
    out.position_origin[axis] = static_cast<float>(facts.position_origin[axis]);
    out.centre_of_mass[axis] = static_cast<float>(facts.centre_of_mass[axis]);
  }
  out.inward_normal = section_data<std::uint8_t>(data_, directory_.find(SectionKind::point_inward_normals));
  out.area = section_data<std::uint8_t>(data_, directory_.find(SectionKind::point_areas));
  out.position_step = static_cast<float>(facts.position_step);
  out.area_step = static_cast<float>(facts.area_step);
  if (const Section* const facets = directory_.find(SectionKind::facet_points); facets != nullptr) {
    out.facets = static_cast<std::uint32_t>(facets->shape[0]);
    out.facet_points = section_data<std::uint32_t>(data_, facets);
    out.facet_corners = section_data<std::int8_t>(data_, directory_.find(SectionKind::facet_corners));
  }
  const Section* const spheres = directory_.find(SectionKind::spheres);
  out.nodes = static_cast<std::uint32_t>(spheres->shape[1]);
  for (std::size_t row = 0; row < 4; ++row)
    out.sphere[row] = section_data<std::uint16_t>(data_, spheres) + row * out.nodes;
  out.children = section_data<std::uint32_t>(data_, directory_.find(SectionKind::children));
  out.parent_point = section_data<std::uint32_t>(data_, directory_.find(SectionKind::parent_points));
  out.level_offsets = section_data<std::uint32_t>(data_, directory_.find(SectionKind::level_offsets));
  out.hull_offsets = section_data<std::uint32_t>(data_, directory_.find(SectionKind::hull_offsets));
  out.face_points = section_data<std::uint32_t>(data_, directory_.find(SectionKind::face_points));
  out.hull_points = section_data<std::uint32_t>(data_, directory_.find(SectionKind::hull_points));
  out.covering_radius = static_cast<float>(facts.covering_radius);
  const double features = facts.feature_covering_radius;
  out.feature_covering_radius = features > 0 ? static_cast<float>(features) : out.covering_radius;
  return Status::ok;
}

}  // namespace vps
