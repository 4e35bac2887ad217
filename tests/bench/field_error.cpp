// SPDX-License-Identifier: GPL-3.0-or-later
// Compares an asset's fields, as queries read them, with CGAL's distance at points of the narrow band. Prints Markdown.
#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <vector>

#include "formats/mesh/mesh_import.h"
#include "runtime/vps_runtime.h"
#include "tests/support/oracle.h"
#include "tests/support/random.h"

namespace vps::bench {
namespace {

using Point = std::array<double, 3>;

struct Options {
  std::string mesh, asset;
  double scale = 1;
  std::size_t samples = 1000000;
};

// A point in the band and its penetration by CGAL.
struct Place {
  Point point;
  double penetration;
};

// Draws points of the surface, uniform by area.
class SurfacePlaces {
 public:
  explicit SurfacePlaces(const TriangleMesh& mesh) : mesh_(mesh) {
    double sum = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) area_to_.push_back(sum += area(t));
  }
  Point next(test::Random& random) const {
    const double wanted = random.next() * area_to_.back();
    const auto t = std::min(
        static_cast<std::size_t>(std::upper_bound(area_to_.begin(), area_to_.end(), wanted) - area_to_.begin()),
        area_to_.size() - 1);
    double u = random.next();
    double v = random.next();
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    Point p;
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = corner(t, 0)[k] + u * (corner(t, 1)[k] - corner(t, 0)[k]) + v * (corner(t, 2)[k] - corner(t, 0)[k]);
    return p;
  }

 private:
  const Point& corner(std::size_t t, std::size_t i) const { return mesh_.vertices[mesh_.triangles[t][i]]; }
  double area(std::size_t t) const {
    Point e[2];
    for (std::size_t k = 0; k < 3; ++k) {
      e[0][k] = corner(t, 1)[k] - corner(t, 0)[k];
      e[1][k] = corner(t, 2)[k] - corner(t, 0)[k];
    }
    return 0.5 * std::hypot(e[0][1] * e[1][2] - e[0][2] * e[1][1], e[0][2] * e[1][0] - e[0][0] * e[1][2],
                            e[0][0] * e[1][1] - e[0][1] * e[1][0]);
  }
  const TriangleMesh& mesh_;
  std::vector<double> area_to_;
};

// Random points in the band, at least half a voxel's diagonal from its ends, as in the certificate: cells nearer to the
// ends may be clamped.
std::vector<Place> places_in_band(const TriangleMesh& mesh, const AssetInfo& info, std::size_t count) {
  const test::Oracle oracle(mesh);
  const SurfacePlaces surface(mesh);
  const double margin = std::sqrt(0.75) * info.voxel_size;
  const double reach = std::max(info.band_inner, info.band_outer) - margin;
  test::Random random;
  std::vector<Place> places;
  std::vector<Place> tried(1 << 16);
  while (places.size() < count) {
    for (Place& place : tried) {
      place.point = surface.next(random);
      for (double& x : place.point) x += random.between(-reach, reach);
    }
    tbb::parallel_for(std::size_t{0}, tried.size(),
                      [&](std::size_t i) { tried[i].penetration = oracle.penetration(tried[i].point); });
    for (const Place& place : tried) {
      if (place.penetration <= info.band_inner - margin && place.penetration >= margin - info.band_outer) {
        places.push_back(place);
      }
    }
  }
  places.resize(count);
  return places;
}

// Whether the direction to the closest point turns by more than 30 degrees within a voxel: next to edges, tips, creases
// and ridges of the distance.
bool is_at_edge(const test::SoupOracle& surface, const Place& place, double voxel_size) {
  const auto direction = [&](const Point& p) {
    const Point c = surface.closest(p);
    Point d;
    double squared = 0;
    for (std::size_t k = 0; k < 3; ++k) squared += (d[k] = c[k] - p[k]) * d[k];
    for (double& x : d) x /= std::sqrt(squared);
    return d;
  };
  const Point here = direction(place.point);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double step : {-1.0, 1.0}) {
      Point other = place.point;
      other[axis] += step * voxel_size;
      const Point there = direction(other);
      // Across the surface the direction reverses.
      const double cosine = std::abs(here[0] * there[0] + here[1] * there[1] + here[2] * there[2]);
      if (!(cosine > std::cos(M_PI / 6))) return true;
    }
  }
  return false;
}

