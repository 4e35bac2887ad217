// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/recommend.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "bake/extent.h"
#include "bake/quantity_text.h"
#include "cli/lab/assets.h"
#include "cli/lab/errors.h"
#include "cli/lab/ours.h"
#include "cli/lab/stress/world.h"

namespace vps::lab {
namespace {

// Half a voxel's diagonal: certificates end at this distance from the band's ends. [vx]
const double kHalfDiagonal = std::sqrt(3.0) / 2;
// Approximate bytes of a file per point, the tree included.
constexpr double kBytesPerPoint = 14;
constexpr double kAlphas[] = {4, 2.8, 2, 1.4142135623730951, 1, 0.7, 0.5};
constexpr std::size_t kDefaultAlpha = 3;
constexpr double kDensest = 1;             // alpha, of those tried without a limit on the error
const double kStep = std::pow(2.0, 0.25);  // from voxel size to voxel size

// Rounds down to three digits of millimetres, so that the command line shows exactly the measured value.
double rounded(double metres) {
  const int power = int(std::floor(std::log10(1000 * metres))) - 2;
  const double digits = std::floor(1000 * metres / std::pow(10.0, power) + 1e-6);
  return std::strtod(fmt::format("{}e{}", digits, power).c_str(), nullptr) * 1e-3;
}

double longest_side(const TriangleMesh& mesh) {
  const bake::Extent extent = bake::measure_extent(mesh);
  return (extent.bounds_max - extent.bounds_min).maxCoeff();
}

class Search {
 public:
  Search(const TriangleMesh& mesh, const RecommendOptions& options)
      : mesh_(mesh), options_(options), limits_(options.limits), longest_(longest_side(mesh)) {}

  Recommendation run() {
    if (limits_.error > 0) {
      search_by_error();
    } else {
      search_by_cost();
    }
    if (out_.tried.empty()) throw bake::BakeError("plan", refusal_);
    out_.limits = limits_;
    choose(out_);
    return std::move(out_);
  }

 private:
  void progress(const std::string& what, double fraction) const {
    if (options_.progress) options_.progress(what, fraction);
  }

  // --- the smallest file that keeps within an error

  void search_by_error() {
    const double coarsest = find_coarsest();
    plan(coarsest);
    // Limits the poses' depths to the range of the certificate of a default band: finer limits get shallower contacts.
    const double certified = (bake::BakeOptions{}.band_inside - kHalfDiagonal) * coarsest;
    // Shallower contacts would not show what an error of the limit misses.
    truth_.options.contact = std::max(truth_.options.contact, std::min(limits_.error, truth_.options.deep));
    truth_.options.contact = std::min(truth_.options.contact, certified);
    truth_.options.gap = std::min(truth_.options.gap, certified);
    place();
    measure();
    constexpr int kMostVoxels = 6;
    double voxel = coarsest;
    double baked = coarsest;
    double refused = 0;
    std::size_t alpha = kDefaultAlpha;
    for (int n = 0; n < kMostVoxels && (voxel > 0.49 * coarsest || !is_within()); ++n) {
      if (find_alpha(voxel, alpha)) {
        baked = voxel;
        if (!finer_may_help(voxel)) return;
      } else {
        refused = voxel;  // a crack stays open
      }
      voxel = rounded(refused > 0 ? std::sqrt(baked * refused) : baked / kStep);
    }
  }

