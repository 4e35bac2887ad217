// SPDX-License-Identifier: GPL-3.0-or-later
// Weight::per_patch against exact integrals. Below a plane V is the depth, as the pressure in water: the force is the
// volume below it, upward (Archimedes).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "formats/mesh/mesh_import.h"
#include "runtime/vps_contacts.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

using Point = std::array<double, 3>;
using Six = std::array<double, 6>;  // force, torque

constexpr double kVoxel = 0.0005;
const Point kHalf = {0.01, 0.012, 0.014};

double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Point minus(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point unit(const Point& a) {
  const double size = std::sqrt(dot(a, a));
  return {a[0] / size, a[1] / size, a[2] / size};
}

struct Body {
  TriangleMesh mesh;
  std::shared_ptr<Asset> asset;
  PointshellView shell;
  VoxelmapView map;
  Scratch scratch;
  std::vector<Contact> contacts;

  Body(const TriangleMesh& the_mesh, double alpha) : mesh(the_mesh) {
    bake::BakeOptions options;
    options.voxel_size = kVoxel;
    options.alpha = alpha;
    asset = baked(mesh, options);
    EXPECT_EQ(asset->pointshell(shell), Status::ok);
    EXPECT_EQ(asset->voxelmap(map), Status::ok);
    contacts.resize(shell.points + shell.facets);
  }
  QueryResult query(FieldRef field, const Pose& pose, const QueryOptions& options) {
    QueryResult result;
    EXPECT_EQ(traverse(shell, field, pose, options, scratch, contacts, result), Status::ok);
    return result;
  }
};

QueryOptions weighed(Weight weight) {
  QueryOptions options;
  options.weight = weight;
  return options;
}

Six six(const QueryResult& r) {
  return {r.force[0], r.force[1], r.force[2], r.torque[0], r.torque[1], r.torque[2]};
}

double force_off(const QueryResult& result, const Point& exact) {
  const Point f = {result.force[0], result.force[1], result.force[2]};
  const Point off = minus(f, exact);
  return std::sqrt(dot(off, off) / dot(exact, exact));
}

// The ground below a plane that a body touches with its lowest corner `depth` deep. `up` is in the body's frame.
HalfSpaceField ground(const TriangleMesh& mesh, const Point& up, double depth) {
  double low = 1e9;
  for (const Point& p : mesh.vertices) low = std::min(low, dot(up, p));
  return {{float(up[0]), float(up[1]), float(up[2])}, float(low + depth)};
}

// Volume of a mesh below a plane: of the tetrahedra between its triangles and a point of the plane.
double volume_below(const TriangleMesh& mesh, const HalfSpaceField& field) {
  const Point up = {field.outward_normal.x, field.outward_normal.y, field.outward_normal.z};
  double volume = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Point corners[3] = {mesh.vertices[i], mesh.vertices[j], mesh.vertices[k]};
    std::vector<Point> below;
    for (std::size_t c = 0; c < 3; ++c) {
      const double here = dot(up, corners[c]) - double(field.offset);
      const double next = dot(up, corners[(c + 1) % 3]) - double(field.offset);
      if (here < 0) below.push_back(corners[c]);
      if ((here < 0) == (next < 0)) continue;
      Point p = minus(corners[(c + 1) % 3], corners[c]);
      for (std::size_t axis = 0; axis < 3; ++axis) p[axis] = corners[c][axis] + here / (here - next) * p[axis];
      below.push_back(p);
    }
    for (Point& p : below) {
      for (std::size_t axis = 0; axis < 3; ++axis) p[axis] -= double(field.offset) * up[axis];
    }
    for (std::size_t c = 2; c < below.size(); ++c) volume += dot(below[0], cross(below[c - 1], below[c])) / 6;
  }
  return volume;
}

