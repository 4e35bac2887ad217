// SPDX-License-Identifier: Zlib
// Encodes and decodes the user block, byte by byte and little-endian. docs/internals/format.md describes every field.
#include <algorithm>
#include <bit>
#include <cstring>
#include <type_traits>
#include <utility>

// Inlined: the hash is part of the format, not a library to link.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "formats/check_directory.h"
#include "formats/fields.h"

namespace vps {
namespace {

using Block = std::span<std::byte, kUserBlockBytes>;
using ConstBlock = std::span<const std::byte, kUserBlockBytes>;

template <class T>
struct IsArray : std::false_type {};
template <class T, std::size_t N>
struct IsArray<std::array<T, N>> : std::true_type {};

// The unsigned integer with the bits of a scalar.
template <class T>
auto to_bits(T value) noexcept {
  if constexpr (std::is_enum_v<T>) {
    return static_cast<std::uint32_t>(value);
  } else if constexpr (std::is_same_v<T, double>) {
    return std::bit_cast<std::uint64_t>(value);
  } else {
    return static_cast<std::make_unsigned_t<T>>(value);
  }
}

template <class T>
void put(Block out, std::size_t at, const T& value) noexcept {
  if constexpr (IsArray<T>::value) {
    for (std::size_t i = 0; i < value.size(); ++i) put(out, at + i * sizeof(value[0]), value[i]);
  } else {
    auto bits = to_bits(value);
    for (std::size_t i = 0; i < sizeof(bits); ++i) out[at + i] = static_cast<std::byte>(bits >> (8 * i) & 0xFF);
  }
}

template <class T>
void get(ConstBlock in, std::size_t at, T& value) noexcept {
  if constexpr (IsArray<T>::value) {
    for (std::size_t i = 0; i < value.size(); ++i) get(in, at + i * sizeof(value[0]), value[i]);
  } else {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i)
      bits |= std::uint64_t{std::to_integer<std::uint8_t>(in[at + i])} << (8 * i);
    if constexpr (std::is_same_v<T, double>) {
      value = std::bit_cast<double>(bits);
    } else {
      value = static_cast<T>(bits);
    }
  }
}

template <class T>
T read(ConstBlock in, std::size_t at) noexcept {
  T value{};
  get(in, at, value);
  return value;
}

std::uint64_t header_hash(ConstBlock block) noexcept {
  std::array<std::byte, kUserBlockBytes> copy;
  std::memcpy(copy.data(), block.data(), copy.size());
  std::memset(copy.data() + detail::kHashOffset, 0, sizeof(std::uint64_t));
  return hash_bytes(copy);
}

// Bytes that no field covers must be zero, so that later versions can use them.
bool reserved_is_zero(ConstBlock block, const Directory& directory) noexcept {
  std::array<std::byte, kUserBlockBytes> written{};
  encode_directory(directory, written);
  return std::memcmp(written.data(), block.data(), written.size()) == 0;
}

bool starts_with(std::span<const std::byte> bytes, std::span<const std::uint8_t> signature) noexcept {
  return bytes.size() >= signature.size() && std::memcmp(bytes.data(), signature.data(), signature.size()) == 0;
}

}  // namespace

std::uint64_t hash_bytes(std::span<const std::byte> bytes) noexcept {
  return XXH3_64bits(bytes.data(), bytes.size());
}

std::size_t element_bytes(ElementType type) noexcept {
  switch (type) {
    case ElementType::i8:
    case ElementType::u8:
      return 1;
    case ElementType::i16:
    case ElementType::u16:
      return 2;
    case ElementType::i32:
    case ElementType::u32:
    case ElementType::f32:
      return 4;
    case ElementType::f64:
      return 8;
  }
  return 0;
}

const Section* Directory::find(SectionKind kind) const noexcept {
  for (std::uint32_t i = 0; i < section_count; ++i) {
    if (sections[i].kind == kind) return &sections[i];
  }
  return nullptr;
}

void encode_directory(const Directory& directory, Block out) noexcept {
  std::memset(out.data(), 0, out.size());
  std::memcpy(out.data(), kMagic.data(), kMagic.size());
  put(out, detail::kMajorOffset, directory.major);
  put(out, detail::kMinorOffset, directory.minor);
  put(out, detail::kUserBlockBytesOffset, static_cast<std::uint32_t>(kUserBlockBytes));
  put(out, detail::kFileBytesOffset, directory.file_bytes);
  put(out, detail::kSectionCountOffset, directory.section_count);
  put(out, detail::kMetadataHashOffset, directory.metadata_hash);
  put(out, detail::kTableOffsetOffset, static_cast<std::uint32_t>(kSectionTableOffset));
  put(out, detail::kBrickEdgeOffset, kBrickEdge);
  detail::for_each_info_field(directory.info, [&](std::size_t at, const auto& field) { put(out, at, field); });
  for (std::size_t i = 0; i < directory.section_count && i < kMaxSections; ++i) {
    const std::size_t entry = kSectionTableOffset + i * kSectionEntryBytes;
    detail::for_each_section_field(directory.sections[i],
                                   [&](std::size_t at, const auto& field) { put(out, entry + at, field); });
  }
  put(out, detail::kHashOffset, header_hash(out));
}

