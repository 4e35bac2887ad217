// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The surface and the samples on it, in blocks that threads can process at the same time with the same result.
/// Internal to bake.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <unordered_map>

#include "bake/geometry.h"
#include "bake/stages/fit_facets.h"

namespace vps::bake {

/// A part of a triangle.
using Piece = std::array<Vector, 3>;

[[nodiscard]] inline Vector centroid(const Piece& p) {
  return (p[0] + p[1] + p[2]) / 3;
}

/// @param edge  set to the longest edge, which runs from corner `edge` to the next.
/// @return its squared length. [m^2]
[[nodiscard]] inline double longest_edge(const Piece& p, std::size_t& edge) {
  const double squared[3] = {(p[1] - p[0]).squaredNorm(), (p[2] - p[1]).squaredNorm(), (p[0] - p[2]).squaredNorm()};
  edge = squared[1] > squared[0] ? 1 : 0;
  if (squared[2] > squared[edge]) edge = 2;
  return squared[edge];
}

/// Halves a piece at an edge: the edge's last corner moves to the middle in the first half, its first in the second.
[[nodiscard]] inline std::array<Piece, 2> split(const Piece& p, std::size_t edge) {
  const std::size_t next = edge == 2 ? 0 : edge + 1;
  std::array<Piece, 2> halves = {p, p};
  halves[0][next] = halves[1][edge] = (p[edge] + p[next]) / 2;
  return halves;
}

/// A point on the surface.
struct Sample {
  Vector position;                                        ///< [m]
  Vector normal;                                          ///< outward, of the triangle it was made on
  double area;                                            ///< [m^2]
  Sample* next;                                           ///< in the same cell
  bool on_edge;                                           ///< a sharp one
  Vector vector_area = Vector::Zero();                    ///< of its cell, outward. [m^2]
  std::unique_ptr<std::vector<CellPart>> cell = nullptr;  ///< where it is folded, else null
};

/// A piece that is small against a block.
struct Patch {
  Piece piece;
  std::uint32_t triangle;
};

/// Patches that lie in one block and were cut out of one piece. Only that piece is kept: the patches would take most of
/// the pointshell's memory, and cutting takes little time.
struct PatchGroup {
  static constexpr std::uint32_t kWhole = 0xFFFFFFFFu;
  std::uint32_t triangle;
  std::uint32_t piece;    ///< number in `Block::pieces`; kWhole: the triangle itself
  std::uint32_t members;  ///< bit n: whether the n-th patch of the piece is one of them
};

/// 4x4x4 cells, the patches whose centroids lie in them, and the samples in them.
struct Block {
  std::array<int, 3> position{};    ///< [Units: blocks]
  std::array<Block*, 27> around{};  ///< itself and its neighbours, x fastest; null where there is no surface
  std::array<Sample*, 64> heads{};  ///< first sample of each cell
  std::deque<Sample> samples;       ///< in the order of their creation; pointers to them stay valid
  std::vector<PatchGroup> patches;
  std::vector<Piece> pieces;
  bool has_folds = false;  ///< some of its samples have a `Sample::cell`
};

/// Work on a patch reads and writes its own block and those around it. Blocks three apart share none of these. So all
/// blocks of one of 27 colours can be processed at the same time, and the result only depends on the order of colours.
class SurfaceBlocks {
 public:
  /// @param surface  must outlive this object
  /// @param cell  edge of a cell, about twice the distance of the samples: most searches then see 8 to 18 cells. [m]
  SurfaceBlocks(const Surface& surface, double cell);
  ~SurfaceBlocks();

  [[nodiscard]] std::deque<Block>& blocks() { return blocks_; }
  /// Calls visit(const Patch&) for each patch of a block.
  template <class Visit>
  void for_each_patch(const Block& block, Visit visit) const {
    for (const PatchGroup& group : block.patches) {
      std::uint32_t n = 0;
      const auto visit_member = [&](const Piece& piece) {
        if ((group.members >> n++ & 1) != 0) visit(Patch{piece, group.triangle});
      };
      for_each_part(group.piece == PatchGroup::kWhole ? triangle(group.triangle) : block.pieces[group.piece],
                    visit_member);
    }
  }
  /// Frees all patches.
  void drop_patches() {
    for (Block& block : blocks_) {
      block.patches = {};
      block.pieces = {};
    }
  }

  /// @pre p lies on the surface
  [[nodiscard]] Block& block_of(const Vector& p) { return *block_at_.find(key(block_position(cell_of(p))))->second; }

