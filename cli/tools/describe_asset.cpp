// SPDX-License-Identifier: GPL-3.0-or-later
// AssetInfo for people and for programs.
#include "cli/tools/describe_asset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <sstream>

#include "bake/quantity_text.h"
#include "bake/store/cache.h"
#include "cli/tools/face_jumps.h"
#include "cli/tools/stored_field.h"

namespace vps::cli {
namespace {

nlohmann::ordered_json certificate_to_json(const FieldCertificate& c) {
  return {{"max", c.max}, {"rms", c.rms}, {"p99", c.p99}, {"worst_at", c.worst_at}, {"bound", c.bound}};
}

nlohmann::ordered_json section_to_json(const Section& section) {
  return {{"name", section_name(section.kind)},
          {"kind", static_cast<std::uint32_t>(section.kind)},
          {"type", element_name(section.element)},
          {"shape", std::vector<std::uint64_t>(section.shape.begin(), section.shape.begin() + section.rank)},
          {"offset", section.offset},
          {"bytes", section.bytes},
          {"xxh3_64", fmt::format("{:016x}", section.hash)}};
}

std::string certificate_line(const char* name, const FieldCertificate& c) {
  if (c.max == 0 && c.rms == 0) return {};
  return fmt::format("  error of {:<8} max {}, 99 % {}, RMS {}, bound {}; worst at ({:.4g}, {:.4g}, {:.4g}) m\n",
                     std::string(name) + ":", bake::format_length(c.max), bake::format_length(c.p99),
                     bake::format_length(c.rms), bake::format_length(c.bound), c.worst_at[0], c.worst_at[1],
                     c.worst_at[2]);
}

}  // namespace

nlohmann::ordered_json info_to_json(const AssetInfo& info) {
  nlohmann::ordered_json j;
  j["generator"] = info.generator.data();
  j["mesh"] = {{"triangles", info.triangles},       {"vertices", info.vertices},
               {"bounds_min", info.bounds_min},     {"bounds_max", info.bounds_max},
               {"surface_area", info.surface_area}, {"hash", fmt::format("{:016x}", info.mesh_hash)}};
  j["mass"] = {{"volume", info.volume}, {"centre_of_mass", info.centre_of_mass}, {"inertia", info.inertia}};
  j["voxel_size"] = info.voxel_size;
  if (info.dims[0] > 0) {
    j["voxelmap"] = {{"dims", info.dims},
                     {"origin", info.origin},
                     {"precision", info.precision},
                     {"lambda", info.lambda},
                     {"band_inner", info.band_inner},
                     {"band_outer", info.band_outer},
                     {"surface_voxels", info.surface_voxels},
                     {"inner_voxels", info.inner_voxels}};
    auto& certificate = j["certificate"];
    certificate["samples"] = info.certificate_samples;
    if (info.layers_error.max > 0) certificate["layers"] = certificate_to_json(info.layers_error);
    if (info.scaled_error.max > 0) certificate["scaled"] = certificate_to_json(info.scaled_error);
    if (info.real_error.max > 0) certificate["real"] = certificate_to_json(info.real_error);
    if (info.far_spacing > 0) {
      j["far"] = {{"origin", info.far_origin},
                  {"spacing", info.far_spacing},
                  {"step_inner", info.far_step_inner},
                  {"step_outer", info.far_step_outer},
                  {"range", info.far_range}};
      certificate["far"] = certificate_to_json(info.far_error);
    }
  }
  if (info.points > 0) {
    j["pointshell"] = {{"points", info.points},
                       {"spacing", info.spacing},
                       {"covering_radius", info.covering_radius},
                       {"feature_covering_radius", info.feature_covering_radius},
                       {"normal_error_mean", info.normal_error_mean},
                       {"normal_error_max", info.normal_error_max},
                       {"position_origin", info.position_origin},
                       {"position_step", info.position_step},
                       {"area_step", info.area_step},
                       {"branching", info.branching},
                       {"levels", info.levels}};
  }
  return j;
}

std::vector<std::pair<std::string, std::string>> record_values(const Asset& asset) {
  std::vector<std::pair<std::string, std::string>> values;
  std::istringstream text(bake::record_of(asset).text);
  for (std::string line; std::getline(text, line);) {
    const std::size_t space = line.find(' ');
    if (space == std::string::npos) continue;
    const std::string name = line.substr(0, space);
    std::string value = line.substr(space + 1);
    // The record holds numbers in hexadecimal, which is exact.
    if (const auto number = bake::exact_number(value)) value = fmt::format("{:.12g}", *number);
    const auto found =
        std::find_if(values.begin(), values.end(), [&](const auto& earlier) { return earlier.first == name; });
    if (found == values.end()) {
      values.emplace_back(name, value);
    } else {
      found->second += " " + value;
    }
  }
  return values;
}

nlohmann::ordered_json asset_to_json(const std::string& path, const Asset& asset) {
  const Directory& directory = asset.directory();
  nlohmann::ordered_json j;
  j["file"] = path;
  j["format"] = fmt::format("{}.{}", directory.major, directory.minor);
  j["bytes"] = directory.file_bytes;
  j["xxh3_64"] = fmt::format("{:016x}", hash_bytes(asset.bytes()));
  j.update(info_to_json(directory.info));
  for (const auto& [field, jump] : face_jumps(asset)) {
    j["jumps"][field_name(field)] = {{"largest", jump.largest}, {"at", jump.place}};
  }
  for (const auto& [name, value] : record_values(asset)) j["record"][name] = value;
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    j["sections"].push_back(section_to_json(directory.sections[i]));
  }
  return j;
}

