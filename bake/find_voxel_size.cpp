// SPDX-License-Identifier: GPL-3.0-or-later
// Searches the largest voxel size whose certified error stays within a limit, by trial bakes of the voxelmap.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/extent.h"
#include "bake/quantity_text.h"
#include "bake/vps_bake.h"

namespace vps::bake {
namespace {

double largest_error(const AssetInfo& info) {
  return std::max({info.layers_error.bound, info.scaled_error.bound, info.real_error.bound});
}

// The advice of a plan, where the error sets the voxel size.
std::string for_errors(std::string refusal) {
  constexpr std::string_view kVoxels = "larger voxels";
  const std::size_t at = refusal.find(kVoxels);
  return at == std::string::npos ? refusal : refusal.replace(at, kVoxels.size(), "a larger --max-error");
}

}  // namespace

double find_voxel_size(const TriangleMesh& mesh, const BakeOptions& options, double max_error) {
  if (!options.voxelmap) throw BakeError("plan", "an error is met by the voxelmap; bake that part too");
  if (!(max_error > 0)) throw BakeError("plan", "the error must be above zero; choose another");
  const Extent extent = measure_extent(mesh);
  const double longest = (extent.bounds_max - extent.bounds_min).maxCoeff();
  BakeOptions trial = options;
  trial.pointshell = false;
  trial.thin_faces = 1;
  trial.planned = nullptr;
  // It may end the search.
  trial.progress = [&](const char*, double) {
    if (options.progress) options.progress("search", 0);
  };
  trial.resolution = 0;
  double good = 0;
  double bad = std::numeric_limits<double>::infinity();
  double least_seen = bad;
  // Errors grow about in proportion to the voxel size, so the ratio of the errors gives the next guess.
  trial.voxel_size = longest / 32;
  constexpr double kCoarsest = 1.0 / 8;
  constexpr double kCloseEnough = 1.05;
  constexpr int kTrials = 16;
  for (int n = 0; n < kTrials && bad > good * kCloseEnough && good < kCoarsest * longest; ++n) {
    double error = 0;
    try {
      error = largest_error(bake(mesh, trial).info);
    } catch (const BakeError& refusal) {
      if (refusal.stage != "plan" || good > 0) throw;
      const std::string best =
          std::isfinite(least_seen) ? fmt::format(" (the best tried has {})", format_length(least_seen)) : "";
      throw BakeError("plan", fmt::format("no voxel size reaches an error of {}{}: {}", format_length(max_error), best,
                                          for_errors(refusal.what())));
    }
    least_seen = std::min(least_seen, error);
    if (error <= max_error) {
      good = std::max(good, trial.voxel_size);
    } else {
      bad = std::min(bad, trial.voxel_size);
    }
    constexpr double kSafety = 0.98;
    double next = trial.voxel_size * std::clamp(kSafety * max_error / error, 0.05, 8.0);
    // Errors jump where the grid happens to align with a feature. Then the next guess halves the bracket.
    if (good > 0 && !(next > good * 1.01 && next < bad * 0.99)) next = std::min(std::sqrt(good * bad), 4 * good);
    if (good == 0) next = std::min(next, 0.9 * bad);
    trial.voxel_size = std::min(next, kCoarsest * longest);
  }
  if (good > 0) return good;
  throw BakeError("plan", fmt::format("no voxel size tried reaches an error of {}; the best has {}",
                                      format_length(max_error), format_length(least_seen)));
}

}  // namespace vps::bake
