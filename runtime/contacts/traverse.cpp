// SPDX-License-Identifier: Zlib
// Hierarchical and segmented traverse of the point-sphere tree. Paper: Algorithm 1 (Sec. 2.3) and Sec. 2.4.
#include <algorithm>
#include <limits>
#include <type_traits>

#include "runtime/queries/budget.h"
#include "runtime/queries/descend.h"

namespace vps {
namespace {

using detail::Budget;
using detail::Descent;
using detail::DescentField;
using detail::Frame;
using detail::Transform;

constexpr float kNothing = -std::numeric_limits<float>::max();

// What is known of a field besides its values.
struct Facts {
  Frame frame;
  std::uint64_t id = 0;     // tells fields apart that a cache may meet
  float error = 0;          // [m]
  bool takes_lists = true;  // kernels can test listed points without their numbers
  // V of a sphere's centre, where the sphere touches, is no more than `excess` above the bound that its test gave, as
  // long as that is less than `known`; and `most` anywhere. [m]
  float excess = 0;
  float known = std::numeric_limits<float>::max();
  float most = std::numeric_limits<float>::max();
};

// Algorithm 1 and its segmented form over one field.
class Traverse {
 public:
  // @param field_pose  takes the shell to the field: `pose`, but for fields with an orientation of their own
  Traverse(const PointshellView& shell, const DescentField& field, const Facts& facts, const Pose& field_pose,
           const Pose& pose, const QueryOptions& options, Scratch& scratch, std::span<Contact> out,
           QueryResult& result) noexcept
      : shell_(shell),
        field_(field),
        facts_(facts),
        pose_(pose),
        transform_(pose),
        options_(options),
        budget_(options),
        out_(out),
        result_(result),
        centre_of_mass_(transform_.apply({shell.centre_of_mass[0], shell.centre_of_mass[1], shell.centre_of_mass[2]})) {
    const auto unit = static_cast<float>(facts.frame.unit);
    d_.shell = &shell;
    d_.unit = unit;
    d_.nodes = affine(field_pose, facts.frame, {0, 0, 0}, 1);
    d_.points = affine(field_pose, facts.frame, shell.position_origin, shell.position_step);
    d_.contact_distance = options.contact_distance / unit;
    d_.slack = facts.error / unit + detail::rounding(shell, d_.nodes, unit);
    d_.queue = scratch.queue.data();
    d_.hits = scratch.hits.data();
    d_.penetrations = scratch.penetrations.data();
    d_.leaves = scratch.leaves.data();
    if (budget_.limited() || options.level > 0) d_.bounds = scratch.bounds.data();
    d_.deepest = d_.rejected = kNothing;
  }

  Status run() noexcept {
    if (options_.segment_level > 0) {
      gather_segments();
    } else if (options_.cache == nullptr || d_.bounds != nullptr || !facts_.takes_lists) {
      gather();
    } else {
      const std::uint32_t gone_into = hit_remembered(*options_.cache);
      consume();
      sharpen(0, gone_into);
    }
    result_.delta = d_.unit * (d_.deepest > kNothing ? d_.deepest : d_.rejected);
    result_.delta_bound = d_.unit * std::max(d_.deepest, d_.rejected);
    result_.nodes_tested = d_.nodes_tested;
    result_.points_tested = d_.points_tested;
    return result_.contacts > out_.size() ? Status::output_full : Status::ok;
  }

 private:
  void gather() noexcept {
    if (!field_.touches(d_, 0)) return;
    const std::uint32_t level = std::min(options_.level, shell_.levels);
    result_.complete = start(0, 0, level > 0 ? shell_.level_offsets[level - 1] : shell_.nodes);
    consume();
    const std::uint32_t gone_into = inner_nodes(0, d_.begin);
    represent(d_.begin, d_.end);
    sharpen(0, gone_into);
  }

  // Returns how many inner nodes lie at the front of the queue.
  std::uint32_t hit_all() noexcept {
    if (!field_.touches(d_, 0)) return 0;
    (void)start(0, 0, shell_.nodes);
    return inner_nodes(0, d_.end);
  }