Point times(double size, const Point& up) {
  return {size * up[0], size * up[1], size * up[2]};
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

// Corners, edges and faces of a box with as many points as the voxels and alpha give.
TEST(WrenchOfPatches, CornersEdgesAndFacesOfABoxHaveTheirExactForces) {
  const double h = 0.5 * kVoxel;
  for (const double alpha : {0.7, 1.4142135623730951, 4.0}) {
    Body box(make_box(kHalf), alpha);
    ASSERT_GT(box.shell.facets, 0U);
    const struct {
      Point up;
      double volume, within;
    } kCases[] = {
        {{0, 0, 1}, 4 * h * kHalf[0] * kHalf[1], 0.005},
        {unit({0, 1, 1}), 2 * h * h * kHalf[0], 0.2},  // rows of points beside the edge enter at the same time
        {unit({1, 1, 1}), std::sqrt(3.0) / 2 * h * h * h, 0.08}};
    for (const auto& [up, volume, within] : kCases) {
      const HalfSpaceField field = ground(box.mesh, up, h);
      EXPECT_NEAR(volume_below(box.mesh, field), volume, 1e-3 * volume);
      EXPECT_LT(force_off(box.query(field, {}, weighed(Weight::per_patch)), times(volume, up)), within)
          << alpha << " " << up[0];
    }
  }
}

TEST(WrenchOfPatches, ASphereHasNoFacetsAndTheForceOfItsAreas) {
  Body ball(make_sphere(0.02, 5), 1.4142135623730951);
  EXPECT_EQ(ball.shell.facets, 0U);
  const HalfSpaceField field = ground(ball.mesh, {0, 0, 1}, 4 * kVoxel);
  const QueryResult by_patch = ball.query(field, {}, weighed(Weight::per_patch));
  EXPECT_EQ(six(by_patch), six(ball.query(field, {}, weighed(Weight::per_area))));
  EXPECT_LT(force_off(by_patch, {0, 0, volume_below(ball.mesh, field)}), 0.02);
}

// The medians that docs/internals/benchmarks/accuracy.md names, with fewer poses.
TEST(WrenchOfPatches, ShallowContactsOfCornersAndEdgesAreWithinFivePercentInTheMedian) {
  const TriangleMesh gear = import_mesh(std::string(VPS_SAMPLE_MESHES) + "/gear.obj");
  for (const TriangleMesh& mesh : {make_box(kHalf), gear}) {
    for (const double alpha : {0.7, 1.4142135623730951, 4.0}) {
      Body body(mesh, alpha);
      Random random;
      std::vector<double> by_patch[2];
      std::vector<double> by_area[2];
      for (int i = 0; i < 60; ++i) {
        for (std::size_t on_edge = 0; on_edge < 2; ++on_edge) {
          const std::array<double, 9> r = random.rotation();
          const Point up = unit({on_edge == 1 ? 0 : r[6], r[7], r[8]});
          const HalfSpaceField field = ground(body.mesh, up, random.between(0.05, 1) * kVoxel);
          const Point exact = times(volume_below(body.mesh, field), up);
          by_patch[on_edge].push_back(force_off(body.query(field, {}, weighed(Weight::per_patch)), exact));
          by_area[on_edge].push_back(force_off(body.query(field, {}, weighed(Weight::per_area)), exact));
        }
      }
      for (std::size_t on_edge = 0; on_edge < 2; ++on_edge) {
        EXPECT_LT(median(by_patch[on_edge]), alpha < 4 ? 0.05 : 0.1) << alpha;
        EXPECT_GT(median(by_area[on_edge]), 0.3) << alpha;
      }
    }
  }
}

TEST(WrenchOfPatches, ContactsSumToTheForceAndTorque) {
  Body box(make_box(kHalf), 1.4142135623730951);
  Random random;
  ContactCache cache;
  for (int i = 0; i < 40; ++i) {
    const std::array<double, 9> r = random.rotation();
    const HalfSpaceField field = ground(box.mesh, {r[6], r[7], r[8]}, random.between(0.05, 2) * kVoxel);
    const QueryResult result = box.query(field, {}, weighed(Weight::per_patch));
    const std::span<const Contact> contacts(box.contacts.data(), result.contacts);
    Wrench sum;
    const float* const c = box.shell.centre_of_mass;
    ASSERT_EQ(penalty_wrench(contacts, {1, 0}, {{c[0], c[1], c[2]}, {}, {}}, sum), Status::ok);
    const double size = std::hypot(result.force[0], result.force[1], result.force[2]);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(sum.force[axis], result.force[axis], 1e-5 * size);
      EXPECT_NEAR(sum.torque[axis], result.torque[axis], 1e-5 * size * 0.02);
    }
    for (const Contact& contact : contacts) {
      // V at the centre of pressure, which lies on the surface.
      EXPECT_NEAR(contact.penetration, penetration(field, contact.position), 0.02 * kVoxel);
      EXPECT_GE(contact.penetration, 0);
    }
    // Neither a cache nor segments change the sums.
    QueryOptions cached = weighed(Weight::per_patch);
    cached.cache = &cache;
    EXPECT_EQ(six(box.query(field, {}, cached)), six(result));
    EXPECT_EQ(six(box.query(field, {}, cached)), six(result));
    QueryOptions segmented = weighed(Weight::per_patch);
    segmented.segment_level = 3;
    const QueryResult of_segments = box.query(field, {}, segmented);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(of_segments.force[axis], result.force[axis], 1e-5 * size);
    for (std::uint32_t k = 0; k < of_segments.contacts; ++k) EXPECT_GE(box.contacts[k].penetration, 0);
  }
}

