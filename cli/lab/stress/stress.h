// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Stability cases: what each asks, which limit is stated for it, and what was measured.
///
/// A case is run for each column (this project's shapes, and the peers) at each setting of its axes: a trial. Limits
/// are stated before anything is run, from theory or as a tolerance in voxels or energy; none is fitted to what comes
/// out. Nothing here reads a clock, so that the same run gives the same numbers.
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
  solver,   ///< the limit is not held, and boxes of Bullet's own in the same place do not hold it either
  broken,   ///< the limit is not held
  shown,    ///< of a case: run, but no column that counts was
  skipped,  ///< not run: the remark says why
};
/// "held", "solver", "broken", "shown", "skipped".
[[nodiscard]] const char* describe(Verdict verdict);

enum class Detection : std::uint8_t { discrete, continuous };

/// Who plays the asset in a world of Bullet's.
struct Column {
  std::string name;   ///< as --without takes it
  bool ours = false;  ///< decides the exit code
  Detection detection = Detection::discrete;
  lab::BulletShape body;           ///< origin: centre of mass; without a shape the column skips everything
  std::vector<btVector3> corners;  ///< of the convex hull of what this column plays, same frame. [m]
  std::size_t triangles = 0;       ///< of a triangle mesh; 0 for others
  std::string absent;              ///< why there is no shape
  std::string from;                ///< of a peer: what it is made of
  /// Of a peer: the same, so many times as large, with a margin. [m]
  std::function<lab::BulletShape(double scale, double margin)> resized;
};

/// Bodies that cases need beside the asset: boxes and a needle, baked at the asset's voxel size for our columns, and as
/// Bullet's own shapes for the others.
class Props {
 public:
  Props(double voxel_size, std::filesystem::path cache) : voxel_size_(voxel_size), cache_(std::move(cache)) {}
  /// Centred on its centre of mass. A baked one plays the voxelmap alone where it is `still`.
  enum class Role : std::uint8_t { still, mixed };
  [[nodiscard]] lab::BulletShape box(const Column& column, const btVector3& half_extents, Role role);
  /// A cone, point down, and the vertices that it has in this column.
  [[nodiscard]] lab::BulletShape needle(const Column& column, double radius, double height,
                                        std::vector<btVector3>& corners);
  /// Any mesh, baked with this voxel size. [m]
  [[nodiscard]] std::shared_ptr<const Asset> baked(const TriangleMesh& mesh, double voxel_size, Role role) const;

 private:
  double voxel_size_;
  std::filesystem::path cache_;
  std::vector<std::pair<std::string, lab::BulletShape>> boxes_;
};

/// A mesh for the peers, asset frame.
struct PeerMesh {
  TriangleMesh mesh;
  std::string from;  ///< such as "the mesh that was given"
};

/// GImpact asks a box triangle by triangle: 37 ms a step with 70,000. HACD takes minutes with more.
inline constexpr std::size_t kMostTriangles = 5000;

inline constexpr const char* kNoMesh =
    "an asset holds no mesh, and this one no voxelmap to make one of; give it with --mesh";

struct SubjectOptions {
  double mass = 1;                      ///< [Limits: value > 0] [Units: kg]
  std::uint64_t seed = 1;               ///< of disturbances and directions
  std::optional<PeerMesh> mesh;         ///< the asset's own, for the peers and other sizes
  std::optional<PeerMesh> zero_set;     ///< of few triangles, where there is no mesh or it has too many
  std::filesystem::path cache;          ///< folder for HACD's hulls and baked props; empty: none is kept
  std::vector<std::string> without;     ///< columns to leave out
  std::function<void()> announce_hacd;  ///< called before it takes minutes; may be empty
};

/// How a body that was dropped on a plane, or into a wedge, is at the end.
struct Rest {
  double off = 0;             ///< lowest point from the ground, either way, in the last quarter. [m]
  double kinetic = 0;         ///< largest in the last quarter. [J]
  std::vector<double> trace;  ///< lowest point. [m]
  std::string failure;        ///< the NaN that ended it; empty: none
};
/// Drops that were played, by column and rate [Hz]: two cases judge each.
using Rests = std::map<std::pair<std::string, double>, Rest>;

/// An asset, and all that its cases need.
struct Subject {
  std::string name;
  std::shared_ptr<const Asset> asset;
  double mass = 1;  ///< [kg]
  std::uint64_t seed = 1;
  double size = 0;                   ///< longest side of the bounds. [m]
  double voxel = 0;                  ///< [m]
  std::optional<TriangleMesh> mesh;  ///< about the centre of mass
  std::vector<btVector3> corners;    ///< of the convex hull of the shell's points, or of the mesh; body frame. [m]
  std::vector<Column> columns;
  std::shared_ptr<Props> props;
  std::shared_ptr<Rests> rests = std::make_shared<Rests>();
};

