// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Stability cases: the question, the stated limit and the measured value of each.
///
/// A trial is one run of a case for one column (this project's shapes, or other ones) at one setting of its axes.
/// Limits are stated before anything is run, from theory or as a tolerance in voxels or energy. None is fitted to
/// results. No result depends on a clock, so that the same run gives the same numbers.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/lab/bullet.h"
#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::stress {

enum class Verdict : std::uint8_t {
  held,
  solver,   ///< the limit is not held, nor by a box or hull of Bullet's own in the same place; it is within 1.5 times
  broken,   ///< the limit is not held
  shown,    ///< only of a case: it was run, but in no column that counts
  skipped,  ///< not run: the remark says why
};
/// "held", "solver", "broken", "shown", "skipped".
[[nodiscard]] const char* describe(Verdict verdict);

enum class Detection : std::uint8_t { discrete, continuous };

/// Bullet's constraint solvers. docs/stress.md says which to take when.
enum class Solver : std::uint8_t {
  sequential,  ///< impulses, Bullet's default
  nncg,        ///< impulses with nonsmooth, nonlinear conjugate gradients
  dantzig,     ///< a linear complementarity problem by Dantzig's method; impulses where that fails
  lemke,       ///< the same by Lemke's
};

/// The shape for the asset in a Bullet world.
struct Column {
  std::string name;   ///< as --without takes it
  bool ours = false;  ///< this project's shape: it decides the exit code
  Detection detection = Detection::discrete;
  lab::BulletShape body;           ///< origin: centre of mass; without a shape the column's trials are skipped
  std::vector<btVector3> corners;  ///< of the convex hull of the column's shape, same frame. [m]
  std::size_t triangles = 0;       ///< of a triangle mesh; 0 for others
  std::string absent;              ///< why there is no shape
  std::string from;                ///< source of another library's shape
  /// Makes another library's shape again, scaled, with a margin. [m]
  std::function<lab::BulletShape(double scale, double margin)> resized;
};

/// Bodies that cases need beside the asset: boxes and a needle. They are baked at the asset's voxel size for this
/// project's columns, and Bullet's own shapes for the others.
class Props {
 public:
  Props(double voxel_size, std::filesystem::path cache) : voxel_size_(voxel_size), cache_(std::move(cache)) {}
  /// Parts of a baked prop: `still` has only a voxelmap, `mixed` a pointshell too.
  enum class Role : std::uint8_t { still, mixed };
  /// A box, centred on its centre of mass.
  [[nodiscard]] lab::BulletShape box(const Column& column, const btVector3& half_extents, Role role);
  /// A cone, tip down. `corners` takes its vertices.
  [[nodiscard]] lab::BulletShape needle(const Column& column, double radius, double height,
                                        std::vector<btVector3>& corners);
  /// Any mesh, baked with this voxel size. [m]
  [[nodiscard]] std::shared_ptr<const Asset> baked(const TriangleMesh& mesh, double voxel_size, Role role) const;

 private:
  double voxel_size_;
  std::filesystem::path cache_;
  std::vector<std::pair<std::string, lab::BulletShape>> boxes_;
};

/// A mesh for the other libraries' shapes, asset frame.
struct PeerMesh {
  TriangleMesh mesh;
  std::string from;  ///< such as "the mesh that was given"
};

/// More triangles are too slow: GImpact tests a box triangle by triangle, 37 ms a step with 70,000, and HACD takes
/// minutes.
inline constexpr std::size_t kMostTriangles = 5000;

/// Why there is no surface for other libraries' shapes and other sizes, where no mesh was given.
[[nodiscard]] const char* why_no_mesh(const Asset& asset);

struct SubjectOptions {
  double mass = 1;                      ///< [Limits: value > 0] [Units: kg]
  std::uint64_t seed = 1;               ///< of disturbances and directions
  Solver solver = Solver::sequential;   ///< of every world
  std::optional<PeerMesh> mesh;         ///< the asset's own, for other libraries' shapes and other sizes
  std::optional<PeerMesh> zero_set;     ///< of few triangles, where there is no mesh or it has too many
  std::filesystem::path cache;          ///< folder for HACD's hulls and baked props; empty: none is kept
  std::vector<std::string> without;     ///< columns to leave out
  std::function<void()> announce_hacd;  ///< called before it takes minutes; may be empty
};

/// State at the end of a body that was dropped on a plane or into a wedge.
struct Rest {
  double off = 0;             ///< largest gap or overlap of the lowest point and the ground in the last quarter. [m]
  double kinetic = 0;         ///< largest kinetic energy in the last quarter. [J]
  std::vector<double> trace;  ///< height of the lowest point. [m]
  std::string failure;        ///< names the NaN that ended the run; empty: none
};
/// Drops that were run, by column and rate [Hz]. Two cases judge each.
using Rests = std::map<std::pair<std::string, double>, Rest>;

/// An asset with all that its cases need.
struct Subject {
  std::string name;
  std::shared_ptr<const Asset> asset;
  double mass = 1;  ///< [kg]
  std::uint64_t seed = 1;
  Solver solver = Solver::sequential;
  double size = 0;                   ///< longest side of the bounds. [m]
  double voxel = 0;                  ///< [m]
  std::optional<TriangleMesh> mesh;  ///< about the centre of mass
  std::vector<btVector3> corners;    ///< of the convex hull of the shell's points, body frame. [m]
  std::vector<Column> columns;
  Column hull;  ///< Bullet's hull of the asset, the control of some cases; without a shape where there is none
  std::shared_ptr<Props> props;
  std::shared_ptr<Rests> rests = std::make_shared<Rests>();
};

