// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The results of the stability cases as JSON (docs/schemas/stress.schema.json), JUnit XML and lines of text.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/lab/stress/stress.h"

namespace vps::stress {

struct AssetResult {
  std::string asset;  ///< its file
  double mass = 1;    ///< [kg]
  double size = 0;    ///< longest side. [m]
  double voxel = 0;   ///< [m]
  std::uint64_t points = 0;
  std::vector<CaseResult> cases;
  std::map<std::string, std::string> peers{};  ///< by column: the source of that column's shape
};

/// One line without a line end: the verdict, and each column's worst trial.
[[nodiscard]] std::string to_line(const CaseResult& result, Strictness strictness);

/// A line with the largest stable stiffness at each rate, the rates at which the body rests (rest_depth and rest_jitter
/// are held) and the walls that stop it. It lists the settings that were tried, not ranges between them, and leaves out
/// cases that were not run.
[[nodiscard]] std::string certificate(const AssetResult& result, Strictness strictness);

/// @param provenance  from cli/tools/provenance.h
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<AssetResult>& results,
                                             const nlohmann::ordered_json& provenance, Strictness strictness);

/// A suite for each asset and a test for each case. The columns that count decide the test; all are in its output.
/// Bytes that are not UTF-8 are replaced.
/// @param provenance  becomes each suite's properties
[[nodiscard]] std::string to_junit(const std::vector<AssetResult>& results, const nlohmann::ordered_json& provenance,
                                   Strictness strictness);

}  // namespace vps::stress
