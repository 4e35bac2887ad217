// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/evaluate/recommend.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "bake/plan.h"
#include "cli/evaluate/assets.h"
#include "cli/evaluate/errors.h"
#include "cli/evaluate/ours.h"

namespace vps::evaluate {
namespace {

// Half a voxel's diagonal: certificates end so far from the band's ends. [vx]
const double kHalfDiagonal = std::sqrt(3.0) / 2;

// Three digits of millimetres, downwards: what is measured is what the command line says.
double rounded(double metres) {
  const int power = int(std::floor(std::log10(1000 * metres))) - 2;
  const double digits = std::floor(1000 * metres / std::pow(10.0, power) + 1e-6);
  return std::strtod(fmt::format("{}e{}", digits, power).c_str(), nullptr) * 1e-3;
}

class Search {
 public:
  Search(const TriangleMesh& mesh, const RecommendOptions& options) : mesh_(mesh), options_(options) {}

  Recommendation run() {
    const std::vector<double> voxels = options_.limits.error > 0 ? voxels_for_error() : ladder();
    place(close(voxels));
    for (const double voxel : voxels) {
      if (options_.limits.error > 0) {
        find_alpha(voxel);
      } else {
        (void)try_alphas(voxel);
      }
    }
    time();
    // Fewer points take less time and fewer bytes: until no grid is so coarse.
    double voxel = voxels.back();
    while (options_.limits.error == 0 && !any_within_limits()) {
      voxel = rounded(voxel * std::sqrt(2.0));
      if (!try_alphas(voxel)) break;
      time();
    }
    if (out_.tried.empty()) throw BakeError("plan", refusal_);
    choose();
    return std::move(out_);
  }

 private:
  struct Queries {
    std::vector<PairAnswer> contacts, distances;
  };

  void progress(const std::string& what, double fraction) const {
    if (options_.progress) options_.progress(what, fraction);
  }

  // What the certificate asks for, and finer.
  std::vector<double> voxels_for_error() {
    progress("search for the voxel size", 0);
    found_ = find_voxel_size(mesh_, options_.base, options_.limits.error);
    return {found_, rounded(found_ / std::sqrt(2.0)), rounded(found_ / 2)};
  }

  std::vector<double> ladder() const {
    const Extent extent = measure_extent(mesh_);
    const double longest = (extent.bounds_max - extent.bounds_min).maxCoeff();
    std::vector<double> voxels;
    for (const double n : {256.0, 180.0, 128.0, 90.0, 64.0}) voxels.push_back(rounded(longest / n));
    return voxels;
  }

  // The mesh that the truth is of: closed for the first voxel size that can close it. Those that are tried close it
  // anew, as the bakes of whoever follows the recommendation do.
  BakeOptions close(const std::vector<double>& voxels) {
    BakeOptions base = options_.base;
    for (std::size_t i = 0;; ++i) {
      base.voxel_size = voxels[i];
      try {
        closed_ = closed_mesh(mesh_, base).mesh;
        return base;
      } catch (const BakeError&) {
        if (i + 1 == voxels.size()) throw;
      }
    }
  }

  void place(const BakeOptions& base) {
    // The pointshell is not needed to know the centre, nor a fine grid.
    BakeOptions coarse = base;
    const Extent extent = measure_extent(closed_);
    coarse.voxel_size = std::max(base.voxel_size, (extent.bounds_max - extent.bounds_min).maxCoeff() / 64);
    body_ = centred(closed_, *bake_file(closed_, coarse, options_.work / "centre.vps.hdf").asset);
    TruthOptions truth = truth_options_for(body_, 0);
    truth.poses[std::size_t(Range::apart)] = options_.poses / 3;
    truth.poses[std::size_t(Range::contact)] = options_.poses - options_.poses / 3;
    truth.seed = options_.seed;
    truth.progress = [this](const char* what, double fraction) { progress(what, fraction); };
    // A finer error is asked for by who has shallower contacts: as deep as the certificate of a default band goes.
    if (found_ > 0) {
      const double certified = (BakeOptions{}.band_inside - kHalfDiagonal) * found_;
      truth.contact = std::min(truth.contact, certified);
      truth.gap = std::min(truth.gap, certified);
    }
    truth_ = find_truth(body_, truth, Wrenches::none, options_.cache);
    out_.truth = truth_.options;
  }

  // The coarsest spacing with which the error is met, and the next coarser one, by bisection.
  void find_alpha(double voxel) {
    const std::vector<double> alphas = {4, 2.8, 2, BakeOptions{}.alpha, 1, 0.7, 0.5};
    std::size_t low = 0;
    std::size_t high = alphas.size();
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      const std::optional<double> error = try_one(voxel, alphas[middle]);
      if (error && *error <= options_.limits.error) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
  }

  // Whether one of the usual spacings can be baked.
  bool try_alphas(double voxel) {
    bool baked = false;
    for (const double alpha : {1.0, BakeOptions{}.alpha, 2.0}) baked |= try_one(voxel, alpha).has_value();
    return baked;
  }

