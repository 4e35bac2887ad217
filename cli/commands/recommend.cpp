// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "bake/quantity_text.h"
#include "cli/commands/bake_command.h"
#include "cli/lab/recommend.h"
#include "cli/lab/report_json.h"
#include "cli/lab/units.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/terminal/progress.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/output_file.h"
#include "cli/tools/provenance.h"
#include "runtime/bullet/vps_bullet.h"

namespace vps::cli {
namespace {

using lab::Recommendation;
using lab::Tried;
using nlohmann::ordered_json;

struct RecommendArguments {
  BakeArguments bake;
  lab::Limits limits;
  std::uint32_t poses = 90;
  std::uint64_t seed = 1;
  std::string cache;
};

// The shell command that bakes this setting.
std::string command_of(const RecommendArguments& arguments, const Tried& tried) {
  return bake_command(arguments.bake, tried.bake);
}

std::string spread_line(const char* what, const lab::Spread& s, const lab::LengthUnit& unit) {
  if (s.told == 0) return "";
  return fmt::format("     {} in {} poses: off by {} median, {} RMS, {} at most\n", what, s.told, unit.text(s.p50),
                     unit.text(s.rms), unit.text(s.max));
}

std::string steps_line(const lab::SceneTimes& steps) {
  std::vector<std::string> scenes;
  for (const lab::Scene scene : lab::kScenes) {
    const lab::Times& t = steps.scenes[std::size_t(scene)].whole;
    if (t.rounds > 0) scenes.push_back(fmt::format("{} {:.3g} / {:.3g} us", lab::describe(scene), t.p50, t.p99));
  }
  return fmt::format("     whole steps on a box in Bullet, median / 99 %: {}\n", fmt::join(scenes, ", "));
}

std::string numbers_of(const Tried& t) {
  const lab::LengthUnit unit = lab::unit_for({t.error()});
  return fmt::format("off by {} at most, {}, {} points; 99 % of whole steps take {:.3g} us, {:.3g} us with the noise\n",
                     unit.text(t.error()), bake::format_bytes(static_cast<double>(t.bytes)), t.points,
                     t.steps.dearest().p99, t.slowest()) +
         steps_line(t.steps) + spread_line("depths", t.penetration, unit) +
         (t.missed > 0 ? fmt::format("     contacts missed: {} of {}, the deepest {}\n", t.missed, t.penetration.asked,
                                     bake::format_length(t.deepest_missed))
                       : "") +
         spread_line("distances", t.distance, unit) +
         fmt::format("     error bound of the field, by its certificate: {}\n", unit.text(t.field_bound));
}

ordered_json to_json(const RecommendArguments& arguments, const Recommendation& r) {
  const lab::Limits& limits = r.limits;
  const auto limit = [](double value) { return value > 0 ? ordered_json(value) : ordered_json(nullptr); };
  ordered_json out = {{"format", "vpsbake recommend 2"}};
  out.update(provenance(arguments.seed));
  out["mesh"] = arguments.bake.mesh;
  out["limits"] = {{"error", limit(limits.error)},
                   {"time_us", limit(limits.microseconds)},
                   {"bytes", limit(limits.bytes)},
                   {"missed", limits.missed}};
  out["poses"] = {{"sought", r.truth.poses[0] + r.truth.poses[1]},
                  {"contact", r.poses[std::size_t(lab::PoseKind::contact)]},
                  {"deepest", r.truth.contact},
                  {"apart", r.poses[std::size_t(lab::PoseKind::apart)]},
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
                            {"penetration_p50", t.penetration.p50},
                            {"missed", t.missed},
                            {"deepest_missed", t.deepest_missed},
                            {"distance_max", t.distance.max},
                            {"distance_rms", t.distance.rms},
                            {"distance_p50", t.distance.p50},
                            {"field_bound", t.field_bound},
                            {"time_us", t.steps.dearest().p99},
                            {"time_noise_us", t.steps.dearest().noise_p99},
                            {"steps", steps_to_json(t.steps)},
                            {"bytes", t.bytes},
                            {"points", t.points},
                            {"exceeds", t.exceeds(limits)}});
  }
  return out;
}

void print_recommend(const RecommendArguments& arguments, const Recommendation& r) {
  const Tried& chosen = r.tried[*r.chosen];
  const std::size_t contact = r.poses[std::size_t(lab::PoseKind::contact)];
  const std::size_t apart = r.poses[std::size_t(lab::PoseKind::apart)];
  print_lines("{}\n", command_of(arguments, chosen));
  if (arguments.bake.verbosity == Verbosity::quiet) return;
  print_lines("why: {}", numbers_of(chosen));
  print_lines(
      "     {} poses of the body on a copy of itself, against exact depths and distances: {} up to {} deep, {} up to "
      "{} apart\n     a sample: other poses may err more\n",
      contact + apart, contact, bake::format_length(r.truth.contact), apart, bake::format_length(r.truth.gap));
  if (contact + apart < r.truth.poses[0] + r.truth.poses[1]) {
    print_lines("     {} were sought: the exact depths of the others take too long\n",
                r.truth.poses[0] + r.truth.poses[1]);
  }
  if (arguments.bake.verbosity == Verbosity::verbose) {
    for (const Tried& tried : r.tried)
      print_lines("tried {}\n     {}", command_of(arguments, tried), numbers_of(tried));
    return;
  }
  if (*r.chosen == 0) {
    print_lines("no smaller file was tried\n");
    return;
  }
  const Tried& cheaper = r.tried[*r.chosen - 1];
  const std::vector<std::string> exceeds = cheaper.exceeds(r.limits);
  print_lines("next smaller file of {} tried: {}\n     {}", r.tried.size(), command_of(arguments, cheaper),
              exceeds.empty() ? numbers_of(cheaper) : fmt::format("{}\n", fmt::join(exceeds, " and ")));
}

