// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/ours.h"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/grow.h"
#include "runtime/vps_queries.h"

namespace vps::lab {

Pose in_asset_frame(const Asset& asset, Pose pose) {
  const auto& c = asset.info().centre_of_mass;
  for (std::size_t i = 0; i < 3; ++i) {
    pose.translation[i] += c[i];
    for (std::size_t j = 0; j < 3; ++j) pose.translation[i] -= pose.rotation[3 * i + j] * c[j];
  }
  return pose;
}

namespace {

// Both parts of an asset, ready for queries.
struct Parts {
  PointshellView shell;
  VoxelmapView map;
  explicit Parts(const Asset& asset) {
    require_ok(asset.pointshell(shell));
    require_ok(asset.voxelmap(map));
  }
  QueryResult query(const Pose& shell_to_map, const QueryOptions& options, Scratch& scratch,
                    std::span<Contact> contacts) const {
    QueryResult result;
    require_ok(traverse(shell, map, shell_to_map, options, scratch, contacts, result));
    return result;
  }
};

class Traverse final : public PairPeer {
 public:
  Traverse(std::shared_ptr<const Asset> asset, const QueryOptions& options)
      : asset_(std::move(asset)), options_(options), parts_(*asset_), contacts_(parts_.shell.points) {
    scratch_.reserve(parts_.shell);
    if (options_.level == 0 && options_.max_tests == 0 && options_.max_microseconds == 0) return;
    areas_.resize(parts_.shell.nodes);
    require_ok(node_areas(parts_.shell, areas_));
    options_.node_areas = areas_;
  }
  PairAnswer query(const Pose& first_in_second) override {
    const Pose pose = in_asset_frame(*asset_, first_in_second);
    PairAnswer answer;
    const auto begin = Clock::now();
    const QueryResult result = parts_.query(pose, options_, scratch_, contacts_);
    answer.microseconds = microseconds_since(begin);
    answer.depth = result.delta;
    answer.contacts = result.contacts;
    answer.delta_bound = result.delta_bound;
    std::copy_n(result.force, 3, answer.force.begin());
    std::copy_n(result.torque, 3, answer.torque.begin());
    tell_deepest(answer);
    return answer;
  }

 private:
  void tell_deepest(PairAnswer& answer) const {
    if (answer.contacts == 0) return;
    const Vec3 at = std::max_element(contacts_.begin(), contacts_.begin() + std::ptrdiff_t(answer.contacts),
                                     [](const Contact& a, const Contact& b) { return a.penetration < b.penetration; })
                        ->position;
    const Vec3 out = outward_normal(parts_.map, at);
    const auto& centre = asset_->info().centre_of_mass;
    answer.position = {double(at.x) - centre[0], double(at.y) - centre[1], double(at.z) - centre[2]};
    answer.direction = {double(out.x), double(out.y), double(out.z)};
  }

  std::shared_ptr<const Asset> asset_;
  QueryOptions options_;
  Parts parts_;
  Scratch scratch_;
  std::vector<Contact> contacts_;
  std::vector<float> areas_;
};

class Separation final : public PairPeer {
 public:
  explicit Separation(std::shared_ptr<const Asset> asset) : asset_(std::move(asset)), parts_(*asset_) {
    scratch_.reserve(parts_.shell);
  }
  PairAnswer query(const Pose& first_in_second) override {
    const Pose pose = in_asset_frame(*asset_, first_in_second);
    PairAnswer answer;
    SeparationResult result;
    const auto begin = Clock::now();
    SeparationOptions options;
    options.field_shell = &parts_.shell;
    require_ok(separation(parts_.shell, parts_.map, pose, options, scratch_, result));
    answer.microseconds = microseconds_since(begin);
    answer.depth = result.delta;
    answer.lower = result.lower;
    answer.upper = result.upper;
    return answer;
  }

 private:
  std::shared_ptr<const Asset> asset_;
  Parts parts_;
  Scratch scratch_;
};

}  // namespace

std::unique_ptr<PairPeer> our_separation(std::shared_ptr<const Asset> asset) {
  return std::make_unique<Separation>(std::move(asset));
}

std::unique_ptr<PairPeer> our_traverse(std::shared_ptr<const Asset> asset, QueryOptions options) {
  return std::make_unique<Traverse>(std::move(asset), options);
}

Opening open_once(const std::filesystem::path& asset, const Pose& first_in_second) {
  Opening opening;
  const auto begin = Clock::now();
  Asset opened;
  require_ok(Asset::open(asset.c_str(), opened));
  opening.open_us = microseconds_since(begin);
  const Parts parts(opened);
  Scratch scratch;
  detail::Room<Contact> room;
  (void)parts.query(in_asset_frame(opened, first_in_second), {}, scratch, room.grow(parts.shell.points));
  opening.query_us = microseconds_since(begin);
  return opening;
}

}  // namespace vps::lab