struct Found {
  double error;
  std::size_t place;
};

std::string row(const char* name, const VoxelmapView& map, const std::vector<Place>& places,
                const test::SoupOracle& surface, double certified) {
  std::vector<Found> found(places.size());
  std::vector<double> wrong_side;
  double squares = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& [p, truth] = places[i];
    const double v =
        penetration(map, {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}, {});
    found[i] = {std::abs(v - truth), i};
    squares += found[i].error * found[i].error;
    if ((v >= 0) != (truth >= 0)) wrong_side.push_back(std::abs(truth));
  }
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.error > b.error; });
  const auto smooth = std::find_if(found.begin(), found.end(), [&](const Found& f) {
    return !is_at_edge(surface, places[f.place], map.voxel_size);
  });
  const auto mm = [](double metres) { return 1e3 * metres; };
  const auto at_rank = [&](double share) {
    return mm(found[static_cast<std::size_t>(share * static_cast<double>(found.size()))].error);
  };
  const auto above = std::count_if(found.begin(), found.end(),
                                   [&](const Found& f) { return f.error > 0.1 * static_cast<double>(map.voxel_size); });
  const double worst_side = wrong_side.empty() ? 0 : *std::max_element(wrong_side.begin(), wrong_side.end());
  return fmt::format("| {} | {:.4f} | {:.4f} | {:.4f} | {:.4f} | {:.4f} | {} | {:.4f} | {}, up to {:.4f} |\n", name,
                     smooth == found.end() ? 0 : mm(smooth->error), mm(found.front().error), at_rank(0.001),
                     at_rank(0.01), mm(std::sqrt(squares / static_cast<double>(found.size()))), above, mm(certified),
                     wrong_side.size(), mm(worst_side));
}

void run(const Options& options) {
  Asset asset;
  if (const Status status = Asset::open(options.asset.c_str(), asset); status != Status::ok) {
    throw std::runtime_error(options.asset + ": " + describe(status));
  }
  const TriangleMesh mesh = import_mesh(options.mesh, {.unit = options.scale});
  const AssetInfo& info = asset.info();
  const std::vector<Place> places = places_in_band(mesh, info, options.samples);
  const test::SoupOracle surface(mesh);
  fmt::print("{} places with {:.3f} <= V <= {:.3f} mm, voxel {:.3f} mm.\n\n", places.size(),
             1e3 * (std::sqrt(0.75) * info.voxel_size - info.band_outer),
             1e3 * (info.band_inner - std::sqrt(0.75) * info.voxel_size), 1e3 * info.voxel_size);
  fmt::print(
      "| field | smooth: max, mm | max, mm | 99.9 %, mm | 99 %, mm | RMS, mm | above 0.1 voxel | certified max, mm | "
      "wrong side, mm away "
      "|\n"
      "|---|---|---|---|---|---|---|---|---|\n");
  VoxelmapView map;
  if (asset.voxelmap(map, Field::scaled) == Status::ok) {
    fmt::print("{}", row("scaled", map, places, surface, info.scaled_error.max));
  }
  if (asset.voxelmap(map, Field::real) == Status::ok) {
    fmt::print("{}", row("real", map, places, surface, info.real_error.max));
  }
}

}  // namespace
}  // namespace vps::bench

int main(int argc, char** argv) {
  try {
    vps::bench::Options options;
    CLI::App app("Errors of an asset's fields in the narrow band");
    app.add_option("MESH", options.mesh)->required();
    app.add_option("ASSET", options.asset)->required();
    app.add_option("--scale", options.scale, "metres per unit of the mesh");
    app.add_option("--samples", options.samples);
    CLI11_PARSE(app, argc, argv);
    vps::bench::run(options);
  } catch (const std::exception& e) {
    fmt::print(stderr, "field_error: {}\n", e.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