int run_recommend(const RecommendArguments& arguments) {
  bullet::set_message_handler(nullptr);  // a body of 1 kg may be of any size
  if (const std::string reason = cache_refusal(arguments.cache); !reason.empty())
    return fail(kIo, arguments.cache, reason);
  return guarded(arguments.bake.mesh, [&] {
    const TriangleMesh mesh = import_with(arguments.bake);
    const Progress progress(arguments.bake.verbosity);
    lab::RecommendOptions options;
    options.base = arguments.bake.options;
    options.limits = arguments.limits;
    options.record = record_maker(arguments.bake);
    options.poses = arguments.poses;
    options.seed = arguments.seed;
    options.cache = arguments.cache;
    options.progress = [&](const std::string& what, double fraction) { progress.show(what, fraction); };
    const Recommendation r = lab::recommend(mesh, options);
    progress.clear();
    if (arguments.bake.json) {
      fmt::print("{}", to_text(to_json(arguments, r)));
    } else if (r.chosen) {
      print_recommend(arguments, r);
    }
    std::fflush(stdout);
    if (r.chosen) return int{kOk};
    const Tried& nearest = r.tried[r.nearest];
    return fail(kBadInput, arguments.bake.mesh,
                fmt::format("no setting that was tried keeps within the limits; the nearest, `{}`, {}; relax a limit",
                            command_of(arguments, nearest), fmt::join(nearest.exceeds(r.limits), " and ")));
  });
}

// Requires at least one limit.
int check_and_run(const RecommendArguments& arguments) {
  const lab::Limits& limits = arguments.limits;
  if (limits.error > 0 || limits.microseconds > 0 || limits.bytes > 0) return run_recommend(arguments);
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
  add_format_option(*recommend, arguments->bake);
  add_text_option(
      *recommend, "--max-error", [=](const std::string& text) { arguments->limits.error = parse_length(text); },
      "Largest error of depths and distances of whole queries, such as 0.2mm, and of the field, the only one that "
      "--max-error of a bake counts")
      ->option_text("LENGTH")
      ->group(kGroup);
  add_text_option(
      *recommend, "--max-time",
      [=](const std::string& text) { arguments->limits.microseconds = 1e6 * parse_time(text); },
      "99 % of whole steps of the body on a box in Bullet take no longer on this machine, with the noise of the "
      "measurement, such as 50us")
      ->option_text("TIME")
      ->group(kGroup);
  add_text_option(
      *recommend, "--max-bytes",
      [=](const std::string& text) { arguments->limits.bytes = static_cast<double>(parse_size(text)); },
      "The file is no larger, such as 2MB")
      ->option_text("SIZE")
      ->group(kGroup);
  add_integer(*recommend, "--poses", arguments->poses, 6, 10000,
              "Poses of the body on a copy of itself, 6 to 10000 [default: 90]")
      ->option_text("N")
      ->group("Measurement");
  add_integer(*recommend, "--seed", arguments->seed, 0, 99999999, "Of the poses, 0 to 99999999 [default: 1]")
      ->option_text("N")
      ->group("Measurement");
  add_verbosity_options(*recommend, arguments->bake.verbosity, "Print the command alone",
                        "Print every setting that was tried");
  recommend->add_flag("--json", arguments->bake.json, "Print everything that was tried as JSON")->group("Output");
  if (const char* const folder = std::getenv("VPSBAKE_CACHE")) arguments->cache = folder;
  recommend
      ->add_option("--cache", arguments->cache,
                   "Keep poses there [default: the environment's VPSBAKE_CACHE, or nowhere]")
      ->check(not_empty())
      ->option_text("DIR")
      ->group("Output");
  recommend->footer(
      "With --max-error: the fastest steps within the limits, and of equally fast settings the smallest file. Without: "
      "the smallest error of 64 to 256 voxels along the longest side.\n"
      "A setting that misses contacts deeper than its own error or half of --max-error is never recommended.\n"
      "Exits with 3 when no setting keeps within the limits, and says which is nearest.\n"
      "Example: vpsbake recommend gear.stl --unit mm --max-error 0.1mm --max-time 50us");
  return {recommend, [arguments] { return check_and_run(*arguments); }};
}

}  // namespace vps::cli
