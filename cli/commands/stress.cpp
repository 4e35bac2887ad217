// SPDX-License-Identifier: GPL-3.0-or-later
// Makes subjects from the options, runs the cases on them, and writes the results to stdout and files.
#include "cli/commands/commands.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "bake/store/vps_store.h"
#include "cli/commands/open_asset.h"
#include "cli/lab/stress/peers.h"
#include "cli/lab/stress/report.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/open_page.h"
#include "cli/terminal/print.h"
#include "cli/terminal/progress.h"
#include "cli/terminal/write_output.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/junit.h"
#include "cli/tools/most_mass.h"
#include "cli/tools/output_file.h"
#include "cli/tools/provenance.h"
#include "cli/tools/utf8.h"
#include "cli/tools/view/embedded.h"
#include "cli/tools/view/page.h"
#include "runtime/bullet/vps_bullet.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kColumns[] = {"ours", "continuous", "hull", "hacd", "gimpact"};
const std::map<std::string, stress::Solver> kSolvers = {{"sequential", stress::Solver::sequential},
                                                        {"nncg", stress::Solver::nncg},
                                                        {"dantzig", stress::Solver::dantzig},
                                                        {"lemke", stress::Solver::lemke}};

struct StressArguments {
  std::vector<std::string> assets;
  BakeArguments mesh;  // of --mesh, --unit and --scale
  std::string output, junit;
  std::vector<std::string> cases;
  double mass = 1;  // [kg]
  std::uint32_t seed = 1;
  bool quick = false, list = false, strict = false, open = false;
  Verbosity verbosity = Verbosity::usual;
  stress::SubjectOptions subject;
};

stress::Strictness strictness(const StressArguments& arguments) {
  return arguments.strict ? stress::Strictness::strict : stress::Strictness::promised;
}

bool is_named(const stress::Case& one, const std::string& glob) {
  return ::fnmatch(glob.c_str(), one.name.c_str(), 0) == 0;
}

std::vector<const stress::Case*> chosen(const StressArguments& arguments) {
  std::vector<const stress::Case*> out;
  for (const stress::Case& one : stress::all_cases()) {
    const bool wanted =
        arguments.cases.empty() || std::any_of(arguments.cases.begin(), arguments.cases.end(),
                                               [&](const std::string& glob) { return is_named(one, glob); });
    if (wanted) out.push_back(&one);
  }
  return out;
}

void list_cases(const StressArguments& arguments) {
  for (const stress::Case* one : chosen(arguments)) {
    print_lines("{:<22} {} {}\n{:<22} measures {}; limit {}\n", one->name, one->question, one->setup, "", one->measured,
                one->limit);
  }
}

struct StressOutput {
  fs::path file;
  std::string_view beginning;  // of files of its kind
  const char* kind;
};

std::vector<StressOutput> outputs(const StressArguments& arguments) {
  std::vector<StressOutput> files;
  if (!arguments.output.empty()) {
    files = {{arguments.output + ".html", page_beginning(kStressPage), "a page of stress"},
             {arguments.output + ".json", "{\n  \"machine\": {", "JSON of stress"}};
  }
  if (!arguments.junit.empty()) files.push_back({arguments.junit, kJUnitBeginning, "a JUnit report"});
  return files;
}

int write_stress(const StressArguments& arguments, const std::vector<stress::AssetResult>& results) {
  int code = kOk;
  const auto write = [&](const fs::path& file, const std::string& text) {
    if (code == kOk)
      code = arguments.verbosity == Verbosity::quiet ? write_quietly(file, text) : write_output(file, text);
  };
  nlohmann::ordered_json about = provenance(arguments.seed);
  about["quick"] = arguments.quick;
  if (!arguments.output.empty()) {
    const nlohmann::ordered_json json = stress::to_json(results, about, strictness(arguments));
    const Embedded libraries[] = {kChart};
    write(arguments.output + ".json", to_text(json));
    write(arguments.output + ".html", make_page(kStressPage.text(), libraries, json));
  }
  if (!arguments.junit.empty()) write(arguments.junit, stress::to_junit(results, about, strictness(arguments)));
  return code;
}

// Sets the surface for shapes of other methods: the given mesh, or the zero set of the asset's field where no mesh was
// given or it has too many triangles.
void add_meshes(const std::optional<TriangleMesh>& mesh, const Asset& asset, stress::SubjectOptions& options) {
  if (mesh) options.mesh = {*mesh, fmt::format("the mesh that was given, {} triangles", mesh->triangles.size())};
  if (!mesh || mesh->triangles.size() > stress::kMostTriangles) options.zero_set = zero_set(asset);
}

std::string painted(const stress::CaseResult& result, stress::Strictness strictness) {
  std::string line = stress::to_line(result, strictness);
  const std::string verdict = stress::describe(stress::verdict_of(result, strictness));
  const TextColour colour = stress::is_broken(result, strictness) ? TextColour::red : TextColour::green;
  return line.replace(0, verdict.size(), painted(verdict, colour, STDOUT_FILENO));
}

