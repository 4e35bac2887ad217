// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Quantities with units, as command lines, scenes and job files write them. Each function throws UsageError.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace vps::cli {

/// An invalid text. `what()` says what to write instead.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// "5mm" to 0.005. [m]
[[nodiscard]] double parse_length(const std::string& text);
/// "4GB" to 4e9.
[[nodiscard]] std::size_t parse_size(const std::string& text);
/// "20us" to 2e-5. [s]
[[nodiscard]] double parse_time(const std::string& text);
/// "-5mm" to -0.005, of any sign. [m]
[[nodiscard]] double parse_coordinate(const std::string& text);
/// "-3m/s" to -3, of any sign. [m/s]
[[nodiscard]] double parse_velocity(const std::string& text);
/// "-9.81m/s2" to -9.81, of any sign. [m/s^2]
[[nodiscard]] double parse_acceleration(const std::string& text);
/// "90deg" to pi / 2, of any sign. [rad]
[[nodiscard]] double parse_angle(const std::string& text);
/// "20g" to 0.02. [kg]
[[nodiscard]] double parse_mass(const std::string& text);
/// "mm" to 0.001. [m]
[[nodiscard]] double parse_unit(const std::string& unit);
/// "2.5vx" to 2.5. @param example  for the message
[[nodiscard]] double parse_voxels(const std::string& text, const char* example);
/// A positive number without a unit. @param name  of the option, for the message
[[nodiscard]] double parse_factor(const char* name, const std::string& text);

}  // namespace vps::cli
