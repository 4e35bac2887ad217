// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "bake/quantity_text.h"
#include "cli/commands/open_asset.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/open_page.h"
#include "cli/terminal/write_output.h"
#include "cli/tools/mesh_bounds.h"
#include "cli/tools/output_file.h"
#include "cli/tools/standard_streams.h"
#include "cli/tools/view/motion_data.h"
#include "cli/tools/view/page.h"
#include "cli/tools/view/view_data.h"

namespace vps::cli {
namespace {

struct ViewArguments {
  std::string asset;
  std::vector<std::string> motions;  ///< instead of an asset
  BakeArguments mesh;                ///< --mesh and how to read it; mesh.output is the page
  bool open = false;                 ///< in a browser
};

int write_page(const ViewArguments& arguments, const std::filesystem::path& output, std::string_view page) {
  const int code = write_output(output, page);
  if (code == kOk && arguments.open) open_page(output);
  return code;
}

int view_asset(const ViewArguments& arguments) {
  const std::filesystem::path output =
      arguments.mesh.output.empty() ? beside(arguments.asset, ".html") : std::filesystem::path(arguments.mesh.output);
  Asset asset;
  if (const int code = open_asset(arguments.asset, asset); code != kOk) return code;
  if (const std::string reason = output_refusal(output, page_beginning(kViewPage), "a page of view"); !reason.empty())
    return fail(kIo, output.string(), reason);
  ImportedMesh mesh;
  if (!arguments.mesh.mesh.empty()) {
    mesh = import_with(arguments.mesh);
    if (const std::string reason = mesh_refusal(mesh, asset.info()); !reason.empty())
      return fail(kBadInput, arguments.mesh.mesh, reason);
  }
  const auto data = view_data(asset, asset_name(arguments.asset), mesh.triangles.empty() ? nullptr : &mesh);
  return write_page(arguments, output, make_view_page(kViewPage, data));
}

int view_motions(const ViewArguments& arguments) {
  std::filesystem::path output = arguments.mesh.output;
  if (output.empty()) output = std::filesystem::path(arguments.motions[0]).replace_extension(".html");
  nlohmann::ordered_json data = {{"motions", nlohmann::ordered_json::array()}};
  for (const std::string& motion : arguments.motions) {
    const int code = guarded(motion, [&] {
      data["motions"].push_back(motion_data(motion));
      return int{kOk};
    });
    if (code != kOk) return code;
  }
  // After the motions: where their folder is missing, so is the page's.
  if (const std::string reason = output_refusal(output, page_beginning(kMotionPage), "a page of view --motion");
      !reason.empty())
    return fail(kIo, output.string(), reason);
  return write_page(arguments, output, make_view_page(kMotionPage, data));
}

int run_view(const ViewArguments& arguments) {
  const std::string& output = arguments.mesh.output;
  if (arguments.open && is_standard_stream(output.empty() ? arguments.asset : output))
    return fail(kCommandLine, "command line", "--open needs a page that is a file; give its name with -o");
  if (!arguments.motions.empty()) return view_motions(arguments);
  if (arguments.asset.empty())
    return fail(kCommandLine, "command line", "view needs an asset or --motion; run vpsbake view --help");
  return guarded(arguments.mesh.mesh.empty() ? arguments.asset : arguments.mesh.mesh,
                 [&] { return view_asset(arguments); });
}

}  // namespace

Command add_view_command(CLI::App& app) {
  CLI::App* const view =
      app.add_subcommand("view", "Write a page that shows an asset: surface, voxels, field, points, tree");
  const auto arguments = std::make_shared<ViewArguments>();
  auto* const asset = view->add_option("ASSET", arguments->asset, "Asset");
  view->add_option("--motion", arguments->motions, "Play recorded motions instead, docs/motion.md")
      ->check(not_empty())
      ->excludes(asset)
      ->option_text("FILE.json...");
  view->add_option("-o,--output", arguments->mesh.output, "Page to write [default: NAME.html beside the asset]")
      ->check(not_empty())
      ->option_text("FILE");
  add_open_option(*view, arguments->open);
  auto* const motion = view->get_option("--motion");
  view->add_option(
          "--mesh", arguments->mesh.mesh,
          "The mesh that the asset was baked from: shown over the surface of its field, which is coloured by its error")
      ->check(not_empty())
      ->excludes(motion)
      ->option_text("MESH")
      ->group("Mesh");
  add_unit_options(*view, arguments->mesh);
  add_import_options(*view, arguments->mesh);
  for (const char* const name : {"--unit", "--scale", "--import-memory", "--import-timeout"})
    view->get_option(name)->needs("--mesh");
  view->footer("Example: vpsbake view gear.vps.hdf --mesh gear.obj\nExample: vpsbake view --motion run.json");
  return {view, [arguments] { return run_view(*arguments); }};
}

}  // namespace vps::cli
