// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The other collision libraries and shapes of a report, by name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "cli/lab/bullet.h"
#include "cli/lab/rounds.h"
#include "formats/triangle_mesh.h"

namespace vps::lab {

/// "hull", "hacd", "gimpact", "fcl": the names that --without takes.
[[nodiscard]] const std::vector<std::string>& peer_names();

/// The call that a row times. Only rows with the same one are comparable.
enum class Way : std::uint8_t {
  query,   ///< one call of a library, with all contacts
  bullet,  ///< Bullet's whole narrowphase of a pair, down to a manifold of at most four contacts
};

/// The objects whose overlap an answered depth measures.
enum class DepthOf : std::uint8_t {
  bodies,     ///< the deepest point of one body below the other's surface
  hulls,      ///< a pair of hulls, along the shortest translation that separates them
  triangles,  ///< a pair of triangles
};

struct Peer {
  std::string name;    ///< of `peer_names`
  std::string series;  ///< for people
  std::string remark;  ///< its settings
  Way way = Way::bullet;
  DepthOf depth_of = DepthOf::hulls;
  Contender contacts;
  std::shared_ptr<const BulletShape> shape;  ///< in Bullet; none: not in Bullet
  Contender distance;                        ///< without `make`: no distance query
};

struct LeftOut {
  std::string name;
  std::string why;
};

struct Peers {
  std::vector<Peer> peers;
  std::vector<LeftOut> left_out;  ///< by an option, or because they cannot be queried
};

struct PeerOptions {
  double margin = 0;                    ///< of hulls and GImpact: a voxel of the base, as a user would choose. [m]
  std::vector<std::string> without;     ///< names
  std::filesystem::path folder;         ///< where HACD's hulls are kept
  std::function<void()> announce_hacd;  ///< called before it takes minutes; may be empty
};

/// @param body  closed, about its centre of mass
[[nodiscard]] Peers make_peers(const TriangleMesh& body, const PeerOptions& options);

}  // namespace vps::lab
