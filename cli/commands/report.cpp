// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <mutex>

#include "bake/quantity_text.h"
#include "cli/commands/bake_command.h"
#include "cli/lab/report_json.h"
#include "cli/lab/units.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/open_page.h"
#include "cli/terminal/print.h"
#include "cli/terminal/progress.h"
#include "cli/terminal/write_output.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/differing_numbers.h"
#include "cli/tools/output_file.h"
#include "cli/tools/provenance.h"
#include "cli/tools/view/page.h"
#include "runtime/bullet/vps_bullet.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// Default number of voxels along the longest side.
constexpr std::uint32_t kResolution = 200;
constexpr std::uint32_t kQuickResolution = 64;
// Most pieces of an exact force's integral. Where they do not suffice, errors of forces are not reported.
constexpr std::size_t kQuickPieces = 200000;
constexpr double kQuickForceTolerance = 0.01;  // relative
constexpr int kQuickRotations = 2;

struct ReportArguments {
  std::vector<std::string> meshes;
  BakeArguments bake;  // how meshes are read, and the base setting
  std::string output = "report";
  std::string cache;
  std::uint32_t poses = 0;  // 0: default, which depends on `quick`
  int rounds = 0;
  std::uint64_t seed = 1;
  bool quick = false;
  bool open = false;
  Verbosity verbosity = Verbosity::usual;
  std::vector<std::string> without;

  [[nodiscard]] std::size_t pose_count() const { return poses > 0 ? poses : quick ? 9 : 150; }
  [[nodiscard]] int round_count() const { return rounds > 0 ? rounds : quick ? 2 : 5; }
};

// A mesh that can be measured.
struct Candidate {
  std::string file;
  std::string bake_command;  // bakes the base setting
  TriangleMesh mesh;         // as imported
  bake::ClosedMesh closed;
  lab::MeasureOptions options;
};

Candidate prepare(const ReportArguments& arguments, const std::string& file) {
  const Progress progress(arguments.verbosity);
  progress.show(fs::path(file).filename().string() + ": import and close", 0);
  BakeArguments bake = arguments.bake;
  bake.mesh = file;
  ImportedMesh mesh = import_with(bake);
  Candidate out;
  out.file = file;
  bake::BakeOptions& base = out.options.base;
  base = bake.options;
  if (base.voxel_size == 0 && base.resolution == 0) base.resolution = arguments.quick ? kQuickResolution : kResolution;
  base.voxel_size = bake::plan_bake(mesh, base).voxel_size;
  base.resolution = 0;
  out.bake_command = bake_command(bake, base);
  out.closed = bake::closed_mesh(mesh, base);
  out.closed.notes.insert(out.closed.notes.begin(), mesh.notes.begin(), mesh.notes.end());
  const lab::Oracle refuses_here(out.closed.mesh);
  out.mesh = std::move(mesh);
  return out;
}

lab::Measurement measure(const ReportArguments& arguments, Candidate& mesh) {
  const Progress progress(arguments.verbosity);
  std::mutex mutex;
  lab::MeasureOptions& options = mesh.options;
  options.size = arguments.quick ? lab::SweepSize::quick : lab::SweepSize::full;
  options.truth = lab::truth_options_for(mesh.closed.mesh, arguments.pose_count());
  options.truth.seed = arguments.seed;
  if (arguments.quick) {
    options.truth.wrench.tolerance = kQuickForceTolerance;
    options.truth.wrench.most_pieces = kQuickPieces;
  }
  options.rounds.rounds = arguments.round_count();
  if (arguments.quick) options.rotations = kQuickRotations;
  options.without = arguments.without;
  if (arguments.quick && std::find(options.without.begin(), options.without.end(), "hacd") == options.without.end())
    options.without.push_back("hacd");  // it takes a minute and more
  options.cache = arguments.cache;
  const std::string name = fs::path(mesh.file).filename().string();
  options.progress = [&](const std::string& what, double fraction) {
    const std::lock_guard lock(mutex);
    progress.show(name + ": " + what, fraction);
  };
  return lab::measure(mesh.mesh, mesh.closed.mesh, options);
}

// Rows of the front's way of query: all, or the base setting (the first), members of the front, and other libraries.
std::vector<std::size_t> rows_to_print(const lab::Measurement& m, const lab::Front& front, Verbosity verbosity) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < m.rows.size(); ++i) {
    const lab::Row& row = m.rows[i];
    const bool member =
        std::any_of(front.members.begin(), front.members.end(), [i](const auto& one) { return one.row == i; });
    if (row.way == front.way && (verbosity == Verbosity::verbose || member || out.empty() || row.knob == "peer"))
      out.push_back(i);
  }
  return out;
}

