// SPDX-License-Identifier: Zlib
/// @file Maps baked assets into memory and answers contact queries between a pointshell and a voxelmap.
///
/// Frames: a query computes in float, in the frame of the asset that plays the voxelmap ("map frame"). Poses and their
/// difference are double. Signs: `penetration` is the paper's V(P), positive inside, V = 0 counts as contact.
/// All queries are const on shared assets, allocate nothing once their Scratch has grown, and never throw.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <variant>
#include <vector>

#include "formats/quantize.h"
#include "formats/vps_format.h"

namespace vps {

struct Vec3 {
  float x = 0, y = 0, z = 0;
};

/// Rigid transform, body to world: p_world = rotation * p_body + translation.
struct Pose {
  double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row-major, orthonormal, determinant +1
  double translation[3] = {0, 0, 0};                 ///< [m]
};

/// `ok`, or `bad_pose` when not finite, translated by more than 1e12 m or farther than 1e-3 from orthonormal.
[[nodiscard]] Status check_pose(const Pose& pose) noexcept;

/// first^-1 * second: takes second's body frame to first's body frame.
[[nodiscard]] Pose relative_pose(const Pose& first, const Pose& second) noexcept;

/// An asset may be used at another size than its bake's, the same along all axes: lengths are multiplied by a scale.
inline constexpr double kLeastScale = 1e-3, kMostScale = 1e3;
/// `bad_argument` for a scale beyond these limits or NaN.
[[nodiscard]] Status check_scale(double scale) noexcept;
/// The facts of an asset at a scale: lengths and errors times `scale`, areas, volume and inertia by its powers 2, 3, 5.
[[nodiscard]] AssetInfo scaled(const AssetInfo& info, double scale) noexcept;

/// Which stored field answers `penetration`.
enum class Field : std::uint8_t { none, layers, scaled, real };

/// Read-only view of a voxelmap's far grid: coarse samples of V for the places beyond the band.
struct FarGridView {
  const std::int8_t* values = nullptr;  ///< [nz,ny,nx]; null: the asset has none
  std::uint32_t dims[3] = {};           ///< nodes along x, y, z
  double origin[3] = {};                ///< node (0,0,0), asset frame. [m]
  float spacing = 0;                    ///< between nodes. [m]
  float step_inner = 0;                 ///< of values above 0. [m]
  float step_outer = 0;                 ///< of values below 0. [m]
  float range = 0;                      ///< distances are known up to this far outside. [m]
  float error = 0;                      ///< proven bound of the interpolated V's error, to the range. [m]
};

/// Read-only view of an asset's voxelmap. Lives as long as its Asset.
struct VoxelmapView {
  Field field = Field::none;                   ///< the finest stored one, unless Asset::voxelmap requested another
  ElementType element{};                       ///< element type of `values`
  const void* values = nullptr;                ///< [n,8,8,8] with Field::layers, else [f,25]
  const float* gradients = nullptr;            ///< with Field::real: [f,25,3], metres per voxel step
  const std::uint32_t* brick_index = nullptr;  ///< with Field::layers
  const std::uint32_t* field_roots = nullptr;  ///< with Field::scaled and real, as field_nodes
  const std::uint32_t* field_nodes = nullptr;
  std::uint32_t root_dims[3] = {};              ///< blocks of 16x16x16 cells along x, y, z
  const std::int16_t* coarse_layers = nullptr;  ///< [rz,ry,rx]
  const std::uint32_t* planes =
      nullptr;                       ///< with Field::scaled: a linear upper bound of V per octant of a root; null: none
  std::uint32_t dims[3] = {};        ///< [vx]
  std::uint32_t brick_dims[3] = {};  ///< bricks along x, y, z
  double origin[3] = {};             ///< lowest corner of voxel (0,0,0), asset frame. [m]
  float voxel_size = 0;              ///< s. [m]
  float lambda = 0;                  ///< step of Field::scaled; twice that in bricks of level 1. [m]
  float band_inner = 0, band_outer = 0;  ///< [m]
  float error = 0;                       ///< error bound of the field, from its certificate. [m]
  float bounds_min[3] = {};              ///< of the mesh, asset frame. [m]
  float bounds_max[3] = {};
  FarGridView far;
  std::uint32_t corners = 0;             ///< convex ones and tips of the mesh
  const float* corner_places = nullptr;  ///< [corners,3], without `scale`, asset frame. [m]
  float scale =
      1;  ///< of all lengths, included in those above; `values` and `gradients` of Field::real are without. [-]
};

/// Read-only view of an asset's pointshell and point-sphere tree. Lives as long as its Asset.
struct PointshellView {
  std::uint32_t points = 0;
  std::uint32_t nodes = 0;
  std::uint32_t levels = 0;                     ///< root = 1
  const std::uint16_t* position[3] = {};        ///< codes, x, y, z rows: see point_position
  const std::uint8_t* inward_normal = nullptr;  ///< codes of 3 bytes: see point_inward_normal
  const std::uint8_t* area = nullptr;           ///< codes: see point_area
  std::uint32_t facets = 0;                     ///< of points whose part of the surface is folded
  const std::uint32_t* facet_points = nullptr;  ///< ascending
  const std::int8_t* facet_corners = nullptr;   ///< codes [facets,4,3]: covering_radius / kFacetSteps less the point
  float position_origin[3] = {};                ///< asset frame. [m]
  float position_step = 0;                      ///< [m]
  float area_step = 0;                          ///< [m^2]
  const std::uint32_t* face_points = nullptr;   ///< see is_on_face; null: no faces are thinned
  const std::uint16_t* sphere[4] = {};          ///< codes, x, y, z, radius rows: see sphere_centre
  const std::uint32_t* children = nullptr;      ///< nodes + 1 entries: see children_of
  const std::uint32_t* parent_point = nullptr;
  const std::uint32_t* level_offsets = nullptr;  ///< levels + 1 entries
  const std::uint32_t* hull_offsets =
      nullptr;  ///< nodes + 1 entries: where each node's corners begin; null: none has any
  const std::uint32_t* hull_points = nullptr;  ///< corners of the hulls of flat nodes: points
  float centre_of_mass[3] = {};                ///< torques are about this point, asset frame. [m]
  float covering_radius = 0;                   ///< [m]
  float feature_covering_radius = 0;           ///< of places on no face; as `covering_radius` if the shell is even. [m]
  float scale = 1;                             ///< of all lengths, included in the numbers above. [-]
};

/// Position of a point, asset frame. The bounding spheres enclose exactly these floats. [m]
[[nodiscard]] inline Vec3 point_position(const PointshellView& shell, std::uint32_t i) noexcept {
  const auto coordinate = [&](int axis) {
    return decode_coordinate(shell.position[axis][i], shell.position_origin[axis], shell.position_step);
  };
  return {coordinate(0), coordinate(1), coordinate(2)};
}

/// Numbers of child nodes, or of points.
struct IndexRange {
  std::uint32_t begin = 0, end = 0;
};
/// Child nodes of a node; on the leaf level points.
[[nodiscard]] inline IndexRange children_of(const PointshellView& shell, std::uint32_t node) noexcept {
  const std::uint32_t* const first = shell.children + node;
  const std::uint32_t before = first[0] < shell.nodes ? 0 : shell.nodes;
  return {first[0] - before, first[1] - before};
}

/// Centre of a node's bounding sphere, asset frame. [m]
[[nodiscard]] inline Vec3 sphere_centre(const PointshellView& shell, std::uint32_t node) noexcept {
  const auto coordinate = [&](int axis) {
    return decode_coordinate(shell.sphere[axis][node], shell.position_origin[axis], shell.position_step);
  };
  return {coordinate(0), coordinate(1), coordinate(2)};
}
/// [m]
[[nodiscard]] inline float sphere_radius(const PointshellView& shell, std::uint32_t node) noexcept {
  return shell.position_step * static_cast<float>(shell.sphere[3][node]);
}

/// Unit normal of a point, into the body, asset frame. [-]
[[nodiscard]] inline Vec3 point_inward_normal(const PointshellView& shell, std::uint32_t i) noexcept {
  const auto [x, y, z] = decode_normal<float>(unpack(shell.inward_normal + 3 * std::size_t{i}));
  return {x, y, z};
}

/// Whether a point lies inside a face of a shell with thinned faces. Contacts there are those of the other body's edges
/// and curved places, which its own points find. [-]
[[nodiscard]] inline bool is_on_face(const PointshellView& shell, std::uint32_t i) noexcept {
  return shell.face_points != nullptr && (shell.face_points[i / 32] >> i % 32 & 1U) != 0;
}

/// Surface area that a point represents. [m^2]
[[nodiscard]] inline float point_area(const PointshellView& shell, std::uint32_t i) noexcept {
  return decode_area(shell.area[i], shell.area_step);
}

/// Surface area below each node: sums of the points' areas. [m^2]
/// @param areas  one for each node of the shell; another size is a bad_argument
[[nodiscard]] Status node_areas(const PointshellView& shell, std::span<float> areas) noexcept;

/// A flat part of the surface: the points below a node of the tree, in a plane and with one normal. Asset frame. The
/// four places centre +- along and centre +- across, with a quarter of the area each, have the points' total area,
/// centre and second moments: the sums of V n A and P x V n A over them are those over the points where V is linear.
struct FlatPatch {
  std::uint32_t node = 0;
  Vec3 centre;         ///< [m]
  Vec3 along, across;  ///< principal axes of the area, sqrt(2) times its deviations long. [m]
  Vec3 inward_normal;  ///< unit; the points' differ from it by at most kPatchNormal. [-]
  float area = 0;      ///< length of the sum of the points' areas times their normals. [m^2]
};
inline constexpr float kPatchNormal = 1e-3F;

/// All patches of a shell, for QueryOptions::flat_patches: one for each node that has a hull, one normal and no facets.
/// Scans and other curved bodies have none. Allocates.
/// @param patches  ascending by node
[[nodiscard]] Status find_flat_patches(const PointshellView& shell, std::vector<FlatPatch>& patches);

/// Segmentation level (Sec. 2.4): the level of the tree whose number of clusters is nearest to `segments`, by ratio.
/// The paper uses about 15 segments.
/// @return 0, the regular traverse, when `segments` is 0 or the shell empty
[[nodiscard]] std::uint32_t segment_level_for(const PointshellView& shell, std::uint32_t segments) noexcept;

/// A baked asset, mapped from a file or in the caller's memory. Move-only; views stay valid while it lives. Any number
/// of threads may read it.
class Asset {
 public:
  Asset() = default;
  Asset(Asset&& other) noexcept;
  Asset& operator=(Asset&& other) noexcept;
  Asset(const Asset&) = delete;
  Asset& operator=(const Asset&) = delete;
  ~Asset();

