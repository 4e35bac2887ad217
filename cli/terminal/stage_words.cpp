// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/stage_words.h"

#include <algorithm>
#include <iterator>

namespace vps::cli {
namespace {

struct StageText {
  std::string_view stage;
  const char* words;
};

constexpr StageText kStageTexts[] = {{"import", "reading the mesh"},
                                     {"search", "finding the voxel size"},
                                     {"check", "checking the mesh"},
                                     {"describe", "checking the mesh"},
                                     {"voxelize", "voxels"},
                                     {"fill_layers", "voxels"},
                                     {"distance_field", "distances"},
                                     {"coarse_layers", "voxels"},
                                     {"inside_test", "distances"},
                                     {"sample_field", "distances"},
                                     {"triangle_tree", "errors"},
                                     {"certify", "errors"},
                                     {"pack_voxelmap", "distances"},
                                     {"thin_walls", "walls"},
                                     {"far_field", "distances"},
                                     {"free_searches", "points"},
                                     {"sample_pointshell", "points"},
                                     {"fit_planes", "planes"},
                                     {"cluster_points", "point tree"},
                                     {"bounding_spheres", "point tree"},
                                     {"done", "writing"}};

}  // namespace

std::string stage_words(std::string_view stage) {
  if (stage.starts_with("check: ")) stage = "check";
  const auto* const found = std::find_if(std::begin(kStageTexts), std::end(kStageTexts),
                                         [&](const StageText& t) { return t.stage == stage; });
  return found != std::end(kStageTexts) ? found->words : std::string(stage);
}

}  // namespace vps::cli
