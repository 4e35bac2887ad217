// SPDX-License-Identifier: GPL-3.0-or-later
// Errors of whole queries against an oracle, beside those of convex hulls. Prints Markdown.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <exception>
#include <span>

#include "cli/lab/bullet.h"
#include "cli/lab/hacd.h"
#include "cli/lab/ours.h"
#include "cli/lab/poses.h"
#include "formats/mesh/mesh_import.h"
#include "tests/bench/query_assets.h"
#include "tests/bench/query_report.h"

namespace vps::bench {
namespace {

using namespace lab;

constexpr double kLongestSide = 310 * kVoxelSize;  // [m]
constexpr double kWideBand = 7;                    // [vx]
// Margin of the hulls: Bullet adds those of both bodies to every depth. [m]
constexpr double kHullMargin = 0;
constexpr double kOracleTolerance = 1e-6;  // [m]

// Largest depth that the default band certifies: half a voxel's diagonal less than the band's depth. [m]
const double kBand = (bake::BakeOptions{}.band_inside - std::sqrt(3.0) / 2) * kVoxelSize;
const std::vector<DepthRange> kRanges{{16, -0.0002, 0}, {17, 0, kBand}, {17, kBand, 0.003}};
const std::vector<std::string> kRangeNames{"apart", "in the band", "deeper"};

struct Side {
  std::string name;
  bool has_bounds = false;
  std::vector<PairAnswer> answers;  // per pose
};

struct Body {
  std::string name;
  std::size_t triangles = 0;
  std::size_t hulls = 0;  // of HACD
  AssetInfo asset;        // with the default band
  std::vector<PairPose> poses;
  std::vector<Side> sides;  // the same for all bodies
};

TriangleMesh import_scaled(const std::filesystem::path& path) {
  TriangleMesh mesh = import_mesh(path);
  double longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax_element(mesh.vertices.begin(), mesh.vertices.end(),
                                                 [axis](const auto& a, const auto& b) { return a[axis] < b[axis]; });
    longest = std::max(longest, (*high)[axis] - (*low)[axis]);
  }
  for (auto& v : mesh.vertices) {
    for (double& x : v) x *= kLongestSide / longest;
  }
  return mesh;
}

void ask(Body& body, std::string name, const std::unique_ptr<PairPeer>& peer) {
  Side side{std::move(name), false, {}};
  for (const PairPose& pose : body.poses) side.answers.push_back(peer->query(pose.first_in_second));
  side.has_bounds = std::isfinite(side.answers[0].upper);
  body.sides.push_back(std::move(side));
}

Body measure(const std::filesystem::path& path, const std::filesystem::path& folder) {
  Body body;
  body.name = path.stem().string();
  fmt::print(stderr, "query_accuracy: {}\n", body.name);
  const TriangleMesh mesh = import_scaled(path);
  bake::BakeOptions wide;
  wide.band_inside = kWideBand;
  const auto file = [&](const char* band) { return folder / fmt::format("accuracy_{}_{}.vps.hdf", body.name, band); };
  const auto asset = bake_body(mesh, {}, file("default")).asset;
  const auto wide_asset = bake_body(mesh, wide, file("wide")).asset;
  body.triangles = mesh.triangles.size();
  body.asset = asset->info();
  const TriangleMesh about_centre = centred(mesh, *asset);
  PoseOptions pose_options;
  pose_options.ranges = kRanges;
  pose_options.tolerance = kOracleTolerance;
  body.poses = pair_poses(about_centre, pose_options, folder);

  ask(body, "traverse", our_traverse(asset));
  ask(body, "separation", our_separation(asset));
  ask(body, fmt::format("traverse, band {} vx", kWideBand), our_traverse(wide_asset));
  ask(body, fmt::format("separation, band {} vx", kWideBand), our_separation(wide_asset));
  const std::vector<Hull> hulls = hacd_hulls(mesh, {}, folder);
  body.hulls = hulls.size();
  ask(body, "HACD", bullet_pair(compound_of(hulls, asset->info().centre_of_mass, kHullMargin)));
  ask(body, "hull of 42", bullet_pair(hull_of_42(about_centre, kHullMargin)));
  return body;
}

// --- tables

// Errors of one side for the poses of one range.
struct Errors {
  std::size_t poses = 0;
  std::vector<double> off;     // |reported - oracle's|, where reported. [mm]
  std::vector<double> widths;  // upper - lower. [mm]
  std::size_t held = 0;        // poses whose bounds hold the oracle's value