void print_case(const StressArguments& arguments, const stress::CaseResult& result) {
  const bool broken = stress::is_broken(result, strictness(arguments));
  if (arguments.verbosity != Verbosity::quiet || broken) print_lines("{}\n", painted(result, strictness(arguments)));
  if (arguments.verbosity == Verbosity::verbose) {
    print_lines("{:<9}{} {}\n{:<9}measures {}; limit {}\n", "", result.asked->question, result.asked->setup, "",
                result.asked->measured, result.asked->limit);
  }
  std::fflush(stdout);
}

// Runs the chosen cases on one asset. @return kOk, or the exit code of its error
int run_asset(const StressArguments& arguments, const std::string& path, const std::optional<TriangleMesh>& mesh,
              std::vector<stress::AssetResult>& results) {
  const auto asset = std::make_shared<Asset>();
  if (const int code = open_asset(path, *asset); code != kOk) return code;
  if (mesh) {
    const auto compare = [&] {
      const std::string reason = mesh_mismatch(*mesh, asset->info());
      return reason.empty() ? int{kOk} : fail(kBadInput, arguments.mesh.mesh, reason);
    };
    if (const int code = guarded(arguments.mesh.mesh, compare); code != kOk) return code;
  }
  return guarded(path, [&] {
    stress::SubjectOptions options = arguments.subject;
    options.mass = arguments.mass;
    options.seed = arguments.seed;
    options.announce_hacd = [] { print_lines(stderr, "HACD decomposes the mesh, once: this takes minutes\n"); };
    add_meshes(mesh, *asset, options);
    const stress::Subject subject = stress::make_subject(path, asset, options);
    stress::AssetResult& result = results.emplace_back();
    result.asset = path;
    result.mass = subject.mass;
    result.size = subject.size;
    result.voxel = subject.voxel;
    result.points = asset->info().points;
    for (const stress::Column& column : subject.columns) {
      if (!column.from.empty()) result.peers[column.name] = column.from;
    }
    const bool quiet = arguments.verbosity == Verbosity::quiet;
    if (arguments.assets.size() > 1 && !quiet) print_lines("{}\n", one_line(path));
    std::string peers;
    for (const auto& [column, from] : result.peers)
      peers += fmt::format("{}{} of {}", peers.empty() ? "peers: " : "; ", column, from);
    if (!peers.empty() && !quiet) print_lines("{}\n", peers);
    const Progress progress(arguments.verbosity);
    const std::vector<const stress::Case*> cases = chosen(arguments);
    for (const stress::Case* one : cases) {
      progress.show(one->name, double(result.cases.size()) / double(cases.size()));
      result.cases.push_back(
          stress::run_case(*one, subject, arguments.quick ? stress::Effort::quick : stress::Effort::full));
      progress.clear();
      print_case(arguments, result.cases.back());
    }
    return int{kOk};
  });
}

int run_stress(const StressArguments& arguments) {
  for (const std::string& glob : arguments.cases) {
    const auto& all = stress::all_cases();
    if (std::none_of(all.begin(), all.end(), [&](const stress::Case& one) { return is_named(one, glob); })) {
      return fail(kCommandLine, "command line",
                  fmt::format("no case is named like '{}'; run vpsbake stress --list", glob));
    }
  }
  if (arguments.list) {
    list_cases(arguments);
    return kOk;
  }
  if (arguments.assets.empty())
    return fail(kCommandLine, "command line", "an asset is required; run vpsbake stress --help");
  if (!arguments.mesh.mesh.empty() && arguments.assets.size() > 1) {
    return fail(kCommandLine, "command line", "--mesh is that of one asset; run vpsbake stress for each");
  }
  const auto names_no_file = [](const std::string& output) {
    const fs::path name = fs::path(output).filename();
    return !output.empty() && (name.empty() || name == "." || name == "..");
  };
  for (const std::string& output : {arguments.output, arguments.junit}) {
    if (names_no_file(output))
      return fail(kCommandLine, "command line", fmt::format("'{}' is a folder; add the name of a file", output));
  }
  for (const char* const ending : {".html", ".json"}) {
    if (fs::path(arguments.output + ending).lexically_normal() == fs::path(arguments.junit).lexically_normal())
      return fail(kCommandLine, "command line", fmt::format("'{}' is written twice; rename one", arguments.junit));
  }
  for (const auto& [file, beginning, kind] : outputs(arguments)) {
    if (const std::string reason = output_refusal(file, beginning, kind); !reason.empty())
      return fail(kIo, file.string(), reason);
  }
  if (const std::string reason = cache_refusal(arguments.mesh.cache); !reason.empty())
    return fail(kIo, arguments.mesh.cache, reason);
  std::optional<TriangleMesh> mesh;
  if (!arguments.mesh.mesh.empty()) {
    const auto import = [&] {
      mesh = import_with(arguments.mesh);
      return int{kOk};
    };
    if (const int code = guarded(arguments.mesh.mesh, import); code != kOk) return code;
  }
  bullet::set_message_handler(nullptr);  // cases are extreme on purpose
  std::vector<stress::AssetResult> results;
  int code = kOk;
  for (const std::string& path : arguments.assets) {
    const int one = run_asset(arguments, path, mesh, results);
    if (one != kOk) code = arguments.assets.size() == 1 ? one : int{kSomeFailed};
  }
  for (const stress::AssetResult& result : results) {
    if (arguments.verbosity != Verbosity::quiet)
      print_lines("{}\n", stress::certificate(result, strictness(arguments)));
    const auto is_broken = [&](const stress::CaseResult& one) { return stress::is_broken(one, strictness(arguments)); };
    const bool nothing = std::all_of(result.cases.begin(), result.cases.end(), [&](const stress::CaseResult& one) {
      return stress::verdict_of(one, strictness(arguments)) == stress::Verdict::skipped;
    });
    if (nothing) code = fail(kSomeFailed, result.asset, "every case was skipped: nothing was tested");
    if (code == kOk && std::any_of(result.cases.begin(), result.cases.end(), is_broken)) code = kSomeFailed;
  }
  if (results.empty()) return code;
  const int written = write_stress(arguments, results);
  if (written == kOk && arguments.open) open_page(arguments.output + ".html");
  return written != kOk ? written : code;
}

}  // namespace