  /// Maps a file read-only and validates its directory and every index before it returns. Payload hashes are checked
  /// only by `verify`. On failure `out` is left empty.
  /// @param use  the parts that will be used. Sections that only other parts need are never read and take no memory;
  /// requests for these parts return `missing_part`
  [[nodiscard]] static Status open(const char* path, Asset& out, Use use = Use::everything) noexcept;

  /// Opens an asset in memory: the bytes of a whole file. Checks what `open` checks for a file, and copies nothing.
  /// @param bytes  must outlive the asset and its views, and must not change meanwhile. Their address is a multiple of
  /// kMemoryAlignment; other addresses are a `bad_argument`
  [[nodiscard]] static Status open(std::span<const std::byte> bytes, Asset& out, Use use = Use::everything) noexcept;
  /// Deleted: the asset would outlive its bytes.
  static Status open(std::vector<std::byte>&& bytes, Asset& out, Use use = Use::everything) = delete;
  /// Alignment of the widest numbers in an asset. [Units: bytes]
  static constexpr std::size_t kMemoryAlignment = alignof(double);

  /// Compares all section hashes with the bytes; reads the whole asset for any use.
  [[nodiscard]] Status verify() const noexcept;

  [[nodiscard]] bool is_open() const noexcept { return data_ != nullptr; }
  [[nodiscard]] const AssetInfo& info() const noexcept { return directory_.info; }
  /// The whole file.
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return {data_, bytes_}; }
  [[nodiscard]] const Directory& directory() const noexcept { return directory_; }
  [[nodiscard]] bool has_voxelmap() const noexcept;
  [[nodiscard]] bool has_pointshell() const noexcept;