/// @throw std::runtime_error, BakeError
[[nodiscard]] Subject make_subject(std::string name, std::shared_ptr<const Asset> asset, SubjectOptions options);

/// A setting that a case is run over.
struct Axis {
  std::string name;
  std::string unit;
  std::vector<double> values;
  std::vector<double> quick;          ///< of --quick; empty: all
  std::vector<std::string> labels{};  ///< in the place of values; empty: the values
};

/// One run of a case in a column.
struct Trial {
  std::vector<double> at;  ///< a value of each axis
  double value = std::numeric_limits<double>::quiet_NaN();
  double limit = std::numeric_limits<double>::quiet_NaN();  ///< value may be no more
  double least = -std::numeric_limits<double>::infinity();  ///< and no less
  Verdict verdict = Verdict::skipped;
  std::string remark;         ///< why it was skipped or broke, or what is worth knowing
  std::vector<double> trace;  ///< for the plot, evenly in time; may be empty
};

enum class Requirement : std::uint8_t { pointshell, both, mesh };

/// All members have values of their own, so that no case depends on the one before it.
struct Case {
  std::string name{};
  std::string family{};
  std::string question{};
  std::string measured{};    ///< what the number is
  std::string quantity{};    ///< the same in a word or three
  std::string below_zero{};  ///< what a negative number's size is; empty: no more than its sign
  std::string unit{};
  std::string limit{};       ///< as text
  std::string limit_from{};  ///< theory or tolerance, and why
  std::vector<Axis> axes{};
  Requirement needs = Requirement::pointshell;
  std::string trace{};  ///< what the trials' traces are; empty: none
  std::string alone{};  ///< what the only column is called of cases that do without Bullet; empty: in Bullet
  /// Where our shapes need ContinuousMotion for the limit, as the README says: what breaks it without is shown only.
  bool needs_continuous = false;
  std::function<Trial(const Subject&, const Column&, std::span<const double>)> run{};
};

/// All of a case's trials in a column.
struct Outcome {
  std::string column;
  bool ours = false;
  bool promised = false;  ///< the limit is stated for this column
  Verdict verdict = Verdict::skipped;
  std::size_t worst = 0;  ///< the trial that is nearest to its limit or farthest beyond it
  std::vector<Trial> trials;
};

struct CaseResult {
  const Case* asked = nullptr;
  std::vector<Axis> axes;  ///< as they were run
  std::vector<Outcome> outcomes;
};

/// All cases, in order.
[[nodiscard]] const std::vector<Case>& all_cases();

enum class Effort : std::uint8_t { full, quick };

/// Runs a case in every column.
[[nodiscard]] CaseResult run_case(const Case& asked, const Subject& subject, Effort effort);

enum class Strictness : std::uint8_t {
  promised,  ///< a limit counts that is stated for the column and broken by it
  strict,    ///< also where ContinuousMotion is needed and off, and where the solver is to blame
};
/// Whether a column counts in the case's verdict.
[[nodiscard]] bool counts(const Outcome& outcome, Strictness strictness);
/// Whether a column of ours breaks the case.
[[nodiscard]] bool is_broken(const CaseResult& result, Strictness strictness);
/// Broken where `is_broken`; otherwise the gravest of the columns that count.
[[nodiscard]] Verdict verdict_of(const CaseResult& result, Strictness strictness);

/// Sets value, limit and verdict: broken also when `value` is not a number.
void judge(Trial& trial, double value, double limit);
/// The same beside the value that boxes of Bullet's own have in the place of the body. The solver is to blame where
/// that breaks the limit too, unless `value` is ten times as far.
void judge_beside(Trial& trial, double value, double limit, double of_boxes);
/// Of what stands for `seconds` of those `asked`, where boxes of Bullet's own stand for `of_boxes`. The solver is to
/// blame where they do not stand either, and no ten times as long.
void judge_standing(Trial& trial, double seconds, double asked, double of_boxes);
/// A trial that was not run.
[[nodiscard]] Trial skipped(std::string why);

// The families, each in a file of its own.
void add_penalty_cases(std::vector<Case>& cases);
void add_rest_cases(std::vector<Case>& cases);
void add_pile_cases(std::vector<Case>& cases);
void add_impact_cases(std::vector<Case>& cases);
void add_energy_cases(std::vector<Case>& cases);
void add_scale_cases(std::vector<Case>& cases);

}  // namespace vps::stress
