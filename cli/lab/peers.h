// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The peers of a report by name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "cli/lab/rounds.h"
#include "formats/triangle_mesh.h"

namespace vps::lab {

/// "hull", "hacd", "gimpact", "fcl": what may be left out.
[[nodiscard]] const std::vector<std::string>& peer_names();

/// What is timed, and answers: only rows asked alike compare.
enum class Way : std::uint8_t {
  query,   ///< one call of a library, with all contacts
  bullet,  ///< Bullet's whole narrowphase of a pair, down to a manifold of at most four contacts
};

/// What a depth that is told is the depth of.
enum class DepthOf : std::uint8_t {
  bodies,     ///< the deepest point of one body below the other's surface
  hulls,      ///< a pair of hulls, along the way that parts them soonest
  triangles,  ///< a pair of triangles
};

struct Peer {
  std::string name;    ///< of `peer_names`
  std::string series;  ///< for people
  std::string remark;  ///< its settings
  Way way = Way::bullet;
  DepthOf depth_of = DepthOf::hulls;
  Contender contacts;
  Contender distance;  ///< without `make`: it has none
};

struct LeftOut {
  std::string name;
  std::string why;
};

struct Peers {
  std::vector<Peer> peers;
  std::vector<LeftOut> left_out;  ///< as asked, or since they cannot be asked
};

struct PeerOptions {
  double margin = 0;                    ///< a voxel of the base: what a user would give hulls and GImpact. [m]
  std::vector<std::string> without;     ///< names
  std::filesystem::path folder;         ///< where HACD's hulls are kept
  std::function<void()> announce_hacd;  ///< called before it takes minutes; may be empty
};

/// @param body  closed, about its centre of mass
[[nodiscard]] Peers make_peers(const TriangleMesh& body, const PeerOptions& options);

}  // namespace vps::lab