TEST(WrenchOfPatches, FacetsChangeNoOtherWeight) {
  Body box(make_box(kHalf), 1.4142135623730951);
  PointshellView without = box.shell;
  without.facets = 0;
  std::vector<Contact> contacts(box.shell.points);
  Random random;
  for (int i = 0; i < 20; ++i) {
    const std::array<double, 9> r = random.rotation();
    const HalfSpaceField field = ground(box.mesh, {r[6], r[7], r[8]}, random.between(0.05, 2) * kVoxel);
    for (const Weight weight : {Weight::per_point, Weight::per_area}) {
      QueryOptions options = weighed(weight);
      options.contact_distance = static_cast<float>(i % 2 * kVoxel);
      const QueryResult result = box.query(field, {}, options);
      QueryResult other;
      ASSERT_EQ(traverse(without, field, {}, options, box.scratch, contacts, other), Status::ok);
      EXPECT_EQ(six(result), six(other));
      ASSERT_EQ(result.contacts, other.contacts);
      for (std::uint32_t k = 0; k < result.contacts; ++k) {
        EXPECT_EQ(box.contacts[k].point, contacts[k].point);
        EXPECT_EQ(box.contacts[k].area, contacts[k].area);
      }
    }
  }
}

// A jump of the force would not get smaller with the steps.
TEST(WrenchOfPatches, ForceIsContinuousAlongATrajectory) {
  Body box(make_box(kHalf), 4);
  Body slab(make_box({0.02, 0.02, 0.01}), 4);
  const auto largest_step = [&](int steps) {
    double largest = 0;
    Six before{};
    for (int i = 0; i <= steps; ++i) {
      // Down, and turning from a corner over an edge to a face.
      const double t = double(i) / steps;
      const double a = 0.6 * (1 - t);
      const double b = 0.3 * (0.5 - t);
      const Pose pose{{std::cos(b), std::sin(b) * std::sin(a), std::sin(b) * std::cos(a), 0, std::cos(a), -std::sin(a),
                       -std::sin(b), std::cos(b) * std::sin(a), std::cos(b) * std::cos(a)},
                      {0.0003 * t, 0, 0}};
      double low = 1e9;
      for (const Point& p : box.mesh.vertices) low = std::min(low, moved(pose, p)[2]);
      Pose placed = pose;
      placed.translation[2] = 0.01 - low - kVoxel * t;
      const Six now = six(box.query(slab.map, placed, weighed(Weight::per_patch)));
      for (std::size_t k = 0; k < 3 && i > 0; ++k) largest = std::max(largest, std::abs(now[k] - before[k]));
      before = now;
    }
    return largest;
  };
  const double coarse = largest_step(1000);
  EXPECT_GT(coarse, 0);
  EXPECT_LT(largest_step(4000), 0.3 * coarse);
}

// Each flat facet of a box is its part of the point's area.
TEST(WrenchOfPatches, FacetsHaveTheAreasOfTheirPoints) {
  const Body box(make_box(kHalf), 1.4142135623730951);
  std::map<std::uint32_t, double> areas;
  for (std::uint32_t i = 0; i < box.shell.facets; ++i) {
    const double step = double(box.shell.covering_radius / kFacetSteps);
    Point corners[4];
    for (std::size_t k = 0; k < 12; ++k) corners[k / 3][k % 3] = step * box.shell.facet_corners[12 * i + k];
    const Point twice = cross(minus(corners[2], corners[0]), minus(corners[3], corners[1]));
    areas[box.shell.facet_points[i]] += std::sqrt(dot(twice, twice)) / 2;
  }
  EXPECT_GT(areas.size(), 100U);
  for (const auto& [point, area] : areas) {
    const double exact = double(point_area(box.shell, point));
    EXPECT_NEAR(area, exact, 0.05 * exact) << point;
  }
}

}  // namespace
}  // namespace vps::test