  // Finds about the largest voxel size whose certified field error keeps the limit.
  double find_coarsest() {
    const double limit = limits_.error;
    constexpr double kUsual = 0.23;  // usual error bound of a field, over the voxel size
    constexpr int kTrials = 10;
    const double most = longest_ / 8;
    double good = 0;
    double bad = std::numeric_limits<double>::infinity();
    double voxel = std::min(limit / kUsual, most);
    double least_seen = bad;
    for (int n = 0; n < kTrials; ++n) {
      const std::optional<std::size_t> tried = bake_once(rounded(voxel), kAlphas[kDefaultAlpha]);
      if (!tried) {  // the voxels may be too fine to close a crack
        if (good > 0 || refused_by_plan_ || voxel >= most) break;
        voxel = std::min(1.3 * voxel, most);
        continue;
      }
      const double bound = out_.tried[*tried].field_bound;
      least_seen = std::min(least_seen, bound);
      if (bound <= limit) {
        good = rounded(voxel);
        if (voxel >= most || bound > 0.85 * limit || bad < 1.15 * good) break;
        voxel = std::min({voxel * std::clamp(0.95 * limit / bound, 1.1, 4.0), std::sqrt(good * bad), most});
      } else {
        bad = std::min(bad, voxel);
        if (good > 0 && bad < 1.15 * good) break;
        voxel = good > 0 ? std::sqrt(good * bad) : voxel * std::clamp(0.97 * limit / bound, 0.05, 0.95);
      }
    }
    if (good > 0) return good;
    if (!std::isfinite(least_seen) && !refusal_.empty() && !refused_by_plan_) throw bake::BakeError("plan", refusal_);
    const std::string best = std::isfinite(least_seen) ? "; the best has " + bake::format_length(least_seen) : "";
    throw bake::BakeError(
        "plan", fmt::format("no voxel size tried reaches an error of {}{}{}", bake::format_length(limit), best,
                            refusal_.empty() ? "" : ": " + refusal_));
  }

  // Searches a spacing: coarser ones while the error limit is kept, or finer ones until it is. Where a setting within
  // the limits is known, only coarser spacings are tried, since finer voxels with as many points make a larger file.
  // @param alpha  index into kAlphas to begin with; set to the one found, or to the last one tried
  // @return whether the first setting can be baked
  bool find_alpha(double voxel, std::size_t& alpha) {
    const bool known = is_within();
    std::size_t at = known && alpha > 0 ? alpha - 1 : alpha;
    const std::optional<bool> met = meets_error(voxel, kAlphas[at]);
    if (!met) return false;
    if (*met) {
      alpha = at;
      while (at > 0 && meets_error(voxel, kAlphas[--at]).value_or(false)) alpha = at;
    } else if (!known) {
      alpha = at;
      while (alpha + 1 < std::size(kAlphas)) {
        const std::optional<bool> finer = meets_error(voxel, kAlphas[++alpha]);
        if (!finer || *finer) break;
      }
    }
    return true;
  }

  std::optional<bool> meets_error(double voxel, double alpha) {
    const std::optional<std::size_t> tried = bake_once(voxel, alpha);
    if (!tried) return std::nullopt;
    measure();
    const Tried& t = out_.tried[*tried];
    return t.error() <= limits_.error && t.deepest_missed <= limits_.missed && !t.misses_beyond_error();
  }

  // Whether a setting keeps all limits.
  [[nodiscard]] bool is_within() const { return smallest_within() < std::numeric_limits<double>::infinity(); }

  [[nodiscard]] double smallest_within() const {
    double smallest = std::numeric_limits<double>::infinity();
    for (const Tried& t : out_.tried) {
      if (t.exceeds(limits_).empty()) smallest = std::min(smallest, double(t.bytes));
    }
    return smallest;
  }

  // Whether finer voxels with points a step further apart, half as many, may give a smaller file than the smallest one
  // within the limits.
  [[nodiscard]] bool finer_may_help(double voxel) const {
    double map = std::numeric_limits<double>::infinity();
    double points = 0;  // of the smallest
    for (const Tried& t : out_.tried) {
      if (t.exceeds(limits_).empty() && double(t.bytes) == smallest_within()) points = double(t.points);
      if (t.bake.voxel_size == voxel) map = std::min(map, double(t.bytes) - kBytesPerPoint * double(t.points));
    }
    return map * kStep * kStep + kBytesPerPoint * points / 2 < smallest_within();
  }

  // --- the smallest error that time and bytes allow

