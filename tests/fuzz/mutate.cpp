// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/fuzz/mutate.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>

#include "formats/fields.h"

namespace vps::test {
namespace {

// Whole numbers, floats and doubles at the ends of their ranges.
constexpr std::uint64_t kExtremes[] = {0,
                                       1,
                                       0x7F,
                                       0x80,
                                       0x7FFF,
                                       0x8000,
                                       0xFFFF,
                                       0x7FFFFFFF,
                                       0x80000000,
                                       0xFFFFFFFE,
                                       0xFFFFFFFF,
                                       0x00000001 /* least float */,
                                       0x7F7FFFFF /* largest float */,
                                       0x7F800000 /* infinity as float */,
                                       0x7FC00000,
                                       0x7FEFFFFFFFFFFFFF /* largest double */,
                                       0x0010000000000000 /* least normal double */,
                                       0x7FF0000000000000 /* infinity as double */,
                                       0x7FF8000000000000,
                                       0xFFFFFFFFFFFFFFFF};

class Damage {
 public:
  Damage(Bytes& file, const Directory& directory, Random& random)
      : file_(file), directory_(directory), random_(random) {}

  void one() {
    const Place place = pick_place();
    std::uint64_t value = 0;
    std::memcpy(&value, file_.data() + place.at, place.size);
    value = changed(value, place);
    std::memcpy(file_.data() + place.at, &value, place.size);
  }

 private:
  struct Place {
    std::size_t at, size;
    bool is_double;
  };

  std::size_t pick(std::size_t below) { return static_cast<std::size_t>(random_.next() * static_cast<double>(below)); }

  Place pick_place() {
    const double where = random_.next();
    if (where < 0.6) {
      const Section& section = directory_.sections[pick(directory_.section_count)];
      const std::size_t size = element_bytes(section.element);
      return {section.offset + size * pick(section.bytes / size), size, section.element == ElementType::f64};
    }
    if (where < 0.95) {
      std::vector<std::size_t> offsets;
      detail::for_each_info_field(directory_.info, [&](std::size_t offset, const auto&) { offsets.push_back(offset); });
      return {offsets[pick(offsets.size())] + 8 * pick(3), 8, true};
    }
    return {pick(kUserBlockBytes - 8), std::size_t{1} << pick(4), false};
  }

  std::uint64_t changed(std::uint64_t value, const Place& place) {
    const double what = random_.next();
    // A factor keeps a double in range more often than noise does.
    if (place.is_double && what < 0.4) {
      const double factor = random_.next() < 0.5 ? random_.between(0.5, 2) : std::pow(10, random_.between(-9, 9));
      return std::bit_cast<std::uint64_t>(std::bit_cast<double>(value) * factor);
    }
    // Finite, but absurd.
    if (place.is_double && what < 0.6) {
      const double sign = random_.next() < 0.8 ? 1 : -1;
      return std::bit_cast<std::uint64_t>(sign * std::pow(10, random_.between(-307, 308)));
    }
    if (what < 0.5) return value + (random_.next() < 0.5 ? 1 : ~std::uint64_t{0});
    if (what < 0.7) return kExtremes[pick(std::size(kExtremes))];
    if (what < 0.85) return value ^ std::uint64_t{1} << pick(8 * place.size);
    return static_cast<std::uint64_t>(random_.next() * 0x1.0p64);
  }

  Bytes& file_;
  const Directory& directory_;
  Random& random_;
};

}  // namespace

void seal_header(std::span<std::byte> file) {
  if (file.size() < kUserBlockBytes) return;
  std::memset(file.data() + detail::kHashOffset, 0, sizeof(std::uint64_t));
  const std::uint64_t hash = hash_bytes(file.first(kUserBlockBytes));
  std::memcpy(file.data() + detail::kHashOffset, &hash, sizeof(hash));
}

void seal_everything(std::span<std::byte> file) {
  seal_header(file);
  Directory directory;
  if (decode_directory(file, directory) != Status::ok) return;
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    Section& section = directory.sections[i];
    section.hash = hash_bytes(file.subspan(section.offset, section.bytes));
  }
  directory.metadata_hash = hash_metadata(file, directory);
  encode_directory(directory, file.first<kUserBlockBytes>());
}

void mutate(Bytes& file, Random& random) {
  Directory directory;
  if (decode_directory(file, directory) != Status::ok) return;
  Damage damage(file, directory, random);
  const int changes = random.next() < 0.5 ? 1 : 2 + static_cast<int>(random.next() * 3);
  for (int n = 0; n < changes; ++n) damage.one();
}

}  // namespace vps::test
