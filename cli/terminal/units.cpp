// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/units.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <numbers>
#include <optional>
#include <vector>

namespace vps::cli {
namespace {

// The message lists the units, because a wrong unit is the most common mistake.
double unit_size(const std::string& unit, const std::map<std::string, double>& units) {
  const auto it = units.find(unit);
  if (it != units.end()) return it->second;
  if (unit.starts_with(',')) throw UsageError("a number has a decimal point, not a comma: '" + unit + "'");
  std::string names;
  for (const auto& [name, size] : units) names += (names.empty() ? "" : ", ") + name;
  throw UsageError("unknown unit '" + unit + "'; use one of " + names);
}

std::string trimmed(const std::string& text) {
  constexpr const char* kSpaces = " \t\n\v\f\r";
  const std::size_t first = text.find_first_not_of(kSpaces);
  return first == text.npos ? "" : text.substr(first, text.find_last_not_of(kSpaces) - first + 1);
}

enum class Sign : std::uint8_t { positive, any };

// A quantity on the command line: a number with a unit.
struct Quantity {
  const char* kind;     // "a length"
  const char* example;  // "5mm"
  std::vector<const char*> usual;
  std::map<std::string, double> units;
};

// "5mm" to 0.005.
double parse(const std::string& text, const Quantity& quantity, Sign sign = Sign::positive) {
  const std::string kind = quantity.kind;
  std::size_t used = 0;
  std::optional<double> read;
  try {
    read = std::stod(text, &used);
    if (text.find_first_of("xX") < used) read.reset();  // hexadecimal
  } catch (const std::exception&) {                     // it is none
  }
  const double number = read.value_or(0);
  const std::string unit = trimmed(text.substr(used));
  if (!read || (unit.empty() && !std::isfinite(number)))
    throw UsageError("'" + text + "' is not " + kind + "; write a number with a unit, such as " + quantity.example);
  if (unit.empty()) {
    std::string forms;
    for (const char* const usual : quantity.usual) forms += (forms.empty() ? "" : " or ") + text + usual;
    throw UsageError(kind + " needs a unit; write " + forms);
  }
  const double size = unit_size(unit, quantity.units);
  if (!std::isfinite(number) || (sign == Sign::positive && !(number > 0)))
    throw UsageError(text + " is not " +
                     (sign == Sign::positive ? "a positive " + kind.substr(kind.find(' ') + 1) : kind));
  return number * size;
}

const Quantity kLength = {
    "a length", "5mm", {"mm", "m"}, {{"km", 1e3}, {"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}, {"in", 0.0254}}};

}  // namespace

double parse_length(const std::string& text) {
  return parse(text, kLength);
}

double parse_coordinate(const std::string& text) {
  return parse(text, kLength, Sign::any);
}

double parse_velocity(const std::string& text) {
  return parse(text,
               {"a speed",
                "3m/s",
                {"m/s", "mm/s"},
                {{"m/s", 1}, {"cm/s", 1e-2}, {"mm/s", 1e-3}, {"km/h", 1 / 3.6}, {"in/s", 0.0254}}},
               Sign::any);
}

double parse_acceleration(const std::string& text) {
  return parse(text, {"an acceleration", "9.81m/s2", {"m/s2"}, {{"m/s2", 1}, {"m/s^2", 1}}}, Sign::any);
}

double parse_angle(const std::string& text) {
  return parse(text, {"an angle", "90deg", {"deg", "rad"}, {{"deg", std::numbers::pi / 180}, {"rad", 1}}}, Sign::any);
}

double parse_mass(const std::string& text) {
  return parse(text, {"a mass", "20g", {"g", "kg"}, {{"mg", 1e-6}, {"g", 1e-3}, {"kg", 1}, {"t", 1e3}}});
}

double parse_unit(const std::string& unit) {
  return unit_size(unit, {{"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}});
}

std::size_t parse_size(const std::string& text) {
  const double size =
      parse(text, {"a size", "4GB", {"MB", "GB"}, {{"B", 1}, {"kB", 1e3}, {"MB", 1e6}, {"GB", 1e9}, {"TB", 1e12}}});
  return static_cast<std::size_t>(std::clamp(size, 1.0, 1e18));
}

double parse_factor(const char* name, const std::string& text) {
  char* end = nullptr;
  const double factor = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(factor > 0) || !std::isfinite(factor)) {
    throw UsageError(std::string(name) + " takes a positive number, not '" + text + "'");
  }
  return factor;
}

double parse_voxels(const std::string& text, const char* example) {
  return parse(text, {"a number of voxels", example, {"vx"}, {{"vx", 1}}});
}

double parse_time(const std::string& text) {
  return parse(text,
               {"a time", "120s", {"s", "min"}, {{"us", 1e-6}, {"ms", 1e-3}, {"s", 1}, {"min", 60}, {"h", 3600}}});
}

}  // namespace vps::cli
