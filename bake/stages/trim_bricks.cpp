// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/trim_bricks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <unordered_map>

#include "formats/brick_faces.h"
#include "formats/vps_format.h"

namespace vps::bake {
namespace {

constexpr std::uint32_t kCellsAlong = kFieldEdge - 1;
constexpr std::uint32_t kFewestSlices = 2;
using CellSet = std::uint64_t;  // a bit for each cell, x fastest

constexpr CellSet cell_bit(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return CellSet{1} << ((z * kCellsAlong + y) * kCellsAlong + x);
}

// Cells that lose a corner when only some slices are stored.
constexpr CellSet changed_cells(const octree::Slices& slices) {
  CellSet changed = 0;
  for (std::uint32_t n = 0; n < kCellsAlong * kCellsAlong * kCellsAlong; ++n) {
    const std::uint32_t cell[3] = {n % kCellsAlong, n / kCellsAlong % kCellsAlong, n / (kCellsAlong * kCellsAlong)};
    const bool stored = cell[slices.axis] >= slices.first && cell[slices.axis] + 1 < slices.first + slices.count;
    if (!stored) changed |= cell_bit(cell[0], cell[1], cell[2]);
  }
  return changed;
}

struct Choice {
  octree::Slices slices;
  CellSet changed;
};
// All ways to leave out slices at one end, the preferred ones first.
constexpr auto all_choices() {
  std::array<Choice, 18> choices;
  std::size_t n = 0;
  for (std::uint32_t count = kFewestSlices; count < kFieldEdge; ++count) {
    for (const std::uint32_t axis : {2U, 1U, 0U}) {
      for (const std::uint32_t first : {0U, kFieldEdge - count}) {
        const octree::Slices slices{axis, first, count};
        choices[n++] = {slices, changed_cells(slices)};
      }
    }
  }
  return choices;
}
constexpr auto kChoices = all_choices();

class BrickTrimmer {
 public:
  BrickTrimmer(const FieldTree& tree, const SampleForm& form) : tree_(tree), form_(form), bricks_(tree.bricks) {
    const octree::Octree octree{tree.roots.data(), tree.nodes.data(), tree.root_dims.data()};
    // All entries that lead to a brick lie under one root.
    tbb::parallel_for(std::size_t{0}, octree.root_count(), [&](std::size_t root) {
      octree::for_each_brick_entry(octree, root,
                                   [&](std::uint32_t entry, const std::uint32_t(&cell)[3], std::uint32_t edge) {
                                     Brick& brick = bricks_[number(entry)];
                                     brick.level = octree::level_of(entry);
                                     mark_used(cell, edge, brick);
                                   });
    });
  }

  static std::size_t number(std::uint32_t entry) { return octree::slice_of(entry) / kFieldEdge; }

  [[nodiscard]] octree::Slices trim(std::size_t brick) const {
    const auto best =
        std::find_if(kChoices.begin(), kChoices.end(), [&](const Choice& c) { return suffices(brick, c); });
    return best != kChoices.end() ? best->slices : octree::Slices{};
  }

 private:
  struct Brick {
    int level = 0;
    CellSet used = 0;  // cells to which an entry leads
  };

  // Marks a brick's cells in a cube of cells of level 0.
  static void mark_used(const std::uint32_t (&cell)[3], std::uint32_t edge, Brick& brick) {
    const double h = std::ldexp(1.0, brick.level);
    std::uint32_t first[3];
    std::uint32_t end[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double low = std::fmod(cell[axis] / h, kCellsAlong);
      first[axis] = static_cast<std::uint32_t>(low);
      end[axis] = static_cast<std::uint32_t>(std::ceil(std::min(low + edge / h, double{kCellsAlong})));
    }
    for (std::uint32_t z = first[2]; z < end[2]; ++z) {
      for (std::uint32_t y = first[1]; y < end[1]; ++y) {
        for (std::uint32_t x = first[0]; x < end[0]; ++x) brick.used |= cell_bit(x, y, z);
      }
    }
  }

  [[nodiscard]] bool suffices(std::size_t brick, const Choice& choice) const {
    for (CellSet left = bricks_[brick].used & choice.changed; left != 0; left &= left - 1) {
      const auto n = static_cast<std::uint32_t>(std::countr_zero(left));
      const std::uint32_t cell[3] = {n % kCellsAlong, n / kCellsAlong % kCellsAlong, n / (kCellsAlong * kCellsAlong)};
      if (!may_change(brick, cell, choice.slices)) return false;
    }
    return true;
  }

