// SPDX-License-Identifier: GPL-3.0-or-later
// What thin faces (BakeOptions::thin_faces) cost and miss. Two bodies are put together at random places of their
// surfaces, face to face, and the deepest penetration that the points find is compared with that of even shells.
// Prints Markdown, the worst pair first.
#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "cli/lab/assets.h"
#include "cli/lab/pair.h"
#include "cli/lab/random.h"
#include "formats/mesh/mesh_import.h"
#include "runtime/vps_queries.h"

namespace vps::bench {
namespace {

namespace fs = std::filesystem;

// A body, a metre long, with an even and a thinned shell.
struct Body {
  std::string name;
  std::shared_ptr<const Asset> assets[2];
  PointshellView shells[2];
  VoxelmapView maps[2];

  Body(const fs::path& file, std::uint32_t resolution, double thin) : name(file.stem().string()) {
    TriangleMesh mesh = import_mesh(file);
    bake::BakeOptions options;
    options.resolution = resolution;
    const double by = 1 / (resolution * bake::plan_bake(mesh, options).voxel_size);
    for (auto& vertex : mesh.vertices) {
      for (double& x : vertex) x *= by;
    }
    options.repair = bake::Repair::fill;
    for (std::size_t k = 0; k < 2; ++k) {
      options.thin_faces = k == 0 ? 1 : thin;
      assets[k] = lab::bake_in_memory(mesh, options);
      lab::require_ok(assets[k]->pointshell(shells[k]));
      lab::require_ok(assets[k]->voxelmap(maps[k], Field::scaled));
    }
  }
};

Eigen::Vector3d to_eigen(Vec3 v) {
  return {v.x, v.y, v.z};
}

// The first body touches the second one at random places, face to face up to a small angle, and sinks in.
Pose meeting(const Body& first, const Body& second, lab::Random& random) {
  using Turn = Eigen::Quaterniond;
  const auto any = [&](const PointshellView& shell) {
    return std::min(shell.points - 1, static_cast<std::uint32_t>(random.next() * shell.points));
  };
  const PointshellView& shell = first.shells[0];
  const PointshellView& other = second.shells[0];
  const std::uint32_t a = any(shell), b = any(other);
  const Eigen::Vector3d into = to_eigen(point_inward_normal(other, b)).normalized();
  Turn turn = Eigen::AngleAxisd(random.between(0, 2 * std::numbers::pi), into) *
              Turn::FromTwoVectors(to_eigen(point_inward_normal(shell, a)), -into);
  // A third lies flat, a third nearly so, a third anyhow.
  const double tilts[] = {0, 0.02, 1};
  const double tilt = random.between(0, tilts[static_cast<std::size_t>(random.next() * 3)]);
  const std::array<double, 9> axes = random.rotation();
  turn = Eigen::AngleAxisd(tilt, Eigen::Vector3d(axes[0], axes[1], axes[2])) * turn;
  const double depth = random.between(-0.1, 1.5) * second.maps[0].voxel_size;
  Pose pose;
  const Eigen::Matrix3d r = turn.normalized().toRotationMatrix();
  const Eigen::Vector3d t = to_eigen(point_position(other, b)) + depth * into - r * to_eigen(point_position(shell, a));
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.rotation[3 * i + j] = r(i, j);
    pose.translation[i] = t[i];
  }
  return pose;
}

struct Found {
  double one = 0, both = 0;  // deepest penetration, roles as asked and both. [vx]
};

// As in Bullet, a contact is found up to a tenth of a voxel off the surface.
constexpr double kReach = 0.1;

// The deepest penetration of a shell's points, those inside thinned faces left out; without contacts: below -kReach.
double deepest_of(const PointshellView& shell, const VoxelmapView& map, const Pose& pose, bool leaves_faces,
                  Scratch& scratch, std::vector<Contact>& contacts) {
  if (contacts.size() < shell.points) contacts.resize(shell.points);
  QueryOptions options;
  options.contact_distance = static_cast<float>(kReach) * map.voxel_size;
  options.leaves_faces = leaves_faces;
  QueryResult result;
  lab::require_ok(traverse(shell, map, pose, options, scratch, contacts, result));
  double deepest = -2 * kReach;
  for (std::uint32_t i = 0; i < result.contacts; ++i) {
    deepest = std::max(deepest, double{contacts[i].penetration} / map.voxel_size);
  }
  return deepest;
}

Found deepest(const Body& first, const Body& second, std::size_t k, const Pose& pose, Scratch& scratch) {
  static std::vector<Contact> contacts;
  const double one = deepest_of(first.shells[k], second.maps[k], pose, false, scratch, contacts);
  const double there = k == 0 ? one : deepest_of(first.shells[k], second.maps[k], pose, true, scratch, contacts);
  const double back = deepest_of(second.shells[k], first.maps[k], relative_pose(pose, {}), true, scratch, contacts);
  return {one, std::max(there, back)};
}

double quantile(std::vector<double>& values, double part) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Row {
  std::string pair;
  int poses = 0, missed_one = 0, missed = 0;
  std::vector<double> less_one, less;  // penetration that thinned shells do not see. [vx]
};

Row compare(const Body& first, const Body& second, int poses, lab::Random& random, Scratch& scratch) {
  constexpr double kDeepest = 3;
  Row row{fmt::format("{} in {}", first.name, second.name)};
  for (int tries = 0; row.poses < poses && tries < 40 * poses; ++tries) {
    const Pose pose = meeting(first, second, random);
    const Found even = deepest(first, second, 0, pose, scratch);
    if (!(even.both >= 0 && even.both < kDeepest)) continue;
    const Found thin = deepest(first, second, 1, pose, scratch);
    ++row.poses;
    row.missed_one += thin.one < -kReach && even.one >= 0;
    row.missed += thin.both < -kReach && even.one >= 0;
    row.less_one.push_back(std::max(0.0, even.one - thin.one));
    row.less.push_back(std::max(0.0, even.one - thin.both));
  }
  return row;
}

}  // namespace
}  // namespace vps::bench

