// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <list>
#include <stdexcept>

#include "cli/lab/assets.h"
#include "cli/lab/bullet.h"
#include "cli/lab/ours.h"
#include "cli/lab/stress/world.h"

namespace vps::lab {
namespace {

// An asset that several settings may share.
struct Baked {
  bake::BakeOptions options;
  std::shared_ptr<const Asset> asset;
  double seconds = 0;
};

bool same(const bake::BakeOptions& a, const bake::BakeOptions& b) {
  return a.voxel_size == b.voxel_size && a.alpha == b.alpha && a.branching == b.branching &&
         a.precision == b.precision && field_of(a) == field_of(b);
}

double longest_of(const std::array<double, 3>& size) {
  return *std::max_element(size.begin(), size.end());
}

Contender contacts_side(const Setting& setting, const std::shared_ptr<const Asset>& asset) {
  return {setting.name, [=]() -> std::unique_ptr<PairPeer> {
            if (setting.reading != Reading::queries) return read_otherwise(asset, setting.reading);
            QueryOptions options;
            options.level = setting.level;
            options.max_tests = setting.max_tests;
            options.max_microseconds = setting.max_microseconds;
            return our_traverse(asset, options);
          }};
}

bool asks_base(const Setting& setting) {
  return setting.level > 0 || setting.max_tests > 0 || setting.max_microseconds > 0;
}

std::string remark_of(const Setting& setting) {
  switch (setting.reading) {
    case Reading::nearest:
      return field_of(setting.bake) == Field::real
                 ? "the same file, read as Eq. (5) has it: from the nearest sample, along its gradient; not timed"
                 : "the same file, read as Eq. (4) has it: from the nearest sample, along the shell's normal; not "
                   "timed";
    case Reading::trilinear:
      return "the same file, layers interpolated between voxel centres, which queries do not do; not timed";
    case Reading::queries:
      break;
  }
  if (field_of(setting.bake) == Field::layers) return "Eq. (4), as queries read layers";
  if (setting.level > 0) return "points of this level stand for those below";
  if (setting.max_tests > 0) return "ends after so many tests of spheres and points, with the answer so far";
  if (setting.max_microseconds > 0) return "ends after so long, with the answer so far: depends on the clock";
  return "";
}

class Run {
 public:
  Run(const TriangleMesh& mesh, const TriangleMesh& closed, const MeasureOptions& options)
      : mesh_(mesh), closed_(closed), options_(options) {}

  Measurement run() {
    const bake::BakeOptions base = with_field(options_.base, Field::scaled);
    const Baked& first = bake_once(base);
    body_ = centred(closed_, *first.asset);
    const std::uint32_t levels = first.asset->info().levels;
    for (std::size_t axis = 0; axis < 3; ++axis)
      out_.size[axis] = first.asset->info().bounds_max[axis] - first.asset->info().bounds_min[axis];
    TruthOptions truth = options_.truth;
    truth.progress = [this](const char* what, double fraction) { progress(std::string("oracle: ") + what, fraction); };
    out_.truth = find_truth(body_, truth, Wrenches::exact, options_.cache);
    out_.bake_noise = std::numeric_limits<double>::quiet_NaN();
    if (options_.size != SweepSize::quick) measure_bake_noise(base);
    const std::vector<Setting> settings = sweep(base, levels, options_.size);
    for (std::size_t i = 0; i < settings.size(); ++i) {
      baking_ = settings[i].name;
      baked_share_ = double(i) / double(settings.size());
      add_ours(settings[i]);
    }
    add_in_bullet();
    add_peers(base.voxel_size);
    ask();
    play(base.voxel_size);
    out_.fronts = find_fronts(out_.rows);
    return std::move(out_);
  }

 private:
  void progress(const std::string& what, double fraction) const {
    if (options_.progress) options_.progress(what, fraction);
  }

