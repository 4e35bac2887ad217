// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Which points of a pointshell lie inside flat faces. Internal to bake.
#pragma once

#include <vector>

#include "bake/stages/surface_blocks.h"

namespace vps::bake {

/// A normal that differs from a triangle's by at most this is that of a flat face. [-]
inline constexpr double kFlatNormal = 5e-4;

/// Points inside a face lie in its plane, have its normal, and are connected. Points near edges are in no face: the
/// field rounds their normals. A face has at least 64 points and is at least about 8 wide, so that a tree that keeps it
/// apart gains more nodes inside than it adds at the rim.
/// @param samples         in a fixed order
/// @param positions       of the samples. [m]
/// @param inward_normals  of the samples, unit, before they are rounded to codes
/// @param reach           points of a face are connected over this distance. [m]
/// @param flat            farthest that a point lies off the plane. [m]
/// @return the number of each point's face, from 1 on; 0: none
[[nodiscard]] std::vector<std::uint32_t> find_faces(const std::vector<Sample*>& samples,
                                                    const std::vector<Vector>& positions,
                                                    const std::vector<Vector>& inward_normals, double reach,
                                                    double flat);

}  // namespace vps::bake
