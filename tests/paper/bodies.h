// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The bodies and the floors of the experiments.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/lab/bullet.h"
#include "formats/triangle_mesh.h"
#include "tests/bench/query_assets.h"

namespace vps::paper {

/// How bodies move between two steps.
enum class Motion : std::uint8_t {
  discrete,  ///< as Bullet does: contacts only at the end of a step
  advanced,  ///< back to the first touch, by bullet::ContinuousMotion
};

/// One competitor: a body under a name.
struct Side {
  std::string name;
  lab::BulletShape body;
  Motion motion = Motion::discrete;
};

/// A named floor, with its top in the plane y = 0.
struct Floor {
  std::string name;
  lab::Ground ground;
};

inline constexpr double kBallRadius = 0.5;     // [m]
inline constexpr double kCoarseVoxel = 0.005;  // of the paper's plane, and of balls and cubes. [m]

struct Balls {
  lab::BakedFile low, high;  ///< 275 and 25,880 points, nearly
  lab::BakedFile cube;       ///< as wide as the balls, for stacks
};
/// Voxels of 5 mm, files in `folder`.
[[nodiscard]] Balls make_balls(const std::filesystem::path& folder);

struct Bunnies {
  std::size_t triangles = 0;       ///< of the mesh
  std::vector<btVector3> corners;  ///< of its convex hull: the deepest point in a plane is one of them
  lab::BakedFile low, fine;        ///< 799 and 35,596 points, nearly; K by default
  lab::BakedFile low_k4, fine_k4;  ///< the same points in trees of K = 4, as in the paper
  Side hull, gimpact;
  std::vector<Side> hacd;  ///< empty if HACD is absent
};
/// @param scale  metres per unit of the mesh file
[[nodiscard]] Bunnies make_bunnies(const std::filesystem::path& mesh, double scale,
                                   const std::filesystem::path& folder);

/// Whether many drops of a peer on a floor are useful: Bullet's own shapes have no points for contacts with a voxelmap,
/// and on a box GImpact takes tens of milliseconds a step.
[[nodiscard]] bool meets(const Side& peer, const Floor& floor, const Bunnies& bunnies);

/// A baked body with contacts segmented at a level of its tree. @param level  root = 1; 0: one manifold of up to four
[[nodiscard]] Side ours(const std::string& name, const lab::BakedFile& file, std::uint32_t level = 0);

/// The side with advanced motion and a name that says so.
[[nodiscard]] Side advanced(Side side);

/// Bullet's static plane, its box of 6 x 1 x 6 m, and a slab of 6 x 0.5 x 6 m baked with voxels of 5 mm.
[[nodiscard]] std::vector<Floor> make_floors(const std::filesystem::path& folder);

/// Numbers of clusters of all tree levels, root first.
[[nodiscard]] std::vector<std::uint32_t> clusters_of_levels(const Asset& asset);

}  // namespace vps::paper
