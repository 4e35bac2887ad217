// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Files embedded in the program, so that they need not be installed: see vps_embed in CMakeLists.txt.
#pragma once

#include <cstddef>
#include <string_view>

namespace vps::cli {

struct Embedded {
  const char* begin;
  const char* end;
  [[nodiscard]] std::string_view text() const { return {begin, static_cast<std::size_t>(end - begin)}; }
};

extern const Embedded kChart;          ///< Chart.js
extern const Embedded kThree;          ///< three.js
extern const Embedded kOrbitControls;  ///< of three.js
extern const Embedded kMotionPage;
extern const Embedded kStressPage;
extern const Embedded kView3d;       ///< script of pages with a three-dimensional view
extern const Embedded kView3dStyle;  ///< their style
extern const Embedded kViewPage;
extern const Embedded kReportPage;  ///< cli/tools/view/pages/report.html

}  // namespace vps::cli
