// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A body with flat faces, and grounds of every kind that one may lie on.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "runtime/contacts/find_hits.h"
#include "runtime/contacts/traverse/traverse_query.h"
#include "runtime/fields/linear_part.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace vps::test {

inline constexpr double kBodyVoxel = 0.001;
inline constexpr float kTouching = 0.0003F;

inline std::shared_ptr<Asset> body() {
  bake::BakeOptions options;
  options.voxel_size = kBodyVoxel;
  return baked(make_box({0.06, 0.05, 0.008}), options);
}

inline bake::BakeOptions coarse_options() {
  bake::BakeOptions options;
  options.voxel_size = 2 * kBodyVoxel;
  return options;
}

// Ground of every kind that a face may lie on. Its top is z = 0 near the origin.
struct Grounds {
  HalfSpaceField plane{{0, 0, 1}, 0};
  BoxField box{{0.2F, 0.2F, 0.05F}};      // larger than the face
  BoxField ledge{{0.2F, 0.015F, 0.05F}};  // narrower: the face lies across it
  RevolvedField post{RevolvedField::Profile::cylinder, 0.03F, 0.05F, 0};
  SphereField ball{0.05F};
  VoxelmapView coarse, fine, round, boss;
  std::vector<std::shared_ptr<Asset>> assets;

  Grounds() {
    assets = {ground(make_box({0.12, 0.12, 0.02}), 0.004), ground(make_box({0.09, 0.08, 0.02}), kBodyVoxel),
              ground(make_torus(0.06, 0.03, 60, 30), 0.002), ground(with_boss(), kBodyVoxel)};
    for (const auto& [view, asset] :
         {std::pair{&coarse, &assets[0]}, {&fine, &assets[1]}, {&round, &assets[2]}, {&boss, &assets[3]}}) {
      EXPECT_EQ((*asset)->voxelmap(*view), Status::ok);
    }
  }
  // A disc whose flat top has a small boss in the middle.
  static TriangleMesh with_boss() {
    const auto circle = [](double radius) { return [=](double) { return radius; }; };
    return samples::make_skin(
        {samples::make_ring(60, -0.02, circle(0.09)), samples::make_ring(60, 0.02, circle(0.09)),
         samples::make_ring(60, 0.02, circle(0.004)), samples::make_ring(60, 0.0206, circle(0.003))},
        false);
  }
  static std::shared_ptr<Asset> ground(const TriangleMesh& mesh, double voxel_size) {
    bake::BakeOptions options;
    options.voxel_size = voxel_size;
    options.pointshell = false;
    return baked(mesh, options);
  }
  struct Ground {
    const char* name;
    FieldRef field;
    double top;  // z of its surface in its own frame. [m]
  };
  [[nodiscard]] std::vector<Ground> all() const {
    return {{"plane", plane, 0},  {"box", box, 0.05},     {"ledge", ledge, 0.05},
            {"post", post, 0.05}, {"ball", ball, 0.05},   {"coarse", coarse, 0.02},
            {"fine", fine, 0.02}, {"round", round, 0.03}, {"boss", boss, 0.02}};
  }
};

// The body's lower face `depth` deep in the ground, turned about z and tilted.
inline Pose flat_pose(Random& random, double top, double depth, double tilt) {
  const double c = std::cos(random.between(0, 6.3));
  const double s = std::sqrt(1 - c * c);
  const double axis = random.between(0, 6.3);
  const double tx = tilt * std::cos(axis);
  const double ty = tilt * std::sin(axis);
  Pose pose = pose_at(random.between(-0.01, 0.01), random.between(-0.01, 0.01), top + 0.008 - depth);
  // R = Rx(tx) Ry(ty) Rz
  const double cx = std::cos(tx), sx = std::sin(tx), cy = std::cos(ty), sy = std::sin(ty);
  const double rz[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
  const double ry[9] = {cy, 0, sy, 0, 1, 0, -sy, 0, cy};
  const double rx[9] = {1, 0, 0, 0, cx, -sx, 0, sx, cx};
  const auto times = [](const double(&a)[9], const double(&b)[9], double(&out)[9]) {
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        out[3 * i + k] = 0;
        for (int j = 0; j < 3; ++j) out[3 * i + k] += a[3 * i + j] * b[3 * j + k];
      }
    }
  };
  double tilted[9];
  times(rx, ry, tilted);
  times(tilted, rz, pose.rotation);
  return pose;
}

inline double any_tilt(Random& random) {
  constexpr double kTilts[] = {0, 1e-5, 1e-4, 1e-3, 1e-2, 0.1};
  return kTilts[static_cast<std::size_t>(random.between(0, 5.999))];
}

inline float support(std::span<const Vec3> places, Vec3 along) {
  float most = -1e9F;
  for (const Vec3& p : places) most = std::max(most, detail::dot(p, along));
  return most;
}

class Queries {
 public:
  explicit Queries(const Asset& asset) {
    EXPECT_EQ(asset.pointshell(shell), Status::ok);
    contacts.resize(shell.points);
    // What docs/internals/bounds.md states for places.
    off = 2 * tolerance() + 3 * shell.position_step;
  }
  // And for depths.
  [[nodiscard]] float bent(FieldRef field) const {
    const float rounding = field.visit([](const auto& kind) { return detail::rounding_of(kind); });
    return 2 * tolerance() + 2 * std::max(tolerance(), 2 * rounding);
  }
  // Every point in contact.
  std::span<const Contact> all(FieldRef field, const Pose& pose, float distance) {
    QueryOptions options;
    options.contact_distance = distance;
    QueryResult result;
    EXPECT_EQ(traverse(shell, field, pose, options, scratch, contacts, result), Status::ok);
    return std::span(contacts).first(result.contacts);
  }
  detail::ContactRows hits(FieldRef field, const Pose& pose, ContactCache* cache) {
    QueryOptions options;
    options.contact_distance = kTouching;
    options.cache = cache;
    detail::ContactRows rows;
    EXPECT_EQ(detail::find_hits(shell, field, pose, options, hit_scratch, rows, most), Status::ok);
    return rows;
  }

  [[nodiscard]] float tolerance() const { return static_cast<float>(kHullTolerance) * shell.covering_radius; }

  PointshellView shell;
  float off = 0, most = 0;
  Scratch scratch, hit_scratch;
  std::vector<Contact> contacts;
};

inline Vec3 place_of(const detail::ContactRows& rows, std::uint32_t i) {
  return {rows.position[0][i], rows.position[1][i], rows.position[2][i]};
}

}  // namespace vps::test
