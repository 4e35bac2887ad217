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
    : origin_(surface.bounds_min - Vector::Constant(8 * cell)), cell_(cell) {
  std::vector<Patch> stack;
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    stack.push_back({{surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2)}, t});
    while (!stack.empty()) {
      const Patch patch = stack.back();
      stack.pop_back();
      std::size_t edge = 0;
      if (longest_edge(patch.piece, edge) > kPatch * kPatch * cell * cell) {
        for (const Piece& half : split(patch.piece, edge)) stack.push_back({half, t});
      } else {
        add(patch);
      }
    }
  }
  for (Block& block : blocks_) {
    const Position& p = block.position;
    colours_[static_cast<std::size_t>((p[2] % 3 * 3 + p[1] % 3) * 3 + p[0] % 3)].push_back(&block);
    for (int n = 0; n < 27; ++n) {
      block.around[static_cast<std::size_t>(n)] = find({p[0] + n % 3 - 1, p[1] + n / 3 % 3 - 1, p[2] + n / 9 - 1});
    }
  }
}

// Creates every block that the patch touches, so that each sample on the patch has a block.
void SurfaceBlocks::add(const Patch& patch) {
  const Piece& p = patch.piece;
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
  block_of(centroid(p)).patches.push_back(patch);
}

}  // namespace vps::bake
