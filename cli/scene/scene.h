// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A scene as read from a TOML or URDF file, with the lines of its entries.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bake/vps_bake.h"

namespace vps::cli {

using Triple = std::array<double, 3>;

/// Rigid transform, the inner frame to the outer.
struct Placement {
  Triple position{};                              ///< [m]
  std::array<double, 4> orientation{0, 0, 0, 1};  ///< quaternion x, y, z, w of unit length
};

/// Rotations about the fixed axes x, y and z, in this order. [rad]
[[nodiscard]] std::array<double, 4> from_roll_pitch_yaw(const Triple& angles);
[[nodiscard]] Triple rotated(const std::array<double, 4>& by, const Triple& v);
/// Applies `inner`, then `outer`.
[[nodiscard]] Placement composed(const Placement& outer, const Placement& inner);

/// Where an entry stands in a file.
struct Place {
  std::string file;
  int line = 0;  ///< 0: no particular line
};

enum class Solid : std::uint8_t { mesh, box, sphere, capsule, cylinder, plane };

/// One piece of a body: a mesh, or one of Bullet's own shapes, which need no asset.
struct SceneShape {
  Solid solid = Solid::mesh;
  std::filesystem::path mesh;  ///< path to open
  Triple units{1, 1, 1};       ///< metres per unit of the mesh's x, y and z, a scale included; negative ones mirror
  double voxel_size = 0;       ///< 0: the plan chooses it. [Units: m]
  bake::Repair repair = bake::Repair::automatic;
  double sheet_thickness = 0;  ///< given to open surfaces; 0: as `repair` does. [Units: m]
  Triple half_extents{};       ///< of a box. [m]
  double radius = 0;           ///< [m]
  double half_height = 0;      ///< along z; of a capsule without its caps. [m]
  Placement pose;              ///< in the body's frame
  Place place;
};

enum class Motion : std::uint8_t { fixed, kinematic, dynamic };

struct SceneBody {
  std::string name;
  Motion motion = Motion::dynamic;
  double mass = 0;                       ///< of a dynamic body. [kg]
  std::optional<Triple> centre_of_mass;  ///< body's frame; empty: from the shape. [m]
  /// xx, yy, zz, xy, xz, yz about the centre of mass, along the body's axes. [kg m^2]
  std::optional<std::array<double, 6>> inertia;
  Placement pose;
  Triple velocity{};            ///< at the start. [m/s]
  std::optional<double> speed;  ///< largest expected speed. [m/s]
  std::int32_t group = 1;       ///< Bullet's collision group; `mask` likewise
  std::int32_t mask = -1;
  double friction = 0.5;
  double restitution = 0;
  std::optional<std::uint32_t> segments;  ///< wished number of segments (Sec. 2.4)
  Use keep{};                             ///< parts to bake and use even if no pair needs them
  std::vector<SceneShape> shapes;
  Place place;
};

/// A joint of a URDF that turns or slides about one axis.
struct SceneJoint {
  enum class Type : std::uint8_t { revolute, continuous, prismatic };
  std::string name;
  Type type{};
  std::string parent;  ///< a body's or a link's name; empty: the world
  std::string child;
  Placement pose;                                   ///< of the child at the joint's zero, in the parent
  Triple axis{1, 0, 0};                             ///< in the child, of unit length
  std::optional<std::pair<double, double>> limits;  ///< [rad] or [m]
  Place place;                                      ///< of the child
};

struct Wish {
  double value = 0;  ///< 0: none
  Place place;
};

struct Scene {
  std::vector<SceneBody> bodies;
  std::vector<std::pair<std::size_t, std::size_t>> joined;  ///< pairs of bodies at a joint, which do not collide
  std::vector<SceneJoint> joints;                           ///< parents before their children
  std::vector<SceneBody> links;                             ///< with a mass and no shapes, held by joints
  Wish error;                                               ///< largest error of distances between surfaces. [m]
  Wish time;                                                ///< for the narrowphase of a step. [s]
  Wish memory;                                              ///< for all assets. [bytes]
  double step = 1.0 / 240;                                  ///< [s]
  std::optional<Triple> gravity;                            ///< [m/s^2]
  std::vector<std::string> notes;                           ///< one sentence each
  std::vector<std::string> assumptions;                     ///< notes on what was assumed where a URDF says nothing
};

/// An error in a scene. `what()` is "reason; what to do".
struct SceneError : std::runtime_error {
  enum class Kind : std::uint8_t { bad_input, io };  ///< io: a file is missing or cannot be read
  Place place;
  Kind kind;
  SceneError(Place place_in, const std::string& reason, Kind kind_in = Kind::bad_input)
      : std::runtime_error(reason), place(std::move(place_in)), kind(kind_in) {}
};

/// Reads a file by its extension: .toml, or .urdf and .xml. @throw SceneError
[[nodiscard]] Scene read_scene(const std::filesystem::path& file);
/// @throw SceneError
[[nodiscard]] Scene read_toml(const std::filesystem::path& file);
/// Links joined by fixed joints become one body. @throw SceneError
[[nodiscard]] Scene read_urdf(const std::filesystem::path& file);
/// Whether a scene may name this file: not empty, without control characters.
[[nodiscard]] bool is_file_name(const std::string& name);
/// The file that `file` names. A folder may be a link, so ".." stays.
[[nodiscard]] std::filesystem::path beside(const std::filesystem::path& file, const std::string& name);
/// The whole of a text file. @throw SceneError
[[nodiscard]] std::string read_text(const std::filesystem::path& file);

}  // namespace vps::cli
