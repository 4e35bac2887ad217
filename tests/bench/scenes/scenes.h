// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What the benchmark by scenes plays: scenes, the sides that play them, and what is measured.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "cli/lab/assets.h"
#include "tests/scenes/scene.h"
#include "tests/support/bullet_world.h"

namespace vps::bench {

enum class Length : std::uint8_t { full, quick };
enum class Hacd : std::uint8_t { with, without };

struct SceneOptions {
  std::string mesh;        ///< the bunny
  double scale = 1;        ///< metres per unit of the mesh
  std::string work = ".";  ///< keeps HACD's hulls and poses for the next run
  Length length = Length::full;
  Hacd hacd = Hacd::with;
};

/// What the bodies of one play did, or the worst of several plays. NaN: not measured.
struct Quality {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  double deepest = kUnknown;       ///< largest penetration ever. [m]
  double deepest_late = kUnknown;  ///< in the last fifth. [m]
  double gain = kUnknown;          ///< largest mechanical energy above the start and the work done. [J]
  double drift = kUnknown;         ///< largest way of a centre of mass in the last second. [m/s]
  double released = kUnknown;      ///< largest potential energy lost: the scale of `gain`. [J]
  double played = kUnknown;        ///< longest play. [s]
  int deepest_play = 0, drift_play = 0;
  std::vector<double> drifts{};  ///< of each play. [m/s]
  std::vector<double> stands{};  ///< of each play: until a body is Script::fallen aside, or to the end. [s]

  void keep_worse(const Quality& other, int play);
};

enum class Kind : std::uint8_t { baked, hull, hacd, box };

/// One of the shapes that play a scene.
struct Side {
  std::string name;
  Kind kind = Kind::baked;
  double voxel = 0;  ///< of the finest shape in the scene. [m]
  /// @param quality  null: only times @return the narrowphase's time of each step. [us]
  std::function<std::vector<double>(int play, Quality* quality)> play;
  int rounds = 1000;  ///< at most
};

/// A span of steps, reported as a row.
struct Phase {
  std::string name;
  std::size_t first = 0, last = 0;  ///< [first, last)
};

struct Scene {
  std::string name;
  int plays = 1;  ///< starts, such as rotations
  std::vector<Phase> phases;
  std::function<std::vector<Side>()> sides;  ///< bakes what it needs
};

/// A body in one of its shapes. `part.baked` gives the mass properties and the surface whose depth is measured.
struct BodySide {
  std::string name;
  Kind kind = Kind::baked;
  std::shared_ptr<scenes::Part> part;
};

struct Body {
  double mass = 0;   ///< [kg]
  double voxel = 0;  ///< [m]
  std::vector<BodySide> sides;
};

/// Bakes each body once.
class Bodies {
 public:
  explicit Bodies(SceneOptions options) : options_(std::move(options)) {}
  const SceneOptions& options() const { return options_; }
  /// @param name  "bunny", "gear", "nut", "brick", "cube" or "coarse cube"
  const Body& get(const std::string& name);
  /// The bunny's mesh, about its centre of mass.
  const TriangleMesh& bunny_mesh();

 private:
  Body make_bunny();
  const SceneOptions options_;
  std::map<std::string, Body> bodies_;
  TriangleMesh bunny_mesh_;
};

/// The points of a body's shell, about its centre of mass. [m]
[[nodiscard]] std::vector<btVector3> shell_points(const bullet::Shape& shape);

/// What happens in a play.
struct Script {
  double step = 0;  ///< [s]
  std::size_t steps = 0;
  std::function<void()> drive;    ///< called before each step; may be empty
  std::function<double()> power;  ///< of the drive, after a step; may be empty. [W]
  std::function<double()> depth;  ///< of the deepest point now. [m]
  std::size_t depth_every = 1;    ///< steps
  double fallen = 0;              ///< a body of a stack that is this far aside has fallen; 0: no stack. [m]
};
/// Plays a script. @return the narrowphase's time of each step. [us]
std::vector<double> record(test::World& world, const scenes::Run& run, const Script& script, Quality* quality);

/// The settings that docs/bullet.md advises. After scenes::Run and all bodies: these raise the threshold of split
/// impulses.
void prepare(test::World& world, double voxel);
/// Depth of the deepest point in any other body, among all points of all shells. [m]
[[nodiscard]] double depth_of_all(const scenes::Run& run);

[[nodiscard]] std::vector<Scene> drop_scenes(Bodies& bodies);  ///< one body falls, lands and rests
[[nodiscard]] std::vector<Scene> pair_scenes(Bodies& bodies);  ///< bunny on bunny in fresh poses
[[nodiscard]] std::vector<Scene> heap_scenes(Bodies& bodies);  ///< bins and stacks
[[nodiscard]] std::vector<Scene> fit_scenes(Hacd hacd);        ///< nut on bolt, peg in hole, gears

}  // namespace vps::bench