  const Baked& bake_once(const bake::BakeOptions& bake) {
    const auto found =
        std::find_if(baked_.begin(), baked_.end(), [&](const Baked& b) { return same(b.options, bake); });
    if (found != baked_.end()) return *found;
    bake::BakeOptions told = bake;
    told.progress = [this](const char* stage, double) {
      progress(fmt::format("bake {}: {}", baking_, stage), baked_share_);
    };
    const auto begin = Clock::now();
    std::shared_ptr<const Asset> asset = bake_in_memory(mesh_, told, options_.record);
    return baked_.emplace_back(Baked{bake, std::move(asset), microseconds_since(begin) / 1e6});
  }

  void measure_bake_noise(const bake::BakeOptions& base) {
    std::vector<double> seconds{baked_.front().seconds};
    for (int i = 0; i < 2; ++i) {
      const auto begin = Clock::now();
      (void)bake_in_memory(mesh_, base, options_.record);
      seconds.push_back(microseconds_since(begin) / 1e6);
    }
    std::sort(seconds.begin(), seconds.end());
    out_.bake_noise = (seconds[2] - seconds[0]) / seconds[1];
    baked_.front().seconds = seconds[1];
  }

  void add_ours(const Setting& setting) {
    const Baked* baked = nullptr;
    try {
      baked = &bake_once(setting.bake);
    } catch (const bake::BakeError& refusal) {
      out_.left_out.push_back({setting.name, refusal.what()});
      return;
    }
    const AssetInfo& info = baked->asset->info();
    Row row;
    row.name = setting.name;
    row.series = setting.series;
    row.knob = setting.knob;
    row.remark = remark_of(setting);
    row.setting = setting;
    row.bytes = baked->asset->directory().file_bytes;
    row.points = info.points;
    row.covering_radius = info.covering_radius;
    row.field_bound = std::max({info.layers_error.bound, info.scaled_error.bound, info.real_error.bound});
    row.bake_seconds = baked->seconds;
    contacts_.push_back(contacts_side(setting, baked->asset));
    // A level, a budget or another reading does not change the result of `separation`.
    Contender distance;
    if (!asks_base(setting) && setting.reading == Reading::queries) {
      distance = {setting.name, [asset = baked->asset] { return our_separation(asset); }};
    }
    distances_.push_back(std::move(distance));
    out_.rows.push_back(std::move(row));
  }

  // Repeats every setting with a file of its own in Bullet, like the other libraries.
  void add_in_bullet() {
    for (std::size_t i = 0, ours = out_.rows.size(); i < ours; ++i) {
      const Setting& setting = *out_.rows[i].setting;
      if (asks_base(setting) || setting.reading != Reading::queries) continue;
      Row row = out_.rows[i];
      row.name += ", in Bullet";
      row.series = "ours in Bullet";
      row.knob = "bullet";
      row.way = Way::bullet;
      row.remark = "the same file in Bullet's narrowphase by the plug-in, from the pair to its manifold";
      const std::shared_ptr<const Asset> asset = bake_once(setting.bake).asset;
      contacts_.push_back({row.name, [asset] { return bullet_pair(ours_of(asset)); }});
      distances_.emplace_back();
      players_.resize(out_.rows.size());
      players_.push_back({row.name, [asset] { return ours_of(asset); }});
      out_.rows.push_back(std::move(row));
    }
  }

  void add_peers(double margin) {
    const auto announce = [this] { progress("HACD, which takes minutes", 0); };
    Peers made = make_peers(body_, {margin, options_.without, options_.cache, announce});
    out_.left_out.insert(out_.left_out.end(), made.left_out.begin(), made.left_out.end());
    for (Peer& peer : made.peers) {
      Row row;
      row.name = row.series = peer.series;
      row.knob = "peer";
      row.remark = peer.remark;
      row.way = peer.way;
      row.depth_of = peer.depth_of;
      players_.push_back(player_of(peer, row.name));
      out_.rows.push_back(std::move(row));
      contacts_.push_back(std::move(peer.contacts));
      distances_.push_back(std::move(peer.distance));
    }
  }

