// SPDX-License-Identifier: GPL-3.0-or-later
// Measures what the query's choices cost: width of the tree, width of samples, instruction set, order of traversal.
// One body against itself in the poses of query_bench. Prints Markdown.
#include <fmt/format.h>
#include <hwy/highway.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <functional>

#include "bake/vps_bake.h"
#include "cli/lab/ours.h"
#include "cli/lab/pair.h"
#include "cli/lab/poses.h"
#include "formats/mesh/mesh_import.h"
#include "runtime/vps_queries.h"
#include "tests/bench/query_assets.h"

namespace vps::bench {
namespace {

using namespace lab;

struct Options {
  std::string mesh;
  double scale = 1;
  std::string work = ".";
  int rounds = 5;
};

struct Side {
  std::string name;
  std::shared_ptr<const Asset> asset;
  Field field = Field::scaled;
  std::int64_t target = 0;  ///< of Highway; 0: the best
  bool separation = false;
  std::vector<std::vector<double>> microseconds{};  ///< [round][pose]
  double nodes = 0, points = 0;                     ///< tested, mean
};

void run_round(Side& side, const std::vector<PairPose>& poses) {
  VoxelmapView map;
  PointshellView shell;
  if (side.asset->voxelmap(map, side.field) != Status::ok || side.asset->pointshell(shell) != Status::ok) {
    throw std::runtime_error(side.name + ": a part is missing");
  }
  if (side.target != 0) hwy::SetSupportedTargetsForTest(side.target);
  Scratch scratch;
  std::vector<Contact> contacts(shell.points);
  std::vector<double> times;
  double nodes = 0;
  double points = 0;
  for (const PairPose& pair : poses) {
    const Pose pose = in_asset_frame(*side.asset, pair.first_in_second);
    QueryResult result;
    SeparationResult apart;
    const auto begin = Clock::now();
    const Status status = side.separation ? separation(shell, map, pose, {}, scratch, apart)
                                          : traverse(shell, map, pose, {}, scratch, contacts, result);
    times.push_back(microseconds_since(begin));
    if (status != Status::ok) throw std::runtime_error(describe(status));
    nodes += side.separation ? apart.nodes_tested : result.nodes_tested;
    points += side.separation ? apart.points_tested : result.points_tested;
  }
  if (side.target != 0) hwy::SetSupportedTargetsForTest(0);
  side.microseconds.push_back(std::move(times));
  side.nodes = nodes / static_cast<double>(poses.size());
  side.points = points / static_cast<double>(poses.size());
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Runs every side in turn in every round. A pose's time is the median of its rounds. The first round warms up.
void run_table(const std::string& title, std::vector<Side>& sides, const std::vector<PairPose>& poses, int rounds) {
  for (int round = 0; round <= rounds; ++round) {
    for (Side& side : sides) {
      run_round(side, poses);
      if (round == 0) side.microseconds.clear();
    }
  }
  fmt::print(
      "| {} | points | file, bytes | median, us | 99 %, us | / first | spheres tested | points tested |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- |\n",
      title);
  double first = 0;
  for (const Side& side : sides) {
    std::vector<double> times;
    for (std::size_t pose = 0; pose < poses.size(); ++pose) {
      std::vector<double> of_pose;
      for (const auto& round : side.microseconds) of_pose.push_back(round[pose]);
      times.push_back(median(of_pose));
    }
    const double middle = median(times);
    if (first == 0) first = middle;
    std::sort(times.begin(), times.end());
    fmt::print("| {} | {} | {} | {:.1f} | {:.1f} | {:.2f} | {:.0f} | {:.0f} |\n", side.name, side.asset->info().points,
               side.asset->directory().file_bytes, middle, times[times.size() * 99 / 100], middle / first, side.nodes,
               side.points);
  }
  fmt::print("\n");
}

void run(const Options& options) {
  ImportOptions import;
  import.unit = options.scale;
  const TriangleMesh mesh = import_mesh(options.mesh, import);
  const std::filesystem::path folder = options.work;
  std::filesystem::create_directories(folder);
  bake::BakeOptions usual;
  usual.alpha = 2.1;  // about the paper's 35,000 points
  const auto side = [&](const std::string& name, const bake::BakeOptions& how) {
    return Side{name, bake_body(mesh, how, folder / "kernel_sweep.vps.hdf").asset};
  };
  std::vector<Side> widths;
  for (const std::uint32_t k : {14U, 2U, 4U, 6U, 8U, 10U, 12U, 16U, 20U, 24U, 32U}) {
    bake::BakeOptions how = usual;
    how.branching = k;
    widths.push_back(side(fmt::format("K = {}", k), how));
  }
  std::vector<Side> fields;
  bake::BakeOptions all = usual;
  all.layers = all.real = true;
  bake::BakeOptions wide = usual;
  wide.precision = 6;
  fields.push_back(side("scaled, 8 bits", usual));
  fields.push_back(side("scaled, 16 bits", wide));
  fields.push_back(side("real, one point at a time", all));
  fields.back().field = Field::real;
  fields.push_back(side("layers, one point at a time", all));
  fields.back().field = Field::layers;
  std::vector<Side> targets;
  for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
    const std::int64_t target = left & -left;
    targets.push_back(side(hwy::TargetName(target), usual));
    targets.back().target = target;
  }
  std::vector<Side> ways;
  ways.push_back(side("breadth first, all contacts", usual));
  ways.push_back(side("best first, the deepest point alone", usual));
  ways.back().separation = true;

  const std::vector<PairPose> poses = pair_poses(centred(mesh, *widths[0].asset), {}, options.work);
  run_table("children of a node, points of a leaf", widths, poses, options.rounds);
  run_table("field", fields, poses, options.rounds);
  run_table("instruction set", targets, poses, options.rounds);
  run_table("way through the tree", ways, poses, options.rounds);
}

}  // namespace
}  // namespace vps::bench

int main(int argc, char** argv) {
  vps::bench::Options options;
  CLI::App app("What the query's choices cost");
  app.add_option("mesh", options.mesh, "Closed mesh")->required();
  app.add_option("--scale", options.scale, "Metres per unit of the mesh");
  app.add_option("--work", options.work, "Folder for assets, and for poses that the next run finds again");
  app.add_option("--rounds", options.rounds, "Measured rounds")->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    vps::bench::run(options);
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    fmt::print(stderr, "kernel_sweep: error: {}\n", error.what());
    return EXIT_FAILURE;
  }
}
