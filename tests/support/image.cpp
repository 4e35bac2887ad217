// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/image.h"

#include <png.h>

#include <cstdlib>
#include <stdexcept>

namespace vps::test {

std::array<int, 3> Image::at(std::size_t x, std::size_t y) const {
  const std::size_t i = 3 * (width * y + x);
  return {rgb.at(i), rgb.at(i + 1), rgb.at(i + 2)};
}

Image decode_png(std::string_view bytes) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) throw std::runtime_error(png.message);
  png.format = PNG_FORMAT_RGB;
  Image image{png.width, png.height, std::vector<std::uint8_t>(PNG_IMAGE_SIZE(png))};
  const png_color white{255, 255, 255};
  if (png_image_finish_read(&png, &white, image.rgb.data(), 0, nullptr) == 0) throw std::runtime_error(png.message);
  return image;
}

double painted_share(const Image& image) {
  if (image.rgb.empty()) return 0;
  const std::array<int, 3> corner = image.at(0, 0);
  std::size_t painted = 0;
  for (std::size_t y = 0; y < image.height; ++y) {
    for (std::size_t x = 0; x < image.width; ++x) {
      const std::array<int, 3> here = image.at(x, y);
      bool differs = false;
      for (std::size_t i = 0; i < 3; ++i) differs |= std::abs(here[i] - corner[i]) > 8;
      painted += differs ? 1 : 0;
    }
  }
  return double(painted) / double(image.width * image.height);
}

}  // namespace vps::test
