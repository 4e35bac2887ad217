// SPDX-License-Identifier: Zlib
// A body above baked ground sees cells whose planes agree. Fits one plane to them, and raises it above all.
#include "runtime/fields/region_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace vps::detail {
namespace {

constexpr std::size_t kMostCells = 512;
constexpr float kNear_vx = 4;   // height of a cell's plane that shows where the surface is
constexpr float kTight_vx = 1;  // of the bound above the plane of such a cell
constexpr float kRounding_vx = 1e-3F;

// A linear function on a cell: slope . (p - centre) + height.
struct Piece {
  float centre[3];
  float slope[3], height;
};
constexpr float kHalfCell = 0.5F * kPlaneCell;

// The cells of a region that matter.
struct Cells {
  std::array<Piece, kMostCells> pieces;
  std::size_t count = 0;
  [[nodiscard]] std::span<const Piece> all() const { return {pieces.data(), count}; }
};

Piece piece_of(const VoxelmapView& map, const std::uint32_t (&cell)[3]) noexcept {
  const CellBound found = bound_of_cell(map, cell);
  Piece piece;
  piece.height = plane_height(found.plane.height);
  for (int axis = 0; axis < 3; ++axis) {
    piece.centre[axis] = (static_cast<float>(cell[axis]) + 0.5F) * kPlaneCell;
    piece.slope[axis] = static_cast<float>(found.plane.slope[axis]) * (1.0F / kSlopeSteps);
    piece.height += piece.slope[axis] * (piece.centre[axis] - found.centre[axis]);
  }
  return piece;
}

// Whether a piece shows surface that faces the middle of the region.
bool shows_surface(const Piece& piece, const float (&middle)[3]) noexcept {
  float steep = 0;
  float at_middle = piece.height;
  for (int axis = 0; axis < 3; ++axis) {
    steep += piece.slope[axis] * piece.slope[axis];
    at_middle += piece.slope[axis] * (middle[axis] - piece.centre[axis]);
  }
  return std::abs(piece.height) <= kNear_vx && steep > 0.8F && at_middle < 0;
}

// Whether points of a piece can be in contact, or surface lies there.
bool can_touch(const Piece& piece, float end) noexcept {
  float most = piece.height;
  for (int axis = 0; axis < 3; ++axis) most += kHalfCell * std::abs(piece.slope[axis]);
  return most >= -end;
}

// Height at `middle` of the lowest function with this slope that is above the least of a piece and 0.
float height_above(const Piece& piece, const float (&slope)[3], const float (&middle)[3]) noexcept {
  float at_middle = 0;
  float above_piece = piece.height;
  float above_zero = 0;
  for (int axis = 0; axis < 3; ++axis) {
    at_middle += slope[axis] * (middle[axis] - piece.centre[axis]);
    above_piece += kHalfCell * std::abs(piece.slope[axis] - slope[axis]);
    above_zero += kHalfCell * std::abs(slope[axis]);
  }
  return at_middle + std::min(above_piece, above_zero);
}

// The slope, at most 1, of the pieces that show the surface: their mean, which has a code's error, and what their
// heights add.
// @return whether there are any
bool fit_slope(const Cells& cells, const float (&middle)[3], float (&slope)[3]) noexcept {
  std::size_t count = 0;
  double sums[3] = {};
  double centres[3] = {};
  double height = 0;
  for (const Piece& piece : cells.all()) {
    if (!shows_surface(piece, middle)) continue;
    ++count;
    height += double{piece.height};
    for (int axis = 0; axis < 3; ++axis) {
      sums[axis] += double{piece.slope[axis]};
      centres[axis] += double{piece.centre[axis]};
    }
  }
  if (count == 0) return false;
  const auto n = static_cast<double>(count);
  for (int axis = 0; axis < 3; ++axis) slope[axis] = static_cast<float>(sums[axis] / n);
  for (int axis = 0; axis < 3; ++axis) {
    double product = 0;
    double square = n;  // a voxel's: where all centres are alike nothing is added
    for (const Piece& piece : cells.all()) {
      if (!shows_surface(piece, middle)) continue;
      double left = double{piece.height} - height / n;
      for (int k = 0; k < 3; ++k) left -= double{slope[k]} * (double{piece.centre[k]} - centres[k] / n);
      const double off = double{piece.centre[axis]} - centres[axis] / n;
      product += off * left;
      square += off * off;
    }
    slope[axis] += static_cast<float>(product / square);
  }
  const float length = std::hypot(slope[0], slope[1], slope[2]);
  for (float& one : slope) one /= std::max(length * (1 + 1e-6F), 1.0F);
  return true;
}

// Whether the grid ends where no point can be in contact.
bool has_margin(const VoxelmapView& map, float end) noexcept {
  const Frame frame = voxel_frame(map);
  for (int axis = 0; axis < 3; ++axis) {
    const double below = (double{map.bounds_min[axis]} - frame.origin[axis]) / frame.unit;
    const double above = (double{map.bounds_max[axis]} - frame.origin[axis]) / frame.unit;
    if (!(below >= double{end} && map.dims[axis] - 1 - above >= double{end})) return false;
  }
  return true;
}

}  // namespace

