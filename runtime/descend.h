// SPDX-License-Identifier: Zlib
/// @file The innermost loops of every query: nodes and points of a shell against a field, many at once. Internal.
#pragma once

#include <cstdint>

#include "runtime/vps_runtime.h"

namespace vps::detail {

/// Rows of lanes that a buffer for `Descent` must have beyond its last entry.
inline constexpr std::uint32_t kLanePadding = 16;

/// p_field = rotation * p + translation, in the field's unit of length.
struct Affine {
  float rotation[9];  ///< row-major, with the unit's scale
  float translation[3];
};

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

/// A `scaled` field in voxels: point (0,0,0) is the centre of voxel (0,0,0).
struct SampledMap {
  const std::int32_t* roots = nullptr;
  const std::int32_t* nodes = nullptr;
  const void* values = nullptr;
  const std::int16_t* coarse_layers = nullptr;
  std::int32_t root_dims[2] = {};                ///< x, y
  std::int32_t brick_dims[2] = {};               ///< x, y
  float top[3] = {};                             ///< the last voxel's centre. [vx]
  float bounds_min[3] = {}, bounds_max[3] = {};  ///< of the mesh. [vx]
  float band_inner = 0, band_outer = 0;          ///< [vx]
  float step = 0;                                ///< lambda; bricks of level 1 have twice that. [vx]
};

struct SampledMap8 : SampledMap {};   ///< samples of 8 bits
struct SampledMap16 : SampledMap {};  ///< samples of 16 bits

/// Fields that are looked up one point after the other.
struct PlainMap {
  const VoxelmapView* map = nullptr;
  const float* rotation = nullptr;  ///< of the shell's normals, row-major
};

/// The solid is z <= 0: `Affine` takes the shell there.
struct SolidBelow {};

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