int main(int argc, char** argv) {
  using namespace vps::bench;
  std::vector<std::filesystem::path> files;
  int poses = 1000;
  std::uint32_t resolution = 100;
  double thin = 4;
  CLI::App app{"Compares thinned shells with even ones on poses of pairs"};
  app.add_option("meshes", files, "Closed meshes; each meets each other and itself")->required();
  app.add_option("--poses", poses, "Of each pair (default 1000)");
  app.add_option("--resolution", resolution, "Voxels along the longest side (default 100)");
  app.add_option("--thin-faces", thin, "See vpsbake (default 4)");
  CLI11_PARSE(app, argc, argv);
  std::vector<Body> bodies;
  fmt::print("| body | points | thinned | file, kB | thinned |\n|---|---|---|---|---|\n");
  for (const auto& file : files) {
    const Body& body = bodies.emplace_back(file, resolution, thin);
    fmt::print("| {} | {} | {} | {:.0f} | {:.0f} |\n", body.name, body.shells[0].points, body.shells[1].points,
               1e-3 * double(body.assets[0]->bytes().size()), 1e-3 * double(body.assets[1]->bytes().size()));
  }
  std::vector<Row> rows;
  vps::lab::Random random;
  vps::Scratch scratch;
  for (const Body& first : bodies) {
    for (const Body& second : bodies) rows.push_back(compare(first, second, poses, random, scratch));
  }
  Row all{"all"};
  for (const Row& row : rows) {
    all.poses += row.poses, all.missed += row.missed, all.missed_one += row.missed_one;
    all.less.insert(all.less.end(), row.less.begin(), row.less.end());
    all.less_one.insert(all.less_one.end(), row.less_one.begin(), row.less_one.end());
  }
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
    return *std::max_element(a.less.begin(), a.less.end()) > *std::max_element(b.less.begin(), b.less.end());
  });
  rows.insert(rows.begin(), std::move(all));
  fmt::print("\n| pair | poses | missed, one role | both | shallower by, one role: 99 % / max, vx | both |\n");
  fmt::print("|---|---|---|---|---|---|\n");
  for (Row& row : rows) {
    fmt::print("| {} | {} | {} | {} | {:.3f} / {:.3f} | {:.3f} / {:.3f} |\n", row.pair, row.poses, row.missed_one,
               row.missed, quantile(row.less_one, 0.99), quantile(row.less_one, 1), quantile(row.less, 0.99),
               quantile(row.less, 1));
  }
  return 0;
}
