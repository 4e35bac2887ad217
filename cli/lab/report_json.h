// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A report as JSON (docs/schemas/report.schema.json) and as CSV.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "cli/lab/measure.h"

namespace vps::cli {

/// One mesh of a report.
struct ReportedMesh {
  std::string file;
  std::string bake_command;   ///< bakes the base setting
  std::size_t triangles = 0;  ///< of the closed mesh
  bake::ClosedMesh closed;
  lab::Measurement measured;
};

/// The meaning and unit of each measure, for the page and for readers of the file.
[[nodiscard]] nlohmann::ordered_json measure_definitions();

/// By the name of each scene. Null: nothing was played.
[[nodiscard]] nlohmann::ordered_json steps_to_json(const lab::SceneTimes& steps);

[[nodiscard]] nlohmann::ordered_json mesh_to_json(const ReportedMesh& mesh);

/// One line per row of every mesh of a whole report. Keys of nested objects are joined by points. Cells without a value
/// are empty.
[[nodiscard]] std::string rows_to_csv(const nlohmann::ordered_json& report);

/// "Pareto front, ...: A (1.2 us, 0.03 mm); ~ B ...". The tilde marks a time within the noise of the one before.
[[nodiscard]] std::string front_line(const lab::Measurement& measured, const lab::Front& front);

}  // namespace vps::cli
