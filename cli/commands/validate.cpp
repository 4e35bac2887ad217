// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <system_error>

#include "bake/quantity_text.h"
#include "cli/commands/open_asset.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/mesh_bounds.h"
#include "cli/tools/provenance.h"
#include "cli/tools/standard_streams.h"
#include "cli/tools/utf8.h"
#include "cli/tools/validate/check.h"
#include "formats/mesh/mesh_import.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;
using Result = Check::Result;

struct ValidateArguments {
  std::vector<std::string> files;
  BakeArguments mesh;
  MeshCheckOptions options;
  Verbosity verbosity = Verbosity::usual;
  bool strict = false;
  bool json = false;
};

struct Validation {
  std::string file;
  std::uint64_t bytes = 0;
  std::vector<Check> checks;
  int code = kOk;
};

const char* result_word(Result result) {
  switch (result) {
    case Result::ok:
      return "ok";
    case Result::warning:
      return "warning";
    case Result::skipped:
      return "skipped";
    case Result::failed:
      return "FAILED";
  }
  return "";
}

TextColour colour_of(Result result) {
  switch (result) {
    case Result::ok:
      return TextColour::green;
    case Result::warning:
    case Result::skipped:
      return TextColour::yellow;
    case Result::failed:
      return TextColour::red;
  }
  return TextColour::plain;
}

bool counts(const Check& check, bool strict) {
  return check.result == Result::failed || (strict && check.result != Result::ok);
}

nlohmann::ordered_json to_json(const Validation& validation) {
  nlohmann::ordered_json j;
  j["file"] = validation.file;
  j["valid"] = validation.code == kOk;
  j["checks"] = nlohmann::ordered_json::array();
  for (const Check& check : validation.checks) {
    nlohmann::ordered_json one = {
        {"name", check.name}, {"result", result_word(check.result)}, {"says", one_line(check.says)}};
    if (check.result == Result::failed) one["result"] = "failed";
    if (!check.figures.is_null()) one["figures"] = check.figures;
    j["checks"].push_back(std::move(one));
  }
  return j;
}

void print_validate(const Validation& validation) {
  print_lines("{}: {}\n", one_line(validation.file), bake::format_bytes(double(validation.bytes)));
  for (const Check& check : validation.checks) {
    const std::string verdict =
        painted(fmt::format("{:<8}", result_word(check.result)), colour_of(check.result), STDOUT_FILENO);
    print_lines("  {} {:<14} {}\n", verdict, check.name, one_line(check.says));
  }
  std::fflush(stdout);
}

// What to do about a file that opens, and is not valid.
std::string_view advise(const std::vector<Check>& checks) {
  const auto has = [&](Result result, std::string_view name) {
    return std::any_of(checks.begin(), checks.end(),
                       [&](const Check& check) { return check.result == result && check.name == name; });
  };
  if (has(Result::failed, "hashes") || has(Result::failed, "hdf5")) return "copy or bake it again";
  if (has(Result::warning, "mesh"))
    return "check that this is its mesh, with the --unit, --scale, --repair and --open-surface of the bake";
  return "bake it again, with smaller voxels if it fails again";
}

// @throw BakeError and ImportError of the mesh
void run_checks(const ValidateArguments& arguments, const std::optional<ImportedMesh>& mesh, Validation& validation) {
  Asset asset;
  std::vector<Check>& checks = validation.checks;
  const std::string file = file_to_read(validation.file).string();
  if (!check_structure(file, asset, checks)) return;
  check_file(file, asset, checks);
  // More checks of damaged numbers would only repeat the failure.
  const bool sound =
      std::none_of(checks.begin(), checks.end(), [](const Check& c) { return c.result == Result::failed; });
  if (!sound) return;
  check_contents(asset, checks);
  check_origin(asset, checks);
  if (!mesh) return;
  bake::BakeOptions options = arguments.mesh.options;
  options.voxel_size = asset.info().voxel_size;
  const bake::ClosedMesh closed = [&] {
    try {
      return bake::closed_mesh(*mesh, options);
    } catch (const bake::BakeError& error) {
      // A mesh in another unit does not fit the asset's voxels.
      const std::string refusal = mesh_refusal(*mesh, asset.info());
      if (refusal.empty()) throw;
      throw bake::BakeError(error.stage, refusal);
    }
  }();
  check_against_mesh(asset, closed.mesh, arguments.options, checks);
}

