// SPDX-License-Identifier: GPL-3.0-or-later
// Fitted to 57 bakes of 29 meshes at 64 to 300 voxels on two cores. The sum is within a factor of 1.8 for nine in ten.
#include "bake/stage_times.h"

#include <algorithm>

namespace vps::bake {
namespace {

// Seconds of a stage: a constant, and for each 100,000 triangles, squares of surface and field bricks.
struct StageTimes {
  std::string_view stage;
  double constant, triangles, area, field_bricks;
};

constexpr StageTimes kTimes[] = {{"check", 0.005, 0.7, 0, 0},
                                 {"voxelize", 0, 0.06, 0.07, 0},
                                 {"fill_layers", 0, 0.03, 0.02, 0},
                                 {"distance_field", 0.01, 0.4, 0.15, 0},
                                 {"coarse_layers", 0, 0, 0.02, 0},
                                 {"sample_field", 0.05, 0, 0, 2.5},
                                 {"triangle_tree", 0, 0.07, 0, 0},
                                 {"thin_walls", 0.015, 0, 0, 0},
                                 {"certify", 0.08, 0.55, 0.1, 0},
                                 {"far_field", 0.03, 0.35, 0.05, 0},
                                 {"sample_pointshell", 0.01, 0.2, 0.55, 0.4},
                                 {"cluster_points", 0, 0, 0.05, 0},
                                 {"bounding_spheres", 0, 0, 0.07, 0},
                                 {"fit_planes", 0.02, 0.05, 0.1, 0.2}};

// Folds and edges make field bricks, and each of their triangles takes time where voxels are coarse. Smooth meshes have
// hardly more field bricks than a flat surface of their area.
double of_creases(const BakeSize& size) {
  constexpr double kFlat = 0.1, kMost = 40e3, kEach = 25e-6;
  if (size.field_bricks <= 0) return 0;
  return kEach * std::min(size.triangles, kMost) * std::clamp(1 - kFlat * size.area / size.field_bricks, 0.0, 1.0);
}

}  // namespace

double expected_seconds(std::string_view stage, const BakeSize& size) {
  const auto* const times =
      std::find_if(std::begin(kTimes), std::end(kTimes), [&](const StageTimes& one) { return one.stage == stage; });
  if (times == std::end(kTimes)) return 0;
  constexpr double kMany = 1e5;
  const double seconds =
      times->constant +
      (times->triangles * size.triangles + times->area * size.area + times->field_bricks * size.field_bricks) / kMany;
  return stage == "sample_field" ? seconds + of_creases(size) : seconds;
}

}  // namespace vps::bake