  [[nodiscard]] bool any_within_limits() const {
    return std::any_of(out_.tried.begin(), out_.tried.end(),
                       [this](const Tried& t) { return t.exceeds(options_.limits).empty(); });
  }

  // The error, where it can be baked.
  std::optional<double> try_one(double voxel, double alpha) {
    Tried tried;
    tried.bake = options_.base;
    tried.bake.voxel_size = voxel;
    tried.bake.resolution = 0;
    tried.bake.alpha = alpha;
    tried.by_certificate = voxel == found_;
    // The band has to hold the depths that are asked for.
    const double band = std::ceil(2 * (truth_.options.contact / voxel + kHalfDiagonal) - 0.01) / 2;
    tried.bake.band_inside = std::clamp(band, tried.bake.band_inside, 8.0);
    progress(fmt::format("voxel {}, alpha {:.3g}", format_length(voxel), alpha), 0);
    BakedFile file;
    try {
      file = bake_file(mesh_, tried.bake, options_.work / fmt::format("{}.vps.hdf", out_.tried.size()));
    } catch (const BakeError& refusal) {
      refusal_ = refusal.what();
      return std::nullopt;
    }
    const AssetInfo& info = file.asset->info();
    tried.bytes = file.asset->directory().file_bytes;
    tried.points = info.points;
    tried.field_bound = info.scaled_error.bound;
    const auto ask = [&](PairPeer& peer) {
      std::vector<PairAnswer> answers;
      for (const TruePose& p : truth_.poses) answers.push_back(peer.query(p.pose.first_in_second));
      return answers;
    };
    std::vector<double> errors;
    const std::vector<PairAnswer> contacts = ask(*our_traverse(file.asset));
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      if (truth_.poses[i].range != Range::apart)
        errors.push_back(std::abs(contacts[i].depth - truth_.poses[i].pose.depth));
    }
    tried.penetration = spread_of(errors);
    tried.distance = distance_errors(truth_, ask(*our_separation(file.asset)));
    out_.tried.push_back(tried);
    assets_.push_back(file.asset);
    return tried.error();
  }

  // Those that have not been timed yet.
  void time() {
    std::vector<Side> sides;
    for (std::size_t i = timed_; i < assets_.size(); ++i)
      sides.push_back({"", [asset = assets_[i]] { return our_traverse(asset); }});
    std::vector<Pose> poses;
    for (const TruePose& p : truth_.poses) poses.push_back(p.pose.first_in_second);
    RoundOptions rounds;
    rounds.rounds = options_.rounds;
    rounds.progress = [this](const std::string&, double fraction) { progress("times", fraction); };
    const std::vector<SideResult> results = ask_in_turn(sides, poses, rounds);
    for (const SideResult& result : results) out_.tried[timed_++].contacts = result.times;
  }

  // By how much a setting exceeds a limit at most; up to 1: by nothing.
  [[nodiscard]] double excess(const Tried& t) const {
    const Limits& limits = options_.limits;
    double most = 0;
    if (limits.error > 0) most = std::max(most, t.error() / limits.error);
    if (limits.microseconds > 0) most = std::max(most, t.contacts.p99 / limits.microseconds);
    if (limits.bytes > 0) most = std::max(most, double(t.bytes) / limits.bytes);
    return most;
  }

  void choose() {
    std::sort(out_.tried.begin(), out_.tried.end(), [](const Tried& a, const Tried& b) { return a.bytes < b.bytes; });
    for (std::size_t i = 0; i < out_.tried.size(); ++i) {
      const Tried& t = out_.tried[i];
      if (excess(t) < excess(out_.tried[out_.nearest])) out_.nearest = i;
      if (!t.exceeds(options_.limits).empty()) continue;
      const bool better = !out_.chosen || (options_.limits.error == 0 && t.error() < out_.tried[*out_.chosen].error());
      if (better) out_.chosen = i;
    }
    if (out_.chosen) out_.nearest = *out_.chosen;
  }

  const TriangleMesh& mesh_;
  const RecommendOptions& options_;
  double found_ = 0;  // voxel size by the certificate; 0: not asked for. [m]
  TriangleMesh closed_, body_;
  Truth truth_;
  std::vector<std::shared_ptr<const Asset>> assets_;
  std::size_t timed_ = 0;
  std::string refusal_;
  Recommendation out_;
};

}  // namespace

double Tried::error() const {
  return std::max({field_bound, penetration.max, distance.max});
}

std::vector<std::string> Tried::exceeds(const Limits& limits) const {
  std::vector<std::string> out;
  if (limits.error > 0 && error() > limits.error) out.push_back("is off by up to " + format_length(error()));
  if (limits.microseconds > 0 && contacts.p99 > limits.microseconds)
    out.push_back(fmt::format("takes {:.3g} us for 99 % of the queries", contacts.p99));
  if (limits.bytes > 0 && double(bytes) > limits.bytes) out.push_back("has " + format_bytes(double(bytes)));
  return out;
}

Recommendation recommend(const TriangleMesh& mesh, const RecommendOptions& options) {
  return Search(mesh, options).run();
}

}  // namespace vps::evaluate