  /// Fills `out`. `Field::none` picks the finest field that is stored and in use: real, then scaled, then layers.
  /// `missing_part` when there is none.
  /// @param scale  all lengths of the view are multiplied by it. Any number of views may have scales of their own;
  /// every query takes them, and queries of unscaled views cost the same. [Limits: kLeastScale <= value <= kMostScale]
  [[nodiscard]] Status voxelmap(VoxelmapView& out, Field field = Field::none, double scale = 1) const noexcept;
  /// @param scale  as of `voxelmap`: a body's views have the same
  [[nodiscard]] Status pointshell(PointshellView& out, double scale = 1) const noexcept;

 private:
  void release() noexcept;
  bool owns_mapping_ = false;
  const std::byte* data_ = nullptr;
  std::size_t bytes_ = 0;
  Directory directory_{};
  Use use_ = Use::everything;
};

/// Which body of a pair plays the pointshell; the other plays the voxelmap.
enum class ShellRole : std::uint8_t { first, second };

/// The body with fewer points plays the pointshell (Sec. 3.2), or the first body if the numbers are equal. If that body
/// cannot, the other one does.
/// @return missing_part when neither can; `role` is `first` then
[[nodiscard]] Status choose_roles(const Asset& first, const Asset& second, ShellRole& role) noexcept;

