// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/compare/compare_assets.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "cli/lab/random.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/nearest_point.h"
#include "cli/tools/stored_field.h"

namespace vps::cli {
namespace {

constexpr std::size_t kFieldPoints = 100000;
constexpr std::size_t kMostTries = 4000000;  // a band may be a small part of its box
constexpr std::uint32_t kShellPoints = 100000;

bool is_same_section(const Asset& a, const Section& of_a, const Asset& b, const Section& of_b) {
  return of_a.element == of_b.element && of_a.shape == of_b.shape && of_a.bytes == of_b.bytes &&
         std::memcmp(a.bytes().data() + of_a.offset, b.bytes().data() + of_b.offset, of_a.bytes) == 0;
}

// Adds the sections of `a` that `b` lacks and, unless `lacking_alone`, those that differ in `b`.
void compare_sections(const Asset& a, const Asset& b, bool lacking_alone, std::vector<std::string>& differing) {
  for (std::uint32_t i = 0; i < a.directory().section_count; ++i) {
    const Section& section = a.directory().sections[i];
    const Section* const other = b.directory().find(section.kind);
    if (other == nullptr || (!lacking_alone && !is_same_section(a, section, b, *other))) {
      differing.emplace_back(section_name(section.kind));
    }
  }
}

using Values = std::map<std::string, std::string>;

void add_differences(const Values& a, const Values& b, std::vector<ValueDifference>& out) {
  Values all = a;
  all.insert(b.begin(), b.end());
  for (const auto& [name, ignored] : all) {
    const auto in_a = a.find(name), in_b = b.find(name);
    const ValueDifference both{name, in_a == a.end() ? "" : in_a->second, in_b == b.end() ? "" : in_b->second};
    if (both.a != both.b) out.push_back(both);
  }
}

Values settings_of(const Asset& asset) {
  const auto values = record_values(asset);
  return {values.begin(), values.end()};
}

Values facts_of(const Asset& asset) {
  Values values;
  const nlohmann::ordered_json facts = info_to_json(asset.info()).flatten();
  for (const auto& [path, value] : facts.items())
    values[path.substr(1)] = value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  return values;
}

// The part of the band where both fields are exact. Samples within half a voxel's diagonal of the band's ends may be
// clamped.
struct Band {
  double outer = 0, inner = 0;  ///< [m]
};
Band common_band(const VoxelmapView& a, const VoxelmapView& b) {
  const auto end = [](float band, const VoxelmapView& map) {
    return double(band) - std::sqrt(0.75) * double(map.voxel_size);
  };
  return {std::min(end(a.band_outer, a), end(b.band_outer, b)), std::min(end(a.band_inner, a), end(b.band_inner, b))};
}

FieldDifference compare_field(const VoxelmapView& a, const VoxelmapView& b) {
  FieldDifference result;
  result.field = a.field;
  double low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = double(std::min(a.bounds_min[axis] - a.band_outer, b.bounds_min[axis] - b.band_outer));
    high[axis] = double(std::max(a.bounds_max[axis] + a.band_outer, b.bounds_max[axis] + b.band_outer));
  }
  const Band band = common_band(a, b);
  lab::Random random;
  std::vector<double> differences;
  double squares = 0;
  for (std::size_t tries = 0; tries < kMostTries && differences.size() < kFieldPoints; ++tries) {
    const double x = random.between(low[0], high[0]), y = random.between(low[1], high[1]),
                 z = random.between(low[2], high[2]);
    const Vec3 p{float(x), float(y), float(z)};
    const double of_a = double(stored_penetration(a, p)), of_b = double(stored_penetration(b, p));
    if (!std::isfinite(of_a) || !std::isfinite(of_b)) {
      result.only_a += std::isfinite(of_a) ? 1 : 0;
      result.only_b += std::isfinite(of_b) ? 1 : 0;
      continue;
    }
    const double clamped_a = std::clamp(of_a, -band.outer, band.inner);
    const double clamped_b = std::clamp(of_b, -band.outer, band.inner);
    if (clamped_a == clamped_b && clamped_a != of_a) continue;  // both are beyond the common band
    const double difference = std::abs(clamped_a - clamped_b);
    if (differences.empty() || difference > result.max) {
      result.max = difference;
      result.at = {double(p.x), double(p.y), double(p.z)};
    }
    squares += difference * difference;
    differences.push_back(difference);
  }
  result.points = differences.size();
  if (differences.empty()) return result;
  result.rms = std::sqrt(squares / double(differences.size()));
  const auto p99 = differences.begin() + std::ptrdiff_t(0.99 * double(differences.size() - 1));
  std::nth_element(differences.begin(), p99, differences.end());
  result.p99 = *p99;
  return result;
}

ShellDistance distance_between(const PointshellView& from, const PointshellView& to, double spacing) {
  const NearestPoint nearest(to, spacing);
  ShellDistance result;
  const std::uint32_t stride = (from.points + kShellPoints - 1) / kShellPoints;
  double squares = 0, angles = 0;
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < from.points; i += stride, ++count) {
    const Vec3 p = point_position(from, i), n = point_inward_normal(from, i);
    const NearestPoint::Found found = nearest({double(p.x), double(p.y), double(p.z)});
    const Vec3 m = point_inward_normal(to, found.point);
    const double angle = std::acos(std::clamp(double(detail::dot(n, m)), -1.0, 1.0));
    result.max = std::max(result.max, found.distance);
    squares += found.distance * found.distance;
    result.angle_max = std::max(result.angle_max, angle);
    angles += angle;
  }
  result.rms = std::sqrt(squares / count);
  result.angle_mean = angles / count;
  return result;
}

