// SPDX-License-Identifier: Zlib
// Hierarchical and segmented traverse of the point-sphere tree. Paper: Algorithm 1 (Sec. 2.3) and Sec. 2.4.
// Checks a query and calls the parts in contacts/traverse/.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <type_traits>

#include "runtime/contacts/find_hits.h"
#include "runtime/contacts/traverse/traverse_query.h"
#include "runtime/grow.h"

namespace vps {
namespace {

using detail::Affine;
using detail::FieldFacts;
using detail::Frame;
using detail::TraverseQuery;
using detail::operator+;
using detail::operator*;

template <class Kernel>
FieldFacts facts_of(const VoxelmapView& map) noexcept {
  FieldFacts facts(map);
  facts.most = detail::greatest_penetration(map);
  facts.excess = map.error;
  if (map.far.values != nullptr) {
    facts.certain = detail::end_of_band(map.band_outer, map.voxel_size);
    facts.known_inside = detail::end_of_band(map.band_inner, map.voxel_size);
    facts.far_error = map.far.error;
  }
  facts.takes_lists = !std::is_same_v<Kernel, detail::PlainMap>;
  if constexpr (std::is_base_of_v<detail::SampledMap, Kernel>) {
    // The diagonal of the largest cell: docs/internals/bounds.md.
    const float largest_cell = std::ldexp(map.voxel_size, kCoarsestLevel);
    facts.excess = 2 * std::sqrt(detail::kHalfDiagonalSquared) * largest_cell + detail::field_error(map);
    facts.known = map.band_inner;
  }
  return facts;
}
template <class Kernel, class Analytic>
FieldFacts facts_of(const Analytic& field) noexcept {
  return FieldFacts(field);
}

// Algorithm 1, down to QueryOptions::level or to the points.
void traverse_once(TraverseQuery& query) noexcept {
  const PointshellView& shell = query.shell;
  detail::Descent& d = query.descent;
  if (!query.field.touches(d, 0)) return;
  const std::uint32_t level = std::min(query.options.level, shell.levels);
  const std::uint32_t last_node = level > 0 ? shell.level_offsets[level - 1] : shell.nodes;
  query.result.complete = detail::descend_in_blocks(query, 0, 0, last_node);
  detail::ask_flat_nodes(query, d.flat_count);
  detail::take_hits(query, detail::HitsAre::points);
  const std::uint32_t expanded = d.begin;
  detail::represent(query, d.begin, d.end);
  detail::sharpen_distance(query, 0, expanded);
}

void traverse_with_cache(TraverseQuery& query) noexcept {
  const std::uint32_t expanded = detail::find_hits_with(*query.options.cache, query);
  detail::take_hits(query, detail::HitsAre::points);
  detail::sharpen_distance(query, 0, expanded);
}

bool uses_cache(const TraverseQuery& query) noexcept {
  return query.options.cache != nullptr && query.descent.moving == nullptr && query.descent.bounds == nullptr &&
         query.facts.takes_lists;
}

bool takes_patches(const TraverseQuery& query) noexcept {
  const QueryOptions& options = query.options;
  return !options.flat_patches.empty() && options.weight != Weight::per_point && options.segment_level == 0 &&
         options.level == 0 && !options.leaves_faces;
}

// Whether only the deepest contacts of segments are wanted, with a field that is likely linear. Over samples as dense
// as the points most nodes are not: on threads the tests of corners would cost a third more than they save.
bool takes_deepest(const TraverseQuery& query) noexcept {
  constexpr float kCoarse = 4;  // covering radii
  const VoxelmapView* const map = query.facts.values.voxelmap();
  return query.options.segment_level > 0 && !query.has_facets && !query.options.leaves_faces &&
         (map == nullptr || map->voxel_size >= kCoarse * query.shell.covering_radius);
}

// Upper bound of the true V of all points, less the field's error.
float delta_bound(const TraverseQuery& query) noexcept {
  const detail::Descent& d = query.descent;
  const float tested = d.deepest > detail::kNothingTested ? query.facts.highest(d.unit * d.deepest) : d.deepest;
  return std::max(tested, d.unit * d.rejected);
}

Status sum_contacts(TraverseQuery& query) noexcept {
  const detail::Descent& d = query.descent;
  if (query.options.segment_level > 0) {
    detail::traverse_segments(query);
  } else if (uses_cache(query)) {
    traverse_with_cache(query);
  } else {
    traverse_once(query);
  }
  QueryResult& result = query.result;
  result.delta = d.unit * (d.deepest > detail::kNothingTested ? d.deepest : d.rejected);
  result.delta_bound = delta_bound(query);
  result.nodes_tested = d.nodes_tested;
  result.points_tested = d.points_tested;
  return result.contacts > query.out.size() ? Status::output_full : Status::ok;
}

Status check_query(const PointshellView& shell, const Pose& pose, const QueryOptions& options,
                   QueryResult& result) noexcept {
  result = {};
  if (shell.points == 0) return Status::missing_part;
  if (!(options.contact_distance >= 0) || !(options.max_microseconds >= 0)) return Status::bad_argument;
  if (!options.node_areas.empty() && options.node_areas.size() != shell.nodes) return Status::bad_argument;
  if (options.level > 0 && (options.node_areas.empty() || options.segment_level > 0)) return Status::bad_argument;
  return check_pose(pose);
}

// Sec. 3.2: whether the root sphere is out of reach of the map's bounds. If so, fills the result. This test is cheap.
bool answer_apart(const PointshellView& shell, const VoxelmapView& map, const Pose& pose, float contact_distance,
                  QueryResult& result) noexcept {
  const Vec3 root = sphere_centre(shell, 0);
  const double centre[3] = {root.x, root.y, root.z};
  const double radius = sphere_radius(shell, 0);
  double squared = 0;
  double size = radius;
  for (int axis = 0; axis < 3; ++axis) {
    double at = pose.translation[axis];
    for (int k = 0; k < 3; ++k) at += pose.rotation[3 * axis + k] * centre[k];
    size += std::abs(at);
    const double gap = std::max({map.bounds_min[axis] - at, at - map.bounds_max[axis], 0.0});
    squared += gap * gap;
  }
  const double apart = std::sqrt(squared) - double{detail::kStretch} * radius - map.error - 1e-6 * size;
  if (!(apart > contact_distance)) return false;
  result.delta = result.delta_bound = -apart;
  result.nodes_tested = 1;
  return true;
}

// Uses the bound of the region that the shell is in, if that rejects enough.
void use_region(const VoxelmapView& map, TraverseQuery& query, ContactCache& cache, detail::CodeBound& bound) noexcept {
  detail::Descent& d = query.descent;
  if (map.planes == nullptr || d.bounds != nullptr) return;
  const float radius = d.radius_scale * static_cast<float>(query.shell.sphere[3][0]) + 1;
  float centre[3];
  for (int axis = 0; axis < 3; ++axis) {
    centre[axis] = d.points.translation[axis];
    for (int k = 0; k < 3; ++k) {
      centre[axis] += d.points.rotation[3 * axis + k] * static_cast<float>(query.shell.sphere[k][0]);
    }
  }
  const float room = detail::keep_region(map, query.facts.id, centre, radius, d.contact_distance, cache);
  if (!cache.region.is_tight) return;
  bound = detail::bound_of_codes(cache.region, d.points, d.rounding);
  d.region = &bound;
  d.rejected = -room;
}

// Calls run(query) with a query of a field in kernel form, unless the bodies are apart.
// @param takes_faces  only two faces of a box may count. A resting pair asks for a few points: to choose costs more
//                     there than it saves
template <class Run>
Status query_field(const PointshellView& shell, FieldRef field, const Pose& shell_to_field, const QueryOptions& options,
                   Scratch& scratch, std::span<Contact> out, QueryResult& result, const Run& run,
                   bool takes_faces = false) noexcept {
  if (const Status status = check_query(shell, shell_to_field, options, result); status != Status::ok) return status;
  return field.visit([&]<class Kind>(const Kind& kind) {
    QueryOptions within = options;
    if constexpr (std::is_same_v<Kind, VoxelmapView>) {
      if (kind.field == Field::none) return Status::missing_part;
      // Points farther outside have no known distance.
      within.contact_distance = std::min(options.contact_distance, detail::known_distance(kind));
      if (answer_apart(shell, kind, shell_to_field, within.contact_distance, result)) return Status::ok;
    }
    const auto run_kernel = [&]<class Kernel>(const Kernel& kernel_field, const Frame& frame, float error,
                                              const Pose& kernel_pose) {
      FieldFacts facts = facts_of<Kernel>(kind);
      facts.frame = frame;
      facts.error = error;
      if constexpr (std::is_same_v<Kernel, detail::SolidBelow>) facts.below = kernel_field;
      if (options.cache != nullptr) facts.id = detail::field_id(kind);
      if (const Status status = detail::try_to_grow([&] { scratch.reserve(shell); }); status != Status::ok) {
        return status;
      }
      TraverseQuery query(shell, detail::DescentField(kernel_field), facts, kernel_pose, shell_to_field, within,
                          scratch, out, result);
      detail::CodeBound region;
      if constexpr (std::is_same_v<Kind, VoxelmapView>) {
        if (options.cache != nullptr && kind.field == Field::scaled) use_region(kind, query, *options.cache, region);
      }
      return run(query);
    };
    if (takes_faces) return detail::in_kernel_form(kind, shell, shell_to_field, run_kernel);
    return detail::in_kernel_form(kind, shell_to_field, run_kernel);
  });
}

// The ways of stored places, in units of `unit`.
Affine ways_of(const detail::RelativeMotion& motion, const Affine& to_field, float unit) noexcept {
  const auto turned = [&](float x, float y, float z) { return (1 / unit) * detail::cross(motion.turn, Vec3{x, y, z}); };
  Affine ways;
  const float* const t = to_field.translation;
  const Vec3 shift = turned(t[0], t[1], t[2]) + (1 / unit) * motion.shift;
  const float moved[3] = {shift.x, shift.y, shift.z};
  std::copy_n(moved, 3, ways.translation);
  for (int k = 0; k < 3; ++k) {
    const float* const r = to_field.rotation + k;
    const Vec3 column = turned(r[0], r[3], r[6]);
    ways.rotation[k] = column.x;
    ways.rotation[3 + k] = column.y;
    ways.rotation[6 + k] = column.z;
  }
  return ways;
}

// Where only the height counts, z of the ways becomes what it grows by.
void make_upright(Vec3 up, detail::MovingShell& moving) noexcept {
  const auto along = [&](float x, float y, float z) { return detail::dot(up, Vec3{x, y, z}); };
  float* const r = moving.ways.rotation;
  for (int k = 0; k < 3; ++k) r[6 + k] = along(r[k], r[3 + k], r[6 + k]);
  float* const t = moving.ways.translation;
  t[2] = along(t[0], t[1], t[2]);
  moving.is_upright = true;
}

}  // namespace

void Scratch::reserve(const PointshellView& shell) {
  // The segmented traverse keeps the list of segments in front of one segment's queue.
  const std::size_t most_nodes = 2 * std::size_t{shell.nodes} + detail::kLanePadding;
  // The points that represent nodes can be hits, too, and there can be more nodes than points.
  const std::size_t most_points =
      std::size_t{std::max(shell.points, shell.nodes)} + detail::kExtraRows + detail::kLanePadding;
  // A moved one has sizes, but no memory.
  if (memory != nullptr && most_nodes <= nodes && most_points <= points) return;
  if (memory == nullptr) nodes = points = 0;
  const std::size_t new_nodes = std::max(nodes, most_nodes);
  const std::size_t new_points = std::max(points, most_points);
  static_assert(sizeof(float) == sizeof(std::uint32_t));
  memory = std::make_unique_for_overwrite<std::byte[]>((3 * new_nodes + 6 * new_points) * sizeof(float));
  nodes = new_nodes;
  points = new_points;
  std::byte* next = memory.get();
  const auto take = [&]<class T>(T*& row, std::size_t size) {
    row = reinterpret_cast<T*>(next);
    next += size * sizeof(T);
  };
  take(queue, nodes);
  take(flats, nodes);
  take(bounds, nodes);
  take(hits, points);
  take(leaves, points);
  take(penetrations, points);
  for (float*& row : positions) take(row, points);
}

Status traverse(const PointshellView& shell, FieldRef field, const Pose& shell_to_field, const QueryOptions& options,
                Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  return query_field(shell, field, shell_to_field, options, scratch, out, result, [&](TraverseQuery& query) {
    if (takes_patches(query)) detail::stop_at_flat_nodes(query, scratch, detail::FlatNodesGive::patches);
    return sum_contacts(query);
  });
}

Status detail::traverse_contacts(const PointshellView& shell, FieldRef field, const Pose& shell_to_field,
                                 const QueryOptions& options, Scratch& scratch, std::span<Contact> out,
                                 QueryResult& result) noexcept {
  return query_field(shell, field, shell_to_field, options, scratch, out, result, [&](TraverseQuery& query) {
    query.descent.hits_only = true;
    if (takes_patches(query)) stop_at_flat_nodes(query, scratch, FlatNodesGive::patches);
    if (takes_deepest(query)) stop_at_flat_nodes(query, scratch, FlatNodesGive::deepest);
    return sum_contacts(query);
  });
}

Status detail::traverse_ahead(const PointshellView& shell, FieldRef field, const Pose& shell_to_field,
                              const QueryOptions& options, const RelativeMotion& motion, Scratch& scratch,
                              std::span<Contact> out, QueryResult& result) noexcept {
  const Affine to_points = affine(shell_to_field, Frame(), shell.position_origin, shell.position_step);
  QueryOptions farthest = options;
  if (field.voxelmap() == nullptr) farthest.cache = nullptr;
  if (shell.points > 0) {
    const Vec3 root = Transform(shell_to_field).apply(sphere_centre(shell, 0));
    farthest.contact_distance +=
        length(motion.shift + cross(motion.turn, root)) + length(motion.turn) * sphere_radius(shell, 0);
  }
  const auto run = [&](TraverseQuery& query) {
    const float unit = query.descent.unit;
    MovingShell moving{ways_of(motion, to_points, unit), length(motion.turn), options.contact_distance / unit};
    if (motion.is_directed && query.facts.below) make_upright(query.facts.below->up, moving);
    query.descent.moving = &moving;
    query.descent.hits_only = true;
    if (takes_deepest(query)) stop_at_flat_nodes(query, scratch, FlatNodesGive::deepest);
    return sum_contacts(query);
  };
  return query_field(shell, field, shell_to_field, farthest, scratch, out, result, run, true);
}

namespace {

constexpr float kUnknown = std::numeric_limits<float>::max();

// Lets a descent write its hits as rows.
detail::ContactRows give_rows(const PointshellView& shell, const Pose& shell_to_field, const Scratch& scratch,
                              detail::Descent& d) noexcept {
  d.hits = scratch.hits;
  d.leaves = scratch.leaves;
  d.penetrations = scratch.penetrations;
  d.to_positions = affine(shell_to_field, Frame(), shell.position_origin, shell.position_step);
  std::copy_n(scratch.positions, 3, d.positions);
  d.hits_only = true;
  return {{d.positions[0], d.positions[1], d.positions[2]}, d.penetrations, d.hits};
}

// Makes rows of the hits that count.
void finish_rows(const PointshellView& shell, const QueryOptions& options, const detail::Descent& d,
                 detail::ContactRows& hits) noexcept {
  hits.count = d.hit_count;
  if (options.leaves_faces) {
    hits.count = 0;
    for (std::uint32_t i = 0; i < d.hit_count; ++i) {
      if (is_on_face(shell, d.hits[i])) continue;
      for (float* const row : d.positions) row[hits.count] = row[i];
      d.penetrations[hits.count] = d.penetrations[i];
      d.hits[hits.count++] = d.hits[i];
    }
  }
  for (std::uint32_t i = 0; i < hits.count; ++i) hits.penetration[i] *= d.unit;
}

}  // namespace

Status detail::find_hits(const PointshellView& shell, FieldRef field, const Pose& shell_to_field,
                         const QueryOptions& options, Scratch& scratch, ContactRows& hits, float& most) noexcept {
  hits = {};
  most = kUnknown;
  QueryResult result;
  const auto run = [&](TraverseQuery& query) {
    hits = give_rows(shell, shell_to_field, scratch, query.descent);
    stop_at_flat_nodes(query, scratch, FlatNodesGive::corners);
    if (uses_cache(query)) {
      (void)find_hits_with(*options.cache, query);
    } else {
      (void)find_all_hits(query);
    }
    finish_rows(shell, options, query.descent, hits);
    // The error of plain maps is not known here.
    result.delta_bound = query.facts.takes_lists ? delta_bound(query) + query.facts.error : kUnknown;
    return Status::ok;
  };
  const Status status = query_field(shell, field, shell_to_field, options, scratch, {}, result, run);
  most = static_cast<float>(result.delta_bound);
  return status;
}

Status detail::find_hits_of(std::span<const std::uint32_t> points, const PointshellView& shell, FieldRef field,
                            const Pose& shell_to_field, const QueryOptions& options, Scratch& scratch,
                            ContactRows& hits) noexcept {
  hits = {};
  QueryResult unused;
  if (const Status status = check_query(shell, shell_to_field, options, unused); status != Status::ok) return status;
  if (const Status status = try_to_grow([&] { scratch.reserve(shell); }); status != Status::ok) return status;
  return field.visit([&]<class Kind>(const Kind& kind) {
    float distance = options.contact_distance;
    if constexpr (std::is_same_v<Kind, VoxelmapView>) {
      if (kind.field == Field::none) return Status::missing_part;
      distance = std::min(distance, known_distance(kind));
    }
    const auto test = [&]<class Kernel>(const Kernel& kernel, const Frame& frame, float error, const Pose& pose) {
      if constexpr (std::is_same_v<Kernel, PlainMap>) {
        float most = 0;
        return find_hits(shell, field, shell_to_field, options, scratch, hits, most);
      } else {
        Descent d = descent_at(shell, pose, frame, distance, error);
        hits = give_rows(shell, shell_to_field, scratch, d);
        float codes[3][kLanePadding] = {};
        std::uint32_t numbers[kLanePadding] = {};
        const std::uint32_t leaves[kLanePadding] = {};
        std::copy(points.begin(), points.end(), numbers);
        for (int axis = 0; axis < 3; ++axis) {
          for (std::size_t i = 0; i < points.size(); ++i) codes[axis][i] = shell.position[axis][points[i]];
        }
        Kernel without_planes = kernel;  // they would not reject points that were in contact
        if constexpr (std::is_base_of_v<SampledMap, Kernel>) without_planes.planes = nullptr;
        DescentField(without_planes)
            .test_list(d, {{codes[0], codes[1], codes[2]}, numbers, leaves, static_cast<std::uint32_t>(points.size())});
        finish_rows(shell, options, d, hits);
        return Status::ok;
      }
    };
    return in_kernel_form(kind, shell_to_field, test);
  });
}

}  // namespace vps