  // A distance field changes by no more than the way that a point goes: a point with V < -reach at the reference cannot
  // be in contact before the body has gone reach - contact distance, less the field's error at both places.
  std::uint32_t hit_remembered(ContactCache& cache) noexcept {
    const bool same =
        cache.shell == shell_.position[0] && cache.shell_points == shell_.points && cache.field == facts_.id;
    const double spent = same ? detail::motion(shell_, cache.reference, pose_) : 0;
    const double needed = options_.contact_distance + 2.0 * facts_.error;
    const double step = same ? detail::motion(shell_, cache.last, pose_) : 0;
    cache.last = pose_;
    if (same && cache.reach >= needed + spent) {
      field_.test_list(d_, {{cache.codes[0].data(), cache.codes[1].data(), cache.codes[2].data()},
                            cache.points.data(),
                            cache.leaves.data(),
                            static_cast<std::uint32_t>(cache.points.size() - detail::kLanePadding)});
      d_.rejected = static_cast<float>((spent + 2.0 * facts_.error - cache.reach) / d_.unit);
      return 0;
    }
    cache.shell = shell_.position[0];
    cache.shell_points = shell_.points;
    cache.field = facts_.id;
    cache.reference = pose_;
    // Room for some steps like the last one; a fast body would only drag a long list along.
    constexpr double kSteps = 8;
    const double least = 0.05 * shell_.covering_radius;
    const double most = 0.5 * shell_.covering_radius;
    if (kSteps * step > most) {
      cache.reach = 0;
      return hit_all();
    }
    const double reach = needed + std::max(least, kSteps * step);
    const float wanted = d_.contact_distance;
    d_.contact_distance = static_cast<float>(reach / d_.unit);
    const std::uint32_t inner = hit_all();
    d_.contact_distance = wanted;
    remember(cache);
    cache.reach = reach;
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < d_.hit_count; ++i) {
      if (d_.penetrations[i] < -wanted) continue;
      d_.hits[kept] = d_.hits[i];
      d_.leaves[kept] = d_.leaves[i];
      d_.penetrations[kept++] = d_.penetrations[i];
    }
    d_.hit_count = kept;
    return inner;
  }

  void remember(ContactCache& cache) const noexcept {
    const std::size_t count = d_.hit_count;
    cache.points.assign(d_.hits, d_.hits + count);
    cache.leaves.assign(d_.leaves, d_.leaves + count);
    cache.points.resize(count + detail::kLanePadding);
    cache.leaves.resize(count + detail::kLanePadding);
    for (int axis = 0; axis < 3; ++axis) {
      cache.codes[axis].resize(count + detail::kLanePadding);
      for (std::size_t i = 0; i < count; ++i) cache.codes[axis][i] = shell_.position[axis][d_.hits[i]];
    }
  }

  // Sec. 2.4: clusters of the segmentation level are found once; each is then traversed alone and keeps its deepest
  // point. Those that the budget does not reach are represented by their own points.
  void gather_segments() noexcept {
    const std::uint32_t level = std::min(options_.segment_level, shell_.levels);
    if (!field_.touches(d_, 0)) return;
    result_.complete = start(0, 0, shell_.level_offsets[level - 1]);
    const std::uint32_t first = d_.begin;
    const std::uint32_t last = d_.end;
    std::uint32_t segment = first;
    for (; segment < last && result_.complete; ++segment) {
      const std::uint32_t node = d_.queue[segment];
      Contact deepest;
      deepest.penetration = kNothing;
      segment_ = &deepest;
      waiting_ = last - segment - 1;
      if (d_.bounds != nullptr) d_.bounds[last] = d_.bounds[segment];
      result_.complete = start(node, last, shell_.nodes);
      consume();
      const std::uint32_t gone_into = inner_nodes(last, d_.begin);
      represent(d_.begin, d_.end);
      if (deepest.penetration > kNothing) {
        deepest.node = node;
        emit(deepest);
      } else {
        sharpen(last, gone_into);
      }
    }
    segment_ = nullptr;
    waiting_ = 0;
    represent(segment, last);
    sharpen(0, inner_nodes(0, first));
  }

  // Goes down from a node, as far as the budget allows: false when it ran out. [begin, end) of the queue are left.
  bool start(std::uint32_t node, std::uint32_t at, std::uint32_t last_node) noexcept {
    d_.queue[at] = node;
    d_.begin = at;
    d_.end = at + 1;
    d_.last_node = last_node;
    if (!budget_.limited()) {
      field_.descend(d_);
      return true;
    }
    while (d_.begin < d_.end && d_.queue[d_.begin] < last_node) {
      d_.stop = affordable();
      if (d_.stop == d_.begin) return false;
      field_.descend(d_);
      consume();
    }
    return true;
  }

  std::uint64_t tests() const noexcept { return std::uint64_t{d_.nodes_tested} + d_.points_tested; }

