// SPDX-License-Identifier: Zlib
/// @file Searches the point of largest V in the point-sphere tree by branch and bound. Internal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "runtime/fields/place_field.h"

namespace vps::detail {

/// One search: its input, and its results. Lengths are in the field's unit: voxels for SampledMap, else metres.
struct DeepestSearch {
  const PointshellView* shell = nullptr;
  Affine points{};                                     ///< takes codes of positions to the field
  float unit = 1;                                      ///< metres in the field's unit
  float radius_scale = 1;                              ///< takes codes of radii to the field's unit
  float slack = 0;                                     ///< added to every radius: rounding
  float margin = 0;                                    ///< spheres with bounds above best - margin are searched
  float floor = std::numeric_limits<float>::lowest();  ///< V up to this are not looked for
  std::uint32_t* stack = nullptr;  ///< room for every node and kLanePadding more; the same for `bounds`
  float* bounds = nullptr;
  std::uint32_t point = 0;  ///< point to start from; then the deepest of the points tested
  float deepest = 0;        ///< its V; `floor` if none is larger
  float best = 0;           ///< largest upper bound of V of the points tested, less the error; `floor` at least
  float rejected = 0;       ///< upper bound of V below the skipped spheres, less the error
  std::uint32_t nodes_tested = 0, points_tested = 0;
};

/// The search for one kind of field, compiled for the machine's instructions.
using DeepestKernel = void (*)(const void* field, DeepestSearch& search);
/// @param kind  index in KernelFields
DeepestKernel deepest_kernel(std::size_t kind) noexcept;

/// Depth first: searches the deepest sphere's children before its siblings.
template <class Field>
void find_deepest(const Field& field, DeepestSearch& search) noexcept {
  deepest_kernel(kernel_kind<Field>())(&field, search);
}

}  // namespace vps::detail