/// @throw std::runtime_error, BakeError
[[nodiscard]] Subject make_subject(std::string name, std::shared_ptr<const Asset> asset, SubjectOptions options);

/// A parameter over whose values a case is run.
struct Axis {
  std::string name;
  std::string unit;
  std::vector<double> values;
  std::vector<double> quick;          ///< values with --quick; empty: all
  std::vector<std::string> labels{};  ///< printed instead of the values, which are then indices; empty: the values
};

/// One run of a case in a column.
struct Trial {
  std::vector<double> at;  ///< a value of each axis
  double value = std::numeric_limits<double>::quiet_NaN();
  double limit = std::numeric_limits<double>::quiet_NaN();  ///< `value` must be no larger
  double least = -std::numeric_limits<double>::infinity();  ///< and no smaller
  Verdict verdict = Verdict::skipped;
  std::string remark;         ///< why it was skipped or is broken, or a detail of the result
  std::vector<double> trace;  ///< for the plot, at even intervals of time; may be empty
};

enum class Requirement : std::uint8_t { pointshell, both, mesh };

/// A stability case. Every member has a default, so that designated initialisers may leave members out.
struct Case {
  std::string name{};
  std::string family{};
  std::string question{};    ///< plain; a yes passes
  std::string setup{};       ///< describes what is done
  std::string measured{};    ///< describes the measured number
  std::string quantity{};    ///< the same in a word or three
  std::string below_zero{};  ///< quantity of a negative number's size; empty: printed with its sign
  std::string unit{};
  std::string limit{};       ///< as text
  std::string limit_from{};  ///< theory or tolerance, and why
  std::vector<Axis> axes{};
  Requirement needs = Requirement::pointshell;
  std::string trace{};  ///< the quantity in the trials' traces; empty: none
  std::string alone{};  ///< name of the only column of a case without Bullet; empty: run in Bullet
  /// This project's shapes need ContinuousMotion for the limit, as the README says. Without it a broken limit is only
  /// shown.
  bool needs_continuous = false;
  std::function<Trial(const Subject&, const Column&, std::span<const double>)> run{};
};

/// All of a case's trials in a column.
struct Outcome {
  std::string column;
  bool ours = false;
  bool promised = false;  ///< whether the limit is stated for this column
  Verdict verdict = Verdict::skipped;
  std::size_t worst = 0;  ///< of the trials with this verdict the nearest to its limit or farthest beyond it
  std::vector<Trial> trials;
};

struct CaseResult {
  const Case* asked = nullptr;
  std::vector<Axis> axes;  ///< with the values that were run
  std::vector<Outcome> outcomes;
};

/// All cases, in order.
[[nodiscard]] const std::vector<Case>& all_cases();

enum class Effort : std::uint8_t { full, quick };

/// Runs a case in every column.
[[nodiscard]] CaseResult run_case(const Case& asked, const Subject& subject, Effort effort);

enum class Strictness : std::uint8_t {
  promised,  ///< only columns count for which the limit is stated, and only `broken` breaks a case
  strict,    ///< also columns without the ContinuousMotion that they need count, and `solver` breaks a case
};
/// Whether a column counts in the case's verdict.
[[nodiscard]] bool counts(const Outcome& outcome, Strictness strictness);
/// Whether a column that counts breaks the case.
[[nodiscard]] bool is_broken(const CaseResult& result, Strictness strictness);
/// `broken` where `is_broken`; otherwise the worst verdict of the columns that count. Without such a column `shown`, or
/// `skipped` when no column was run.
[[nodiscard]] Verdict verdict_of(const CaseResult& result, Strictness strictness);

/// Sets value, limit and verdict. A NaN is broken.
void judge(Trial& trial, double value, double limit);
/// Judges beside the value that Bullet's own boxes or hull have in place of the body. The verdict is `solver` where
/// that breaks the limit too, unless `value` is more than 1.5 times as large.
void judge_beside(Trial& trial, double value, double limit, double of_bullets);
/// Whether a value beyond its limit is at most 1.5 times that of Bullet's own shape, which breaks the limit too.
[[nodiscard]] bool is_as_bullets(double value, double limit, double of_bullets);
/// Judges bodies that stay up for `seconds` of the wanted time `asked`. Bullet's own boxes stay up for `of_boxes`. The
/// verdict is `solver` where the boxes fall too, after at most 1.5 times as long.
void judge_standing(Trial& trial, double seconds, double asked, double of_boxes);
/// A trial that was not run.
[[nodiscard]] Trial skipped(std::string why);

// The families of cases, one file each.
void add_penalty_cases(std::vector<Case>& cases);
void add_rest_cases(std::vector<Case>& cases);
void add_pile_cases(std::vector<Case>& cases);
void add_impact_cases(std::vector<Case>& cases);
void add_energy_cases(std::vector<Case>& cases);
void add_scale_cases(std::vector<Case>& cases);

}  // namespace vps::stress
