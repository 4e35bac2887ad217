// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bake/stages/exactness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "bake/repair/winding.h"
#include "bake/stages/coarse_layers.h"
#include "tests/support/winding_number.h"

namespace vps::test {

using namespace bake;
namespace {

std::string print(const Vector& p) {
  char text[100];
  std::snprintf(text, sizeof text, "(%.17g, %.17g, %.17g)", p.x(), p.y(), p.z());
  return text;
}

TriangleMesh as_triangles(const Mesh& mesh) {
  TriangleMesh out;
  for (const Vector& v : mesh.vertices) out.vertices.push_back(to_array(v));
  out.triangles = mesh.triangles;
  return out;
}

// Collapsed triangles have no side, and the other triangles give their distance.
TriangleMesh without_collapsed(TriangleMesh mesh) {
  std::erase_if(mesh.triangles, [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  return mesh;
}

double longest(const TriangleMesh& m) {
  const Extent extent = measure_extent(m);
  return (extent.bounds_max - extent.bounds_min).maxCoeff();
}

/// Counts failures and keeps the first for the message.
struct Failures {
  std::size_t count = 0, of = 0;
  std::string first;
  void check(bool good, const auto& describe) {
    ++of;
    if (good) return;
    if (count++ == 0) first = describe();
  }
  void expect_none(const char* what) const { EXPECT_EQ(count, 0U) << what << ": of " << of << ", first " << first; }
};

}  // namespace

Subject::Subject(Truth truth, const Effort& e, TriangleMesh imported)
    : effort(e),
      mesh(without_collapsed(std::move(imported))),
      scene(mesh, longest(mesh) / e.resolution),
      surface(as_triangles(scene.surface)),
      distance(surface),
      size(longest(mesh)) {
  // For the imported mesh, not for the surface after the check.
  if (truth == Truth::side) side.emplace(mesh);
}

std::vector<StoredVoxel> Subject::voxels(std::size_t most) const {
  const std::size_t all = scene.field.set.bricks.size() * kBrickVoxels;
  const std::size_t count = std::min(all, most);
  std::vector<StoredVoxel> chosen;
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t at = n * all / count;
    chosen.push_back({at / kBrickVoxels, static_cast<std::uint32_t>(at % kBrickVoxels)});
  }
  return chosen;
}

Vector Subject::random_point(Random& random) const {
  const Grid& grid = scene.grid;
  Vector p;
  for (int axis = 0; axis < 3; ++axis) {
    const double length = grid.voxel_size * grid.dims[static_cast<std::size_t>(axis)];
    p[axis] = grid.origin[axis] + random.between(0, length);
  }
  return p;
}
bool bounds_solid(const TriangleMesh& mesh, const std::array<double, 3>& point, double size) {
  const double near = 1e-9 * size;
  const Vector p(point[0], point[1], point[2]);
  for (const auto& [i, j, k] : mesh.triangles) {
    const TriangleMesh alone{{mesh.vertices[i], mesh.vertices[j], mesh.vertices[k]}, {{0, 1, 2}}};
    if (exact_distance(alone, point, near) > near) continue;
    Vector corners[3];
    for (std::size_t c = 0; c < 3; ++c) corners[c] = Vector(alone.vertices[c].data());
    const Vector normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized();
    // Just above or below the triangle, near the point but off the triangle's edges.
    const Vector on = p + 0.01 * ((corners[0] + corners[1] + corners[2]) / 3 - p);
    for (const double side : {-1e-7, 1e-7}) {
      if (winding_number(mesh, to_array(on + side * size * normal)) > 0.5) return true;
    }
  }
  return false;
}

void expect_distances(const Subject& s) {
  const BandField& field = s.scene.field;
  Failures failures;
  for (const auto& [brick, voxel] : s.voxels(s.effort.voxels)) {
    const Vector p = s.scene.grid.centre(field.set.bricks[brick], voxel);
    const double tolerance = 1e-9 * s.size;
    const double stored = std::abs(field.value(brick, voxel));
    const bool exact = field.is_exact(brick, voxel);
    const auto wrong = [&](double truth) {
      return exact ? std::abs(stored - truth) > tolerance
                   : truth < field.band_inner - tolerance || stored != field.band_inner;
    };
    double truth = s.distance.distance(to_array(p));
    // If the two results in double differ, rational arithmetic decides.
    if (wrong(truth)) truth = exact_distance(s.surface, to_array(p), std::max(stored, truth) + tolerance);
    failures.check(!wrong(truth), [&] {
      return print(p) + " stored " + std::to_string(stored / s.size) + " true " + std::to_string(truth / s.size) +
             " of the size, off by " + std::to_string((stored - truth) / s.size * 1e9) + "e-9";
    });
  }
  failures.expect_none("distances");
  // Outside the solid, a triangle that the check removed cannot be nearest. The distance to the import is therefore the
  // same, unless a fin is nearer.
  const SoupOracle imported(s.mesh);
  Failures changed;
  for (const auto& [brick, voxel] : s.voxels(s.effort.voxels / 4)) {
    const double stored = field.value(brick, voxel);
    if (!field.is_exact(brick, voxel) || stored > 0) continue;
    const Vector p = s.scene.grid.centre(field.set.bricks[brick], voxel);
    const double truth = imported.distance(to_array(p));
    const double excess = -stored - truth;
    const double tolerance = 1e-9 * s.size;
    const bool good =
        std::abs(excess) <= tolerance || (excess > 0 && !bounds_solid(s.mesh, imported.closest(to_array(p)), s.size));
    changed.check(good, [&] {
      return print(p) + " stored " + std::to_string(stored / s.size) + " true " + std::to_string(truth / s.size);
    });
  }
  changed.expect_none("distances to the import from outside");
}

void expect_signs_of_cgal(const Subject& s) {
  const BandField& field = s.scene.field;
  Failures failures;
  for (const auto& [brick, voxel] : s.voxels(s.effort.voxels)) {
    const Vector p = s.scene.grid.centre(field.set.bricks[brick], voxel);
    const int side = s.side->side(to_array(p));
    const double v = field.value(brick, voxel);
    // The depth of a centre may round to zero; its sign bit still gives the side.
    failures.check(side == 0 || std::signbit(v) == (side < 0),
                   [&] { return print(p) + " V " + std::to_string(v / s.size); });
  }
  failures.expect_none("signs of voxel centres");
  const InsideTest inside(s.scene.surface, s.scene.grid);
  Random random;
  Failures points;
  for (int n = 0; n < 20000; ++n) {
    const Vector p = s.random_point(random);
    const int side = s.side->side(to_array(p));
    points.check(side == 0 || inside.inside(p) == (side > 0), [&] { return print(p); });
  }
  points.expect_none("signs of random points");
}

void expect_signs_of_winding_numbers(const Subject& s) {
  const BandField& field = s.scene.field;
  const double off = 0.02 * s.scene.grid.voxel_size;
  const std::size_t count = s.effort.winding_work / s.mesh.triangles.size();
  Failures failures;
  for (const auto& [brick, voxel] : s.voxels(std::min(count, s.effort.voxels))) {
    const double v = field.value(brick, voxel);
    if (std::abs(v) < off) continue;
    const Vector p = s.scene.grid.centre(field.set.bricks[brick], voxel);
    const double winding = winding_number(s.mesh, to_array(p));
    failures.check((v > 0) == (winding > 0.5), [&] {
      return print(p) + " V " + std::to_string(v / s.size) + " winding number " + std::to_string(winding);
    });
  }
  failures.expect_none("signs of voxel centres");
  const InsideTest inside(s.scene.surface, s.scene.grid);
  Random random;
  Failures points;
  for (std::size_t n = 0; n < std::min<std::size_t>(count, 20000); ++n) {
    const Vector p = s.random_point(random);
    if (s.distance.distance(to_array(p)) < off) continue;
    const double winding = winding_number(s.mesh, to_array(p));
    points.check(inside.inside(p) == (winding > 0.5),
                 [&] { return print(p) + " winding number " + std::to_string(winding); });
  }
  points.expect_none("signs of random points");
}

void expect_no_voxel_missed(const Subject& s) {
  const Grid& grid = s.scene.grid;
  Random random;
  Failures failures;
  for (int n = 0; n < 300; ++n) {
    const auto t = static_cast<std::size_t>(random.next() * static_cast<double>(s.scene.surface.triangles.size()));
    const Surface& surface = s.scene.surface;
    const std::array<std::array<double, 3>, 3> corners = {
        to_array(surface.corner(t, 0)), to_array(surface.corner(t, 1)), to_array(surface.corner(t, 2))};
    for (int m = 0; m < 20; ++m) {
      // A voxel next to a point of the triangle: the triangle often just touches it or just misses it.
      const Vector cell = (point_on(surface, t, random) - grid.origin) / grid.voxel_size;
      std::uint32_t index[3];
      for (int axis = 0; axis < 3; ++axis) {
        index[axis] = static_cast<std::uint32_t>(cell[axis] + random.between(-1, 1));
      }
      if (s.scene.voxels.test(grid, index[0], index[1], index[2])) continue;
      const Vector low = grid.origin + grid.voxel_size * Vector(index[0], index[1], index[2]);
      failures.check(!touches_exactly(corners, to_array(low), grid.voxel_size),
                     [&] { return "triangle " + std::to_string(t) + " voxel at " + print(low); });
    }
  }
  failures.expect_none("missed voxels");
}

void expect_far_bricks_bounded(const Subject& s) {
  const Grid& grid = s.scene.grid;
  const std::vector<std::int16_t> layers = coarse_layers(grid, s.scene.voxels, s.scene.runs, kBrickEdge);
  const InsideTest inside(s.scene.surface, grid);
  Random random;
  Failures bounds;
  Failures sides;
  const std::size_t per_brick = 1 + 2000 / grid.brick_count();
  for (std::uint32_t z = 0; z < grid.brick_dims[2]; ++z) {
    for (std::uint32_t y = 0; y < grid.brick_dims[1]; ++y) {
      for (std::uint32_t x = 0; x < grid.brick_dims[0]; ++x) {
        const std::size_t at = grid.brick_at(x, y, z);
        if (s.scene.field.set.index[at] != kNoBrick) continue;
        const double edge = kBrickEdge * grid.voxel_size;
        const Vector centre = grid.origin + edge * Vector(x + 0.5, y + 0.5, z + 0.5);
        for (std::size_t n = 0; n < per_brick; ++n) {
          const Vector offset =
              edge * Vector(random.between(-0.5, 0.5), random.between(-0.5, 0.5), random.between(-0.5, 0.5));
          const Vector p = centre + offset;
          const double truth = s.distance.distance(to_array(p));
          bounds.check(truth >= (std::abs(layers[at]) * grid.voxel_size - offset.norm()) * (1 - 1e-12),
                       [&] { return print(p) + " layer " + std::to_string(layers[at]); });
          sides.check(layers[at] != 0 && inside.inside(p) == (layers[at] > 0),
                      [&] { return print(p) + " layer " + std::to_string(layers[at]); });
        }
      }
    }
  }
  bounds.expect_none("bounds of coarse layers");
  sides.expect_none("sides of coarse layers");
}

}  // namespace vps::test
