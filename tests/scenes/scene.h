// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Shared by the scenes: parts, depth measured independently of the contact list, energy, times, trajectories,
/// verdict.
#pragma once

#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "cli/lab/bullet.h"
#include "tests/support/bullet_world.h"

namespace vps::scenes {

/// Exit codes; ctest knows kSkipped as SKIP_RETURN_CODE.
inline constexpr int kPassed = 0, kUsage = 1, kFailed = 4, kSkipped = 77;

/// The command line: SCENE VARIANT [--hulls] [--trajectory FILE].
struct Options {
  std::string variant;
  bool hulls = false;      ///< uses convex hulls, for comparison; depths are still measured in the baked fields
  std::string trajectory;  ///< file of poses for pictures; empty: none
};

/// Folders of meshes.
[[nodiscard]] std::filesystem::path sample_mesh(const std::string& name);
[[nodiscard]] std::filesystem::path shared_file(const std::string& relative);

/// A body's shape. Frame of every shape: the origin is the centre of mass.
struct Part {
  std::filesystem::path mesh;
  std::unique_ptr<bullet::Shape> baked;
  lab::BulletShape hulls;  ///< empty: `baked` is used
  [[nodiscard]] btCollisionShape& shape() const {
    return hulls.shape != nullptr ? *hulls.shape : static_cast<btCollisionShape&>(*baked);
  }
  [[nodiscard]] double volume() const { return baked->asset().info().volume; }  ///< [m^3]
};

/// Bakes a mesh as the program does by default. @param voxel_size  [m] @throw BakeError, ImportError
[[nodiscard]] Part bake_part(const std::filesystem::path& mesh, double voxel_size);
[[nodiscard]] Part bake_part(const TriangleMesh& mesh, double voxel_size);
/// Replaces the part's shape by HACD's hulls. @throw std::runtime_error without HACD
void use_hacd(Part& part, std::size_t hulls);

/// Measures a world while it steps.
class Run {
 public:
  /// @param step  [s]
  Run(test::World& scene, double step, const Options& options);
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  ~Run();

  /// @param mesh_at  pose of the mesh's frame, not of the centre of mass @param density  [kg/m^3]; 0: static
  btRigidBody& add(const Part& part, double density, const btTransform& mesh_at);
  btRigidBody& add_mass(const Part& part, double mass, const btTransform& mesh_at);  ///< [kg]
  /// Static. Hidden boxes are not in pictures.
  enum class Look { shown, hidden };
  btRigidBody& add_box(const btVector3& half_extents, const btVector3& at, Look look);

  /// Depth of the deepest shell point of any part in any other and in boxes, among all points, as the contact list may
  /// miss it.
  struct Depth {
    double in_parts = 0, in_boxes = 0;  ///< [m]; 0: nothing touches
  };
  [[nodiscard]] Depth depth_now() const;
  void measure_depth_every(int steps) { depth_every_ = steps; }
  void frame_every(int steps) { frame_every_ = steps; }
  void add_work(double joules) { work_ += joules; }  ///< of external torques
  void step();

  [[nodiscard]] double time() const { return steps_ * step_; }
  [[nodiscard]] const Depth& deepest() const { return deepest_; }  ///< of all steps measured
  /// Kinetic and potential energy; the latter is 0 at z = 0. [J]
  [[nodiscard]] double energy() const;
  /// Largest excess of the energy over its start plus the work done. [J]
  [[nodiscard]] double energy_gain() const { return gain_; }
  [[nodiscard]] double kinetic() const;  ///< [J]
  [[nodiscard]] double fastest() const;  ///< of the moving bodies, now. [m/s]
  /// Prints the measurements and the row of docs/scenes.md.
  void print(const std::string& title) const;

 private:
  struct Body {
    const Part* part = nullptr;  ///< null: a box
    btRigidBody* body = nullptr;
    btVector3 half_extents{0, 0, 0};
    [[nodiscard]] btTransform mesh_pose() const {
      const btTransform& at = body->getWorldTransform();
      return part == nullptr ? at : part->baked->mesh_pose(at);
    }
  };
  [[nodiscard]] double depth_of(const Body& a, const Body& b) const;
  void write_frame() const;

  test::World& scene_;
  const double step_;
  const Options& options_;
  std::vector<Body> bodies_;
  std::vector<std::unique_ptr<btBoxShape>> boxes_;
  std::FILE* trajectory_ = nullptr;
  int depth_every_ = 10, frame_every_ = 20, steps_ = 0;
  Depth deepest_;
  double start_energy_ = 0, work_ = 0, gain_ = 0;
  std::vector<double> narrow_us_, whole_us_, energies_;
};

/// Collects conditions that must hold, and prints each.
class Verdict {
 public:
  void expect(bool holds, const std::string& sentence);
  [[nodiscard]] int exit_code() const { return failed_ ? kFailed : kPassed; }

 private:
  bool failed_ = false;
};

struct Variant {
  std::string name;
  std::vector<std::string> needs;  ///< files below the shared folder
};
/// Parses the command line, runs the scene, reports exceptions; skips a variant that needs an absent file.
/// @return the exit code of the program
int run_scene(int argc, char** argv, const std::vector<Variant>& variants,
              const std::function<int(const Options&)>& scene);

}  // namespace vps::scenes
