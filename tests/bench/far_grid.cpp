// SPDX-License-Identifier: GPL-3.0-or-later
// What the far grid costs and gives: bytes, time, and errors of V, of directions and of delta beyond the band, each
// beside a query without it. Prints Markdown.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "formats/mesh/mesh_import.h"
#include "runtime/vps_queries.h"
#include "tests/support/oracle.h"
#include "tests/support/poses.h"

namespace vps::bench {
namespace {

using Point = std::array<double, 3>;

Vec3 to_float(const Point& p) {
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Points with V between two values. [vx]
struct Range {
  double low, high;
};
constexpr Range kRanges[] = {{10, 1e9}, {5, 10}, {2.5, 5}, {0, 2.5}, {-5, -2}, {-10, -5}};

struct Errors {
  std::vector<double> value, angle;  // [vx], [degrees]
  int zero = 0;
  void add(const VoxelmapView& map, const test::Oracle& oracle, const Point& p, double truth) {
    const Vec3 at = to_float(p);
    value.push_back(std::abs(static_cast<double>(penetration(map, at, {})) - truth) / map.voxel_size);
    const Vec3 n = outward_normal(map, at);
    const Point exact = oracle.outward_normal(p);
    const double cosine = n.x * exact[0] + n.y * exact[1] + n.z * exact[2];
    if (n.x == 0 && n.y == 0 && n.z == 0) {
      ++zero;
    } else {
      angle.push_back(180 / std::numbers::pi * std::acos(std::clamp(cosine, -1.0, 1.0)));
    }
  }
  [[nodiscard]] std::string row() const {
    const auto count = static_cast<double>(value.size());
    return fmt::format("{:.2f} / {:.2f} / {:.2f} | {:.1f} | {:.1f} % |", quantile(value, 0.5), quantile(value, 0.99),
                       quantile(value, 1), quantile(angle, 0.5), 100 * zero / std::max(count, 1.0));
  }
};

void print_points(const VoxelmapView& map, const VoxelmapView& bare, const test::Oracle& oracle) {
  fmt::print(
      "| V [vx] | V error, with: median / 99 % / max [vx] | angle [degrees] | zero | without: V | angle | zero |\n");
  fmt::print("|---|---|---|---|---|---|---|\n");
  constexpr int kPoints = 2000;
  for (const Range& range : kRanges) {
    test::Random random;
    Errors with;
    Errors without;
    for (int tries = 0; tries < 100 * kPoints && with.value.size() < kPoints; ++tries) {
      Point p;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double pad = 12 * map.voxel_size;
        p[axis] = static_cast<float>(random.between(map.bounds_min[axis] - pad, map.bounds_max[axis] + pad));
      }
      const double guess = penetration(map, to_float(p), {}) / map.voxel_size;
      if (guess < range.low - 4 || guess > range.high + 4) continue;
      const double truth = oracle.penetration(p);
      if (truth < range.low * map.voxel_size || truth >= range.high * map.voxel_size) continue;
      with.add(map, oracle, p, truth);
      without.add(bare, oracle, p, truth);
    }
    if (with.value.empty()) continue;
    fmt::print("| {:g} to {:g} | {} {}\n", range.low, std::min(range.high, 999.0), with.row(), without.row());
  }
}

// Largest V of a shell's points. [m]
double true_delta(const PointshellView& shell, const Pose& pose, const test::Oracle& oracle) {
  double most = -1e9;
  for (std::uint32_t i = 0; i < shell.points; ++i) {
    const Vec3 p = point_position(shell, i);
    const Point at = test::moved(pose, {p.x, p.y, p.z});
    const double distance = oracle.distance(at);
    if (-distance > most || oracle.side(at) > 0) most = std::max(most, oracle.penetration(at));
  }
  return most;
}

// Poses of the body beside itself, a given distance apart by `separation`.
void print_poses(const PointshellView& shell, const VoxelmapView& map, const VoxelmapView& bare,
                 const test::Oracle& oracle, int poses) {
  test::Random random(7);
  Scratch scratch;
  std::vector<double> with;
  std::vector<double> without;
  int zero_with = 0;
  int zero_without = 0;
  std::vector<Contact> contacts(shell.points);
  for (int n = 0; n < poses; ++n) {
    const double wanted = random.between(2, 10) * map.voxel_size;
    Pose pose = test::random_pose(random, 0);
    const std::array<double, 9> way = random.rotation();
    double low = 0;
    double high = double{4 * sphere_radius(shell, 0)};
    for (int i = 0; i < 24; ++i) {
      const double middle = (low + high) / 2;
      for (std::size_t axis = 0; axis < 3; ++axis) pose.translation[axis] = middle * way[axis];
      SeparationResult result;
      if (separation(shell, map, pose, {}, scratch, result) != Status::ok) return;
      (-result.delta > wanted ? high : low) = middle;
    }
    const double truth = true_delta(shell, pose, oracle);
    const auto off = [&](const VoxelmapView& field, std::vector<double>& out, int& zero) {
      QueryResult result;
      if (traverse(shell, field, pose, {}, scratch, contacts, result) != Status::ok) return;
      out.push_back(std::abs(result.delta - truth) / map.voxel_size);
      Pose deep = pose;
      for (double& x : deep.translation) x *= 0.7;
      SeparationResult apart;
      if (separation(shell, field, deep, {}, scratch, apart) != Status::ok) return;
      zero += apart.direction.x == 0 && apart.direction.y == 0 && apart.direction.z == 0 ? 1 : 0;
    };
    off(map, with, zero_with);
    off(bare, without, zero_without);
  }
  fmt::print(
      "\ndelta of {} poses 2 to 10 voxels apart errs by {:.2f} / {:.2f} voxels (median / max); without: {:.2f} / "
      "{:.2f}\n",
      poses, quantile(with, 0.5), quantile(with, 1), quantile(without, 0.5), quantile(without, 1));
  fmt::print("direction of separation in as many deep poses is zero in {}; without: {}\n", zero_with, zero_without);
}

int run(int argc, char** argv) {
  CLI::App app("Measures the far grid of a mesh's asset.");
  std::string file;
  double scale = 1;
  int poses = 30;
  bake::BakeOptions options;
  app.add_option("mesh", file, "mesh file")->required();
  app.add_option("--scale", scale, "factor that makes metres of its coordinates");
  app.add_option("--voxel", options.voxel_size, "voxel size in metres");
  app.add_option("--resolution", options.resolution, "voxels along the longest side");
  app.add_option("--poses", poses, "poses of the body beside itself");
  CLI11_PARSE(app, argc, argv);

  TriangleMesh mesh = import_mesh(file);
  for (auto& v : mesh.vertices) {
    for (double& x : v) x *= scale;
  }
  const bake::BakedAsset baked = bake::bake(mesh, options);
  const std::vector<std::byte> bytes = asset_bytes(baked.info, baked.sections);
  Asset asset;
  VoxelmapView map;
  PointshellView shell;
  if (Asset::open(bytes, asset) != Status::ok || asset.voxelmap(map) != Status::ok ||
      asset.pointshell(shell) != Status::ok) {
    fmt::print("cannot open the asset\n");
    return 1;
  }
  const AssetInfo& info = asset.info();
  const double s = info.voxel_size;
  double seconds = 0;
  double far_seconds = 0;
  for (const bake::StageTime& stage : baked.times) {
    seconds += stage.seconds;
    if (stage.stage == "far_field") far_seconds = stage.seconds;
  }
  const auto far_bytes = static_cast<double>(asset.directory().find(SectionKind::far)->bytes);
  fmt::print("{}: spacing {:g} vx, {:.0f} bytes of {} ({:.1f} %), {:.2f} s of {:.2f} s\n", file, info.far_spacing / s,
             far_bytes, bytes.size(), 100 * far_bytes / static_cast<double>(bytes.size()), far_seconds, seconds);
  fmt::print(
      "steps {:.2f} vx inside, {:.2f} vx outside; error max {:.2f} vx, 99 % {:.2f} vx, RMS {:.2f} vx, bound {:.2f} "
      "vx\n\n",
      info.far_step_inner / s, info.far_step_outer / s, info.far_error.max / s, info.far_error.p99 / s,
      info.far_error.rms / s, info.far_error.bound / s);
  const test::Oracle oracle(bake::closed_mesh(mesh, options).mesh);
  VoxelmapView bare = map;
  bare.far = {};
  print_points(map, bare, oracle);
  print_poses(shell, map, bare, oracle, poses);
  return 0;
}

}  // namespace
}  // namespace vps::bench

int main(int argc, char** argv) {
  return vps::bench::run(argc, argv);
}
