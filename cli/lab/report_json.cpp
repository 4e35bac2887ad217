// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/report_json.h"

#include <fmt/format.h>

#include <cmath>

#include "bake/quantity_text.h"
#include "cli/lab/units.h"

namespace vps::cli {
namespace {

using lab::Held;
using lab::Row;
using lab::Setting;
using lab::Spread;
using lab::Times;
using nlohmann::ordered_json;

template <class T>
ordered_json or_null(bool known, const T& value) {
  return known ? ordered_json(value) : ordered_json(nullptr);
}

// Null for NaN.
ordered_json or_null(double value) {
  return or_null(!std::isnan(value), value);
}

ordered_json to_json(const Spread& s) {
  if (s.told == 0) return nullptr;
  return {{"asked", s.asked}, {"told", s.told},        {"p50", s.p50},
          {"rms", s.rms},     {"p99", or_null(s.p99)}, {"max", s.max}};
}

ordered_json to_json(const Times& t) {
  if (t.rounds == 0) return nullptr;
  return {{"rounds", t.rounds},       {"p50", t.p50},
          {"p99", or_null(t.p99)},    {"max", t.max},
          {"noise_p50", t.noise_p50}, {"noise_p99", or_null(t.noise_p99)},
          {"noise_max", t.noise_max}};
}

ordered_json to_json(const Held& h) {
  if (h.asked == 0) return nullptr;
  return {{"asked", h.asked}, {"held", h.held}};
}

const char* reading_name(lab::Reading reading) {
  switch (reading) {
    case lab::Reading::nearest:
      return "nearest";
    case lab::Reading::trilinear:
      return "trilinear";
    case lab::Reading::queries:
      break;
  }
  return "queries";
}

ordered_json setting_to_json(const Setting& s) {
  return {{"voxel_size", s.bake.voxel_size},
          {"alpha", s.bake.alpha},
          {"field", lab::describe(lab::field_of(s.bake))},
          {"reading", reading_name(s.reading)},
          {"precision", or_null(s.bake.precision != bake::BakeOptions::kAutoPrecision, s.bake.precision)},
          {"branching", s.bake.branching},
          {"level", s.level},
          {"max_tests", s.max_tests},
          {"max_microseconds", s.max_microseconds}};
}

ordered_json errors_to_json(const Row& row) {
  const lab::ContactErrors& c = row.errors.contact;
  const lab::ContactErrors& d = row.errors.deep;
  return {{"penetration", to_json(c.penetration)},
          {"distance", to_json(row.distance)},
          {"normal_deg", to_json(c.normal)},
          {"force_percent", to_json(c.force)},
          {"force_direction_deg", to_json(c.force_direction)},
          {"torque_percent", to_json(c.torque)},
          {"deep_penetration", to_json(d.penetration)},
          {"deep_normal_deg", to_json(d.normal)},
          {"deep_force_percent", to_json(d.force)},
          {"deep_force_direction_deg", to_json(d.force_direction)},
          {"deep_torque_percent", to_json(d.torque)}};
}

ordered_json missed_to_json(const lab::ContactErrors& errors) {
  return {{"asked", errors.penetration.asked}, {"missed", errors.missed}};
}

ordered_json left_out_to_json(const std::vector<lab::LeftOut>& left_out) {
  ordered_json out = ordered_json::array();
  for (const lab::LeftOut& one : left_out) out.push_back({{"name", one.name}, {"why", one.why}});
  return out;
}

ordered_json row_to_json(const Row& row) {
  return {{"name", row.name},
          {"series", row.series},
          {"knob", row.knob},
          {"kind", row.setting ? "ours" : "peer"},
          {"way", lab::describe(row.way)},
          {"depth_of", lab::describe(row.depth_of)},
          {"remark", row.remark},
          {"repeatable", !row.setting || row.setting->repeatable()},
          {"setting", row.setting ? setting_to_json(*row.setting) : ordered_json(nullptr)},
          {"points", or_null(row.points > 0, row.points)},
          {"bytes", or_null(row.bytes > 0, row.bytes)},
          {"bake_seconds", or_null(row.bake_seconds > 0, row.bake_seconds)},
          {"field_bound", or_null(row.field_bound > 0, row.field_bound)},
          {"covering_radius", or_null(row.covering_radius > 0, row.covering_radius)},
          {"contacts_us", to_json(row.contacts)},
          {"distances_us", to_json(row.distances)},
          {"steps", steps_to_json(row.steps)},
          {"missed", missed_to_json(row.errors.contact)},
          {"deep_missed", missed_to_json(row.errors.deep)},
          {"errors", errors_to_json(row)},
          {"bounds", {{"separation", to_json(row.separation_held)}, {"budget", to_json(row.budget_held)}}}};
}

ordered_json poses_to_json(const lab::GroundTruth& truth, lab::PoseKind range, double least, double most) {
  const auto i = std::size_t(range);
  return {{"count", truth.found[i]}, {"sought", truth.options.poses[i]}, {"least", least}, {"most", most}};
}

const char* cost_name(lab::Cost cost) {
  switch (cost) {
    case lab::Cost::bytes:
      return "bytes";
    case lab::Cost::step:
      return "steps.dearest_us.p99";
    case lab::Cost::time:
      break;
  }
  return "contacts_us.p50";
}

ordered_json front_to_json(const lab::Measurement& m, const lab::Front& front) {
  ordered_json out = {{"way", lab::describe(front.way)},
                      {"cost", cost_name(front.cost)},
                      {"line", front_line(m, front)},
                      {"members", ordered_json::array()},
                      {"left_out", left_out_to_json(front.left_out)}};
  for (const lab::Front::Member& one : front.members) {
    out["members"].push_back({{"name", m.rows[one.row].name}, {"tied", one.tied}});
  }
  return out;
}

void flatten(const ordered_json& json, const std::string& prefix,
             std::vector<std::pair<std::string, ordered_json>>& out) {
  for (const auto& [key, value] : json.items()) {
    const std::string name = prefix.empty() ? key : prefix + "." + key;
    if (value.is_object()) {
      flatten(value, name, out);
    } else {
      out.emplace_back(name, value);
    }
  }
}

std::string csv_cell(const ordered_json& value) {
  if (value.is_null()) return "";
  if (!value.is_string()) return value.dump();
  std::string out = "\"";
  for (const char c : value.get<std::string>()) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

// The columns of a row that has all values. Other rows may have null in the place of an object.
ordered_json all_columns() {
  Row row;
  row.setting.emplace();
  row.contacts.rounds = row.distances.rounds = 1;
  for (lab::StepTimes& scene : row.steps.scenes) scene.whole.rounds = scene.narrowphase.rounds = 1;
  Spread* const spreads[] = {&row.distance,
                             &row.errors.contact.penetration,
                             &row.errors.contact.normal,
                             &row.errors.contact.force,
                             &row.errors.contact.force_direction,
                             &row.errors.contact.torque,
                             &row.errors.deep.penetration,
                             &row.errors.deep.normal,
                             &row.errors.deep.force,
                             &row.errors.deep.force_direction,
                             &row.errors.deep.torque};
  for (Spread* const spread : spreads) spread->told = 1;
  row.separation_held.asked = row.budget_held.asked = 1;
  return row_to_json(row);
}

}  // namespace

ordered_json measure_definitions() {
  const auto entry = [](const char* unit, const char* title, const char* text) {
    return ordered_json{{"unit", unit}, {"title", title}, {"text", text}};
  };
  return {
      {"penetration",
       entry("m", "penetration",
             "Reported depth against exact depth, over the poses in contact; where a contact is missed, the whole "
             "depth. The "
             "exact depth is that of the deepest point of the first body's surface below the second's.")},
      {"distance",
       entry("m", "distance",
             "Reported distance against exact distance, over the poses apart: vpsbake's by the query `separation`, "
             "those of other "
             "libraries in Bullet by their contacts, where they have any.")},
      {"normal_deg",
       entry("degrees", "normal direction",
             "At the deepest reported contact: between its direction and the exact one at that place, towards the "
             "nearest point of the second body's surface. Poses in contact.")},
      {"force_percent",
       entry("%", "total force",
             "Length of the difference between reported and exact total force, over the RMS of the exact forces of all "
             "poses in contact. The exact force is the integral of V n over the surface in touch.")},
      {"force_direction_deg",
       entry("degrees", "direction of the total force",
             "Between reported and exact total force; poses in contact that are pressed from one side (a force of at "
             "least a tenth of the integral of V).")},
      {"torque_percent",
       entry(
           "%", "total torque",
           "Length of the difference between reported and exact total torque about the centre of mass, over the RMS of "
           "the exact forces times half the body's longest side. Poses in contact.")},
      {"deep_penetration", entry("m", "penetration, deep poses", "As penetration, over the deep poses.")},
      {"deep_normal_deg",
       entry("degrees", "normal direction, deep poses", "As normal direction, over the deep poses.")},
      {"deep_force_percent", entry("%", "total force, deep poses", "As total force, over the deep poses.")},
      {"deep_force_direction_deg", entry("degrees", "direction of the total force, deep poses",
                                         "As direction of the total force, over the deep poses.")},
      {"deep_torque_percent", entry("%", "total torque, deep poses", "As total torque, over the deep poses.")}};
}

ordered_json steps_to_json(const lab::SceneTimes& steps) {
  if (steps.dearest().rounds == 0) return nullptr;
  ordered_json out;
  for (const lab::Scene scene : lab::kScenes) {
    const lab::StepTimes& times = steps.scenes[std::size_t(scene)];
    out[lab::describe(scene)] = {{"whole_us", to_json(times.whole)}, {"narrowphase_us", to_json(times.narrowphase)}};
  }
  out["dearest_us"] = to_json(steps.dearest());
  return out;
}

ordered_json mesh_to_json(const ReportedMesh& mesh) {
  const lab::Measurement& m = mesh.measured;
  const lab::TruthOptions& t = m.truth.options;
  ordered_json out = {{"file", mesh.file},
                      {"bake_command", mesh.bake_command},
                      {"triangles", mesh.triangles},
                      {"size", m.size},
                      {"repair", describe(mesh.closed.repair)},
                      {"filled_share", mesh.closed.filled_share},
                      {"notes", mesh.closed.notes},
                      {"poses",
                       {{"apart", poses_to_json(m.truth, lab::PoseKind::apart, -t.gap, 0)},
                        {"contact", poses_to_json(m.truth, lab::PoseKind::contact, 0, t.contact)},
                        {"deep", poses_to_json(m.truth, lab::PoseKind::deep, t.contact, t.deep)}}},
                      {"oracle",
                       {{"depth_tolerance", t.tolerance},
                        {"force_tolerance", t.wrench.tolerance},
                        {"force_error", m.truth.wrench_error},
                        {"force_rms", m.truth.force_rms[std::size_t(lab::PoseKind::contact)]},
                        {"deep_force_rms", m.truth.force_rms[std::size_t(lab::PoseKind::deep)]}}},
                      {"bake_noise", or_null(m.bake_noise)},
                      {"rows", ordered_json::array()},
                      {"left_out", left_out_to_json(m.left_out)},
                      {"fronts", ordered_json::array()}};
  for (const Row& row : m.rows) out["rows"].push_back(row_to_json(row));
  for (const lab::Front& front : m.fronts) out["fronts"].push_back(front_to_json(m, front));
  return out;
}

std::string rows_to_csv(const ordered_json& report) {
  std::vector<std::pair<std::string, ordered_json>> columns;
  flatten(all_columns(), "", columns);
  std::string out = "mesh";
  for (const auto& [name, value] : columns) out += "," + name;
  out += "\n";
  for (const ordered_json& mesh : report["meshes"]) {
    for (const ordered_json& row : mesh["rows"]) {
      std::vector<std::pair<std::string, ordered_json>> cells;
      flatten(row, "", cells);
      out += csv_cell(mesh["file"]);
      for (const auto& [name, ignored] : columns) {
        out += ",";
        for (const auto& [cell, value] : cells) {
          if (cell == name) out += csv_cell(value);
        }
      }
      out += "\n";
    }
  }
  return out;
}

std::string front_line(const lab::Measurement& m, const lab::Front& front) {
  const bool bytes = front.cost == lab::Cost::bytes;
  const bool step = front.cost == lab::Cost::step;
  std::string out = fmt::format("Pareto front, {}, RMS error of penetration against {}:",
                                step                           ? "whole steps in Bullet"
                                : front.way == lab::Way::query ? "bare queries"
                                                               : "whole collisions in Bullet",
                                bytes ? "size of the file, smallest first"
                                      : fmt::format("{}, fastest first (~: as fast as the one before, within noise)",
                                                    step ? "99 % of the steps of the slowest scene" : "median time"));
  if (front.members.empty()) return out + " none";
  std::vector<double> errors;
  for (const auto& [i, tied] : front.members) errors.push_back(m.rows[i].errors.contact.penetration.rms);
  const lab::LengthUnit unit = lab::unit_for(errors);
  for (const auto& [i, tied] : front.members) {
    const Row& row = m.rows[i];
    out += fmt::format("{} {}{} ({}, {})", i == front.members.front().row ? "" : ";", tied ? "~ " : "", row.name,
                       bytes ? bake::format_bytes(double(row.bytes))
                             : fmt::format("{:.3g} us", step ? row.steps.dearest().p99 : row.contacts.p50),
                       unit.text(row.errors.contact.penetration.rms));
  }
  return out;
}

}  // namespace vps::cli