Status decode_directory(std::span<const std::byte> file, Directory& out) noexcept {
  out = {};
  if (file.size() < kUserBlockBytes) return Status::too_short;
  const ConstBlock block = file.first<kUserBlockBytes>();
  if (!starts_with(block, kMagic)) return Status::wrong_magic;
  // The version comes before the hash: another major version may place or compute it differently.
  if (read<std::uint16_t>(block, detail::kMajorOffset) != kFormatMajor) return Status::wrong_version;
  if (read<std::uint64_t>(block, detail::kHashOffset) != header_hash(block)) return Status::corrupt_header;

  Directory directory;
  get(block, detail::kMajorOffset, directory.major);
  get(block, detail::kMinorOffset, directory.minor);
  get(block, detail::kFileBytesOffset, directory.file_bytes);
  get(block, detail::kSectionCountOffset, directory.section_count);
  get(block, detail::kMetadataHashOffset, directory.metadata_hash);
  if (read<std::uint32_t>(block, detail::kUserBlockBytesOffset) != kUserBlockBytes ||
      read<std::uint32_t>(block, detail::kTableOffsetOffset) != kSectionTableOffset ||
      read<std::uint32_t>(block, detail::kBrickEdgeOffset) != kBrickEdge || directory.section_count > kMaxSections) {
    return Status::bad_info;
  }
  detail::for_each_info_field(directory.info, [&](std::size_t at, auto& field) { get(block, at, field); });
  for (std::size_t i = 0; i < directory.section_count; ++i) {
    const std::size_t entry = kSectionTableOffset + i * kSectionEntryBytes;
    detail::for_each_section_field(directory.sections[i],
                                   [&](std::size_t at, auto& field) { get(block, entry + at, field); });
  }
  if (!reserved_is_zero(block, directory)) return Status::bad_info;

  constexpr std::array<std::uint8_t, 8> kHdf5Signature = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1A, '\n'};
  const bool is_hdf5 = starts_with(file.subspan(kUserBlockBytes), kHdf5Signature);
  if (directory.file_bytes != file.size()) {
    // HDF5 ends a file at a multiple of 8 bytes. A larger file of such a size was extended by an HDF5 tool.
    const bool appended = file.size() > directory.file_bytes && file.size() % 8 == 0;
    return is_hdf5 && appended ? Status::rewritten : Status::wrong_size;
  }
  if (!is_hdf5) return Status::rewritten;
  if (const Status status = detail::check_directory(directory); status != Status::ok) return status;
  out = directory;
  return Status::ok;
}

std::uint64_t hash_metadata(std::span<const std::byte> file, const Directory& directory) noexcept {
  std::array<std::pair<std::uint64_t, std::uint64_t>, kMaxSections> taken{};  // offset, bytes
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    taken[i] = {directory.sections[i].offset, directory.sections[i].bytes};
  }
  std::sort(taken.begin(), taken.begin() + directory.section_count);
  XXH3_state_t state;
  XXH3_64bits_reset(&state);
  std::uint64_t at = kUserBlockBytes;
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    XXH3_64bits_update(&state, file.data() + at, taken[i].first - at);
    at = taken[i].first + taken[i].second;
  }
  XXH3_64bits_update(&state, file.data() + at, file.size() - at);
  return XXH3_64bits_digest(&state);
}

Status verify_hashes(std::span<const std::byte> file, const Directory& directory) noexcept {
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    const Section& section = directory.sections[i];
    if (hash_bytes(file.subspan(section.offset, section.bytes)) != section.hash) return Status::corrupt_payload;
  }
  if (hash_metadata(file, directory) != directory.metadata_hash) return Status::corrupt_payload;
  return Status::ok;
}

const char* describe(Status status) noexcept {
  switch (status) {
    case Status::ok:
      return "no error";
    case Status::cannot_open:
      return "the file does not exist, is no regular file or may not be read; check its name and permissions";
    case Status::cannot_map:
      return "the operating system refused to map the file; check the limits of the process";
    case Status::too_short:
      return "the file is too short to be an asset; give a .vps.hdf file, or bake it again";
    case Status::wrong_magic:
      return "this is not a vpsbake asset; give a .vps.hdf file";
    case Status::wrong_version:
      return "the asset has another format version; bake it again with this version";
    case Status::wrong_size:
      return "the file is truncated or has bytes added; copy or bake it again";
    case Status::corrupt_header:
      return "the header is damaged; copy or bake the asset again";
    case Status::rewritten:
      return "another HDF5 tool has rewritten the file; bake it again";
    case Status::bad_info:
      return "a value in the header is out of range; bake the asset again";
    case Status::bad_section:
      return "an entry of the section table is wrong; bake the asset again";
    case Status::unknown_section:
      return "the asset needs a newer version of this program; update it";
    case Status::missing_section:
      return "a part of the asset is incomplete; bake it again";
    case Status::bad_index:
      return "an index in the asset points outside its target; bake it again";
    case Status::corrupt_payload:
      return "the data do not match their hash; copy or bake the asset again";
    case Status::missing_part:
      return "the asset lacks the part or field that is asked for; bake it with --parts voxelmap,pointshell, or "
             "--fields";
    case Status::bad_pose:
      return "a pose is not finite, not a rotation or farther than 1e12 m; check its matrix";
    case Status::output_full:
      return "the buffer for contacts was too small; pass a larger one";
    case Status::bad_argument:
      return "an argument is outside its documented range";
    case Status::no_memory:
      return "there is not enough memory; free some or use a smaller asset";
  }
  return "unknown status";
}

}  // namespace vps
