// SPDX-License-Identifier: GPL-3.0-or-later
// Contact queries beside those of Bullet, HACD, GImpact and FCL, with the same bodies and poses in one run. Prints
// Markdown.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <thread>

#include "cli/lab/bullet.h"
#include "cli/lab/fcl.h"
#include "cli/lab/hacd.h"
#include "cli/lab/ours.h"
#include "cli/lab/poses.h"
#include "formats/mesh/mesh_import.h"
#include "tests/bench/query_assets.h"
#include "tests/bench/query_report.h"

namespace vps::bench {
namespace {

using namespace lab;

const std::vector<Target> kTargets{
    {"on a box", "HACD", 0.25},     {"on a box", "hull of 42", 1}, {"on a plane", "HACD", 2},
    {"body on body", "HACD", 0.05}, {"body on body", "FCL", 0.02}, {"distance", "FCL", 0.02},
    {"open and query", "", 60},
};
// GImpact takes tens of milliseconds a query.
constexpr int kSlowSteps = 20;
// Bullet's box is this large because the hull of 42 vertices rolls and GImpact sinks into it. The baked box must fit
// into memory; the baked body stays on it.
constexpr std::array<double, 3> kBoxHalfExtents{1.5, 0.5, 1.5};
constexpr std::array<double, 3> kBakedBoxHalfExtents{0.15, 0.05, 0.15};
// Ratios of point spacing to voxel size: the default, and one that gives the bunny about the paper's 35,000 points.
constexpr double kAlphas[] = {1.4142135623730951, 2.1};

struct Options {
  std::string mesh;
  double scale = 1;
  std::string work = ".";
  std::string json;
  std::string only;  ///< a kind of work; empty: all
  int rounds = 5;

