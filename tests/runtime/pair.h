// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A sphere's shell and a torus' voxelmap.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {

inline Vec3 apply(const Pose& pose, Vec3 v, bool as_direction) {
  float out[3];
  for (int r = 0; r < 3; ++r) {
    const auto* m = pose.rotation + 3 * r;
    out[r] = static_cast<float>(m[0]) * v.x + static_cast<float>(m[1]) * v.y + static_cast<float>(m[2]) * v.z +
             (as_direction ? 0 : static_cast<float>(pose.translation[r]));
  }
  return {out[0], out[1], out[2]};
}

inline bool same_bytes(std::span<const Contact> a, std::span<const Contact> b) {
  return std::ranges::equal(std::as_bytes(a), std::as_bytes(b));
}

struct Pair {
  std::shared_ptr<Asset> map_asset, shell_asset;
  VoxelmapView map;
  PointshellView shell;
  Scratch scratch;
  std::vector<Contact> contacts;

  explicit Pair(Field field = Field::scaled) {
    map_asset = baked(make_torus(0.1, 0.04, 40, 20), all_fields(0.006));
    shell_asset = baked(make_sphere(0.05, 4, {0.01, 0.02, 0.03}), all_fields(0.004));
    EXPECT_EQ(map_asset->voxelmap(map, field), Status::ok);
    EXPECT_EQ(shell_asset->pointshell(shell), Status::ok);
    contacts.resize(shell.points);
  }
};

}  // namespace vps::test