  // Entry of the queue before which the next block of work ends.
  std::uint32_t affordable() const noexcept {
    const std::uint32_t leaves = shell_.level_offsets[shell_.levels - 1];
    std::uint64_t left = budget_.left(tests(), std::uint64_t{waiting_} + d_.end - d_.begin);
    std::uint64_t block = Budget::kBlock;
    std::uint32_t at = d_.begin;
    for (; at < d_.end; ++at) {
      const std::uint32_t node = d_.queue[at];
      const std::uint64_t children = shell_.children[2 * std::size_t{node} + 1];
      // Nodes that are left have their own points tested in the end.
      const std::uint64_t cost = node < leaves ? 2 * children : children;
      // One node goes in any block, however many children it has.
      if (cost > left || (cost > block && at > d_.begin)) break;
      left -= cost;
      block -= std::min(cost, block);
    }
    return at;
  }

  // Lets nodes of the queue, [from, to), stand for what is below them: by their bounds and by their own points.
  void represent(std::uint32_t from, std::uint32_t to) noexcept {
    for (std::uint32_t i = from; i < to; ++i) {
      const float radius = shell_.sphere[3][d_.queue[i]] + d_.unit * d_.slack;
      const float centre = d_.unit * d_.bounds[i] - radius;
      const float most = centre < facts_.known ? std::min(centre + radius + facts_.excess, facts_.most) : facts_.most;
      d_.rejected = std::max(d_.rejected, most / d_.unit);
    }
    coarse_ = true;
    while (from < to) {
      const auto count =
          static_cast<std::uint32_t>(std::min<std::uint64_t>(to - from, budget_.left_in_block(tests(), 0)));
      if (count == 0) {
        result_.complete = false;
        break;
      }
      field_.test_parents(d_, from, from + count);
      consume();
      from += count;
    }
    coarse_ = false;
  }

  // Where no point was met in touch, the own points of nodes that were gone into say more of the distance.
  void sharpen(std::uint32_t from, std::uint32_t to) noexcept {
    if (d_.deepest >= -d_.contact_distance) return;
    if (budget_.limited())
      to = from + static_cast<std::uint32_t>(std::min<std::uint64_t>(to - from, budget_.left_in_block(tests(), 0)));
    field_.test_parents(d_, from, to);
    d_.hit_count = 0;
  }

  // Takes the hits up into the answer.
  void consume() noexcept {
    const std::uint32_t count = coarse_ && options_.node_areas.empty() ? 0 : d_.hit_count;
    for (std::uint32_t i = 0; i < count; ++i) {
      const Contact contact = contact_of(i);
      if (contact.penetration >= 0) add_force(contact);
      if (segment_ == nullptr) {
        emit(contact);
      } else if (contact.penetration > segment_->penetration) {
        *segment_ = contact;
      }
    }
    d_.hit_count = 0;
  }

  // The queue is in tree order: leaves are last.
  std::uint32_t inner_nodes(std::uint32_t from, std::uint32_t to) const noexcept {
    const std::uint32_t leaves = shell_.level_offsets[shell_.levels - 1];
    return static_cast<std::uint32_t>(std::lower_bound(d_.queue + from, d_.queue + to, leaves) - d_.queue);
  }

  Contact contact_of(std::uint32_t hit) const noexcept {
    const std::uint32_t point = d_.hits[hit];
    Contact contact;
    contact.position = transform_.apply(point_position(shell_, point));
    contact.inward_normal = transform_.rotate(point_inward_normal(shell_, point));
    contact.penetration = d_.unit * d_.penetrations[hit];
    contact.point = point;
    contact.node = d_.leaves[hit];
    contact.area = coarse_ ? options_.node_areas[contact.node] : point_area(shell_, point);
    return contact;
  }

  // Eqs. (2) and (3).
  void add_force(const Contact& contact) noexcept {
    using namespace detail;
    const double weight = options_.weight == Weight::per_area ? contact.area : 1.0;
    const double scale = weight * contact.penetration;
    const double f[3] = {scale * contact.inward_normal.x, scale * contact.inward_normal.y,
                         scale * contact.inward_normal.z};
    const Vec3 arm = contact.position - centre_of_mass_;
    for (int axis = 0; axis < 3; ++axis) result_.force[axis] += f[axis];
    result_.torque[0] += arm.y * f[2] - arm.z * f[1];
    result_.torque[1] += arm.z * f[0] - arm.x * f[2];
    result_.torque[2] += arm.x * f[1] - arm.y * f[0];
  }

  void emit(const Contact& contact) noexcept {
    if (result_.contacts < out_.size()) out_[result_.contacts] = contact;
    ++result_.contacts;
  }

