// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled once per instruction set by Highway, chosen at run time. Results differ between instruction sets, but only
// within the error bound.
#include "bake/stages/triangle_tree.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "bake/morton.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/stages/triangle_tree.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<float, TriangleTree::kWidth> tree_lanes;
using TreeLanes = hn::Vec<decltype(tree_lanes)>;

HWY_INLINE TreeLanes tree_lanes_at(const float* from) {
  return hn::Load(tree_lanes, from);
}

// Squared distances from a node's boxes.
// @return bit n: whether box n is nearer than the root of `least`
HWY_INLINE std::uint32_t box_distances(const TriangleTree::Node& node, const float* point, float least,
                                       float* squared) {
  std::uint32_t nearer = 0;
  for (std::size_t i = 0; i < TriangleTree::kWidth; i += hn::Lanes(tree_lanes)) {
    TreeLanes sum = hn::Zero(tree_lanes);
    for (int axis = 0; axis < 3; ++axis) {
      const TreeLanes p = hn::Set(tree_lanes, point[axis]);
      const TreeLanes beyond =
          hn::Max(hn::Sub(tree_lanes_at(node.low[axis] + i), p), hn::Sub(p, tree_lanes_at(node.high[axis] + i)));
      const TreeLanes outside = hn::Max(beyond, hn::Zero(tree_lanes));
      sum = hn::MulAdd(outside, outside, sum);
    }
    hn::Store(sum, tree_lanes, squared + i);
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(tree_lanes, hn::Lt(sum, hn::Set(tree_lanes, least)), bits);
    nearer |= (bits[0] | std::uint32_t{bits[1]} << 8) << i;
  }
  return nearer;
}

// Squared distances from some of a leaf's triangles: see `squared_distance` in float_distances.cpp.
HWY_INLINE TreeLanes leaf_distances(const TriangleTree::Leaf& leaf, const float* point, std::size_t i) {
  const TreeLanes zero = hn::Zero(tree_lanes);
  const auto value = [&](int n) HWY_ATTR {
    TreeLanes sum = tree_lanes_at(leaf.linear[n][3] + i);
    for (int axis = 2; axis >= 0; --axis) {
      sum = hn::MulAdd(tree_lanes_at(leaf.linear[n][axis] + i), hn::Set(tree_lanes, point[axis]), sum);
    }
    return sum;
  };
  TreeLanes nearest = hn::Set(tree_lanes, std::numeric_limits<float>::infinity());
  TreeLanes farthest_out = hn::Set(tree_lanes, -std::numeric_limits<float>::infinity());
  for (int k = 0; k < 3; ++k) {
    const TreeLanes along = value(1 + k);
    const TreeLanes out = value(4 + k);
    const TreeLanes beyond = hn::Sub(along, hn::Min(hn::Max(along, zero), tree_lanes_at(leaf.length[k] + i)));
    nearest = hn::Min(nearest, hn::MulAdd(beyond, beyond, hn::Mul(out, out)));
    farthest_out = hn::Max(farthest_out, out);
  }
  const TreeLanes height = value(0);
  return hn::MulAdd(height, height, hn::IfThenZeroElse(hn::Lt(farthest_out, zero), nearest));
}

HWY_INLINE float least_of_leaf(const TriangleTree::Leaf& leaf, const float* point) {
  TreeLanes least = hn::Set(tree_lanes, std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < TriangleTree::kWidth; i += hn::Lanes(tree_lanes)) {
    least = hn::Min(least, leaf_distances(leaf, point, i));
  }
  return hn::GetLane(hn::MinOfLanes(tree_lanes, least));
}