  // Whether a cell's corners may have the samples of the nearest stored slice: they are the same, or the cell lies
  // beyond the band and none of them gets farther from 0.
  [[nodiscard]] bool may_change(std::size_t brick, const std::uint32_t (&cell)[3], const octree::Slices& slices) const {
    const auto number_of = [&](const std::uint32_t(&at)[3]) {
      return brick * kFieldSamples + (std::size_t{at[2]} * kFieldEdge + at[1]) * kFieldEdge + at[0];
    };
    bool same = true;
    bool inside = true;
    bool outside = true;
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      std::uint32_t at[3] = {cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)};
      const std::size_t from = number_of(at);
      at[slices.axis] = std::clamp(at[slices.axis], slices.first, slices.first + slices.count - 1);
      const std::size_t to = number_of(at);
      for_each_value(bricks_[brick].level, [&](const auto& v) {
        same = same && v(to) == v(from);
        inside = inside && v(to) >= form_.band_inner && v(to) <= v(from);
        outside = outside && v(to) <= -form_.band_outer && v(to) >= v(from);
      });
      if (!same && !inside && !outside) return false;
      const float* const g = tree_.gradient.data();
      if (!tree_.gradient.empty() && !std::equal(g + 3 * to, g + 3 * to + 3, g + 3 * from)) return false;
    }
    return true;
  }

  // Calls visit(v) for each field that is stored; v gives a sample's V. [m]
  template <class Visit>
  void for_each_value(int level, const Visit& visit) const {
    // The band may end at a whole number of steps: 127.
    const double step = form_.step(level) * (1 + 1e-9);
    if (!tree_.scaled.empty()) visit([&](std::size_t n) { return tree_.scaled[n] * step; });
    if (!tree_.penetration.empty()) visit([&](std::size_t n) { return tree_.penetration[n]; });
  }

  const FieldTree& tree_;
  const SampleForm& form_;
  std::vector<Brick> bricks_;
};

// The samples of a brick that are stored, in their order.
struct KeptSamples {
  std::array<std::int16_t, kFieldSamples> values;
  std::size_t count = 0;

  KeptSamples(const FieldTree& tree, std::size_t brick, const octree::Slices& slices)
      : count(kFieldSlice * slices.count) {
    const std::int16_t* const samples = tree.scaled.data() + brick * kFieldSamples;
    for (std::uint32_t n = 0; n < count; ++n) values[n] = samples[sample_of(slices, n)];
  }
  [[nodiscard]] std::span<const std::int16_t> span() const { return std::span(values).first(count); }
};

// For each brick the first one that is stored as the same bytes.
std::vector<std::uint32_t> equal_bricks(const FieldTree& tree, const std::vector<octree::Slices>& slices) {
  std::vector<std::uint64_t> hashes(tree.bricks);
  tbb::parallel_for(std::size_t{0}, tree.bricks, [&](std::size_t brick) {
    hashes[brick] = hash_bytes(std::as_bytes(KeptSamples(tree, brick, slices[brick]).span()));
  });
  std::vector<std::uint32_t> equal(tree.bricks);
  std::unordered_map<std::uint64_t, std::uint32_t> first;
  for (std::uint32_t brick = 0; brick < tree.bricks; ++brick) {
    const std::uint32_t other = first.try_emplace(hashes[brick], brick).first->second;
    const bool is_equal = std::ranges::equal(KeptSamples(tree, brick, slices[brick]).span(),
                                             KeptSamples(tree, other, slices[other]).span());
    equal[brick] = is_equal ? other : brick;
  }
  return equal;
}

}  // namespace

TrimmedTree trim_bricks(const FieldTree& tree, const SampleForm& form) {
  const BrickTrimmer trimmer(tree, form);
  TrimmedTree out;
  out.bricks.resize(tree.bricks);
  tbb::parallel_for(std::size_t{0}, tree.bricks, [&](std::size_t brick) { out.bricks[brick] = trimmer.trim(brick); });
  out.first.resize(tree.bricks);
  // Values of Field::real are hardly ever equal.
  const bool is_scaled_only = tree.penetration.empty();
  const std::vector<std::uint32_t> equal =
      is_scaled_only ? equal_bricks(tree, out.bricks) : std::vector<std::uint32_t>();
  for (std::uint32_t brick = 0; brick < tree.bricks; ++brick) {
    if (is_scaled_only && equal[brick] != brick) {
      out.first[brick] = out.first[equal[brick]];
      continue;
    }
    out.kept.push_back(brick);
    out.first[brick] = static_cast<std::uint32_t>(out.slices);
    out.slices += out.bricks[brick].count;
  }
  const auto trimmed = [&](std::vector<std::uint32_t> entries) {
    for (std::uint32_t& entry : entries) {
      if (!octree::is_brick(entry)) continue;
      const std::size_t brick = BrickTrimmer::number(entry);
      entry = octree::brick_entry(out.first[brick], octree::level_of(entry), out.bricks[brick]);
    }
    return entries;
  };
  out.roots = trimmed(tree.roots);
  out.nodes = trimmed(tree.nodes);
  return out;
}

}  // namespace vps::bake