// "12.1 +- 0.6 / 15"; the 99th percentile only of enough values.
std::string text_of(const lab::Times& t) {
  if (t.rounds == 0) return "not timed";
  return fmt::format("{:.3g} +- {:.2g}", t.p50, t.noise_p50) +
         (std::isnan(t.p99) ? "" : fmt::format(" / {:.3g}", t.p99));
}

std::string scene_names() {
  std::vector<std::string> names;
  for (const lab::Scene scene : lab::kScenes) names.push_back(lab::describe(scene));
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string text_of(const lab::StepTimes& scene) {
  return scene.whole.rounds > 0 ? fmt::format("{:.3g} / {:.3g}", scene.whole.p50, scene.whole.p99) : "-";
}

// Median and 99 % of a whole step: in each scene, or in the slowest.
std::string text_of(const lab::SceneTimes& steps, Verbosity verbosity) {
  if (!steps.failure.empty()) return steps.failure;
  const lab::Times& slowest = steps.dearest();
  if (slowest.rounds == 0) return "not played";
  if (verbosity != Verbosity::verbose) return fmt::format("{:.3g} / {:.3g}", slowest.p50, slowest.p99);
  std::vector<std::string> out;
  for (const lab::StepTimes& scene : steps.scenes) out.push_back(text_of(scene));
  return fmt::format("{}", fmt::join(out, ", "));
}

// Columns as wide as their texts, two spaces apart.
void print_columns(const std::vector<std::array<std::string, 5>>& rows) {
  std::array<std::size_t, 5> widths{};
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i + 1 < row.size(); ++i) line += fmt::format("{:<{}}", row[i], widths[i] + 2);
    print_lines("{}\n", line + row.back());
  }
}

void print_rows(const lab::Measurement& m, const lab::Front& front, Verbosity verbosity) {
  const bool steps = front.cost == lab::Cost::step;
  const std::vector<std::size_t> rows = rows_to_print(m, front, verbosity);
  std::vector<double> errors;
  for (const std::size_t i : rows) errors.push_back(m.rows[i].errors.contact.penetration.rms);
  const lab::LengthUnit unit = lab::unit_for(errors);
  const bool has_p99 =
      std::any_of(rows.begin(), rows.end(), [&](std::size_t i) { return !std::isnan(m.rows[i].contacts.p99); });
  const std::string scenes = verbosity == Verbosity::verbose ? ": " + scene_names() : "";
  std::vector<std::array<std::string, 5>> table = {{fmt::format("  {}", lab::describe(front.way)),
                                                    fmt::format("error, RMS / max, {}", unit.name), "missed", "MB",
                                                    steps     ? "us a step, median / 99 %" + scenes
                                                    : has_p99 ? "us a query, median / 99 %"
                                                              : "us a query, median"}};
  for (const std::size_t i : rows) {
    const lab::Row& row = m.rows[i];
    const lab::Spread& s = row.errors.contact.penetration;
    const auto member =
        std::find_if(front.members.begin(), front.members.end(), [i](const auto& one) { return one.row == i; });
    const char* const mark = member == front.members.end() ? "  " : member->tied ? "~ " : "* ";
    constexpr std::string_view kWay = ", in Bullet";  // the title says it
    const std::string name = row.name.ends_with(kWay) ? row.name.substr(0, row.name.size() - kWay.size()) : row.name;
    table.push_back({mark + name,
                     s.told == 0 ? "none" : fmt::format("{:.3g} / {:.3g}", s.rms / unit.size, s.max / unit.size),
                     fmt::format("{} of {}", row.errors.contact.missed, s.asked),
                     row.bytes > 0 ? fmt::format("{:.3g}", double(row.bytes) / 1e6) : "",
                     steps ? text_of(row.steps, verbosity) : text_of(row.contacts)});
  }
  print_columns(table);
}