std::string printable(const std::string& text) {
  std::string out = text.substr(0, 100);
  for (char& c : out) c = std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
  return out;
}

std::string to_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

std::string info_to_text(const AssetInfo& info) {
  std::string out = fmt::format("mesh        {} triangles, {} vertices, {} x {} x {}\n", info.triangles, info.vertices,
                                bake::format_length(info.bounds_max[0] - info.bounds_min[0]),
                                bake::format_length(info.bounds_max[1] - info.bounds_min[1]),
                                bake::format_length(info.bounds_max[2] - info.bounds_min[2]));
  // A rounding error of zero is printed as 0.
  const double size = info.bounds_max[0] - info.bounds_min[0] + info.bounds_max[1] - info.bounds_min[1];
  const auto tidy = [&](double x) { return std::abs(x) < 1e-9 * size ? 0.0 : x; };
  out += fmt::format("mass        volume {:.6g} m^3, centre ({:.6g}, {:.6g}, {:.6g}) m\n", info.volume,
                     tidy(info.centre_of_mass[0]), tidy(info.centre_of_mass[1]), tidy(info.centre_of_mass[2]));
  if (info.dims[0] > 0) {
    out +=
        fmt::format("voxelmap    {} x {} x {} voxels of {}, {} on the surface, {} inside\n", info.dims[0], info.dims[1],
                    info.dims[2], bake::format_length(info.voxel_size), info.surface_voxels, info.inner_voxels);
    out += fmt::format("  distances from {} outside to {} inside; steps of {}\n", bake::format_length(info.band_outer),
                       bake::format_length(info.band_inner), bake::format_length(info.lambda));
    if (info.far_spacing > 0) {
      out += fmt::format("  coarse distances to {} outside and to the deepest place inside, {} apart\n",
                         bake::format_length(info.far_range), bake::format_length(info.far_spacing));
    }
    out += certificate_line("layers", info.layers_error);
    out += certificate_line("scaled", info.scaled_error);
    out += certificate_line("real", info.real_error);
    out += certificate_line("far", info.far_error);
  }
  if (info.points > 0) {
    out += fmt::format("pointshell  {} points sampled at least {} apart, every surface point within {} of one\n",
                       info.points, bake::format_length(info.spacing), bake::format_length(info.covering_radius));
    if (info.feature_covering_radius > 0) {
      out += fmt::format("  thinned inside faces; other places within {} of a point\n",
                         bake::format_length(info.feature_covering_radius));
    }
    constexpr double kDegrees = 180 / std::numbers::pi;
    out += fmt::format("  normals {:.2g} degrees off their faces in the mean, {:.2g} at most\n",
                       kDegrees * info.normal_error_mean, kDegrees * info.normal_error_max);
    out += fmt::format("  positions in steps of {}\n", bake::format_length(info.position_step));
    out += fmt::format("  tree of {} levels, K = {}\n", info.levels, info.branching);
  }
  return out;
}

const char* section_name(SectionKind kind) {
  switch (kind) {
    case SectionKind::brick_index:
      return "brick_index";
    case SectionKind::field_roots:
      return "field_roots";
    case SectionKind::field_nodes:
      return "field_nodes";
    case SectionKind::coarse_layers:
      return "coarse_layers";
    case SectionKind::layers:
      return "layers";
    case SectionKind::scaled:
      return "scaled";
    case SectionKind::real:
      return "real";
    case SectionKind::real_gradient:
      return "real_gradient";
    case SectionKind::point_positions:
      return "point_positions";
    case SectionKind::point_inward_normals:
      return "point_inward_normals";
    case SectionKind::point_areas:
      return "point_areas";
    case SectionKind::facet_points:
      return "facet_points";
    case SectionKind::facet_corners:
      return "facet_corners";
    case SectionKind::face_points:
      return "face_points";
    case SectionKind::corners:
      return "corners";
    case SectionKind::spheres:
      return "spheres";
    case SectionKind::children:
      return "children";
    case SectionKind::parent_points:
      return "parent_points";
    case SectionKind::level_offsets:
      return "level_offsets";
    case SectionKind::hull_offsets:
      return "hull_offsets";
    case SectionKind::hull_points:
      return "hull_points";
    case SectionKind::far:
      return "far";
    case SectionKind::planes:
      return "planes";
    case SectionKind::record:
      return "record";
  }
  return "unknown";
}

const char* element_name(ElementType type) {
  switch (type) {
    case ElementType::i8:
      return "i8";
    case ElementType::i16:
      return "i16";
    case ElementType::i32:
      return "i32";
    case ElementType::u8:
      return "u8";
    case ElementType::u16:
      return "u16";
    case ElementType::u32:
      return "u32";
    case ElementType::f32:
      return "f32";
    case ElementType::f64:
      return "f64";
  }
  return "unknown";
}

}  // namespace vps::cli
