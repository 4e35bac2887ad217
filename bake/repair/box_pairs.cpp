// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled once per instruction set by Highway, chosen at run time.
#include "bake/repair/box_pairs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "bake/morton.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/repair/box_pairs.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#ifndef VPS_BOX_PAIRS_ONCE
#define VPS_BOX_PAIRS_ONCE
namespace vps::bake::detail {

using Node = BoxPairs::Node;

struct FloatBox {
  float low[3], high[3];
};

// Two positions in the order of triangles.
using PositionPair = std::pair<std::size_t, std::size_t>;

}  // namespace vps::bake::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<float, BoxPairs::kWidth> box_lanes;

// One bit for each of a node's boxes that overlaps or touches the box.
HWY_INLINE std::uint32_t overlaps(const Node& node, const FloatBox& box) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < BoxPairs::kWidth; i += hn::Lanes(box_lanes)) {
    const auto along = [&](int axis) HWY_ATTR {
      return hn::And(hn::Le(hn::Load(box_lanes, node.low[axis] + i), hn::Set(box_lanes, box.high[axis])),
                     hn::Ge(hn::Load(box_lanes, node.high[axis] + i), hn::Set(box_lanes, box.low[axis])));
    };
    std::uint8_t mask[8] = {};
    hn::StoreMaskBits(box_lanes, hn::And(along(0), hn::And(along(1), along(2))), mask);
    bits |= (std::uint32_t{mask[0]} | std::uint32_t{mask[1]} << 8) << i;
  }
  return bits;
}

HWY_INLINE FloatBox box_of(const Node& node, std::size_t n) {
  FloatBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = node.low[axis][n];
    box.high[axis] = node.high[axis][n];
  }
  return box;
}

// Pairs of a leaf's triangles with each other and with those of later leaves.
void find_pairs(const std::vector<std::vector<Node>>& levels, std::size_t leaf, const FloatBox& whole,
                std::vector<PositionPair>& pairs) {
  constexpr std::size_t kWidth = BoxPairs::kWidth;
  struct Waiting {
    std::size_t level, node;
  };
  // A node leaves at most 15 waiting, and 2^32 triangles make 8 levels.
  Waiting waiting[8 * kWidth];
  std::size_t count = 0;
  waiting[count++] = {levels.size() - 1, 0};
  const Node& own = levels[0][leaf];
  while (count > 0) {
    const Waiting next = waiting[--count];
    const Node& node = levels[next.level][next.node];
    if (next.level == 0) {
      for (std::size_t n = 0; n < kWidth; ++n) {
        std::uint32_t bits = overlaps(node, box_of(own, n));
        if (next.node == leaf) bits &= ~std::uint32_t{0} << (n + 1);
        for (; bits != 0; bits &= bits - 1) {
          pairs.emplace_back(leaf * kWidth + n, next.node * kWidth + static_cast<std::size_t>(std::countr_zero(bits)));
        }
      }
      continue;
    }
    for (std::uint32_t bits = overlaps(node, whole); bits != 0; bits &= bits - 1) {
      const std::size_t child = next.node * kWidth + static_cast<std::size_t>(std::countr_zero(bits));
      const std::size_t last_leaf = ((child + 1) << 4 * (next.level - 1)) - 1;
      if (last_leaf >= leaf) waiting[count++] = {next.level - 1, child};
    }
  }
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(find_pairs);

constexpr FloatBox empty_box() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
}

// Puts the boxes into nodes of 16. @return a box around each node's
std::vector<FloatBox> fill_nodes(const std::vector<FloatBox>& boxes, std::vector<Node>& nodes) {
  constexpr std::size_t kWidth = BoxPairs::kWidth;
  nodes.resize((boxes.size() + kWidth - 1) / kWidth);
  std::vector<FloatBox> around(nodes.size(), empty_box());
  tbb::parallel_for(std::size_t{0}, nodes.size(), [&](std::size_t n) {
    FloatBox& outer = around[n];
    for (std::size_t i = 0; i < kWidth; ++i) {
      const std::size_t at = n * kWidth + i;
      const FloatBox& box = at < boxes.size() ? boxes[at] : empty_box();
      for (int axis = 0; axis < 3; ++axis) {
        nodes[n].low[axis][i] = box.low[axis];
        nodes[n].high[axis][i] = box.high[axis];
        outer.low[axis] = std::min(outer.low[axis], box.low[axis]);
        outer.high[axis] = std::max(outer.high[axis], box.high[axis]);
      }
    }
  });
  return around;
}
}  // namespace detail

// Subtracting the centre and rounding to float keep the order of coordinates: boxes that overlap still do.
BoxPairs::BoxPairs(const Mesh& mesh) {
  if (mesh.triangles.empty()) return;
  Eigen::AlignedBox3d bounds;
  for (const Vector& v : mesh.vertices) bounds.extend(v);
  order_ = morton_order(mesh, bounds.min(), bounds.sizes().maxCoeff());
  std::vector<detail::FloatBox> boxes(order_.size());
  const Vector centre = bounds.center();
  tbb::parallel_for(std::size_t{0}, boxes.size(), [&](std::size_t i) {
    const std::uint32_t t = order_[i];
    for (int axis = 0; axis < 3; ++axis) {
      const auto [low, high] = std::minmax({mesh.corner(t, 0)[axis], mesh.corner(t, 1)[axis], mesh.corner(t, 2)[axis]});
      boxes[i].low[axis] = static_cast<float>(low - centre[axis]);
      boxes[i].high[axis] = static_cast<float>(high - centre[axis]);
    }
  });
  do {
    boxes = detail::fill_nodes(boxes, levels_.emplace_back());
  } while (boxes.size() > 1);
}

void BoxPairs::find(std::size_t part, std::vector<TrianglePair>& pairs) const {
  const Node& leaf = levels_[0][part];
  detail::FloatBox whole;
  for (int axis = 0; axis < 3; ++axis) {
    whole.low[axis] = *std::min_element(leaf.low[axis], leaf.low[axis] + kWidth);
    whole.high[axis] = *std::max_element(leaf.high[axis], leaf.high[axis] + kWidth);
  }
  std::vector<detail::PositionPair> found;
  using namespace detail;  // Highway's macros take names without a namespace
  HWY_DYNAMIC_DISPATCH(find_pairs)(levels_, part, whole, found);
  for (const PositionPair& pair : found) {
    const std::uint32_t a = order_[pair.first];
    const std::uint32_t b = order_[pair.second];
    pairs.emplace_back(std::min(a, b), std::max(a, b));
  }
}

}  // namespace vps::bake
#endif