// Analytic fields: each can replace a voxelmap and has its own frame. Their penetration is exact outside and inside,
// except for polytopes.
struct BoxField {
  Vec3 half_extents;  ///< centred on the origin. [m]
};
struct SphereField {
  float radius = 0;  ///< centred on the origin. [m]
};
struct HalfSpaceField {
  Vec3 outward_normal{0, 0, 1};  ///< unit
  float offset = 0;              ///< the solid is outward_normal . p <= offset. [m]
};
/// A solid of revolution about the z axis, centred on the origin. No length is negative.
struct RevolvedField {
  enum class Profile : std::uint32_t { capsule, cylinder, cone };  ///< a cone's tip is at z = half_height
  Profile profile = Profile::cylinder;
  float radius = 0;       ///< [m]
  float half_height = 0;  ///< of a capsule: half its axis, without the caps. [m]
  float rounding = 0;     ///< added on every side. [m]
};
/// Intersection of half spaces: a convex polytope. Its penetration is exact inside. Outside, the distance is that to
/// the farthest plane, which is never more than the true distance. Extra planes that touch the body at edges and
/// corners make it more accurate.
struct PolytopeField {
  std::span<const HalfSpaceField> planes;  ///< not copied; a ContactCache must be dropped with them
  /// Radius by which the edges are rounded: only over the faces is V that of the body. It matters to flat nodes alone,
  /// which answer where V is linear. [m]
  float rounding = 0;
};

/// Refers to a field of any kind: a voxelmap or an analytic field. Each kind converts to it. It does not own the field,
/// which must live until the query returns; a temporary in the call does.
class FieldRef {
 public:
  /// The list of all kinds.
  using Pointers = std::variant<const VoxelmapView*, const BoxField*, const SphereField*, const HalfSpaceField*,
                                const RevolvedField*, const PolytopeField*>;

  template <class Field, class = std::enable_if_t<std::is_constructible_v<Pointers, const Field*>>>
  FieldRef(const Field& field) noexcept : field_(&field) {}

  /// The voxelmap, or null where the field is of another kind.
  [[nodiscard]] const VoxelmapView* voxelmap() const noexcept {
    const auto* const map = std::get_if<const VoxelmapView*>(&field_);
    return map == nullptr ? nullptr : *map;
  }
  /// Calls visit(field) with the field itself, by one switch over its kind.
  template <class Visit>
  decltype(auto) visit(const Visit& visit) const noexcept {
    return std::visit([&](const auto* field) -> decltype(auto) { return visit(*field); }, field_);
  }

 private:
  Pointers field_;
};

/// Penetration of a point into a field.
///
/// Voxelmap: Paper, Sec. 2.2. Layers use Eq. (4). Scaled and real interpolate trilinearly between the eight samples
/// round the point; the paper's Eqs. (4) and (5) extrapolate from one sample. Beyond the narrow band the sign is right.
/// V is that of the far grid there, within FarGridView::error; without one, and beyond its range, the distance exceeds
/// the true one by no more than that. Layers may take a point of the band for one beyond it.
/// @param point          P, the field's frame. [m]
/// @param inward_normal  n, unit length, into the pointshell's body, the field's frame. Only Field::layers uses it. [-]
/// @return V(P) [m], >= 0 inside or on the surface; infinite for a polytope of no planes.
[[nodiscard]] float penetration(FieldRef field, Vec3 point, Vec3 inward_normal = {}) noexcept;
/// A map of layers needs the normal.
float penetration(const VoxelmapView& map, Vec3 point) = delete;

/// Upper bound of the true penetration at a point, also far outside the grid. Sphere tests need it. [m]
[[nodiscard]] float penetration_bound(const VoxelmapView& map, Vec3 point) noexcept;

