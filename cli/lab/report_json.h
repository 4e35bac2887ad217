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
  std::size_t triangles = 0;  ///< of the closed mesh
  bake::ClosedMesh closed;
  lab::Measurement measured;
};

/// What each measure means, with its unit: for pages and readers of the file.
[[nodiscard]] nlohmann::ordered_json measure_definitions();

[[nodiscard]] nlohmann::ordered_json mesh_to_json(const ReportedMesh& mesh);

/// One line per row of every mesh of a whole report; keys of nested objects are joined by points. What is not told is
/// empty.
[[nodiscard]] std::string rows_to_csv(const nlohmann::ordered_json& report);

/// "Pareto front of ...: A (1.2 us, 0.03 mm); ~ B ...": the tilde where B's time is within the noise of A's.
[[nodiscard]] std::string front_line(const lab::Measurement& measured, const lab::Front& front);

}  // namespace vps::cli