  void search_by_cost() {
    std::vector<double> voxels;  // from the coarsest
    for (const double n : {64.0, 90.0, 128.0, 180.0, 256.0}) voxels.push_back(rounded(longest_ / n));
    constexpr std::size_t kMiddle = 2;
    plan(voxels[kMiddle]);
    place();
    std::size_t at = kMiddle;
    Limits costs = limits_;
    costs.missed = 0;  // finer voxels may miss less
    if (try_alphas(voxels[at], costs)) {
      while (at + 1 < voxels.size() && try_alphas(voxels[at + 1], costs)) ++at;
    }
    if (is_within()) return;
    // Fewer points take less time and fewer bytes, and miss more. Coarser voxels follow until even the densest points
    // miss too much, or until the plan refuses so coarse a grid.
    double finer = at + 1 < voxels.size() ? voxels[at + 1] : voxels[at];
    double voxel = voxels[at];
    while (!only_misses(voxel)) {
      finer = voxel;
      voxel = at > 0 ? voxels[--at] : rounded(voxel * std::sqrt(2.0));
      if (try_alphas(voxel, limits_) || refused_by_plan_) return;
    }
    // Between voxels that cost too much and ones that miss too much. Larger voxels may give larger files.
    for (const double part : {0.25, 0.5, 0.75}) {
      if (try_alphas(rounded(finer * std::pow(voxel / finer, part)), limits_)) return;
    }
  }

  // Whether the densest points keep the limits on time and bytes, but miss contacts that are too deep.
  bool only_misses(double voxel) {
    const std::optional<std::size_t> tried = bake_once(voxel, kDensest);
    if (!tried) return false;
    measure();
    const Tried& t = out_.tried[*tried];
    return t.deepest_missed > limits_.missed && (limits_.bytes == 0 || double(t.bytes) <= limits_.bytes) &&
           (limits_.microseconds == 0 || t.slowest() <= limits_.microseconds);
  }

  // Whether one of the usual spacings keeps the limits.
  bool try_alphas(double voxel, const Limits& limits) {
    bool within = false;
    for (const double alpha : {kDensest, kAlphas[kDefaultAlpha], 2.0}) {
      const std::optional<std::size_t> tried = bake_once(voxel, alpha);
      if (!tried) continue;
      measure();
      within |= out_.tried[*tried].exceeds(limits).empty();
    }
    return within;
  }

  // --- used by both searches

  // Makes the closed mesh for the truth, with the first voxel size that can close it. Each trial closes the mesh again,
  // as a later bake by the user does.
  void plan(double voxel) {
    bake::BakeOptions base = options_.base;
    base.voxel_size = voxel;
    while (true) {
      try {
        closed_ = bake::closed_mesh(mesh_, base).mesh;
        break;
      } catch (const bake::BakeError&) {
        base.voxel_size *= 1.5;
        if (base.voxel_size > longest_ / 8) throw;
      }
    }
    // The centre of mass needs neither a pointshell nor a fine grid.
    base.voxel_size = std::max(base.voxel_size, longest_ / 32);
    base.pointshell = false;
    closed_ = centred(std::move(closed_), *bake_in_memory(closed_, base));
    TruthOptions& truth = truth_.options;
    truth = truth_options_for(closed_, 0);
    truth.poses[std::size_t(PoseKind::apart)] = options_.poses / 3;
    truth.poses[std::size_t(PoseKind::contact)] = options_.poses - options_.poses / 3;
    truth.seed = options_.seed;
  }

  void place() {
    truth_.options.progress = [this](const char* what, double fraction) { progress(what, fraction); };
    const TruthOptions options = truth_.options;
    truth_ = find_truth(closed_, options, Wrenches::none, options_.cache);
    out_.truth = truth_.options;
    limits_.missed = truth_.options.contact / 2;
    if (limits_.error > 0) limits_.missed = std::min(limits_.missed, limits_.error / 2);
    std::copy(std::begin(truth_.found), std::end(truth_.found), out_.poses);
  }

