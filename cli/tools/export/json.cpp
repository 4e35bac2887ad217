// SPDX-License-Identifier: GPL-3.0-or-later
// An asset's points and tree as plain numbers, for programs that read neither HDF5 nor the codes.
#include <fmt/format.h>

#include <charconv>
#include <string>

#include "cli/tools/describe_asset.h"
#include "cli/tools/export/export.h"

namespace vps::cli {
namespace {

// The decimal number with the fewest digits that gives the same float.
double short_number(float x) {
  const std::string text = fmt::format("{}", x);
  double number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number);  // strtod knows the locale's decimal point alone
  return number;
}
nlohmann::ordered_json triple(Vec3 v) {
  return {short_number(v.x), short_number(v.y), short_number(v.z)};
}

}  // namespace

std::string to_json_text(const std::string& path, const Asset& asset) {
  nlohmann::ordered_json j = {{"schema", "vpsbake asset 1"}};
  j.update(asset_to_json(path, asset));
  PointshellView shell;
  if (asset.pointshell(shell) == Status::ok) {
    auto& points = j["points"];
    for (std::uint32_t i = 0; i < shell.points; ++i) {
      points["positions"].push_back(triple(point_position(shell, i)));
      points["inward_normals"].push_back(triple(point_inward_normal(shell, i)));
      points["areas"].push_back(short_number(point_area(shell, i)));
    }
    auto& tree = j["tree"];
    for (std::uint32_t node = 0; node < shell.nodes; ++node) {
      tree["centres"].push_back(triple(sphere_centre(shell, node)));
      tree["radii"].push_back(short_number(sphere_radius(shell, node)));
      const auto [begin, end] = children_of(shell, node);
      tree["children"].push_back({begin, end - begin});
      tree["parent_points"].push_back(shell.parent_point[node]);
    }
    for (std::uint32_t l = 0; l <= shell.levels; ++l) tree["level_offsets"].push_back(shell.level_offsets[l]);
  }
  return j.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

}  // namespace vps::cli