  void add(double depth, const PairAnswer& told) {
    ++poses;
    if (std::isfinite(told.depth)) off.push_back(1000 * std::abs(told.depth - depth));
    widths.push_back(1000 * (told.upper - told.lower));
    // The true depth lies between the oracle's depth and that plus its tolerance.
    if (told.lower <= depth + kOracleTolerance && depth <= told.upper) ++held;
  }
  [[nodiscard]] std::string errors_cell() const {
    if (off.empty()) return "none told";
    const std::string cell = fmt::format("{} / {} / {}", number(percentile(off, 0.5)), number(percentile(off, 0.99)),
                                         number(percentile(off, 1)));
    return off.size() == poses ? cell : fmt::format("{}; {} of {} told", cell, off.size(), poses);
  }
  [[nodiscard]] std::string bounds_cell() const {
    return fmt::format("{:g} %; {}", 100 * double(held) / double(poses), number(percentile(widths, 0.5)));
  }
};

std::size_t range_of(double depth) {
  return depth < 0 ? 0 : depth < kBand ? 1 : 2;
}

Errors errors_of(std::span<const Body> bodies, std::size_t side, std::size_t range) {
  Errors out;
  for (const Body& body : bodies) {
    for (std::size_t i = 0; i < body.poses.size(); ++i) {
      const double depth = body.poses[i].depth;
      if (range_of(depth) == range) out.add(depth, body.sides[side].answers[i]);
    }
  }
  return out;
}

std::string head_of(const std::string& first, const std::vector<Side>& sides) {
  std::vector<std::string> cells{first, "poses"};
  for (const Side& side : sides) {
    cells.push_back(side.name);
    if (side.has_bounds) cells.emplace_back("bounds hold; width");
  }
  return row(cells) + row(std::vector<std::string>(cells.size(), "---"));
}

std::string row_of(const std::string& name, std::span<const Body> bodies, std::size_t range) {
  const std::vector<Side>& sides = bodies[0].sides;
  std::vector<std::string> cells{name, std::to_string(errors_of(bodies, 0, range).poses)};
  for (std::size_t s = 0; s < sides.size(); ++s) {
    const Errors errors = errors_of(bodies, s, range);
    cells.push_back(errors.errors_cell());
    if (sides[s].has_bounds) cells.push_back(errors.bounds_cell());
  }
  return row(cells);
}

void print_tables(const std::vector<Body>& bodies) {
  fmt::print("Voxel {:g} mm, band certified to a depth of {:.3f} mm. Off the oracle by, median / 99 % / max, mm.\n\n",
             1000 * kVoxelSize, 1000 * kBand);
  fmt::print("| mesh | triangles | points | covering radius, mm | hulls of HACD |\n| --- | --- | --- | --- | --- |\n");
  for (const Body& body : bodies) {
    fmt::print("{}", row({body.name, std::to_string(body.triangles), std::to_string(body.asset.points),
                          number(1000 * body.asset.covering_radius), std::to_string(body.hulls)}));
  }
  fmt::print("\n{}", head_of("all meshes", bodies[0].sides));
  for (std::size_t range = 0; range < kRanges.size(); ++range) {
    fmt::print("{}", row_of(kRangeNames[range], bodies, range));
  }
  for (std::size_t range = 0; range < kRanges.size(); ++range) {
    fmt::print("\n{}", head_of(kRangeNames[range], bodies[0].sides));
    for (const Body& body : bodies) fmt::print("{}", row_of(body.name, std::span(&body, 1), range));
  }
}

// Names the poses whose bounds do not hold, and returns their number. Each is a bug.
std::size_t missed_bounds(const std::vector<Body>& bodies) {
  std::size_t missed = 0;
  for (const Body& body : bodies) {
    for (const Side& side : body.sides) {
      for (std::size_t i = 0; i < body.poses.size(); ++i) {
        Errors one;
        one.add(body.poses[i].depth, side.answers[i]);
        if (one.held == 1) continue;
        ++missed;
        fmt::print(stderr, "query_accuracy: {}, pose {}, {}: {:.4f} mm is not in [{:.4f}, {:.4f}] mm\n", body.name, i,
                   side.name, 1000 * body.poses[i].depth, 1000 * side.answers[i].lower, 1000 * side.answers[i].upper);
      }
    }
  }
  return missed;
}

}  // namespace
}  // namespace vps::bench

int main(int argc, char** argv) {
  std::vector<std::string> meshes;
  std::string work = ".";
  CLI::App app("Accuracy of contact queries, beside convex hulls: a body on a copy of itself");
  app.add_option("meshes", meshes, "Closed manifold meshes without self-intersections, wound outward")->required();
  app.add_option("--work", work, "Folder for assets, and for hulls and poses that the next run finds again");
  CLI11_PARSE(app, argc, argv);
  try {
    std::filesystem::create_directories(work);
    std::vector<vps::bench::Body> bodies;
    for (const std::string& mesh : meshes) bodies.push_back(vps::bench::measure(mesh, work));
    vps::bench::print_tables(bodies);
    return vps::bench::missed_bounds(bodies) == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "query_accuracy: error: {}\n", error.what());
    return 4;
  }
}
