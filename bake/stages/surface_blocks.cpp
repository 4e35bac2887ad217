// SPDX-License-Identifier: GPL-3.0-or-later
// Cuts the surface into patches and assigns them to blocks.
#include "bake/stages/surface_blocks.h"

namespace vps::bake {
namespace {

// Longest edge of a patch, in cells. Found by measurement: larger patches have more samples to compare, smaller ones
// are too many.
constexpr double kPatch = 1.25;

}  // namespace

SurfaceBlocks::SurfaceBlocks(const Surface& surface, double cell)
    : surface_(surface),
      origin_(surface.bounds_min - Vector::Constant(8 * cell)),
      cell_(cell),
      patch_squared_(kPatch * kPatch * cell * cell) {
  std::vector<Piece> stack;
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    stack.push_back(triangle(t));
    for (bool whole = true; !stack.empty(); whole = false) {
      const Piece piece = stack.back();
      stack.pop_back();
      std::size_t edge = 0;
      // Two or three cuts from its patches.
      const bool small = longest_edge(piece, edge) <= 4 * patch_squared_;
      if (small && add(piece, t, whole)) continue;
      for (const Piece& half : split(piece, edge)) stack.push_back(half);
    }
  }
  for (Block& block : blocks_) {
    block.patches.shrink_to_fit();
    block.pieces.shrink_to_fit();
    const Position& p = block.position;
    colours_[static_cast<std::size_t>((p[2] % 3 * 3 + p[1] % 3) * 3 + p[0] % 3)].push_back(&block);
    for (int n = 0; n < 27; ++n) {
      block.around[static_cast<std::size_t>(n)] = find({p[0] + n % 3 - 1, p[1] + n / 3 % 3 - 1, p[2] + n / 9 - 1});
    }
  }
}

// Assigns the patches of a piece to blocks. @return false when the piece has too many
bool SurfaceBlocks::add(const Piece& piece, std::uint32_t triangle, bool whole) {
  constexpr std::size_t kMost = 32;  // bits of PatchGroup::members
  std::size_t count = 0;
  std::array<Block*, kMost> homes;
  const auto assign = [&](const Piece& patch) {
    if (count < kMost) {
      create_blocks(patch);
      homes[count] = &block_of(centroid(patch));
    }
    ++count;
  };
  for_each_part(piece, assign);
  if (count > kMost) return false;
  for (std::size_t n = 0; n < count; ++n) {
    if (homes[n] == nullptr) continue;
    Block& home = *homes[n];
    std::uint32_t members = 0;
    for (std::size_t m = n; m < count; ++m) {
      if (homes[m] != &home) continue;
      members |= std::uint32_t{1} << m;
      homes[m] = nullptr;
    }
    const auto number = whole ? PatchGroup::kWhole : static_cast<std::uint32_t>(home.pieces.size());
    home.patches.push_back({triangle, number, members});
    if (!whole) home.pieces.push_back(piece);
  }
  return true;
}

// Creates every block that a patch touches, so that each sample on the patch has a block.
void SurfaceBlocks::create_blocks(const Piece& p) {
  const Vector slack = Vector::Constant(0.01 * cell_);
  const Position first = block_position(cell_of(p[0].cwiseMin(p[1]).cwiseMin(p[2]) - slack));
  const Position last = block_position(cell_of(p[0].cwiseMax(p[1]).cwiseMax(p[2]) + slack));
  for (int z = first[2]; z <= last[2]; ++z) {
    for (int y = first[1]; y <= last[1]; ++y) {
      for (int x = first[0]; x <= last[0]; ++x) {
        Block*& block = block_at_[key({x, y, z})];
        if (block != nullptr) continue;
        block = &blocks_.emplace_back();
        block->position = {x, y, z};
      }
    }
  }
}

}  // namespace vps::bake