  const PointshellView& shell_;
  const DescentField field_;
  const Facts& facts_;
  const Pose& pose_;
  const Transform transform_;
  const QueryOptions& options_;
  const Budget budget_;
  const std::span<Contact> out_;
  QueryResult& result_;
  const Vec3 centre_of_mass_;
  Descent d_;
  Contact* segment_ = nullptr;  // keeps the deepest contact, where one is kept
  std::uint32_t waiting_ = 0;   // segments to come
  bool coarse_ = false;         // points stand for nodes
};

template <class T>
std::uint64_t id_of(const T& field) noexcept {
  return hash_bytes(std::as_bytes(std::span(&field, 1)));
}

// Of an analytic field.
template <class Analytic>
Facts facts_of(const Analytic& field) noexcept {
  Facts facts;
  facts.id = id_of(field);
  return facts;
}
Facts facts_of(const VoxelmapView& map) noexcept {
  Facts facts;
  facts.id = id_of(map.values);
  facts.excess = map.error;
  // Inside, the surface is never farther than the nearest face of the bounds.
  for (int axis = 0; axis < 3; ++axis) {
    facts.most = std::min(facts.most, 0.5F * (map.bounds_max[axis] - map.bounds_min[axis]) + map.error);
  }
  return facts;
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

// Sec. 3.2: whether the root sphere is out of reach of the map's bounds, which is cheap, and the answer then.
bool answer_apart(const PointshellView& shell, const VoxelmapView& map, const Pose& pose, float contact_distance,
                  QueryResult& result) noexcept {
  double squared = 0;
  double size = shell.sphere[3][0];
  for (int axis = 0; axis < 3; ++axis) {
    double at = pose.translation[axis];
    for (int k = 0; k < 3; ++k) at += pose.rotation[3 * axis + k] * shell.sphere[k][0];
    size += std::abs(at);
    const double gap = std::max({map.bounds_min[axis] - at, at - map.bounds_max[axis], 0.0});
    squared += gap * gap;
  }
  // For rounding, and for what check_pose lets pass.
  constexpr double kStretch = 1 + 1e-3;
  const double apart = std::sqrt(squared) - kStretch * shell.sphere[3][0] - map.error - 1e-6 * size;
  if (!(apart > contact_distance)) return false;
  result.delta = result.delta_bound = -apart;
  result.nodes_tested = 1;
  return true;
}

}  // namespace

void Scratch::reserve(const PointshellView& shell) {
  // The segmented traverse keeps a list of segments in front of the queue of one of them.
  const std::size_t nodes = 2 * std::size_t{shell.nodes} + detail::kLanePadding;
  // Nodes can have points of their own tested, and there can be more nodes than points.
  const std::size_t points = std::size_t{std::max(shell.points, shell.nodes)} + detail::kLanePadding;
  if (queue.size() < nodes) queue.resize(nodes);
  if (bounds.size() < nodes) bounds.resize(nodes);
  if (hits.size() < points) hits.resize(points);
  if (leaves.size() < points) leaves.resize(points);
  if (penetrations.size() < points) penetrations.resize(points);
}

Status traverse(const PointshellView& shell, FieldRef field, const Pose& shell_to_field, const QueryOptions& options,
                Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  if (const Status status = check_query(shell, shell_to_field, options, result); status != Status::ok) return status;
  return field.visit([&](const auto& kind) {
    constexpr bool kIsMap = std::is_same_v<decltype(kind), const VoxelmapView&>;
    if constexpr (kIsMap) {
      if (kind.field == Field::none) return Status::missing_part;
      if (answer_apart(shell, kind, shell_to_field, options.contact_distance, result)) return Status::ok;
    }
    Facts facts = facts_of(kind);
    const auto run = [&]<class Kernel>(const Kernel& kernel_field, const Frame& frame, float error, const Pose& pose) {
      facts.frame = frame;
      facts.error = error;
      facts.takes_lists = !std::is_same_v<Kernel, detail::PlainMap>;
      if constexpr (std::is_base_of_v<detail::SampledMap, Kernel>) {
        // The diagonal of the largest cell: docs/bounds.md.
        facts.excess =
            2 * std::sqrt(detail::kHalfDiagonalSquared) * std::ldexp(kind.voxel_size, kCoarsestLevel) + error;
        facts.known = kind.band_inner;
      }
      scratch.reserve(shell);
      return Traverse(shell, DescentField(kernel_field), facts, pose, shell_to_field, options, scratch, out, result)
          .run();
    };
    return detail::in_kernel_form(kind, shell_to_field, run);
  });
}

}  // namespace vps