  [[nodiscard]] bool wants(std::string_view of_work) const { return only.empty() || only == of_work; }
};

struct OurAsset {
  std::string name;
  BakedFile file;
};

struct Bodies {
  TriangleMesh mesh;  ///< about the centre of mass
  double lowest = 0;  ///< y. [m]
  std::vector<OurAsset> ours;
  BakedFile box;
  std::vector<std::pair<std::string, BulletShape>> peers;  ///< fast ones
  BulletShape gimpact;
};

std::string thousands(std::uint64_t value) {
  return value < 1000 ? fmt::format("{}", value) : fmt::format("{},{:03}", thousands(value / 1000), value % 1000);
}

Bodies make_bodies(const Options& options) {
  ImportOptions import;
  import.unit = options.scale;
  Bodies out;
  out.mesh = import_mesh(options.mesh, import);
  const std::filesystem::path folder = options.work;
  std::filesystem::create_directories(folder);
  for (const double alpha : kAlphas) {
    bake::BakeOptions bake;
    bake.alpha = alpha;
    const BakedFile file = bake_body(out.mesh, bake, folder / fmt::format("query_{:.2f}.vps.hdf", alpha));
    out.ours.push_back({fmt::format("ours, {} points", thousands(file.asset->info().points)), file});
  }
  out.box = bake_box(kBakedBoxHalfExtents, folder / "query_box.vps.hdf");

  const TriangleMesh as_read = out.mesh;
  const Asset& asset = *out.ours[0].file.asset;
  out.mesh = centred(std::move(out.mesh), asset);
  if (options.only == "distance" || options.only == "open") return out;  // HACD takes minutes
  const std::vector<Hull> hulls = hacd_hulls(as_read, {}, folder);
  for (const auto& v : out.mesh.vertices) out.lowest = std::min(out.lowest, v[1]);
  out.peers.emplace_back("hull of 42", hull_of_42(out.mesh, kPeerMargin));
  out.peers.emplace_back("HACD", compound_of(hulls, asset.info().centre_of_mass, kPeerMargin));
  out.peers.emplace_back("HACD, margin 4 cm", compound_of(hulls, asset.info().centre_of_mass, kBulletMargin));
  out.gimpact = gimpact_of(out.mesh);
  return out;
}

// A query's time is the median of its rounds.
std::vector<double> medians(std::vector<std::vector<double>> rounds_of) {
  std::vector<double> out;
  for (auto& rounds : rounds_of) {
    const auto middle = rounds.begin() + std::ptrdiff_t(rounds.size() / 2);
    std::nth_element(rounds.begin(), middle, rounds.end());
    out.push_back(*middle);
  }
  return out;
}

// --- a body at rest

struct DropSide {
  std::string name;
  BulletShape body;
  Ground ground;
  DropOptions options;
  int rounds = 1;
};

std::vector<DropSide> drop_sides(const Bodies& bodies, const std::string& work, int rounds) {
  const Ground ground = work == "on a box" ? box_ground(kBoxHalfExtents) : plane_ground();
  DropOptions options;
  options.voxel = kVoxelSize;
  options.lowest = bodies.lowest;
  std::vector<DropSide> sides;
  for (const auto& [name, shape] : bodies.peers) sides.push_back({name, shape, ground, options, rounds});
  for (const OurAsset& our : bodies.ours) {
    sides.push_back({our.name, ours_of(our.file.asset), ground, options, rounds});
    if (work != "on a box") continue;
    sides.push_back(
        {our.name + ", box baked", ours_of(our.file.asset), baked_ground(bodies.box.asset), options, rounds});
  }
  options.last_timed = options.first_timed + kSlowSteps;
  sides.push_back({"GImpact", bodies.gimpact, ground, options, 1});
  return sides;
}

// Runs every side in turn in every round. A drop is reproducible to the bit, so that its steps can be compared.
void run_drops(const Bodies& bodies, const std::string& work, int rounds, Report& report) {
  const std::vector<DropSide> sides = drop_sides(bodies, work, rounds);
  std::vector<std::vector<std::vector<double>>> us(sides.size());
  std::vector<DropResult> last(sides.size());
  for (int round = 1; round <= rounds; ++round) {
    fmt::print(stderr, "query_bench: {}: round {} of {}\n", work, round, rounds);
    for (std::size_t s = 0; s < sides.size(); ++s) {
      if (round > sides[s].rounds) continue;
      last[s] = drop(sides[s].body, sides[s].ground, sides[s].options);
      us[s].resize(last[s].microseconds.size());
      for (std::size_t i = 0; i < us[s].size(); ++i) us[s][i].push_back(last[s].microseconds[i]);
    }
  }
  for (std::size_t s = 0; s < sides.size(); ++s) {
    report.add({work,
                sides[s].name,
                medians(std::move(us[s])),
                last[s].contacts,
                {},
                fmt::format("centre {:.1f} mm up, {:.2g} mm/s", 1000 * last[s].height, 1000 * last[s].speed)});
  }
}

// --- a body and its copy

struct PairSide {
  std::string name;
  std::unique_ptr<PairPeer> peer;
  int rounds = 1;
};

// Runs every side in turn in every round, after one round that only warms up.
void run_pairs(const std::string& work, std::vector<PairSide> sides, const std::vector<PairPose>& poses,
               Report& report) {
  int rounds = 0;
  for (const PairSide& side : sides) rounds = std::max(rounds, side.rounds);
  std::vector<std::vector<std::vector<double>>> us(sides.size(), std::vector<std::vector<double>>(poses.size()));
  std::vector<Series> series(sides.size());
  for (int round = 0; round <= rounds; ++round) {
    fmt::print(stderr, "query_bench: {}: round {} of {}\n", work, round, rounds);
    for (std::size_t s = 0; s < sides.size(); ++s) {
      if (round > sides[s].rounds) continue;
      for (std::size_t p = 0; p < poses.size(); ++p) {
        const PairAnswer answer = sides[s].peer->query(poses[p].first_in_second);
        if (round > 0) us[s][p].push_back(answer.microseconds);
        if (round != 1) continue;
        series[s].contacts.push_back(double(answer.contacts));
        if (std::isfinite(answer.depth)) series[s].depth_errors.push_back(std::abs(answer.depth - poses[p].depth));
      }
    }
  }
  for (std::size_t s = 0; s < sides.size(); ++s) {
    series[s].work = work;
    series[s].side = sides[s].name;
    const std::size_t told = series[s].depth_errors.size();
    if (told > 0 && told < poses.size()) series[s].remark = fmt::format("{} poses told a depth", told);
    series[s].microseconds = medians(std::move(us[s]));
    report.add(std::move(series[s]));
  }
}

void run_contacts(const Bodies& bodies, const std::vector<PairPose>& poses, int rounds, Report& report) {
  std::vector<PairSide> sides;
  for (const auto& [name, shape] : bodies.peers) sides.push_back({name, bullet_pair(shape), rounds});
  sides.push_back({"FCL", fcl_collide(bodies.mesh), rounds});
  for (const OurAsset& our : bodies.ours) {
    sides.push_back({our.name, bullet_pair(ours_of(our.file.asset)), rounds});
    sides.push_back({our.name + ", traverse alone", our_traverse(our.file.asset), rounds});
  }
  sides.push_back({"GImpact", bullet_pair(bodies.gimpact), 1});
  run_pairs("body on body", std::move(sides), poses, report);
}

void run_distances(const std::string& work, const Bodies& bodies, const std::vector<PairPose>& poses, int rounds,
                   Report& report) {
  std::vector<PairSide> sides;
  sides.push_back({"FCL", fcl_distance(bodies.mesh), rounds});
  for (const OurAsset& our : bodies.ours) sides.push_back({our.name, our_separation(our.file.asset), rounds});
  run_pairs(work, std::move(sides), poses, report);
}

std::vector<PairPose> those_apart(const std::vector<PairPose>& poses) {
  std::vector<PairPose> apart;
  std::copy_if(poses.begin(), poses.end(), std::back_inserter(apart), [](const PairPose& p) { return p.depth < 0; });
  return apart;
}

// The same, with the bodies moved apart along the line between their centres. FCL's distances are exact.
std::vector<PairPose> moved_apart(const Bodies& bodies, const std::vector<PairPose>& apart) {
  const std::unique_ptr<PairPeer> exact = fcl_distance(bodies.mesh);
  std::vector<PairPose> far;
  for (const double way : {0.001, 0.003, 0.01, 0.03, 0.1}) {
    for (PairPose pose : apart) {
      double(&t)[3] = pose.first_in_second.translation;
      const double from_centre = std::hypot(t[0], t[1], t[2]);
      for (double& x : t) x *= 1 + way / from_centre;
      pose.depth = exact->query(pose.first_in_second).depth;
      far.push_back(pose);
    }
  }
  return far;
}

// --- opening

void run_openings(const Bodies& bodies, const Pose& touching, Report& report) {
  constexpr int kOpenings = 101;
  for (const OurAsset& our : bodies.ours) {
    Series open{"open", our.name, {}, {}, {}, "map and validate"};
    Series query{"open and query", our.name, {}, {}, {}, "and a first query with fresh working memory"};
    for (int i = 0; i <= kOpenings; ++i) {
      const Opening opening = open_once(our.file.path, touching);
      if (i == 0) continue;  // fills the page cache
      open.microseconds.push_back(opening.open_us);
      query.microseconds.push_back(opening.query_us);
    }
    report.add(std::move(open));
    report.add(std::move(query));
  }
}

// --- all of it

void print_head(const Bodies& bodies, const Options& options) {
  double load[1] = {0};
  if (getloadavg(load, 1) == 1 && load[0] > 0.3 * std::thread::hardware_concurrency()) {
    fmt::print("The machine was busy, with a load of {:.1f}: not a clean measurement.\n", load[0]);
  }
  fmt::print("{} triangles, voxel {:g} mm; {} rounds.\n\n", thousands(bodies.mesh.triangles.size()), 1000 * kVoxelSize,
             options.rounds);
  fmt::print("| asset | points | covering radius, mm | voxels | file, bytes |\n| --- | --- | --- | --- | --- |\n");
  const auto asset_row = [](const std::string& name, const BakedFile& file) {
    const AssetInfo& info = file.asset->info();
    fmt::print("| {} | {} | {:.3g} | {} x {} x {} | {} |\n", name, thousands(info.points), 1000 * info.covering_radius,
               info.dims[0], info.dims[1], info.dims[2], thousands(file.asset->directory().file_bytes));
  };
  for (const OurAsset& our : bodies.ours) asset_row("body", our.file);
  asset_row("box", bodies.box);
  fmt::print("\n");
}

void run(const Options& options) {
  const Bodies bodies = make_bodies(options);
  const std::vector<PairPose> poses = pair_poses(bodies.mesh, {}, options.work);
  print_head(bodies, options);

  Report report(kTargets);
  for (const std::string ground : {"on a box", "on a plane"}) {
    if (options.wants(ground)) run_drops(bodies, ground, options.rounds, report);
  }
  if (options.wants("body on body")) run_contacts(bodies, poses, options.rounds, report);
  if (options.wants("distance")) {
    const std::vector<PairPose> apart = those_apart(poses);
    run_distances("distance", bodies, apart, options.rounds, report);
    run_distances("distance, 1 to 100 mm", bodies, moved_apart(bodies, apart), options.rounds, report);
  }
  if (options.wants("open")) run_openings(bodies, poses[poses.size() / 2].first_in_second, report);

  fmt::print("{}\n{}", report.ratio_table(), report.time_table());
  if (!options.json.empty()) {
    std::ofstream out(options.json);
    out << report.json().dump(2) << '\n';
    out.close();
    if (!out) throw std::runtime_error(options.json + ": cannot be written");
  }
}

}  // namespace
}  // namespace vps::bench

int main(int argc, char** argv) {
  vps::bench::Options options;
  CLI::App app("Contact queries beside those of Bullet, HACD, GImpact and FCL");
  app.add_option("mesh", options.mesh, "Closed mesh")->required();
  app.add_option("--scale", options.scale, "Metres per unit of the mesh");
  app.add_option("--work", options.work, "Folder for assets, and for hulls and poses that the next run finds again");
  app.add_option("--rounds", options.rounds, "Measured rounds")->check(CLI::PositiveNumber);
  app.add_option("--only", options.only, "Only this work")
      ->check(CLI::IsMember({"on a box", "on a plane", "body on body", "distance", "open"}));
  app.add_option("--json", options.json, "Also write the numbers there");
  CLI11_PARSE(app, argc, argv);
  try {
    vps::bench::run(options);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "query_bench: error: {}\n", error.what());
    return 4;
  }
}
