// SPDX-License-Identifier: GPL-3.0-or-later
// Cuts the surface into patches and assigns them to blocks.
#include "bake/stages/surface_blocks.h"

#include <utility>

namespace vps::bake {
namespace {

// Longest edge of a patch, in cells. Found by measurement: larger patches have more samples to compare, smaller ones
// are too many.
constexpr double kPatch = 1.25;

}  // namespace

/// The patches of triangles that follow each other, and the blocks that they touch: so each sample on a patch has one.
struct SurfaceBlocks::Part {
  struct Group {
    PatchGroup patches;
    std::uint32_t home;  // number in `touched`
  };
  std::vector<Position> touched;  // in order
  std::vector<Group> groups;
  std::vector<Piece> pieces;  // of the groups that are not of whole triangles
};

class SurfaceBlocks::Cutter {
 public:
  explicit Cutter(const SurfaceBlocks& blocks) : blocks_(blocks) {}

  void add(std::uint32_t triangle) {
    stack_.assign(1, blocks_.triangle(triangle));
    for (bool whole = true; !stack_.empty(); whole = false) {
      const Piece piece = stack_.back();
      stack_.pop_back();
      std::size_t edge = 0;
      // Its patches are at most three halvings away.
      const bool small = longest_edge(piece, edge) <= 4 * blocks_.patch_squared_;
      if (small && add(piece, triangle, whole)) continue;
      for (const Piece& half : split(piece, edge)) stack_.push_back(half);
    }
  }
  [[nodiscard]] Part finish() { return std::move(part_); }

 private:
  // @return false when the piece has too many patches
  bool add(const Piece& piece, std::uint32_t triangle, bool whole) {
    constexpr std::size_t kMost = 32;  // bits of PatchGroup::members
    constexpr std::uint32_t kDone = 0xFFFFFFFFu;
    std::size_t count = 0;
    std::array<std::uint32_t, kMost> homes;
    const auto assign = [&](const Piece& patch) {
      if (count < kMost) homes[count] = touch(patch);
      ++count;
    };
    blocks_.for_each_part(piece, assign);
    if (count > kMost) return false;
    for (std::size_t n = 0; n < count; ++n) {
      const std::uint32_t home = homes[n];
      if (home == kDone) continue;
      std::uint32_t members = 0;
      for (std::size_t m = n; m < count; ++m) {
        if (homes[m] != home) continue;
        members |= std::uint32_t{1} << m;
        homes[m] = kDone;
      }
      part_.groups.push_back({{triangle, whole ? PatchGroup::kWhole : 0, members}, home});
      if (!whole) part_.pieces.push_back(piece);
    }
    return true;
  }

  // @return the number of the block in which the patch's centroid lies
  std::uint32_t touch(const Piece& p) {
    const Vector slack = Vector::Constant(0.01 * blocks_.cell_);
    const Position first = block_position(blocks_.cell_of(p[0].cwiseMin(p[1]).cwiseMin(p[2]) - slack));
    const Position last = block_position(blocks_.cell_of(p[0].cwiseMax(p[1]).cwiseMax(p[2]) + slack));
    for (int z = first[2]; z <= last[2]; ++z) {
      for (int y = first[1]; y <= last[1]; ++y) {
        for (int x = first[0]; x <= last[0]; ++x) number_of({x, y, z});
      }
    }
    return number_of(block_position(blocks_.cell_of(centroid(p))));
  }

  std::uint32_t number_of(const Position& block) {
    if (!part_.touched.empty() && part_.touched[last_] == block) return last_;
    const auto [it, fresh] = numbers_.try_emplace(key(block), static_cast<std::uint32_t>(part_.touched.size()));
    if (fresh) part_.touched.push_back(block);
    return last_ = it->second;
  }

  const SurfaceBlocks& blocks_;
  Part part_;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;
  std::uint32_t last_ = 0;  // the block that was looked up last, often the next one
  std::vector<Piece> stack_;
};

SurfaceBlocks::SurfaceBlocks(const Surface& surface, double cell)
    : surface_(surface),
      origin_(surface.bounds_min - Vector::Constant(8 * cell)),
      cell_(cell),
      patch_squared_(kPatch * kPatch * cell * cell) {
  const std::size_t count = surface.triangles.size();
  std::vector<Part> parts(std::min<std::size_t>(count, 256));
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t n) {
    Cutter cutter(*this);
    for (std::size_t t = n * count / parts.size(); t < (n + 1) * count / parts.size(); ++t) {
      cutter.add(static_cast<std::uint32_t>(t));
    }
    parts[n] = cutter.finish();
  });
  for (Part& part : parts) {
    add(part);
    part = {};
  }
  for (Block& block : blocks_) {
    const Position& p = block.position;
    colours_[static_cast<std::size_t>((p[2] % 3 * 3 + p[1] % 3) * 3 + p[0] % 3)].push_back(&block);
  }
  tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t i) {
    Block& block = blocks_[i];
    block.patches.shrink_to_fit();
    block.pieces.shrink_to_fit();
    const Position& p = block.position;
    for (int n = 0; n < 27; ++n) {
      block.around[static_cast<std::size_t>(n)] = find({p[0] + n % 3 - 1, p[1] + n / 3 % 3 - 1, p[2] + n / 9 - 1});
    }
  });
}

SurfaceBlocks::~SurfaceBlocks() {
  // Samples are freed one by one, which takes a while.
  for_each_block([](Block& block) { std::deque<Sample>().swap(block.samples); });
}

void SurfaceBlocks::add(const Part& part) {
  std::vector<Block*> blocks;
  for (const Position& position : part.touched) {
    Block*& block = block_at_[key(position)];
    if (block == nullptr) {
      block = &blocks_.emplace_back();
      block->position = position;
    }
    blocks.push_back(block);
  }
  auto piece = part.pieces.begin();
  for (const Part::Group& group : part.groups) {
    Block& home = *blocks[group.home];
    PatchGroup& patches = home.patches.emplace_back(group.patches);
    if (patches.piece == PatchGroup::kWhole) continue;
    patches.piece = static_cast<std::uint32_t>(home.pieces.size());
    home.pieces.push_back(*piece++);
  }
}

}  // namespace vps::bake
