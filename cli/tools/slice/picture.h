// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A picture with lines and a built-in font: enough for plots, without installed fonts.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vps::cli {

using Colour = std::array<std::uint8_t, 3>;  ///< red, green, blue

/// Outside blue, surface white, inside red: distinct with every common colour blindness. @param t  -1 to 1, clamped
[[nodiscard]] Colour diverging_colour(double t);

/// Rows count from the top. Pixels outside are not drawn.
class Picture {
 public:
  /// A white picture. [Limits: 1 <= width, height <= 20000]
  Picture(int width, int height);
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  void set(int x, int y, const Colour& colour);
  void fill(int x, int y, int width, int height, const Colour& colour);
  /// The rim of a rectangle, a pixel wide.
  void frame(int x, int y, int width, int height, const Colour& colour);
  /// Draws letters, digits and the signs of names and numbers; 10 x 14 pixels each, 12 from one to the next. (x, y) is
  /// the upper left corner. Any other byte becomes a question mark.
  void write(int x, int y, std::string_view text);
  [[nodiscard]] static int width_of(std::string_view text) { return 12 * static_cast<int>(text.size()); }

  /// @throw std::runtime_error when libpng fails
  [[nodiscard]] std::string png() const;

 private:
  int width_, height_;
  std::vector<std::uint8_t> rgb_;
};

}  // namespace vps::cli
