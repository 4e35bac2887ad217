// SPDX-License-Identifier: Zlib
/// @file The innermost loops of every query: nodes and points of a shell against a field, many at once. Internal.
#pragma once

#include <cstdint>

#include "runtime/fields/place_field.h"

namespace vps::detail {

/// One way down the tree: what it needs, and what it found. Lengths are in the field's unit: voxels for SampledMap,
/// else metres.
struct Descent {
  const PointshellView* shell = nullptr;
  Affine nodes{};   ///< takes sphere centres to the field
  Affine points{};  ///< takes codes of positions to the field
  float unit = 1;   ///< metres in the field's unit
  float contact_distance = 0;
  float slack = 0;                 ///< added to every radius: the field's error, rounding
  std::uint32_t* queue = nullptr;  ///< entries [begin, end) are nodes whose spheres touch, of one level
  std::uint32_t begin = 0, end = 0;
  std::uint32_t last_node = 0;      ///< nodes from this one on are left in the queue
  std::uint32_t stop = UINT32_MAX;  ///< and so are entries of the queue from this one on
  float* bounds = nullptr;          ///< null, or: upper bounds of V below the nodes of the queue, entry for entry
  std::uint32_t* hits = nullptr;    ///< points with V >= -contact_distance, in tree order
  std::uint32_t* leaves = nullptr;  ///< nodes of the hits
  float* penetrations = nullptr;    ///< their V
  std::uint32_t hit_count = 0;
  float deepest = 0;   ///< max V of the points tested
  float rejected = 0;  ///< upper bound of V below all spheres that were rejected
  std::uint32_t nodes_tested = 0, points_tested = 0;
};

/// Whether a node's sphere may touch the field.
template <class Field>
bool touches(const Field& field, Descent& descent, std::uint32_t node) noexcept;

/// Algorithm 1 of the paper (Sec. 2.3) from the nodes in the queue, breadth first. Afterwards [begin, end) are the
/// nodes that were left; what lies before `begin` are the nodes that were gone into.
template <class Field>
void descend(const Field& field, Descent& descent) noexcept;

/// Tests listed points: `codes` are the rows of their positions, as floats, and `hits` and `leaves` become those of the
/// list. Arrays reach kLanePadding beyond `count`.
struct PointList {
  const float* codes[3] = {};
  const std::uint32_t* points = nullptr;
  const std::uint32_t* leaves = nullptr;
  std::uint32_t count = 0;
};
template <class Field>
void test_list(const Field& field, Descent& descent, const PointList& list) noexcept;

/// The same for the points that stand for nodes: [first, last) of the queue. `leaves` become those nodes.
template <class Field>
void test_parents(const Field& field, Descent& descent, std::uint32_t first, std::uint32_t last) noexcept;

}  // namespace vps::detail