// @return the least squared distance, or `least` if that is less
float search(const TriangleTree::Node* nodes, std::uint32_t root, const TriangleTree::Leaf* leaves, const float* point,
             float least) {
  struct Waiting {
    float squared;
    std::uint32_t child;
  };
  // A node leaves at most 15 children waiting, and 2^32 triangles make 8 levels.
  Waiting waiting[8 * TriangleTree::kWidth];
  std::size_t count = 0;
  waiting[count++] = {0, root};
  while (count > 0) {
    const Waiting next = waiting[--count];
    if (next.squared >= least) continue;
    if ((next.child & TriangleTree::kLeaf) != 0) {
      least = std::min(least, least_of_leaf(leaves[next.child - TriangleTree::kLeaf], point));
      continue;
    }
    const TriangleTree::Node& node = nodes[next.child];
    alignas(64) float squared[TriangleTree::kWidth];
    std::uint32_t nearer = box_distances(node, point, least, squared);
    const std::size_t first = count;
    for (; nearer != 0; nearer &= nearer - 1) {
      const auto n = static_cast<std::size_t>(std::countr_zero(nearer));
      // The nearest comes last, to be the next.
      std::size_t at = count++;
      for (; at > first && waiting[at - 1].squared < squared[n]; --at) waiting[at] = waiting[at - 1];
      waiting[at] = {squared[n], node.child[n]};
    }
  }
  return least;
}

// Appends the positions in all leaves of the triangles within a distance.
void find_near(const TriangleTree::Node* nodes, std::uint32_t root, const TriangleTree::Leaf* leaves,
               const float* point, float most, std::vector<std::uint32_t>& found) {
  std::uint32_t waiting[8 * TriangleTree::kWidth];
  std::size_t count = 0;
  waiting[count++] = root;
  while (count > 0) {
    const std::uint32_t next = waiting[--count];
    alignas(64) float squared[TriangleTree::kWidth];
    if ((next & TriangleTree::kLeaf) != 0) {
      const std::size_t number = next - TriangleTree::kLeaf;
      for (std::size_t i = 0; i < TriangleTree::kWidth; i += hn::Lanes(tree_lanes)) {
        hn::Store(leaf_distances(leaves[number], point, i), tree_lanes, squared + i);
      }
      for (std::size_t n = 0; n < TriangleTree::kWidth; ++n) {
        if (squared[n] <= most) found.push_back(static_cast<std::uint32_t>(number * TriangleTree::kWidth + n));
      }
      continue;
    }
    box_distances(nodes[next], point, most, squared);
    for (std::size_t n = 0; n < TriangleTree::kWidth; ++n) {
      if (squared[n] <= most) waiting[count++] = nodes[next].child[n];
    }
  }
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(search);
HWY_EXPORT(find_near);

using Box = Eigen::AlignedBox3f;

// The first triangle fills a leaf that is not full.
TriangleTree::Leaf make_leaf(const Surface& surface, std::span<const std::uint32_t> triangles, const Vector& centre,
                             double reach, Box& box, float& error) {
  TriangleTree::Leaf leaf;
  for (std::size_t n = 0; n < TriangleTree::kWidth; ++n) {
    const std::uint32_t number = triangles[n < triangles.size() ? n : 0];
    const FloatTriangle t = float_triangle(surface, number, centre, 1, reach);
    const FloatTriangle::Linear linear[7] = {t.height,     t.along[0],   t.along[1],  t.along[2],
                                             t.outward[0], t.outward[1], t.outward[2]};
    for (std::size_t i = 0; i < 7; ++i) {
      leaf.linear[i][0][n] = linear[i].a;
      leaf.linear[i][1][n] = linear[i].b;
      leaf.linear[i][2][n] = linear[i].c;
      leaf.linear[i][3][n] = linear[i].d;
    }
    for (std::size_t k = 0; k < 3; ++k) leaf.length[k][n] = t.length[k];
    error = std::max(error, t.error);
    for (int k = 0; k < 3; ++k) box.extend((surface.corner(number, k) - centre).cast<float>().eval());
  }
  return leaf;
}

// Over boxes whose numbers begin at `first`.
TriangleTree::Node make_node(std::span<const Box> boxes, std::uint32_t first, Box& box) {
  TriangleTree::Node node;
  std::fill_n(&node.low[0][0], 3 * TriangleTree::kWidth, std::numeric_limits<float>::infinity());
  std::fill_n(&node.high[0][0], 3 * TriangleTree::kWidth, std::numeric_limits<float>::infinity());
  for (std::size_t n = 0; n < boxes.size(); ++n) {
    for (int axis = 0; axis < 3; ++axis) {
      node.low[axis][n] = boxes[n].min()[axis];
      node.high[axis][n] = boxes[n].max()[axis];
    }
    node.child[n] = first + static_cast<std::uint32_t>(n);
    box.extend(boxes[n]);
  }
  return node;
}

}  // namespace detail