  // Queries all sides that have a `make`. The results are by row.
  std::vector<ContenderResult> ask_all(const std::vector<Contender>& sides, const std::vector<Pose>& poses,
                                       const char* what) {
    std::vector<Contender> asked;
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < sides.size(); ++i) {
      if (!sides[i].make) continue;
      asked.push_back(sides[i]);
      rows.push_back(i);
    }
    RoundOptions rounds = options_.rounds;
    rounds.progress = [&](const std::string& side, double fraction) { progress(what + (": " + side), fraction); };
    std::vector<ContenderResult> answers = ask_in_turn(asked, poses, rounds);
    std::vector<ContenderResult> out(sides.size());
    for (std::size_t i = 0; i < rows.size(); ++i) out[rows[i]] = std::move(answers[i]);
    return out;
  }

  void ask() {
    const double longest = longest_of(out_.size);
    std::vector<Pose> poses;
    std::vector<Pose> apart;
    for (const TruePose& p : out_.truth.poses) {
      poses.push_back(p.pose.first_in_second);
      if (p.range == PoseKind::apart) apart.push_back(p.pose.first_in_second);
    }
    const std::vector<ContenderResult> contacts = ask_all(contacts_, poses, "contacts");
    const std::vector<ContenderResult> distances = ask_all(distances_, apart, "distances");
    for (std::size_t i = 0; i < out_.rows.size(); ++i) {
      Row& row = out_.rows[i];
      row.contacts = contacts[i].times;
      row.errors = contact_errors(out_.truth, contacts[i].answers, longest);
      if (row.setting && asks_base(*row.setting)) {
        row.budget_held = budget_held(contacts[i].answers, contacts.front().answers);
      }
      if (!distances_[i].make) {
        // Bullet also makes contacts of bodies that are apart.
        if (row.way == Way::bullet) row.distance = distance_errors(out_.truth, contacts[i].answers);
        continue;
      }
      row.distances = distances[i].times;
      if (!row.setting) continue;  // FCL itself gives the exact distances
      // The poses apart come first.
      std::vector<PairAnswer> all = ask_every(distances_[i], distances[i].answers, poses);
      row.distance = distance_errors(out_.truth, all);
      if (std::isfinite(all.front().upper)) row.separation_held = bounds_held(out_.truth, all);
    }
  }

  // Bullet tests a box against every triangle of a mesh for GImpact.
  Player player_of(const Peer& peer, const std::string& name) {
    if (!peer.shape) return {name, {}};
    if (peer.name == "gimpact" && body_.triangles.size() > stress::kMostTriangles) {
      out_.left_out.push_back({name + " in scenes", stress::kTooManyTriangles});
      return {name, {}};
    }
    return {name, [shape = peer.shape] { return *shape; }};
  }

  void play(double voxel) {
    SceneOptions scenes;
    scenes.voxel = voxel;
    scenes.corners = stress::hull_corners(body_.vertices);
    scenes.rotations = options_.rotations;
    scenes.rounds = options_.rounds.rounds;
    scenes.seed = options_.truth.seed;
    scenes.progress = [&](const std::string& player, double fraction) { progress("scenes: " + player, fraction); };
    std::vector<SceneTimes> steps = play_in_turn(players_, scenes);
    for (std::size_t i = 0; i < steps.size(); ++i) out_.rows[i].steps = std::move(steps[i]);
  }

  // Adds the answers at overlapping poses, untimed, since `separation` gives bounds there too.
  static std::vector<PairAnswer> ask_every(const Contender& side, std::vector<PairAnswer> apart,
                                           const std::vector<Pose>& poses) {
    const std::unique_ptr<PairPeer> peer = side.make();
    for (std::size_t i = apart.size(); i < poses.size(); ++i) apart.push_back(peer->query(poses[i]));
    return apart;
  }

  const TriangleMesh& mesh_;
  const TriangleMesh& closed_;
  const MeasureOptions& options_;
  TriangleMesh body_;  // about its centre of mass
  std::list<Baked> baked_;
  std::string baking_ = "the base";
  double baked_share_ = 0;
  std::vector<Contender> contacts_, distances_;  // by row
  std::vector<Player> players_;                  // by row
  Measurement out_;
};

}  // namespace

Measurement measure(const TriangleMesh& mesh, const TriangleMesh& closed, const MeasureOptions& options) {
  return Run(mesh, closed, options).run();
}

}  // namespace vps::lab
