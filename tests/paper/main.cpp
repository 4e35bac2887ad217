// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the paper's experiments and writes the measurements as JSON.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <exception>
#include <fstream>

#include "tests/paper/paper.h"

namespace vps::paper {
namespace {

struct Options {
  std::string mesh;
  double scale = 1;
  std::string work = ".";
  std::string json;
  std::vector<std::string> only;
};

void run(const Options& options) {
  std::filesystem::create_directories(options.work);
  const Balls balls = make_balls(options.work);
  const Bunnies bunnies = make_bunnies(options.mesh, options.scale, options.work);
  const std::vector<Floor> floors = make_floors(options.work);
  const auto wanted = [&](const char* name) {
    return options.only.empty() || std::find(options.only.begin(), options.only.end(), name) != options.only.end();
  };
  nlohmann::json out;
  out["vpsbake"] = VPS_PROJECT_VERSION;
  out["bullet"] = fmt::format("{}.{:02}", btGetVersion() / 100, btGetVersion() % 100);
  if (wanted("ball")) out["ball"] = run_ball(balls, floors);
  if (wanted("bunny")) out["bunny"] = run_bunny(bunnies, floors);
  if (wanted("levels")) out["levels"] = run_levels(bunnies, floors);
  if (wanted("low_rates")) out["low_rates"] = run_low_rates(bunnies, floors);
  if (wanted("stacks")) out["stacks"] = run_stacks(balls, bunnies, floors);
  std::ofstream file(options.json);
  file << out.dump() << '\n';
  file.close();
  if (!file) throw std::runtime_error(options.json + ": cannot be written");
}

}  // namespace
}  // namespace vps::paper

int main(int argc, char** argv) {
  vps::paper::Options options;
  CLI::App app("The experiments of the paper's Sec. 4");
  app.add_option("mesh", options.mesh, "The closed bunny")->required();
  app.add_option("--scale", options.scale, "Metres per unit of the mesh");
  app.add_option("--work", options.work, "Folder for assets, and for hulls that the next run finds again");
  app.add_option("--json", options.json, "File for the numbers")->required();
  app.add_option("--only", options.only, "Of ball, bunny, levels, low_rates, stacks");
  CLI11_PARSE(app, argc, argv);
  try {
    vps::paper::run(options);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "paper_runs: error: {}\n", error.what());
    return 4;
  }
}