void print_table(const ReportedMesh& mesh, Verbosity verbosity) {
  const lab::Measurement& m = mesh.measured;
  print_lines(
      "{}: {} triangles, {} poses; of {} rows the base, other libraries and fronts (*, ~ where the time is "
      "within the noise of the one before)\n",
      mesh.file, mesh.triangles, m.truth.poses.size(), m.rows.size());
  for (const lab::Front& front : m.fronts) {
    const bool query = front.way == lab::Way::query;
    if (front.cost == (query ? lab::Cost::time : lab::Cost::step)) print_rows(m, front, verbosity);
  }
  for (const lab::LeftOut& one : m.left_out) print_lines("left out: {}: {}\n", one.name, one.why);
  for (const std::string& note : mesh.closed.notes) print_lines("note: {}\n", note);
  for (const lab::Front& front : m.fronts) print_lines("{}\n", front_line(m, front));
}

ordered_json report_head(const ReportArguments& arguments) {
  ordered_json out = {{"format", "vpsbake report 2"}};
  out.update(provenance(arguments.seed));
  out["load_end"] = 0;
  out["busy"] = false;
  out["quick"] = arguments.quick;
  out["rounds"] = arguments.round_count();
  out["measures"] = measure_definitions();
  out["meshes"] = ordered_json::array();
  return out;
}

// Records the load at the end, and whether other programs used the processor before or during the run. The load at the
// end includes this program.
void tell_load(ordered_json& report) {
  const double cores = report["machine"]["cores"];
  const double start = report["machine"]["load"];
  const double end = provenance(0)["machine"]["load"];
  constexpr double kBusy = 0.3;
  constexpr double kOwn = 1.2;
  report["load_end"] = end;
  report["busy"] = start > kBusy * cores || end > kOwn + kBusy * cores;
}

// An output file, and the first bytes that identify its kind.
struct ReportOutput {
  const char* ending;
  std::string_view beginning;
  const char* kind;
};
constexpr ReportOutput kJson = {".json", "{\n  \"format\": \"vpsbake report", "a report's JSON"};
constexpr ReportOutput kCsv = {".csv", "mesh,name,series,", "a report's table"};
constexpr const char* kPage = ".html";

// Refuses unusable outputs. Called before the measurement, which takes minutes. @return kOk or kIo
int check_outputs(const std::string& name) {
  if (!fs::path(name).has_filename()) return fail(kIo, name, "this is a folder; give a name with -o");
  const ReportOutput page{kPage, page_beginning(kReportPage), "a report's page"};
  for (const ReportOutput& output : {kJson, kCsv, page}) {
    const std::string file = name + output.ending;
    if (const std::string reason = output_refusal(file, output.beginning, output.kind); !reason.empty())
      return fail(kIo, file, reason);
  }
  return kOk;
}

int write_report(const ReportArguments& arguments, const ordered_json& report) {
  const std::string& name = arguments.output;
  const auto write = arguments.verbosity == Verbosity::quiet ? write_quietly : write_output;
  const Embedded libraries[] = {kChart};
  int code = write(name + kJson.ending, to_text(report));
  if (code == kOk) code = write(name + kCsv.ending, rows_to_csv(report));
  if (code == kOk) code = write(name + kPage, make_page(kReportPage.text(), libraries, report));
  return code;
}

// Adds notes where the exact reference is incomplete or not exact enough.
void add_notes(const lab::GroundTruth& truth, std::vector<std::string>& notes) {
  const std::size_t(&sought)[3] = truth.options.poses;
  const std::size_t all = sought[0] + sought[1] + sought[2];
  if (truth.poses.size() < all) {
    notes.push_back(fmt::format(
        "{} of {} poses were found (apart {} of {}, in contact {} of {}, deep {} of {}): for the "
        "others the exact depth takes too long, or no approach gets so deep",
        truth.poses.size(), all, truth.found[0], sought[0], truth.found[1], sought[1], truth.found[2], sought[2]));
  }
  constexpr double kCoarse = 0.1;
  if (truth.options.tolerance > kCoarse * truth.options.contact) {
    notes.push_back(
        fmt::format("the body is so thin that its contacts are {} deep at most, and exact depths are known to {}: "
                    "smaller errors of depth say nothing",
                    bake::format_length(truth.options.contact), bake::format_length(truth.options.tolerance)));
  }
  if (!truth.wrenches_exact()) {
    const auto [known, wanted] = differing_numbers(100 * truth.wrench_error, 100 * truth.options.wrench.tolerance, 2);
    notes.push_back(
        fmt::format("exact forces and torques are known to {} % instead of {} %: errors of force and torque "
                    "are left out",
                    known, wanted));
  } else if (truth.options.wrench.tolerance > lab::WrenchOptions().tolerance) {
    notes.push_back(
        fmt::format("exact forces and torques are known to {:.2g} %: smaller errors of force and torque say nothing",
                    100 * truth.options.wrench.tolerance));
  }
}

