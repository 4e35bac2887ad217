// SPDX-License-Identifier: Zlib
/// @file The innermost loops of traverse: nodes and points of a shell against a field, many at once. Internal.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/fields/place_field.h"
#include "runtime/fields/region_bound.h"

namespace vps::detail {

/// A motion of the shell: each point moves by its own way. In the field's unit.
struct MovingShell {
  Affine ways{};            ///< takes codes of positions to their ways
  float turn = 0;           ///< upper bound of the difference of ways, for each unit of distance
  float near = 0;           ///< contact distance at the end of a way
  bool is_upright = false;  ///< with SolidBelow: only z of the ways counts, and its sign
};

/// One descent of the tree: its input, and its results. Lengths are in the field's unit: voxels for SampledMap, else
/// metres.
struct Descent {
  const PointshellView* shell = nullptr;
  Affine points{};         ///< takes codes of positions to the field
  float unit = 1;          ///< metres in the field's unit
  float radius_scale = 1;  ///< takes codes of radii to the field's unit
  float rounding = 0;      ///< of coordinates in the field
  float contact_distance = 0;
  float slack = 0;                      ///< added to every radius: the field's error and rounding
  const MovingShell* moving = nullptr;  ///< if not null: hits are points that may come within `near` in a motion
  const CodeBound* region = nullptr;    ///< if not null: a bound for the whole shell. Not with `bounds`
  std::uint32_t* queue = nullptr;       ///< entries [begin, end) are nodes whose spheres touch, of one level
  std::uint32_t begin = 0, end = 0;
  std::uint32_t last_node = 0;      ///< nodes from this one on stay in the queue
  std::uint32_t stop = UINT32_MAX;  ///< entries of the queue from this one on stay, too
  float* bounds = nullptr;          ///< if not null: upper bounds of V below the nodes of the queue, entry for entry
  std::uint32_t* flats = nullptr;   ///< if not null: nodes with a hull are not expanded, but written here
  std::uint32_t flat_count = 0;
  bool hits_only = false;           ///< neither sums over hits nor V of other points are asked for
  std::uint32_t* hits = nullptr;    ///< points with V >= -contact_distance, in tree order
  std::uint32_t* leaves = nullptr;  ///< nodes of the hits
  float* penetrations = nullptr;    ///< their V
  float* positions[3] = {};         ///< if not null: their positions, `to_positions` of their codes
  Affine to_positions{};
  std::uint32_t hit_count = 0;
  float deepest = 0;   ///< max V of the points tested; of points beyond the band that are no hits an upper bound of V
  float rejected = 0;  ///< upper bound of V below all rejected spheres
  std::uint32_t nodes_tested = 0, points_tested = 0;
};

/// Listed points: `codes` are the rows of their positions, as floats. Arrays reach kLanePadding beyond `count`.
struct PointList {
  const float* codes[3] = {};
  const std::uint32_t* points = nullptr;
  const std::uint32_t* leaves = nullptr;
  std::uint32_t count = 0;
  const float* ways = nullptr;  ///< if not null: points whose way is longer than `moved` are left out
  float moved = 0;              ///< in the field's unit
};

/// The loops for one kind of field, compiled for the machine's instructions.
struct DescentKernels {
  bool (*touches)(const void* field, Descent& descent, std::uint32_t node);
  std::uint32_t (*touching)(const void* field, Descent& descent, IndexRange nodes, std::uint32_t* out);
  void (*descend)(const void* field, Descent& descent);
  void (*test_list)(const void* field, Descent& descent, const PointList& list);
  void (*measure_ways)(const void* field, const Descent& descent, const PointList& list, float jump, float* ways);
  void (*test_parents)(const void* field, Descent& descent, std::uint32_t first, std::uint32_t last);
};
/// @param kind  index in KernelFields
const DescentKernels& descent_kernels(std::size_t kind) noexcept;

/// A field with its loops, found once for a query. It does not own the field.
class DescentField {
 public:
  template <class Field>
  explicit DescentField(const Field& field) noexcept
      : kernels_(descent_kernels(kernel_kind<Field>())), field_(&field) {}

  /// Whether a node's sphere may touch the field.
  bool touches(Descent& descent, std::uint32_t node) const noexcept { return kernels_.touches(field_, descent, node); }
  /// Writes those of some nodes, in their order, whose spheres may touch the field. Not with a budget.
  /// @param out  room for all of them and kLanePadding more
  /// @return how many there are
  std::uint32_t touching(Descent& descent, IndexRange nodes, std::uint32_t* out) const noexcept {
    return kernels_.touching(field_, descent, nodes, out);
  }
  /// Algorithm 1 of the paper (Sec. 2.3) from the nodes in the queue, breadth first. Afterwards [begin, end) are the
  /// nodes that are left; the nodes before `begin` were expanded.
  void descend(Descent& descent) const noexcept { kernels_.descend(field_, descent); }
  /// Tests listed points. `hits` and `leaves` become those of the list.
  void test_list(Descent& descent, const PointList& list) const noexcept { kernels_.test_list(field_, descent, list); }
  /// Ways by which points can move before they may be hits: docs/internals/bounds.md, "Lists of points".
  /// @param list  all hits of the descent, whose `penetrations` are at hand
  /// @param jump  most by which V may change beyond a point's way, in the field's unit
  void measure_ways(const Descent& descent, const PointList& list, float jump, float* ways) const noexcept {
    kernels_.measure_ways(field_, descent, list, jump, ways);
  }
  /// Tests the points that represent nodes: [first, last) of the queue. `leaves` become those nodes.
  void test_parents(Descent& descent, std::uint32_t first, std::uint32_t last) const noexcept {
    kernels_.test_parents(field_, descent, first, last);
  }

 private:
  const DescentKernels& kernels_;
  const void* field_;
};

}  // namespace vps::detail
