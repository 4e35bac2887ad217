// SPDX-License-Identifier: Zlib
// Hierarchical and segmented traverse of the point-sphere tree. Paper: Algorithm 1 (Sec. 2.3) and Sec. 2.4.
#include <algorithm>
#include <limits>
#include <type_traits>

#include "runtime/descend.h"

namespace vps {
namespace {

using detail::Descent;
using detail::Frame;
using detail::Transform;

constexpr float kNothing = -std::numeric_limits<float>::max();

// Algorithm 1 and its segmented form over one field.
template <class Field>
class Traverse {
 public:
  Traverse(const PointshellView& shell, const Field& field, const Frame& frame, const Pose& field_pose,
           const Pose& pose, float error, std::uint64_t field_id, const QueryOptions& options, Scratch& scratch,
           std::span<Contact> out, QueryResult& result) noexcept
      : shell_(shell),
        field_(field),
        pose_(pose),
        error_(error),
        field_id_(field_id),
        transform_(pose),
        options_(options),
        out_(out),
        result_(result),
        centre_of_mass_(transform_.apply({shell.centre_of_mass[0], shell.centre_of_mass[1], shell.centre_of_mass[2]})) {
    const auto unit = static_cast<float>(frame.unit);
    d_.shell = &shell;
    d_.unit = unit;
    d_.nodes = affine(field_pose, frame, {0, 0, 0}, 1);
    d_.points = affine(field_pose, frame, shell.position_origin, shell.position_step);
    d_.contact_distance = options.contact_distance / unit;
    d_.slack = error / unit + detail::rounding(shell, d_.nodes, unit);
    d_.queue = scratch.queue.data();
    d_.hits = scratch.hits.data();
    d_.penetrations = scratch.penetrations.data();
    d_.leaves = scratch.leaves.data();
    d_.deepest = d_.rejected = kNothing;
  }

  Status run() noexcept {
    const std::uint32_t inner = gather();
    // What was gone into without meeting a point in touch: the nodes' own points say more of the distance.
    if (!(d_.deepest >= -d_.contact_distance)) detail::test_parents(field_, d_, 0, inner);
    result_.delta = d_.unit * (d_.deepest > kNothing ? d_.deepest : d_.rejected);
    result_.delta_bound = d_.unit * std::max(d_.deepest, d_.rejected);
    result_.nodes_tested = d_.nodes_tested;
    result_.points_tested = d_.points_tested;
    return result_.contacts > out_.size() ? Status::output_full : Status::ok;
  }

 private:
  // These return how many inner nodes lie at the front of the queue.
  std::uint32_t gather() noexcept {
    if (options_.segment_level > 0) return gather_segments();
    std::uint32_t inner = 0;
    if (options_.cache == nullptr || std::is_same_v<Field, detail::PlainMap>) {
      inner = hit_all();
    } else {
      inner = hit_remembered(*options_.cache);
    }
    for (std::uint32_t i = 0; i < d_.hit_count; ++i) {
      const Contact contact = contact_of(i);
      if (contact.penetration >= 0) add_force(contact);
      emit(contact);
    }
    return inner;
  }

  std::uint32_t hit_all() noexcept {
    if (!detail::touches(field_, d_, 0)) return 0;
    start(0, 0, shell_.nodes);
    return inner_nodes(0, d_.end);
  }