  /// @pre p lies on a patch of `home`
  Sample* insert(Block& home, const Vector& p, const Vector& normal) {
    const Position c = cell_of(p);
    Block& block = *home.around[around(home, c)];
    Sample*& head = block.heads[cell_in_block(c)];
    head = &block.samples.emplace_back(Sample{p, normal, 0, head, false});
    return head;
  }

  /// Calls visit(sample) for those in the cells that the box touches, widened by `reach`, until visit returns false.
  /// @pre the box is a patch of `home` or a part of one, and the reach at most two cells. [Units: m]
  template <class Visit>
  void for_each_near(const Block& home, const Vector& low, const Vector& high, double reach, Visit visit) const {
    const Position from = cell_of(low - Vector::Constant(reach));
    const Position to = cell_of(high + Vector::Constant(reach));
    Position c;
    for (c[2] = from[2]; c[2] <= to[2]; ++c[2]) {
      for (c[1] = from[1]; c[1] <= to[1]; ++c[1]) {
        for (c[0] = from[0]; c[0] <= to[0]; ++c[0]) {
          const Block* block = home.around[around(home, c)];
          if (block == nullptr) continue;
          for (Sample* s = block->heads[cell_in_block(c)]; s != nullptr; s = s->next) {
            if (!visit(*s)) return;
          }
        }
      }
    }
  }

  using Position = std::array<int, 3>;

  [[nodiscard]] Position cell_of(const Vector& p) const {
    const Vector c = (p - origin_) / cell_;
    return {static_cast<int>(c[0]), static_cast<int>(c[1]), static_cast<int>(c[2])};
  }
  /// Calls visit(first sample or null) for the cells from one to another, x fastest, in the order of `for_each_near`.
  /// @pre they lie in `home` or in the blocks around it
  template <class Visit>
  static void for_each_cell(const Block& home, const Position& from, const Position& to, Visit visit) {
    Position c;
    for (c[2] = from[2]; c[2] <= to[2]; ++c[2]) {
      for (c[1] = from[1]; c[1] <= to[1]; ++c[1]) {
        for (c[0] = from[0]; c[0] <= to[0]; ++c[0]) {
          const Block* const block = home.around[around(home, c)];
          visit(block == nullptr ? nullptr : block->heads[cell_in_block(c)]);
        }
      }
    }
  }

  /// Calls work(block) for every block, in parallel.
  template <class Work>
  void for_each_block(Work work) {
    for (const std::vector<Block*>& blocks : colours_) {
      tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t n) { work(*blocks[n]); });
    }
  }

 private:
  struct Part;
  class Cutter;

  [[nodiscard]] Piece triangle(std::uint32_t t) const {
    return {surface_.corner(t, 0), surface_.corner(t, 1), surface_.corner(t, 2)};
  }
  // Cuts a piece into patches. Calls visit(piece) for each, always in the same order.
  template <class Visit>
  void for_each_part(const Piece& piece, Visit& visit) const {
    std::size_t edge = 0;
    if (longest_edge(piece, edge) <= patch_squared_) return visit(piece);
    const std::array<Piece, 2> halves = split(piece, edge);
    for_each_part(halves[1], visit);
    for_each_part(halves[0], visit);
  }
  void add(const Part& part);
  Block* find(const Position& block) const {
    const auto it = block_at_.find(key(block));
    return it == block_at_.end() ? nullptr : it->second;
  }
  static Position block_position(const Position& cell) { return {cell[0] >> 2, cell[1] >> 2, cell[2] >> 2}; }
  static std::size_t around(const Block& home, const Position& cell) {
    const Position b = block_position(cell);
    return static_cast<std::size_t>(((b[2] - home.position[2]) * 3 + b[1] - home.position[1]) * 3 + b[0] -
                                    home.position[0] + 13);
  }
  static std::size_t cell_in_block(const Position& c) {
    return static_cast<std::size_t>((c[2] & 3) << 4 | (c[1] & 3) << 2 | (c[0] & 3));
  }
  static std::uint64_t key(const Position& block) {
    return static_cast<std::uint64_t>(block[0]) << 42 | static_cast<std::uint64_t>(block[1]) << 21 |
           static_cast<std::uint64_t>(block[2]);
  }

  const Surface& surface_;
  const Vector origin_;  // two blocks below the surface, so that no position around it is negative
  const double cell_;
  const double patch_squared_;  // longest edge of a patch. [m^2]
  std::deque<Block> blocks_;
  std::unordered_map<std::uint64_t, Block*> block_at_;
  std::array<std::vector<Block*>, 27> colours_;
};

}  // namespace vps::bake