int run_report(const ReportArguments& arguments) {
  bullet::set_message_handler(nullptr);  // a body of 1 kg may be of any size
  if (const int code = check_outputs(arguments.output); code != kOk) return code;
  if (const std::string reason = cache_refusal(arguments.cache); !reason.empty())
    return fail(kIo, arguments.cache, reason);
  ordered_json report = report_head(arguments);
  std::vector<Candidate> meshes;
  for (const std::string& file : arguments.meshes) {
    const int code = guarded(file, [&] {
      meshes.push_back(prepare(arguments, file));
      return int{kOk};
    });
    if (code != kOk) return code;
  }
  for (Candidate& mesh : meshes) {
    const int code = guarded(mesh.file, [&] {
      ReportedMesh reported{mesh.file, mesh.bake_command, mesh.closed.mesh.triangles.size(), mesh.closed,
                            measure(arguments, mesh)};
      add_notes(reported.measured.truth, reported.closed.notes);
      if (arguments.verbosity != Verbosity::quiet) print_table(reported, arguments.verbosity);
      std::fflush(stdout);
      report["meshes"].push_back(mesh_to_json(reported));
      return int{kOk};
    });
    if (code != kOk) return code;
  }
  tell_load(report);
  const int code = write_report(arguments, report);
  if (code == kOk && arguments.open) open_page(arguments.output + kPage);
  return code;
}

void add_sweep_options(CLI::App& app, ReportArguments& arguments) {
  constexpr const char* kGroup = "Measurement";
  add_integer(
      app, "--poses", arguments.poses, 3, 100000,
      "Poses of the body on a copy of itself, 3 to 100000: a third each apart, in contact and deep [default: 150]")
      ->option_text("N")
      ->group(kGroup);
  add_integer(app, "--rounds", arguments.rounds, 1, 1000,
              "Rounds in which all are timed in turn, 1 to 1000 [default: 5]")
      ->option_text("N")
      ->group(kGroup);
  add_integer(app, "--seed", arguments.seed, 0, 99999999, "Of the poses, 0 to 99999999 [default: 1]")
      ->option_text("N")
      ->group(kGroup);
  app.add_flag("--quick", arguments.quick,
               "A few settings, 64 voxels, 9 poses, 2 rounds, no HACD: to see that it works")
      ->group(kGroup);
  app.add_option("--without", arguments.without, "Peers to leave out: hull,hacd,gimpact,fcl [default: none]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(lab::peer_names()))
      ->option_text("LIST")
      ->group(kGroup);
}

}  // namespace

Command add_report_command(CLI::App& app) {
  CLI::App* const report = app.add_subcommand(
      "report",
      "Measure error against run time, size and bake time of many settings, beside hulls, HACD, GImpact and FCL");
  const auto arguments = std::make_shared<ReportArguments>();
  report->add_option("MESH...", arguments->meshes, "Meshes to measure")->required();
  add_surface_options(*report, arguments->bake);
  add_import_options(*report, arguments->bake);
  add_grid_options(*report, arguments->bake);
  add_sweep_options(*report, *arguments);
  report->add_option("-o,--output", arguments->output, "Write NAME.html, NAME.csv and NAME.json [default: report]")
      ->check(not_stream())
      ->option_text("NAME")
      ->group("Output");
  add_verbosity_options(*report, arguments->verbosity, "Print errors and warnings only",
                        "Print all rows that were measured");
  add_open_option(*report, arguments->open)->group("Output");
  if (const char* const folder = std::getenv("VPSBAKE_CACHE")) arguments->cache = folder;
  report
      ->add_option("--cache", arguments->cache,
                   "Keep poses, exact forces and HACD's hulls there, which take minutes [default: the environment's "
                   "VPSBAKE_CACHE, or nowhere]")
      ->check(not_stream())
      ->option_text("DIR")
      ->group("Output");
  report->footer(
      "The base setting, round which others vary, has 200 voxels along the longest side where no voxel is given "
      "(--quick: "
      "64).\n"
      "Example: vpsbake report gear.stl --unit mm -o gear");
  return {report, [arguments] { return run_report(*arguments); }};
}

}  // namespace vps::cli
