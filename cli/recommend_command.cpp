// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/recommend_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>
#include <memory>

#include "bake/plan.h"
#include "cli/describe_asset.h"
#include "cli/evaluate/recommend.h"
#include "cli/exit_code.h"
#include "cli/progress.h"
#include "cli/provenance.h"
#include "cli/work_folder.h"

namespace vps::cli {
namespace {

using evaluate::Recommendation;
using evaluate::Tried;
using nlohmann::ordered_json;

struct RecommendArguments {
  BakeArguments bake;
  evaluate::Limits limits;
  std::uint32_t poses = 36;
  std::uint64_t seed = 1;
  std::string cache;
};

// A length as parse_length reads it back, to the last digit. [m]
std::string exact_length(double metres) {
  for (const auto& [unit, size] : {std::pair{"mm", 1e-3}, {"um", 1e-6}, {"m", 1.0}}) {
    for (int digits = 1; digits <= 17; ++digits) {
      const std::string text = fmt::format("{:.{}g}{}", metres / size, digits, unit);
      if (text.find('e') == std::string::npos && parse_length(text) == metres) return text;
    }
  }
  return fmt::format("{}m", metres);
}

// The command that bakes a setting, as a shell takes it.
std::string command_of(const RecommendArguments& arguments, const Tried& tried) {
  const BakeArguments& bake = arguments.bake;
  const BakeOptions defaults;
  std::string out = "vpsbake " + quoted_word(bake.mesh);
  for (const auto& [name, unit] : {std::pair{"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}}) {
    if (bake.unit == unit) out += fmt::format(" --unit {}", name);
  }
  if (bake.scale != 1) out += fmt::format(" --scale {}", bake.scale);
  if (bake.options.repair != Repair::automatic) out += fmt::format(" --repair {}", describe(bake.options.repair));
  if (bake.options.sheet_thickness > 0) out += " --open-surface thicken=" + exact_length(bake.options.sheet_thickness);
  out += tried.by_certificate ? " --max-error " + exact_length(arguments.limits.error)
                              : " --voxel " + exact_length(tried.bake.voxel_size);
  if (tried.bake.alpha != defaults.alpha) out += fmt::format(" --alpha {}", tried.bake.alpha);
  if (tried.bake.band_inside != defaults.band_inside) out += fmt::format(" --band-inside {}vx", tried.bake.band_inside);
  return out;
}

std::string numbers_of(const Tried& t) {
  return fmt::format(
      "whole queries are off by {} at most in {} poses, {} RMS, the field by {}; 99 % of them take {:.3g} us (noise "
      "{:.2g}); {}, "
      "{} points",
      format_length(std::max(t.penetration.max, t.distance.max)), t.penetration.told + t.distance.told,
      format_length(t.penetration.rms), format_length(t.field_bound), t.contacts.p99, t.contacts.noise_p99,
      format_bytes(static_cast<double>(t.bytes)), t.points);
}

ordered_json to_json(const RecommendArguments& arguments, const Recommendation& r) {
  const evaluate::Limits& limits = arguments.limits;
  const auto limit = [](double value) { return value > 0 ? ordered_json(value) : ordered_json(nullptr); };
  ordered_json out = {{"format", "vpsbake recommend 1"}};
  out.update(provenance(arguments.seed));
  out["mesh"] = arguments.bake.mesh;
  out["limits"] = {
      {"error", limit(limits.error)}, {"time_us", limit(limits.microseconds)}, {"bytes", limit(limits.bytes)}};
  out["poses"] = {{"contact", r.truth.poses[std::size_t(evaluate::Range::contact)]},
                  {"deepest", r.truth.contact},
                  {"apart", r.truth.poses[std::size_t(evaluate::Range::apart)]},
                  {"farthest", r.truth.gap}};
  out["chosen"] = r.chosen ? ordered_json(*r.chosen) : ordered_json(nullptr);
  out["tried"] = ordered_json::array();
  for (const Tried& t : r.tried) {
    out["tried"].push_back({{"command", command_of(arguments, t)},
                            {"voxel_size", t.bake.voxel_size},
                            {"alpha", t.bake.alpha},
                            {"band_inside_vx", t.bake.band_inside},
                            {"error", t.error()},
                            {"penetration_max", t.penetration.max},
                            {"penetration_rms", t.penetration.rms},
                            {"distance_max", t.distance.max},
                            {"field_bound", t.field_bound},
                            {"time_us", t.contacts.p99},
                            {"time_noise_us", t.contacts.noise_p99},
                            {"bytes", t.bytes},
                            {"points", t.points},
                            {"exceeds", t.exceeds(limits)}});
  }
  return out;
}

void print_text(const RecommendArguments& arguments, const Recommendation& r) {
  const Tried& chosen = r.tried[*r.chosen];
  fmt::print("{}\n", command_of(arguments, chosen));
  fmt::print("why: {}\n", numbers_of(chosen));
  fmt::print("     measured on {} poses up to {} deep and {} up to {} apart, against exact depths and distances\n",
             r.truth.poses[std::size_t(evaluate::Range::contact)], format_length(r.truth.contact),
             r.truth.poses[std::size_t(evaluate::Range::apart)], format_length(r.truth.gap));
  if (*r.chosen > 0) {
    const Tried& cheaper = r.tried[*r.chosen - 1];
    const std::vector<std::string> exceeds = cheaper.exceeds(arguments.limits);
    fmt::print("next smaller file: {}\n", command_of(arguments, cheaper));
    fmt::print("     {}{}\n", numbers_of(cheaper),
               exceeds.empty() ? "" : fmt::format(": {}", fmt::join(exceeds, " and ")));
  } else {
    fmt::print("no smaller file was tried\n");
  }
  if (chosen.by_certificate) {
    fmt::print(
        "the voxel size is {}, which is what --max-error finds: it counts the field alone, the above whole queries\n",
        format_length(chosen.bake.voxel_size));
  }
}

int run(const RecommendArguments& arguments) {
  return guarded(arguments.bake.mesh, [&] {
    const TriangleMesh mesh = import_with(arguments.bake);
    const WorkFolder work;
    const Progress progress;
    evaluate::RecommendOptions options;
    options.base = arguments.bake.options;
    options.limits = arguments.limits;
    options.poses = arguments.poses;
    options.seed = arguments.seed;
    options.cache = arguments.cache.empty() ? work.path().string() : arguments.cache;
    options.work = work.path();
    options.progress = [&](const std::string& what, double fraction) { progress.show(what, fraction); };
    const Recommendation r = evaluate::recommend(mesh, options);
    progress.clear();
    if (arguments.bake.json) {
      fmt::print("{}", to_text(to_json(arguments, r)));
    } else if (r.chosen) {
      print_text(arguments, r);
    }
    std::fflush(stdout);
    if (r.chosen) return int{kOk};
    const Tried& nearest = r.tried[r.nearest];
    return fail(kBadInput, arguments.bake.mesh,
                fmt::format("no setting that was tried keeps within the limits; the nearest, `{}`, {}; relax a limit",
                            command_of(arguments, nearest), fmt::join(nearest.exceeds(arguments.limits), " and ")));
  });
}

// At least one is needed.
int check_and_run(const RecommendArguments& arguments) {
  const evaluate::Limits& limits = arguments.limits;
  if (limits.error > 0 || limits.microseconds > 0 || limits.bytes > 0) return run(arguments);
  return fail(kCommandLine, "command line",
              "--max-error, --max-time or --max-bytes is required; run vpsbake recommend --help");
}

}  // namespace

Command add_recommend_command(CLI::App& app) {
  constexpr const char* kGroup = "Limits (one or more)";
  CLI::App* const recommend = app.add_subcommand("recommend", "Say with which setting to bake a mesh, and why");
  const auto arguments = std::make_shared<RecommendArguments>();
  add_mesh_options(*recommend, arguments->bake)->required();
  add_import_options(*recommend, arguments->bake);
  recommend
      ->add_option_function<std::string>(
          "--max-error", [=](const std::string& text) { arguments->limits.error = parse_length(text); },
          "Depths and distances of whole queries are off by no more, such as 0.2mm, nor is the field, which is all "
          "that "
          "--max-error of a bake counts")
      ->option_text("LENGTH")
      ->group(kGroup);
  recommend
      ->add_option_function<std::string>(
          "--max-time", [=](const std::string& text) { arguments->limits.microseconds = 1e6 * parse_time(text); },
          "99 % of contact queries take no longer on this machine, such as 20us")
      ->option_text("TIME")
      ->group(kGroup);
  recommend
      ->add_option_function<std::string>(
          "--max-bytes",
          [=](const std::string& text) { arguments->limits.bytes = static_cast<double>(parse_size(text)); },
          "The file is no larger, such as 2MB")
      ->option_text("SIZE")
      ->group(kGroup);
  add_integer(*recommend, "--poses", arguments->poses, 6, 10000, "Poses of the body on a copy of itself [default: 36]")
      ->option_text("N")
      ->group("Measurement");
  add_integer(*recommend, "--seed", arguments->seed, 0, 99999999, "Of the poses [default: 1]")
      ->option_text("N")
      ->group("Measurement");
  recommend->add_flag("--json", arguments->bake.json, "Print everything that was tried as JSON")->group("Output");
  if (const char* const folder = std::getenv("VPSBAKE_CACHE")) arguments->cache = folder;
  recommend
      ->add_option("--cache", arguments->cache,
                   "Keep poses there [default: the environment's VPSBAKE_CACHE, or nowhere]")
      ->check(not_empty())
      ->option_text("DIR")
      ->group("Output");
  recommend->footer(
      "With --max-error: the smallest file within the limits. Without: the smallest error.\n"
      "Exits with 3 when no setting keeps within the limits, and says which is nearest.\n"
      "Example: vpsbake recommend gear.stl --unit mm --max-error 0.1mm --max-time 20us");
  return {recommend, [arguments] { return check_and_run(*arguments); }};
}

}  // namespace vps::cli