RegionBound bound_region(const VoxelmapView& map, const float (&low)[3], const float (&high)[3]) noexcept {
  RegionBound region;
  const float touch = end_of_band(map.band_outer, map.voxel_size) / map.voxel_size;
  std::copy_n(low, 3, region.low);
  std::copy_n(high, 3, region.high);
  std::uint32_t begin[3];
  std::uint32_t end[3];
  float middle[3];
  double count = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t whole = (map.dims[axis] + kPlaneCell - 2) / kPlaneCell;
    const auto cells = static_cast<float>(whole);
    // Written so that NaN gives no cells.
    if (!(low[axis] < high[axis] && high[axis] > 0 && low[axis] < cells * kPlaneCell)) return region;
    begin[axis] = static_cast<std::uint32_t>(std::max(low[axis], 0.0F) / kPlaneCell);
    end[axis] = static_cast<std::uint32_t>(std::min(std::ceil(high[axis] / kPlaneCell), cells));
    middle[axis] = 0.5F * (low[axis] + high[axis]);
    count *= static_cast<double>(end[axis]) - static_cast<double>(begin[axis]);
  }
  if (!(count > 0 && count <= double{kMostCells}) || !has_margin(map, touch)) return region;
  Cells cells;
  std::uint32_t cell[3];
  for (cell[2] = begin[2]; cell[2] < end[2]; ++cell[2]) {
    for (cell[1] = begin[1]; cell[1] < end[1]; ++cell[1]) {
      for (cell[0] = begin[0]; cell[0] < end[0]; ++cell[0]) {
        const Piece piece = piece_of(map, cell);
        if (can_touch(piece, touch)) cells.pieces[cells.count++] = piece;
      }
    }
  }
  if (!fit_slope(cells, middle, region.slope)) return region;
  region.height = std::numeric_limits<float>::lowest();
  for (const Piece& piece : cells.all()) {
    region.height = std::max(region.height, height_above(piece, region.slope, middle));
  }
  region.height += kRounding_vx;
  region.is_tight = std::all_of(cells.all().begin(), cells.all().end(), [&](const Piece& piece) {
    float above = region.height - piece.height;
    for (int axis = 0; axis < 3; ++axis) above += region.slope[axis] * (piece.centre[axis] - middle[axis]);
    return !shows_surface(piece, middle) || above <= kTight_vx;
  });
  return region;
}

float keep_region(const VoxelmapView& map, std::uint64_t field, const float (&centre)[3], float radius, float distance,
                  ContactCache& cache) noexcept {
  constexpr float kRoom_vx = 8;
  float low[3];
  float high[3];
  float room = std::numeric_limits<float>::max();
  for (int axis = 0; axis < 3; ++axis) {
    const float at = centre[axis];
    const float most = radius + distance + kRoom_vx;
    low[axis] = at - most;
    high[axis] = at + most;
    room = std::min({room, at - radius - cache.region.low[axis], cache.region.high[axis] - at - radius});
  }
  if (cache.region_field == field && room >= distance) return room;
  if (cache.region.is_tight) cache.reach = 0;  // points that are not in the list were below it
  cache.region = bound_region(map, low, high);
  cache.region_field = field;
  return distance + kRoom_vx;
}

CodeBound bound_of_codes(const RegionBound& bound, const Affine& points, float rounding) noexcept {
  CodeBound out;
  double height = double{bound.height} + 4 * double{rounding};
  double normal[3] = {};
  for (int axis = 0; axis < 3; ++axis) {
    const double slope{bound.slope[axis]};
    const double middle = 0.5 * (double{bound.low[axis]} + double{bound.high[axis]});
    height += slope * (double{points.translation[axis]} - middle);
    for (int k = 0; k < 3; ++k) normal[k] += slope * double{points.rotation[3 * axis + k]};
  }
  for (int k = 0; k < 3; ++k) out.normal[k] = static_cast<float>(normal[k]);
  out.height = static_cast<float>(height);
  return out;
}

}  // namespace vps::detail