// The errors of distances from triangles are bounded by `float_triangle`. With e and B as there, rounding the point and
// the boxes and the arithmetic of boxes changes distances by less than 10 e B. So a box that is skipped for that holds
// no triangle that is nearer than the least one by more.
TriangleTree::TriangleTree(const Surface& surface, double reach)
    : centre_((surface.bounds_min + surface.bounds_max) / 2) {
  order_ = morton_order(surface, surface.bounds_min, (surface.bounds_max - surface.bounds_min).maxCoeff());
  const double farthest = (surface.bounds_max - surface.bounds_min).maxCoeff() / 2 + reach;
  const auto parts = [](std::size_t count) { return (count + kWidth - 1) / kWidth; };
  const auto part = [](auto all, std::size_t n) {
    return std::span(all).subspan(n * kWidth, std::min(kWidth, all.size() - n * kWidth));
  };
  leaves_.resize(parts(order_.size()));
  std::vector<detail::Box> boxes(leaves_.size());
  std::vector<float> errors(leaves_.size(), 0);
  tbb::parallel_for(std::size_t{0}, leaves_.size(), [&](std::size_t n) {
    leaves_[n] = detail::make_leaf(surface, part(std::span(order_), n), centre_, farthest, boxes[n], errors[n]);
  });
  error_ = static_cast<double>(*std::max_element(errors.begin(), errors.end())) +
           10.0 / (1 << 24) * 2 * std::sqrt(3.0) * farthest;
  // Nodes over the leaves, over those nodes, and so on; the root last.
  for (std::uint32_t first = kLeaf; first == kLeaf || boxes.size() > 1;) {
    std::vector<detail::Box> above(parts(boxes.size()));
    const auto next = static_cast<std::uint32_t>(nodes_.size());
    for (std::size_t n = 0; n < above.size(); ++n) {
      nodes_.push_back(detail::make_node(part(std::span<const detail::Box>(boxes), n),
                                         first + static_cast<std::uint32_t>(n * kWidth), above[n]));
    }
    first = next;
    boxes.swap(above);
  }
}

double TriangleTree::distance(const Vector& point, double at_most) const {
  const Vector at = point - centre_;
  const float place[3] = {static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z())};
  using namespace detail;  // Highway's macros take names without a namespace
  const float least = HWY_DYNAMIC_DISPATCH(search)(nodes_.data(), static_cast<std::uint32_t>(nodes_.size() - 1),
                                                   leaves_.data(), place, static_cast<float>(at_most * at_most));
  return std::min(std::sqrt(static_cast<double>(least)), at_most);
}

// A triangle within reach has a float distance of at most reach + error.
void TriangleTree::find_within(const Vector& point, double reach, std::vector<std::uint32_t>& triangles) const {
  const Vector at = point - centre_;
  const float place[3] = {static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z())};
  const double most = reach + error_;
  const std::size_t first = triangles.size();
  using namespace detail;  // Highway's macros take names without a namespace
  HWY_DYNAMIC_DISPATCH(find_near)
  (nodes_.data(), static_cast<std::uint32_t>(nodes_.size() - 1), leaves_.data(), place,
   static_cast<float>(most * most * (1 + 1e-6)), triangles);
  // A leaf that is not full repeats its first triangle.
  std::size_t kept = first;
  for (std::size_t n = first; n < triangles.size(); ++n) {
    if (triangles[n] < order_.size()) triangles[kept++] = order_[triangles[n]];
  }
  triangles.resize(kept);
}

}  // namespace vps::bake
#endif
