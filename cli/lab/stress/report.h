// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What the stability cases found, as JSON (docs/schemas/stress.schema.json), JUnit XML and lines of text.
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
  std::map<std::string, std::string> peers{};  ///< by column: what the peer is made of
};

/// One line without an end: the verdict, and for each column its worst trial.
[[nodiscard]] std::string to_line(const CaseResult& result, Strictness strictness);

/// The largest stable stiffness at each rate, the rates at which the body rests (rest_depth and rest_jitter are held),
/// the walls that stop it: the settings that were tried, and no range between them. What was not run is not in it.
[[nodiscard]] std::string certificate(const AssetResult& result, Strictness strictness);

/// @param provenance  as cli/tools/provenance.h has it
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<AssetResult>& results,
                                             const nlohmann::ordered_json& provenance, Strictness strictness);

/// A suite for each asset, a test for each case; the columns that count decide, the others are in its output. Bytes
/// that are not UTF-8 are replaced.
/// @param provenance  becomes each suite's properties
[[nodiscard]] std::string to_junit(const std::vector<AssetResult>& results, const nlohmann::ordered_json& provenance,
                                   Strictness strictness);

}  // namespace vps::stress