  // Bakes a setting once. @return its index in `tried`; nothing when it cannot be baked
  std::optional<std::size_t> bake_once(double voxel, double alpha) {
    Tried tried;
    tried.bake = options_.base;
    tried.bake.voxel_size = voxel;
    tried.bake.resolution = 0;
    tried.bake.alpha = alpha;
    // The band must contain the depths of the truth's poses.
    const double band = std::ceil(2 * (truth_.options.contact / voxel + kHalfDiagonal) - 0.01) / 2;
    tried.bake.band_inside = std::clamp(band, tried.bake.band_inside, 8.0);
    for (std::size_t i = 0; i < out_.tried.size(); ++i) {
      const bake::BakeOptions& other = out_.tried[i].bake;
      if (other.voxel_size == voxel && other.alpha == alpha && other.band_inside == tried.bake.band_inside) return i;
    }
    std::shared_ptr<const Asset> asset;
    try {
      bake::BakeOptions told = tried.bake;
      told.progress = [&](const char* stage, double fraction) {
        progress(fmt::format("bake {}: voxel {}, alpha {:.3g}: {}", out_.tried.size() + 1, bake::format_length(voxel),
                             alpha, stage),
                 fraction);
      };
      asset = bake_in_memory(mesh_, told, options_.record);
    } catch (const bake::BakeError& refusal) {
      refusal_ = refusal.what();
      refused_by_plan_ = refusal.stage == "plan";
      return std::nullopt;
    }
    const AssetInfo& info = asset->info();
    tried.bytes = asset->directory().file_bytes;
    tried.points = info.points;
    tried.field_bound = info.scaled_error.bound;
    out_.tried.push_back(tried);
    assets_.push_back(asset);
    return out_.tried.size() - 1;
  }

  // Measures the trials that have not been measured yet.
  void measure() {
    std::vector<Pose> poses;
    for (const TruePose& p : truth_.poses) poses.push_back(p.pose.first_in_second);
    std::vector<Player> players;
    for (std::size_t i = measured_; i < assets_.size(); ++i)
      players.push_back({"trial " + std::to_string(i + 1), [asset = assets_[i]] { return ours_of(asset); }});
    SceneOptions scenes;
    scenes.voxel = assets_[0]->info().voxel_size;
    scenes.corners = stress::hull_corners(closed_.vertices);
    scenes.rounds = options_.rounds;
    scenes.seed = options_.seed;
    scenes.progress = [this](const std::string& player, double fraction) { progress("scenes: " + player, fraction); };
    for (SceneTimes& steps : play_in_turn(players, scenes)) {
      Tried& tried = out_.tried[measured_];
      tried.steps = std::move(steps);
      const std::vector<PairAnswer> contacts = ask(*our_traverse(assets_[measured_]), poses);
      tried.penetration = penetration_errors(truth_, contacts, PoseKind::contact);
      tried.missed = count_missed(truth_, contacts, PoseKind::contact);
      tried.deepest_missed = deepest_missed(truth_, contacts, PoseKind::contact);
      tried.distance = distance_errors(truth_, ask(*our_separation(assets_[measured_]), poses));
      ++measured_;
    }
  }

  static std::vector<PairAnswer> ask(PairPeer& peer, const std::vector<Pose>& poses) {
    std::vector<PairAnswer> answers;
    for (const Pose& pose : poses) answers.push_back(peer.query(pose));
    return answers;
  }

  const TriangleMesh& mesh_;
  const RecommendOptions& options_;
  Limits limits_;         // of Recommendation
  const double longest_;  // side of the mesh. [m]
  TriangleMesh closed_;   // about its centre of mass
  GroundTruth truth_;
  std::vector<std::shared_ptr<const Asset>> assets_;  // by `tried`
  std::size_t measured_ = 0;                          // of `tried`
  std::string refusal_;                               // the last
  bool refused_by_plan_ = false;
  Recommendation out_;
};

}  // namespace

Recommendation recommend(const TriangleMesh& mesh, const RecommendOptions& options) {
  return Search(mesh, options).run();
}

}  // namespace vps::lab
