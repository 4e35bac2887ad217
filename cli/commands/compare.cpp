// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>

#include <memory>
#include <numbers>

#include "bake/quantity_text.h"
#include "cli/commands/open_asset.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/tools/compare/compare_assets.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/stored_field.h"

namespace vps::cli {
namespace {

struct CompareArguments {
  std::string a, b;
  bool json = false;
};

constexpr double kDegrees = 180 / std::numbers::pi;

const char* same_word(Comparison::Same same) {
  return same == Comparison::Same::bytes ? "bytes" : same == Comparison::Same::content ? "content" : "nothing";
}

std::string shown(const std::string& value) {
  return value.empty() ? "none" : printable(value);
}

nlohmann::ordered_json values_to_json(const std::vector<ValueDifference>& values) {
  auto j = nlohmann::ordered_json::array();
  for (const auto& [name, a, b] : values) j.push_back({{"name", name}, {"a", a}, {"b", b}});
  return j;
}
nlohmann::ordered_json distance_to_json(const ShellDistance& d) {
  return {{"max", d.max}, {"rms", d.rms}, {"normal_angle_max", d.angle_max}, {"normal_angle_mean", d.angle_mean}};
}

nlohmann::ordered_json to_json(const CompareArguments& arguments, const Comparison& comparison) {
  nlohmann::ordered_json j = {{"format", "vpsbake compare 1"},
                              {"a", arguments.a},
                              {"b", arguments.b},
                              {"same", same_word(comparison.same)},
                              {"settings", values_to_json(comparison.settings)},
                              {"facts", values_to_json(comparison.facts)},
                              {"sections", comparison.sections}};
  j["fields"] = nlohmann::ordered_json::array();
  for (const FieldDifference& f : comparison.fields) {
    j["fields"].push_back({{"field", field_name(f.field)},
                           {"points", f.points},
                           {"only_a", f.only_a},
                           {"only_b", f.only_b},
                           {"max", f.max},
                           {"rms", f.rms},
                           {"p99", f.p99},
                           {"at", f.at}});
  }
  if (const auto& s = comparison.shell) {
    j["shell"] = {{"points", s->points},
                  {"nodes", s->nodes},
                  {"area", s->area},
                  {"a_to_b", distance_to_json(s->a_to_b)},
                  {"b_to_a", distance_to_json(s->b_to_a)}};
  }
  return j;
}

void print_values(const char* what, const std::vector<ValueDifference>& values) {
  for (const auto& [name, a, b] : values) {
    print_lines("{:<9} {:<32} {}  |  {}\n", what, printable(name), shown(a), shown(b));
  }
}

void print_field(const FieldDifference& f, double voxel) {
  if (f.points == 0) return print_lines("field     {:<7} no point is stored in both\n", field_name(f.field));
  print_lines(
      "field     {:<7} V differs by {} at most ({:.3g} voxels), at ({:.4g}, {:.4g}, {:.4g}) m; 99 % {}, RMS {}\n",
      field_name(f.field), bake::format_length(f.max), f.max / voxel, f.at[0], f.at[1], f.at[2],
      bake::format_length(f.p99), bake::format_length(f.rms));
  print_lines("          at {} points; {} more are stored in A alone, {} in B alone\n", f.points, f.only_a, f.only_b);
}

void print_distance(const char* which, const ShellDistance& d) {
  print_lines(
      "          {}: nearest points are {} apart at most, RMS {}; normals turn by {:.3g} degrees, {:.3g} at most\n",
      which, bake::format_length(d.max), bake::format_length(d.rms), kDegrees * d.angle_mean, kDegrees * d.angle_max);
}

void print_compare(const CompareArguments& arguments, const Comparison& comparison, double voxel) {
  print_lines("A is {}, B is {}\n", arguments.a, arguments.b);
  if (comparison.same == Comparison::Same::bytes) return print_lines("the same bytes\n");
  print_values("setting", comparison.settings);
  print_values("fact", comparison.facts);
  if (comparison.same == Comparison::Same::content) {
    return print_lines("the same content: only the record, the program's name or HDF5's own bytes differ\n");
  }
  print_lines("sections  differ: {}\n", fmt::join(comparison.sections, ", "));
  for (const FieldDifference& field : comparison.fields) print_field(field, voxel);
  if (const auto& s = comparison.shell) {
    print_lines("shell     {} | {} points, {} | {} nodes, {:.6g} | {:.6g} m^2\n", s->points[0], s->points[1],
                s->nodes[0], s->nodes[1], s->area[0], s->area[1]);
    print_distance("A to B", s->a_to_b);
    print_distance("B to A", s->b_to_a);
  }
  print_lines("they differ\n");
}

int run_compare(const CompareArguments& arguments) {
  Asset a, b;
  if (const int code = open_asset(arguments.a, a); code != kOk) return code;
  if (const int code = open_asset(arguments.b, b); code != kOk) return code;
  const Comparison comparison = compare_assets(a, b);
  if (arguments.json) {
    fmt::print("{}", to_text(to_json(arguments, comparison)));
  } else {
    print_compare(arguments, comparison, a.info().voxel_size);
  }
  return comparison.same == Comparison::Same::nothing ? kSomeFailed : kOk;
}

}  // namespace

Command add_compare_command(CLI::App& app) {
  CLI::App* const compare = app.add_subcommand("compare", "Say whether two assets are the same, and how they differ");
  const auto arguments = std::make_shared<CompareArguments>();
  compare->add_option("ASSET", arguments->a, "Asset")->required()->option_text("ASSET");
  compare->add_option("OTHER", arguments->b, "Another, in the same frame")->required()->option_text("ASSET");
  compare->add_flag("--json", arguments->json, "Print JSON");
  compare->footer(
      "Exit codes: 0 the same content, 5 they differ\nExample: vpsbake compare old/gear.vps.hdf new/gear.vps.hdf");
  return {compare, [arguments] { return guarded(arguments->a, [&] { return run_compare(*arguments); }); }};
}

}  // namespace vps::cli
