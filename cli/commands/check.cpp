// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "bake/quantity_text.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/terminal/progress.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/likely_unit.h"
#include "cli/tools/utf8.h"

namespace vps::cli {
namespace {

// The likely unit of the file's numbers.
std::string guess_unit(const BakeArguments& arguments, const bake::MeshReport& r) {
  double longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) longest = std::max(longest, r.bounds_max[axis] - r.bounds_min[axis]);
  const ImportOptions import = complete_settings(arguments).import;
  return likely_unit(mesh_format(arguments.mesh, import), longest / import.unit);
}

nlohmann::ordered_json to_json(const BakeArguments& arguments, const bake::MeshReport& r) {
  nlohmann::ordered_json j = {{"mesh", arguments.mesh},
                              {"triangles", r.triangles},
                              {"vertices", r.vertices},
                              {"bounds_min", r.bounds_min},
                              {"bounds_max", r.bounds_max},
                              {"likely_unit", guess_unit(arguments, r)},
                              {"components", r.components},
                              {"open_edges", r.open_edges},
                              {"nonmanifold_edges", r.nonmanifold_edges},
                              {"nonmanifold_vertices", r.nonmanifold_vertices},
                              {"inconsistent_edges", r.inconsistent_edges},
                              {"collapsed", r.collapsed},
                              {"duplicates", r.duplicates},
                              {"self_intersections", r.self_intersections},
                              {"inside_out", r.inside_out},
                              {"usable", r.usable}};
  if (!r.usable) {
    j["refusal"] = r.refusal;
    return j;
  }
  j["repair"] = describe(r.repair);
  j["filled_share"] = r.filled_share;
  j["notes"] = r.notes;
  j["area"] = r.area;
  j["volume"] = r.volume;
  j["wall_median"] = r.wall_median;
  j["wall_p01"] = r.wall_p01;
  j["thin_share"] = r.thin_share;
  return j;
}

// A thickness is infinite where no wall lies opposite: at the edges of a box, and where faces meet at an acute angle.
std::string walls_text(const bake::MeshReport& r) {
  if (std::isinf(r.wall_p01)) return "none: hardly any of the surface has a wall opposite to it";
  if (std::isinf(r.wall_median)) {
    return fmt::format("half of the surface or more has no wall opposite to it; 1 % has one thinner than {}",
                       bake::format_length(r.wall_p01));
  }
  return fmt::format("half of the surface has walls thicker than {}, 99 % thicker than {}",
                     bake::format_length(r.wall_median), bake::format_length(r.wall_p01));
}

// After the size of the mesh.
std::string unit_hint(const BakeArguments& arguments, const bake::MeshReport& r) {
  if (arguments.unit > 0) return "";
  const std::string unit = guess_unit(arguments, r);
  return unit == "m" ? "" : fmt::format("; likely {0}, add --unit {0}", unit);
}

void print_check(const BakeArguments& arguments, const bake::MeshReport& r) {
  print_lines("{}: {} triangles, {} vertices, {} component{}\n", one_line(arguments.mesh), r.triangles, r.vertices,
              r.components, r.components == 1 ? "" : "s");
  print_lines("size        {} x {} x {}{}\n", bake::format_length(r.bounds_max[0] - r.bounds_min[0]),
              bake::format_length(r.bounds_max[1] - r.bounds_min[1]),
              bake::format_length(r.bounds_max[2] - r.bounds_min[2]), unit_hint(arguments, r));
  const auto line = [](const char* name, std::size_t count, const char* what) {
    const std::string text = count == 0 ? "none" : std::to_string(count);
    const TextColour colour = count == 0 ? TextColour::green : TextColour::yellow;
    print_lines("{:<11} {}{}\n", name, painted(text, colour, STDOUT_FILENO), count == 0 ? "" : what);
  };
  line("open", r.open_edges, " edges with one triangle");
  line("nonmanifold", r.nonmanifold_edges, " edges with more than two triangles");
  if (r.nonmanifold_vertices > 0) line("", r.nonmanifold_vertices, " vertices where several fans of triangles meet");
  line("winding", r.inconsistent_edges, " edges whose triangles disagree");
  if (r.inside_out) print_lines("            the mesh is inside out\n");
  line("collapsed", r.collapsed, " triangles without area");
  line("duplicate", r.duplicates, " triangles on the vertices of others");
  line("crossing", r.self_intersections, " pairs of triangles that meet where they should not");
  if (!r.usable) return;
  print_lines("repair      {}\n", describe(r.repair));
  for (const std::string& note : r.notes) print_lines("            {}\n", note);
  print_lines("solid       {:.6g} m^2, {:.6g} m^3\n", r.area, r.volume);
  print_lines("walls       {}; {:.1f} % is thinner than two voxels\n", walls_text(r), 100 * r.thin_share);
}

int run_check(const BakeArguments& arguments) {
  return guarded(arguments.mesh, [&] {
    const Progress progress;
    progress.show("reading the mesh", 0);
    const ImportedMesh mesh = import_with(arguments);
    bake::BakeOptions options = arguments.options;
    options.progress = [&](const char* step, double fraction) { progress.show(step, fraction); };
    const bake::MeshReport report = bake::inspect_mesh(mesh, options);
    progress.clear();
    if (arguments.json) {
      fmt::print("{}", to_text(to_json(arguments, report)));
    } else {
      print_check(arguments, report);
    }
    std::fflush(stdout);
    if (!report.usable) return fail(kBadInput, arguments.mesh, report.refusal);
    (void)bake::plan_bake(mesh, arguments.options);  // throws when the grid does not fit
    if (!arguments.json)
      print_lines("{}: {}\n", one_line(arguments.mesh), painted("it bakes", TextColour::green, STDOUT_FILENO));
    return int{kOk};
  });
}

}  // namespace

Command add_check_command(CLI::App& app) {
  CLI::App* const check = app.add_subcommand("check", "Say what is wrong with a mesh and whether it would bake");
  const auto arguments = std::make_shared<BakeArguments>();
  add_mesh_options(*check, *arguments)->required();
  add_import_options(*check, *arguments);
  add_format_option(*check, *arguments);
  add_grid_options(*check, *arguments);
  check->add_flag("--json", arguments->json, "Print JSON")->group("Output");
  check->footer("Example: vpsbake check scan.ply --voxel 1mm");
  return {check, [arguments] {
            set_default_grid(*arguments);
            return run_check(*arguments);
          }};
}

}  // namespace vps::cli
