// SPDX-License-Identifier: GPL-3.0-or-later
// Searches the worst case of every promise on meshes with many options. Prints one JSON object per line and body;
// names broken promises on stderr, and exits with 1 if there are any.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "formats/mesh/mesh_import.h"
#include "tests/trust/promises.h"

namespace {

using namespace vps;
using namespace vps::test;

struct Options {
  std::string name;
  bake::BakeOptions bake;
};

bake::BakeOptions everything(std::uint32_t resolution) {
  bake::BakeOptions options;
  options.resolution = resolution;
  options.layers = options.scaled = options.real = true;
  return options;
}

// Each setting at its ends, the others as they are by default.
std::vector<Options> all_options(std::uint32_t resolution) {
  std::vector<Options> all;
  const auto add = [&](const char* name, auto change) {
    all.push_back({name, everything(resolution)});
    change(all.back().bake);
  };
  add("default", [](auto&) {});
  add("wide bands", [](auto& o) { o.band_inside = o.band_outside = 8; });
  add("narrow bands", [](auto& o) { o.band_inside = o.band_outside = 2; });
  add("unequal bands, thin faces", [](auto& o) {
    o.band_inside = 2;
    o.band_outside = 6;
    o.thin_faces = 4;
    o.alpha = 0.7;
  });
  add("field error 1, alpha 4", [](auto& o) {
    o.field_error = 1;
    o.alpha = 4;
    o.band_inside = 6;
  });
  add("field error 0.01, branching 2", [](auto& o) {
    o.field_error = 0.01;
    o.branching = 2;
  });
  return all;
}

nlohmann::ordered_json describe(const Promise& promise) {
  return {{"name", promise.name},
          {"says", promise.says},
          {"most", most_of(promise.measure)},
          {"certified", promise.certified}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Searches the worst case of every promise");
  std::vector<std::string> meshes;
  std::string only;
  std::uint32_t resolution = 40;
  std::size_t most_options = 99;
  double seconds = 1e9;
  bool list = false;
  bool prove_bound = false;
  lab::ClimbOptions climb;
  app.add_option("meshes", meshes);
  app.add_option("--resolution", resolution);
  app.add_option("--options", most_options, "how many of the settings");
  app.add_option("--only", only, "the promises whose names begin so");
  app.add_option("--starts", climb.starts);
  app.add_option("--climbs", climb.climbs);
  app.add_option("--steps", climb.steps);
  app.add_option("--seed", climb.seed);
  app.add_option("--seconds", seconds, "no body is begun afterwards");
  app.add_flag("--prove-bound", prove_bound, "bodies whose bounds are proven");
  app.add_flag("--list", list, "print the promises");
  CLI11_PARSE(app, argc, argv);
  if (list) {
    for (const Promise& promise : promises()) fmt::print("{}\n", describe(promise).dump());
    return 0;
  }
  const auto begin = std::chrono::steady_clock::now();
  const auto is_over = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() > seconds;
  };
  int broken = 0;
  std::vector<Options> settings = all_options(resolution);
  settings.resize(std::min(most_options, settings.size()));
  for (Options& options : settings) options.bake.prove_bound = prove_bound;
  // All bodies are attacked with the first setting before one is with the second.
  for (const Options& options : settings) {
    for (const std::string& file : meshes) {
      if (is_over()) break;
      nlohmann::ordered_json line = {{"mesh", file.substr(file.rfind('/') + 1)}, {"options", options.name}};
      try {
        const Subject subject(bake::closed_mesh(import_mesh(file), options.bake).mesh, options.bake);
        for (const Promise& promise : promises()) {
          if (promise.name.compare(0, only.size(), only) != 0) continue;
          lab::ClimbOptions effort = climb;
          effort.starts = std::max(1, int(promise.effort * climb.starts));
          const Found found = promise.attack(subject, effort);
          if (found.measured == 0) continue;
          line["found"][promise.name] = {
              {"measured", found.measured}, {"worst", found.worst}, {"started", found.started}};
          if (found.worst > most_of(promise.measure)) {
            ++broken;
            fmt::print(stderr, "{}, {}: {} is broken: {:.4f} (random places: {:.4f}); it says: {}{}\n", file,
                       options.name, promise.name, found.worst, found.started, promise.says,
                       promise.certified ? " (it rests on the certificate, which is measured)" : "");
          }
        }
      } catch (const std::exception& error) {
        line["skipped"] = error.what();
      }
      fmt::print("{}\n", line.dump());
      std::fflush(stdout);
    }
  }
  fmt::print(stderr, "{} broken\n", broken);
  return broken > 0 ? 1 : 0;
}