std::optional<ShellDifference> compare_shells(const Asset& a, const Asset& b) {
  PointshellView of_a, of_b;
  if (a.pointshell(of_a) != Status::ok || b.pointshell(of_b) != Status::ok) return std::nullopt;
  ShellDifference result;
  const PointshellView* const shells[2] = {&of_a, &of_b};
  for (std::size_t i = 0; i < 2; ++i) {
    result.points[i] = shells[i]->points;
    result.nodes[i] = shells[i]->nodes;
    for (std::uint32_t p = 0; p < shells[i]->points; ++p) result.area[i] += double(point_area(*shells[i], p));
  }
  result.a_to_b = distance_between(of_a, of_b, b.info().spacing);
  result.b_to_a = distance_between(of_b, of_a, a.info().spacing);
  return result;
}

// Whether all facts are the same, except the generator's name.
bool have_same_info(const Comparison& comparison) {
  return std::all_of(comparison.facts.begin(), comparison.facts.end(),
                     [](const ValueDifference& fact) { return fact.name == "generator"; });
}

}  // namespace

Comparison compare_assets(const Asset& a, const Asset& b) {
  Comparison comparison;
  if (a.bytes().size() == b.bytes().size() && std::memcmp(a.bytes().data(), b.bytes().data(), a.bytes().size()) == 0) {
    return comparison;
  }
  add_differences(settings_of(a), settings_of(b), comparison.settings);
  add_differences(facts_of(a), facts_of(b), comparison.facts);
  compare_sections(a, b, false, comparison.sections);
  compare_sections(b, a, true, comparison.sections);
  const bool same_sections = std::all_of(comparison.sections.begin(), comparison.sections.end(),
                                         [](const std::string& name) { return name == "record"; });
  comparison.same = same_sections && have_same_info(comparison) ? Comparison::Same::content : Comparison::Same::nothing;
  if (comparison.same == Comparison::Same::content) return comparison;
  for (const Field field : {Field::layers, Field::scaled, Field::real}) {
    VoxelmapView of_a, of_b;
    if (a.voxelmap(of_a, field) != Status::ok || b.voxelmap(of_b, field) != Status::ok) continue;
    comparison.fields.push_back(compare_field(of_a, of_b));
  }
  comparison.shell = compare_shells(a, b);
  return comparison;
}

}  // namespace vps::cli
