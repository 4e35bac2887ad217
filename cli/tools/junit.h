// SPDX-License-Identifier: GPL-3.0-or-later
/// @file JUnit reports, which CI servers read.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace vps::cli {

/// First bytes of a report. An existing file that begins otherwise is not overwritten.
inline constexpr const char* kJUnitBeginning = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n";

/// A test that passed, failed or was skipped. Texts may hold any bytes: those that XML cannot hold are replaced.
struct JUnitCase {
  struct Failure {
    std::string message;  ///< one line
    std::string text;
  };
  std::string classname;
  std::string name;
  std::optional<double> seconds;       ///< nothing: not measured. [s]
  std::optional<Failure> failure;      ///< nothing: it did not fail
  std::optional<std::string> skipped;  ///< why; nothing: not skipped
  std::string output;
};

struct JUnitSuite {
  std::string name;
  std::optional<double> seconds;  ///< nothing: not measured. [s]
  std::vector<JUnitCase> cases;
};

/// @param provenance  becomes the properties of each suite, such as "machine.processor"
[[nodiscard]] std::string to_junit(const std::vector<JUnitSuite>& suites, const nlohmann::ordered_json& provenance);

}  // namespace vps::cli
