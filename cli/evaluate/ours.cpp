// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/evaluate/ours.h"

#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/vps_queries.h"

namespace vps::evaluate {

Pose in_asset_frame(const Asset& asset, Pose pose) {
  const auto& c = asset.info().centre_of_mass;
  for (std::size_t i = 0; i < 3; ++i) {
    pose.translation[i] += c[i];
    for (std::size_t j = 0; j < 3; ++j) pose.translation[i] -= pose.rotation[3 * i + j] * c[j];
  }
  return pose;
}

namespace {

void check(Status status) {
  if (status != Status::ok) throw std::runtime_error(describe(status));
}

// Both parts of an asset, and where its contacts go.
struct Parts {
  PointshellView shell;
  VoxelmapView map;
  explicit Parts(const Asset& asset) {
    check(asset.pointshell(shell));
    check(asset.voxelmap(map));
  }
  QueryResult query(const Pose& shell_to_map, Scratch& scratch, std::vector<Contact>& contacts) const {
    QueryResult result;
    check(traverse(shell, map, shell_to_map, QueryOptions{}, scratch, contacts, result));
    return result;
  }
};

class Traverse final : public PairPeer {
 public:
  explicit Traverse(std::shared_ptr<const Asset> asset)
      : asset_(std::move(asset)), parts_(*asset_), contacts_(parts_.shell.points) {
    scratch_.reserve(parts_.shell);
  }
  PairAnswer query(const Pose& first_in_second) override {
    const Pose pose = in_asset_frame(*asset_, first_in_second);
    PairAnswer answer;
    const auto begin = Clock::now();
    const QueryResult result = parts_.query(pose, scratch_, contacts_);
    answer.microseconds = microseconds_since(begin);
    answer.depth = result.delta;
    answer.contacts = result.contacts;
    return answer;
  }

 private:
  std::shared_ptr<const Asset> asset_;
  Parts parts_;
  Scratch scratch_;
  std::vector<Contact> contacts_;
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
    check(separation(parts_.shell, parts_.map, pose, SeparationOptions{}, scratch_, result));
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

std::unique_ptr<PairPeer> our_traverse(std::shared_ptr<const Asset> asset) {
  return std::make_unique<Traverse>(std::move(asset));
}

Opening open_once(const std::filesystem::path& asset, const Pose& first_in_second) {
  Opening opening;
  const auto begin = Clock::now();
  Asset opened;
  check(Asset::open(asset.c_str(), opened));
  opening.open_us = microseconds_since(begin);
  const Parts parts(opened);
  Scratch scratch;
  std::vector<Contact> contacts(parts.shell.points);
  (void)parts.query(in_asset_frame(opened, first_in_second), scratch, contacts);
  opening.query_us = microseconds_since(begin);
  return opening;
}

}  // namespace vps::evaluate