/// Direction out of a field, of unit length.
///
/// Voxelmap: minus the gradient of V, which is stored (Eq. 5) or comes from the samples. Beyond the band it comes from
/// the far grid, and beyond that from the mesh's bounds. For Field::layers, and without a far grid, it is estimated
/// from the layers. It is the zero vector only where the field has no slope, as in the middle of a wall. Analytic
/// fields: exact everywhere; where several directions are nearest, it is one of them. Polytope: the normal of the plane
/// whose distance `penetration` gives, or z without planes.
/// @param point  the field's frame. [m]
[[nodiscard]] Vec3 outward_normal(FieldRef field, Vec3 point) noexcept;

/// One point of the pointshell in contact, map frame. With Weight::per_patch also a facet of the point's part of the
/// surface. The sum of penetration * area * inward_normal over the contacts with V >= 0 is QueryResult::force, and that
/// of the moments at `position` is QueryResult::torque (regular traverse, not with Weight::per_point).
struct Contact {
  Vec3 position;            ///< P, of the shell's point. Of a facet: the centre of pressure of its part in contact. [m]
  Vec3 inward_normal;       ///< into the pointshell's body, unit. [-]
  float penetration = 0;    ///< V(P). [m]
  float area = 0;           ///< of the point. Of a facet: the integral of V over it, divided by `penetration`. [m^2]
  std::uint32_t point = 0;  ///< index of the point, of a FlatPatch one of its first four: stable from step to step
  std::uint32_t node = 0;   ///< segmented traverse: the segment's node. If the point represents a node (see
                            ///< QueryOptions::level and max_tests) or is of a patch: that node. Otherwise: its leaf
};

/// How Eqs. (2) and (3) weigh a point.
enum class Weight : std::uint8_t {
  per_point,  ///< the paper's: sums of V n [m] and P x V n [m^2]; grows with the number of points
  per_area,   ///< sums of V n A [m^3] and P x V n A [m^4]; times a foundation stiffness [N/m^3] gives N and N m
  /// The same units. A point whose part of the surface is folded (a sharp edge, a corner, a strong curve) adds the
  /// integrals of V n and P x V n over its flat facets, as far as they lie in the field. Every other point adds what
  /// per_area adds. The force is as continuous as the field. Shells without facets give what per_area gives.
  /// Median error of the force of contacts up to a voxel deep on a plane: corners and edges 4 % at alpha 0.7 and 1.4,
  /// 6 % at 4. A curved surface without facets has that of per_area (sphere of 40 voxels: 0.1, 0.5, 6 %). Where a field
  /// has an edge or corner within a patch, the error is larger: 7 % at 0.7, 17 % at 1.4 (a box on its copy).
  /// A query takes 4 to 10 times as long, because facets of points outside are tested too. Not the default, because
  /// facets take the place of their points among the contacts.
  per_patch,
};

/// A linear upper bound of a sampled field's V in a box around a shell: docs/internals/bounds.md, "A plane for a
/// region".
struct RegionBound {
  float low[3] = {}, high[3] = {};  ///< the box, in the field's voxels. [vx]
  float slope[3] = {};              ///< [-]
  float height = 0;                 ///< at the box's middle. [vx]
  bool is_tight = false;            ///< false: there is none that would reject enough
};

/// The points of a pair that can be in contact while the pair moves little (a Verlet list). Queries of a resting body
/// test only these points, from the third one on. The contacts are the same as without a cache. Use one cache for each
/// pair of a shell and a field, in one thread at a time, and drop it with their assets. Its arrays grow with the
/// contacts.
struct ContactCache {
  std::vector<std::uint32_t> points, leaves;
  std::vector<std::uint32_t> flats;         ///< nodes whose corners answer for their points, for a manifold
  std::array<std::vector<float>, 3> codes;  ///< of the positions of `points`
  std::vector<float> ways;                  ///< by which `points` can move before they may touch. [the field's unit]
  Pose reference, last;                     ///< poses of the last full traverse, and of the last query
  double reach = 0;                         ///< `points` are all with V >= -reach at `reference`; 0: none are held. [m]
  double touching = 0;                      ///< contact distance for which `ways` hold. [m]
  const void* shell = nullptr;
  std::uint32_t shell_points = 0;
  float shell_scale = 1;
  std::uint64_t field = 0;
  bool has_flats = false;
  RegionBound region;              ///< for points far from the surface
  std::uint64_t region_field = 0;  ///< the field that `region` is of
};