  // A distance field changes by no more than the way that a point goes: a point with V < -reach at the reference cannot
  // be in contact before the body has gone reach - contact distance, less the field's error at both places.
  std::uint32_t hit_remembered(ContactCache& cache) noexcept {
    const bool same = cache.shell == shell_.position[0] && cache.field == field_id_;
    const double spent = same ? motion(cache.reference) : 0;
    const double needed = options_.contact_distance + 2.0 * error_;
    const double step = same ? motion(cache.last) : 0;
    cache.last = pose_;
    if (same && cache.reach >= needed + spent) {
      detail::test_list(field_, d_,
                        {{cache.codes[0].data(), cache.codes[1].data(), cache.codes[2].data()},
                         cache.points.data(),
                         cache.leaves.data(),
                         static_cast<std::uint32_t>(cache.points.size() - detail::kLanePadding)});
      d_.rejected = static_cast<float>((spent + 2.0 * error_ - cache.reach) / d_.unit);
      return 0;
    }
    cache.shell = shell_.position[0];
    cache.field = field_id_;
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

  // No point of the shell lies farther than this from where it was at another pose. [m]
  double motion(const Pose& from) const noexcept {
    double turned = 0;
    double moved = 0;
    for (int i = 0; i < 3; ++i) {
      double along = pose_.translation[i] - from.translation[i];
      for (int k = 0; k < 3; ++k) {
        const double change = pose_.rotation[3 * i + k] - from.rotation[3 * i + k];
        along += change * shell_.sphere[k][0];
        turned += change * change;
      }
      moved += along * along;
    }
    // The difference of two rotations stretches by its Frobenius norm over sqrt(2).
    constexpr double kRounding = 1 + 1e-6;
    return kRounding * (std::sqrt(moved) + std::sqrt(turned / 2) * shell_.sphere[3][0]);
  }

  // Sec. 2.4: clusters of the segmentation level are found once; each is then traversed alone and keeps its deepest
  // point.
  std::uint32_t gather_segments() noexcept {
    const std::uint32_t level = std::min(options_.segment_level, shell_.levels);
    if (!detail::touches(field_, d_, 0)) return 0;
    start(0, 0, shell_.level_offsets[level - 1]);
    const std::uint32_t first = d_.begin;
    const std::uint32_t last = d_.end;
    for (std::uint32_t segment = first; segment < last; ++segment) {
      d_.hit_count = 0;
      const std::uint32_t node = d_.queue[segment];
      start(node, last, shell_.nodes);
      Contact deepest;
      deepest.penetration = kNothing;
      for (std::uint32_t i = 0; i < d_.hit_count; ++i) {
        const Contact contact = contact_of(i);
        if (contact.penetration >= 0) add_force(contact);
        if (contact.penetration > deepest.penetration) deepest = contact;
      }
      if (d_.hit_count == 0) {
        if (!(d_.deepest >= -d_.contact_distance)) detail::test_parents(field_, d_, last, inner_nodes(last, d_.end));
        continue;
      }
      deepest.node = node;
      emit(deepest);
    }
    return inner_nodes(0, last);
  }

  void start(std::uint32_t node, std::uint32_t at, std::uint32_t last_node) noexcept {
    d_.queue[at] = node;
    d_.begin = at;
    d_.end = at + 1;
    d_.last_node = last_node;
    detail::descend(field_, d_);
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
    contact.area = point_area(shell_, point);
    contact.point = point;
    contact.node = d_.leaves[hit];
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
  const Field& field_;
  const Pose& pose_;
  const float error_;
  const std::uint64_t field_id_;
  const Transform transform_;
  const QueryOptions& options_;
  const std::span<Contact> out_;
  QueryResult& result_;
  const Vec3 centre_of_mass_;
  Descent d_;
};

// @param field_pose  takes the shell to the field: `pose`, but for fields with an orientation of their own
template <class Field>
Status start(const PointshellView& shell, const Field& field, const Frame& frame, const Pose& field_pose,
             const Pose& pose, float error, std::uint64_t field_id, const QueryOptions& options, Scratch& scratch,
             std::span<Contact> out, QueryResult& result) noexcept {
  scratch.reserve(shell);
  return Traverse<Field>(shell, field, frame, field_pose, pose, error, field_id, options, scratch, out, result).run();
}

// Tells fields apart that a cache may meet.
template <class T>
std::uint64_t id_of(const T& field) noexcept {
  return hash_bytes(std::as_bytes(std::span(&field, 1)));
}

Status check_query(const PointshellView& shell, const Pose& pose, const QueryOptions& options,
                   QueryResult& result) noexcept {
  result = {};
  if (shell.points == 0) return Status::missing_part;
  if (!(options.contact_distance >= 0)) return Status::bad_argument;
  return check_pose(pose);
}

}  // namespace

Status check_pose(const Pose& pose) noexcept {
  constexpr double kTolerance = 1e-3;
  const double* const r = pose.rotation;
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(pose.translation[i])) return Status::bad_pose;
    for (int j = i; j < 3; ++j) {
      const double product = r[3 * i] * r[3 * j] + r[3 * i + 1] * r[3 * j + 1] + r[3 * i + 2] * r[3 * j + 2];
      if (!(std::abs(product - (i == j ? 1.0 : 0.0)) <= kTolerance)) return Status::bad_pose;
    }
  }
  const double determinant =
      r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) + r[2] * (r[3] * r[7] - r[4] * r[6]);
  return determinant > 0 ? Status::ok : Status::bad_pose;
}

