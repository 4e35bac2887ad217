// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/hacd.h"

#include <HACD/hacdHACD.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "cli/lab/numbers_file.h"

namespace vps::lab {
namespace {

std::vector<Hull> decompose(const TriangleMesh& mesh, const HacdOptions& options) {
  // Copies, since HACD scales the points in place.
  std::vector<HACD::Vec3<HACD::Real>> points;
  for (const auto& v : mesh.vertices) points.emplace_back(v[0], v[1], v[2]);
  std::vector<HACD::Vec3<long>> triangles;
  for (const auto& t : mesh.triangles) triangles.emplace_back(long{t[0]}, long{t[1]}, long{t[2]});

  HACD::HACD hacd;
  hacd.SetPoints(points.data());
  hacd.SetNPoints(points.size());
  hacd.SetTriangles(triangles.data());
  hacd.SetNTriangles(triangles.size());
  hacd.SetCompacityWeight(options.compacity_weight);
  hacd.SetVolumeWeight(0);
  hacd.SetNClusters(options.hulls);
  hacd.SetNVerticesPerCH(options.vertices_per_hull);
  hacd.SetConcavity(options.concavity);
  hacd.SetAddExtraDistPoints(false);
  hacd.SetAddNeighboursDistPoints(false);
  hacd.SetAddFacesPoints(false);
  if (!hacd.Compute()) throw std::runtime_error("HACD failed");

  std::vector<Hull> hulls;
  for (std::size_t i = 0; i < hacd.GetNClusters(); ++i) {
    std::vector<HACD::Vec3<HACD::Real>> corners(hacd.GetNPointsCH(i));
    std::vector<HACD::Vec3<long>> faces(hacd.GetNTrianglesCH(i));
    hacd.GetCH(i, corners.data(), faces.data());
    Hull& hull = hulls.emplace_back();
    for (const auto& c : corners) hull.push_back({c.X(), c.Y(), c.Z()});
  }
  return hulls;
}

// Checks that the hulls are in the mesh's units again: HACD scales its points.
void check_place(const std::vector<Hull>& hulls, const TriangleMesh& mesh) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double low[2];
    double high[2];
    std::fill_n(low, 2, std::numeric_limits<double>::max());
    std::fill_n(high, 2, -std::numeric_limits<double>::max());
    const auto grow = [&](int which, const std::array<double, 3>& p) {
      low[which] = std::min(low[which], p[axis]);
      high[which] = std::max(high[which], p[axis]);
    };
    for (const auto& v : mesh.vertices) grow(0, v);
    for (const auto& hull : hulls) {
      for (const auto& p : hull) grow(1, p);
    }
    const double tolerance = 0.05 * (high[0] - low[0]);
    if (!(std::abs(low[0] - low[1]) < tolerance && std::abs(high[0] - high[1]) < tolerance)) {
      throw std::runtime_error(fmt::format("HACD's hulls span {} to {} along axis {}, the mesh {} to {}", low[1],
                                           high[1], axis, low[0], high[0]));
    }
  }
}

}  // namespace

std::vector<Hull> hacd_hulls(const TriangleMesh& mesh, const HacdOptions& options,
                             const std::filesystem::path& folder) {
  const double key[] = {double(options.hulls), double(options.vertices_per_hull), options.concavity,
                        options.compacity_weight};
  const std::filesystem::path file = folder.empty() ? folder : cache_file(folder, "hacd", mesh, key);
  // The file has, for each hull, the number of its vertices and then their coordinates.
  if (const auto numbers = read_numbers(file)) {
    std::vector<Hull> hulls;
    for (std::size_t at = 0; at < numbers->size();) {
      const auto count = static_cast<std::size_t>((*numbers)[at++]);
      Hull& hull = hulls.emplace_back();
      for (std::size_t i = 0; i < count; ++i, at += 3) {
        hull.push_back({numbers->at(at), numbers->at(at + 1), numbers->at(at + 2)});
      }
    }
    return hulls;
  }
  if (options.announce) options.announce();
  std::vector<Hull> hulls = decompose(mesh, options);
  check_place(hulls, mesh);
  if (file.empty()) return hulls;
  std::vector<double> numbers;
  for (const Hull& hull : hulls) {
    numbers.push_back(double(hull.size()));
    for (const auto& p : hull) numbers.insert(numbers.end(), p.begin(), p.end());
  }
  write_numbers(file, numbers);
  return hulls;
}

}  // namespace vps::lab
