// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Writes values on a regular grid of points as VTKHDF ImageData 1.0, for ParaView and VTK.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "formats/hdf5/hdf5_writer.h"

namespace vps {

/// The points of a grid, x fastest.
struct ImageGrid {
  std::array<std::uint64_t, 3> points{};  ///< along x, y, z. [Limits: 1 <= value < 2^31]
  std::array<double, 3> origin{};         ///< the first point. [m]
  double spacing = 0;                     ///< [m]
};

/// One value for each point.
struct ImageArray {
  std::string name;
  ElementType element{};  ///< [Limits: i8, i16, f32]
  /// Fills a plane of the grid, y by x, with values of that type. @param out  room for points[0] * points[1] of them
  std::function<void(std::uint64_t z, void* out)> plane;
};

/// Writes the file whole or not at all. Same values, same bytes.
/// @return its size. [bytes]
/// @throw WriteError with the reason and what to do
std::size_t write_vtkhdf(const std::filesystem::path& path, const ImageGrid& grid,
                         const std::vector<ImageArray>& arrays);

}  // namespace vps