Pose relative_pose(const Pose& first, const Pose& second) noexcept {
  Pose out;
  const double d[3] = {second.translation[0] - first.translation[0], second.translation[1] - first.translation[1],
                       second.translation[2] - first.translation[2]};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += first.rotation[3 * k + i] * second.rotation[3 * k + j];
      out.rotation[3 * i + j] = sum;
    }
    out.translation[i] = first.rotation[i] * d[0] + first.rotation[3 + i] * d[1] + first.rotation[6 + i] * d[2];
  }
  return out;
}

void Scratch::reserve(const PointshellView& shell) {
  // The segmented traverse keeps a list of segments in front of the queue of one of them.
  const std::size_t nodes = 2 * std::size_t{shell.nodes} + detail::kLanePadding;
  const std::size_t points = std::size_t{shell.points} + detail::kLanePadding;
  if (queue.size() < nodes) queue.resize(nodes);
  if (bounds.size() < nodes) bounds.resize(nodes);
  if (hits.size() < points) hits.resize(points);
  if (leaves.size() < points) leaves.resize(points);
  if (penetrations.size() < points) penetrations.resize(points);
}

Status traverse(const PointshellView& shell, const VoxelmapView& map, const Pose& shell_to_map,
                const QueryOptions& options, Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  if (const Status status = check_query(shell, shell_to_map, options, result); status != Status::ok) return status;
  if (map.field == Field::none) return Status::missing_part;
  const auto run = [&](const auto& field, const Frame& frame, float error) {
    return start(shell, field, frame, shell_to_map, shell_to_map, error, id_of(map.values), options, scratch, out,
                 result);
  };
  return detail::on_map(map, shell_to_map, run);
}
Status traverse(const PointshellView& shell, const BoxField& field, const Pose& shell_to_field,
                const QueryOptions& options, Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  if (const Status status = check_query(shell, shell_to_field, options, result); status != Status::ok) return status;
  return start(shell, field, {}, shell_to_field, shell_to_field, 0, id_of(field), options, scratch, out, result);
}
Status traverse(const PointshellView& shell, const SphereField& field, const Pose& shell_to_field,
                const QueryOptions& options, Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  if (const Status status = check_query(shell, shell_to_field, options, result); status != Status::ok) return status;
  return start(shell, field, {}, shell_to_field, shell_to_field, 0, id_of(field), options, scratch, out, result);
}
Status traverse(const PointshellView& shell, const HalfSpaceField& field, const Pose& shell_to_field,
                const QueryOptions& options, Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  if (const Status status = check_query(shell, shell_to_field, options, result); status != Status::ok) return status;
  return start(shell, detail::SolidBelow{}, {}, detail::pose_above(field, shell_to_field), shell_to_field, 0,
               id_of(field), options, scratch, out, result);
}

}  // namespace vps