int validate_file(const ValidateArguments& arguments, const std::optional<ImportedMesh>& mesh, Validation& validation) {
  const fs::path file = file_to_read(validation.file);
  check_is_file(file, kAssetFile);
  std::error_code error;
  validation.bytes = fs::file_size(file, error);
  std::string refusal;
  try {
    run_checks(arguments, mesh, validation);
  } catch (const bake::BakeError& of_mesh) {
    refusal = of_mesh.what();
  }
  const bool prints = !arguments.json && arguments.verbosity != Verbosity::quiet;
  if (prints) print_validate(validation);
  if (!refusal.empty()) return fail(kBadInput, arguments.mesh.mesh, refusal);
  std::string failed;
  for (const Check& check : validation.checks) {
    if (counts(check, arguments.strict)) failed += (failed.empty() ? "" : ", ") + check.name;
  }
  if (failed.empty()) {
    if (prints)
      print_lines("{}: {}, {} checks\n", one_line(validation.file), painted("valid", TextColour::green, STDOUT_FILENO),
                  validation.checks.size());
    return kOk;
  }
  const Check& structure = validation.checks.front();
  const bool opens = structure.result != Result::failed;
  return fail(kBadInput, validation.file,
              "not valid: " + (opens ? fmt::format("{}; {}", failed, advise(validation.checks)) : structure.says));
}

int run_validate(const ValidateArguments& arguments) {
  std::optional<ImportedMesh> mesh;
  if (!arguments.mesh.mesh.empty()) mesh = import_with(arguments.mesh);
  nlohmann::ordered_json j = {{"format", "vpsbake validate 1"}};
  j.update(provenance(arguments.options.seed));
  j["strict"] = arguments.strict;
  j["mesh"] =
      arguments.mesh.mesh.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(arguments.mesh.mesh);
  j["files"] = nlohmann::ordered_json::array();
  int code = kOk;
  for (const std::string& file : arguments.files) {
    Validation validation{file, 0, {}, kOk};
    validation.code = guarded(file, [&] { return validate_file(arguments, mesh, validation); });
    if (validation.code != kOk) code = arguments.files.size() > 1 ? int{kSomeFailed} : validation.code;
    j["files"].push_back(to_json(validation));
  }
  if (arguments.json) fmt::print("{}", to_text(j));
  return code;
}

}  // namespace

Command add_validate_command(CLI::App& app) {
  CLI::App* const validate = app.add_subcommand("validate", "Check assets thoroughly, against their mesh too");
  const auto arguments = std::make_shared<ValidateArguments>();
  validate->add_option("ASSET...", arguments->files, "Assets")->required();
  validate->add_option("--mesh", arguments->mesh.mesh, "The mesh they were baked from: errors are measured against it")
      ->check(not_empty())
      ->option_text("MESH");
  add_integer(*validate, "--samples", arguments->options.samples, 100, 10000000,
              "Points that each check against the mesh takes, 100 to 10000000 [default: 10000]")
      ->option_text("N");
  validate->add_flag("--strict", arguments->strict, "Count warnings, and what could not be checked, as failures");
  validate->add_flag("--json", arguments->json, "Print JSON")->group("Output");
  add_verbosity_options(*validate, arguments->verbosity, "Print errors only", nullptr);
  add_surface_options(*validate, arguments->mesh);
  add_import_options(*validate, arguments->mesh);
  add_format_option(*validate, arguments->mesh);
  for (const char* const name : {"--samples", "--unit", "--scale", "--repair", "--open-surface", "--import-memory",
                                 "--import-timeout", "--format"}) {
    validate->get_option(name)->needs("--mesh");
  }
  validate->footer("Example: vpsbake validate gear.vps.hdf --mesh gear.stl --unit mm --strict");
  return {validate, [arguments] {
            const std::string& about = arguments->mesh.mesh.empty() ? arguments->files[0] : arguments->mesh.mesh;
            return guarded(about, [&] { return run_validate(*arguments); });
          }};
}

}  // namespace vps::cli