Command add_stress_command(CLI::App& app) {
  constexpr const char* kCases = "Cases";
  CLI::App* const stress = app.add_subcommand(
      "stress", "Run stability cases on assets in Bullet and in a penalty loop; exit code 5 when a limit is not held");
  const auto arguments = std::make_shared<StressArguments>();
  StressArguments& a = *arguments;
  stress->add_option("ASSET...", a.assets, "Assets");
  stress
      ->add_option("--mesh", a.mesh.mesh,
                   "The mesh that the asset was baked from, for peers and other sizes [default: the asset's zero set]")
      ->check(not_empty())
      ->option_text("MESH")
      ->group("Mesh");
  add_unit_options(*stress, a.mesh);
  stress->add_option("-o,--output", a.output, "Write NAME.html and NAME.json [default: neither]")
      ->check(not_stream())
      ->option_text("NAME")
      ->group("Output");
  stress->add_option("--junit", a.junit, "Write JUnit XML, for CI [default: none]")
      ->check(not_stream())
      ->option_text("FILE")
      ->group("Output");
  stress->add_option("--cases", a.cases, "Run these alone: names, or patterns such as 'rest_*,impact_*' [default: all]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("GLOBS")
      ->group(kCases);
  stress
      ->add_option("--without", a.subject.without,
                   "Columns to leave out: ours,continuous,hull,hacd,gimpact [default: none]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(kColumns), std::end(kColumns))))
      ->option_text("LIST")
      ->group(kCases);
  add_text_option(
      *stress, "--mass",
      [&a](const std::string& text) {
        a.mass = parse_mass(text);
        if (!(a.mass >= 1e-9 && a.mass <= kMostMass))
          throw CLI::ValidationError("--mass takes 1e-9kg to 1.4e7kg, not '" + text +
                                     "'; Bullet's solver does not move heavier bodies");
      },
      "Mass of the body, such as 250g, from 1e-9 to 1.4e7 kg [default: 1kg]")
      ->option_text("MASS")
      ->group(kCases);
  add_integer(*stress, "--seed", a.seed, 0, 99999999, "Of disturbances and directions, 0 to 99999999 [default: 1]")
      ->option_text("N")
      ->group(kCases);
  stress
      ->add_option_function<std::string>(
          "--solver", [&a](const std::string& name) { a.subject.solver = kSolvers.at(name); },
          "Bullet's solver: sequential, nncg, dantzig or lemke [default: sequential]")
      ->check(CLI::IsMember(kSolvers))
      ->option_text("NAME")
      ->group(kCases);
  stress
      ->add_flag("--quick", a.quick,
                 "Fewer settings of each case, about a minute for 70,000 points: see docs/stress.md")
      ->group(kCases);
  stress
      ->add_flag("--strict", a.strict,
                 "Exit code 5 also for limits that are broken without ContinuousMotion, or by Bullet's solver")
      ->group(kCases);
  add_verbosity_options(*stress, a.verbosity, "Print broken cases only", "Print what each case does and measures");
  add_open_option(*stress, a.open)->needs("--output")->group("Output");
  stress->add_flag("--list", a.list, "Print the cases and their limits")->group(kCases);
  std::string& cache = a.mesh.cache;
  if (const char* const folder = std::getenv("VPSBAKE_CACHE")) cache = folder;
  stress
      ->add_option(
          "--cache", cache,
          "Keep HACD's hulls of large meshes and baked walls in this folder [default: the environment's VPSBAKE_CACHE]")
      ->check(not_stream())
      ->option_text("DIR")
      ->group("Output");
  stress->footer(
      "Exits with 5 when a limit is broken that is stated for the asset's columns, or when nothing was tested.\n"
      "Example: vpsbake stress gear.vps.hdf --mesh gear.obj --quick --junit stress.xml -o stress");
  return {stress, [arguments] {
            arguments->subject.cache = arguments->mesh.cache;
            return run_stress(*arguments);
          }};
}

}  // namespace vps::cli
