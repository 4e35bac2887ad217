// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads PNG, for tests of pictures.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace vps::test {

/// Rows from the top, 8 bits of red, green, blue each.
struct Image {
  std::size_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;

  [[nodiscard]] std::array<int, 3> at(std::size_t x, std::size_t y) const;
};

/// @throw std::runtime_error when the bytes are no PNG
[[nodiscard]] Image decode_png(std::string_view bytes);

/// Share of the pixels whose colour differs from the top left corner's by more than 8 of 255; 0 for an empty picture.
[[nodiscard]] double painted_share(const Image& image);

}  // namespace vps::test