struct QueryOptions {
  float contact_distance = 0;  ///< points with V >= -contact_distance become contacts. A voxelmap knows distances up to
                               ///< FarGridView::range, or without a far grid to the end of its band; points farther
                               ///< outside are no contacts. [Limits: value >= 0] [Units: m]
  Weight weight = Weight::per_area;
  std::uint32_t segment_level =
      0;  ///< 0: regular traverse (Algorithm 1). l >= 1: one deepest contact per cluster of level l (Sec. 2.4)
  /// Points inside thinned faces (is_on_face) are no contacts. For pairs of which each body's points are sought in the
  /// other: what these points could touch is an edge or a curved place of the other body.
  bool leaves_faces = false;
  ContactCache* cache = nullptr;  ///< may be null; ignored by the segmented traverse, with a level or a budget, and
                                  ///< for Field::layers and real

  /// Level of detail. 0: all points. l >= 1: the points that represent the nodes of level l, with the areas below these
  /// nodes; not together with segment_level.
  std::uint32_t level = 0;
  /// Areas from the function of this name, or empty. A level requires them. When a budget runs out, the points that
  /// represent unvisited nodes become contacts with these areas; without areas they only count for QueryResult::delta.
  std::span<const float> node_areas = {};

  /// Patches from find_flat_patches of this view, or empty. A face in contact then costs its rim, not its area: a patch
  /// of which all corners are in contact where V is linear, and either all or none are inside, gives four contacts in
  /// place of its points. Force and torque differ from those of all points by what docs/internals/bounds.md, "Flat
  /// nodes", says. Ignored with Weight::per_point, segments, a level, a budget and `leaves_faces`.
  std::span<const FlatPatch> flat_patches = {};

  // Budgets. The traverse goes breadth first, or segment by segment, and leaves out the rest when a budget runs out.
  std::uint32_t max_tests = 0;  ///< tests of spheres and points; 0: no limit
  float max_microseconds =
      0;  ///< may be exceeded by a block of 128 tests or one wide node; 0: no limit. [Limits: value >= 0]
};

struct QueryResult {
  double delta = 0;        ///< max V over the points tested [m]; negative: minus the separation. When every sphere was
                           ///< rejected before a point was tested: an upper bound of V, "at least this far apart"
  double delta_bound = 0;  ///< upper bound of V over all points of the shell, outside beyond the band of the true V;
                           ///< at least `delta`. [m]
  double force[3] = {};    ///< Eq. (2), on the pointshell's body, map frame. Units: see Weight
  double torque[3] = {};   ///< Eq. (3), about the pointshell's centre of mass, map frame
  std::uint32_t contacts = 0;  ///< contacts found; more than were written when the status is output_full
  std::uint32_t nodes_tested = 0;
  std::uint32_t points_tested = 0;
  bool complete = true;  ///< false: a budget ran out; `delta_bound` holds for unvisited points, too
};

/// Working memory of one thread. Grows on first use with a shell, never afterwards. A query whose working memory cannot
/// grow returns `no_memory`; `reserve` throws std::bad_alloc. Nothing is written when it grows: pages that no query
/// needs cost no time.
struct Scratch {
  /// Rows in `memory`: of nodes, then of points.
  std::uint32_t *queue = nullptr, *flats = nullptr, *hits = nullptr, *leaves = nullptr;
  float *bounds = nullptr, *penetrations = nullptr, *positions[3] = {};
  std::unique_ptr<std::byte[]> memory;
  std::size_t nodes = 0, points = 0;  ///< for which there is room
  void reserve(const PointshellView& shell);
};

/// Algorithm 1 of the paper (Sec. 2.3), or its segmented form (Sec. 2.4).
/// Force and torque sum every point with V >= 0, for any size of `out` and any segmentation.
/// Uses the machine's widest vectors. The same query on the same machine gives the same bits; penetrations of different
/// instruction sets agree within 1e-4 voxel.
/// @param shell_to_field  takes the shell's asset frame to the field's frame: relative_pose(field's body, shell's body)
/// @param out             contacts are written here: those of patches, then those of points, each in tree order
[[nodiscard]] Status traverse(const PointshellView& shell, FieldRef field, const Pose& shell_to_field,
                              const QueryOptions& options, Scratch& scratch, std::span<Contact> out,
                              QueryResult& result) noexcept;

}  // namespace vps
