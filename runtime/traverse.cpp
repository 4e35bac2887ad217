// SPDX-License-Identifier: Zlib
// Hierarchical and segmented traverse of the point-sphere tree. Paper: Algorithm 1 (Sec. 2.3) and Sec. 2.4.
#include <limits>

#include "runtime/penetration.h"

namespace vps {
namespace {

// What the traverse asks of a field: a bound for spheres and V for points, all in the field's frame.
struct MapAdapter {
  const VoxelmapView& map;
  float bound(Vec3 p) const noexcept { return detail::voxelmap_bound(map, p); }
  float value(Vec3 p, Vec3 n) const noexcept { return detail::voxelmap_penetration(map, p, n); }
};
struct BoxAdapter {
  const BoxField& box;
  float bound(Vec3 p) const noexcept { return detail::box_penetration(box, p); }
  float value(Vec3 p, Vec3) const noexcept { return detail::box_penetration(box, p); }
};
struct SphereAdapter {
  const SphereField& sphere;
  float bound(Vec3 p) const noexcept { return detail::sphere_penetration(sphere, p); }
  float value(Vec3 p, Vec3) const noexcept { return detail::sphere_penetration(sphere, p); }
};
struct PlaneAdapter {
  const HalfSpaceField& plane;
  float bound(Vec3 p) const noexcept { return detail::half_space_penetration(plane, p); }
  float value(Vec3 p, Vec3) const noexcept { return detail::half_space_penetration(plane, p); }
};

// The relative pose in float: the difference of two double poses, so large world coordinates have cancelled.
struct Transform {
  float r[9];
  Vec3 t;
  explicit Transform(const Pose& pose) noexcept
      : t{static_cast<float>(pose.translation[0]), static_cast<float>(pose.translation[1]),
          static_cast<float>(pose.translation[2])} {
    for (int i = 0; i < 9; ++i) r[i] = static_cast<float>(pose.rotation[i]);
  }
  Vec3 rotate(Vec3 v) const noexcept {
    return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
            r[6] * v.x + r[7] * v.y + r[8] * v.z};
  }
  Vec3 apply(Vec3 v) const noexcept { return detail::operator+(rotate(v), t); }
};

template <class FieldAdapter>
class Traverse {
 public:
  Traverse(const PointshellView& shell, FieldAdapter field, const Pose& pose, const QueryOptions& options,
           Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept
      : shell_(shell),
        field_(field),
        transform_(pose),
        options_(options),
        queue_(scratch.queue.data()),
        out_(out),
        result_(result),
        centre_of_mass_(transform_.apply({shell.centre_of_mass[0], shell.centre_of_mass[1], shell.centre_of_mass[2]})) {
  }

  Status run() noexcept {
    result_ = {};
    if (options_.segment_level == 0) {
      if (touches(0)) visit(0, 0, shell_.levels, nullptr);
    } else {
      run_segmented();
    }
    result_.delta = deepest_ > -std::numeric_limits<float>::max() ? deepest_ : rejected_;
    return result_.contacts > out_.size() ? Status::output_full : Status::ok;
  }

 private:
  // Sec. 2.4: clusters of the segmentation level are found once; each is then traversed alone and keeps its deepest
  // point.
  void run_segmented() noexcept {
    const std::uint32_t level = std::min(options_.segment_level, shell_.levels);
    if (!touches(0)) return;
    const std::uint32_t segments = level == 1 ? (queue_[0] = 0, 1U) : visit(0, 0, level - 1, nullptr);
    for (std::uint32_t i = 0; i < segments; ++i) {
      Contact deepest;
      deepest.penetration = -std::numeric_limits<float>::max();
      const std::uint32_t node = queue_[i];
      visit(node, segments, shell_.levels, &deepest);
      if (deepest.penetration >= -options_.contact_distance) {
        deepest.node = node;
        emit(deepest);
      }
    }
  }

  // Algorithm 1 from `root`, whose sphere touches, down to nodes of level `last`. With `last` above the leaves the
  // surviving nodes of level last + 1 are left at the front of the queue and their number is returned.
  // The queue's first `base` entries belong to the caller.
  std::uint32_t visit(std::uint32_t root, std::uint32_t base, std::uint32_t last, Contact* segment) noexcept {
    std::uint32_t head = base;
    std::uint32_t tail = base;
    queue_[tail++] = root;
    const std::uint32_t end = shell_.level_offsets[last];
    const std::uint32_t leaves = shell_.level_offsets[shell_.levels - 1];
    while (head < tail && queue_[head] < end) {
      const std::uint32_t node = queue_[head++];
      const std::uint32_t first = shell_.children[2 * node];
      const std::uint32_t count = shell_.children[2 * node + 1];
      if (node >= leaves) {
        for (std::uint32_t i = first; i < first + count; ++i) test_point(i, node, segment);
      } else {
        test_parent(shell_.parent_point[node]);
        for (std::uint32_t child = first; child < first + count; ++child) {
          if (touches(child)) queue_[tail++] = child;
        }
      }
    }
    for (std::uint32_t i = 0; i < tail - head; ++i) queue_[base + i] = queue_[head + i];
    return tail - head;
  }

  bool touches(std::uint32_t node) noexcept {
    ++result_.nodes_tested;
    const Vec3 centre = transform_.apply({shell_.sphere[0][node], shell_.sphere[1][node], shell_.sphere[2][node]});
    const float bound = field_.bound(centre) + shell_.sphere[3][node];
    if (bound >= -options_.contact_distance) return true;
    rejected_ = std::max(rejected_, bound);
    return false;
  }

  Contact contact_at(std::uint32_t point) const noexcept {
    Contact contact;
    contact.position = transform_.apply(point_position(shell_, point));
    contact.inward_normal = transform_.rotate(point_inward_normal(shell_, point));
    contact.penetration = field_.value(contact.position, contact.inward_normal);
    contact.point = point;
    return contact;
  }

  // A parent point is also a point of some leaf: here it only sharpens delta, so that no point counts twice.
  void test_parent(std::uint32_t point) noexcept {
    ++result_.points_tested;
    deepest_ = std::max(deepest_, contact_at(point).penetration);
  }

  void test_point(std::uint32_t point, std::uint32_t node, Contact* segment) noexcept {
    ++result_.points_tested;
    Contact contact = contact_at(point);
    deepest_ = std::max(deepest_, contact.penetration);
    if (contact.penetration < -options_.contact_distance) return;
    contact.area = point_area(shell_, point);
    contact.node = node;
    if (contact.penetration >= 0) add_force(contact);
    if (segment == nullptr) {
      emit(contact);
    } else if (contact.penetration > segment->penetration) {
      *segment = contact;
    }
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
  const FieldAdapter field_;
  const Transform transform_;
  const QueryOptions& options_;
  std::uint32_t* const queue_;
  const std::span<Contact> out_;
  QueryResult& result_;
  const Vec3 centre_of_mass_;
  float deepest_ = -std::numeric_limits<float>::max();
  float rejected_ = -std::numeric_limits<float>::max();
};

template <class FieldAdapter>
Status start(const PointshellView& shell, FieldAdapter field, const Pose& pose, const QueryOptions& options,
             Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  result = {};
  if (shell.points == 0) return Status::missing_part;
  if (!(options.contact_distance >= 0)) return Status::bad_argument;
  if (const Status status = check_pose(pose); status != Status::ok) return status;
  scratch.reserve(shell);
  return Traverse<FieldAdapter>(shell, field, pose, options, scratch, out, result).run();
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
  if (queue.size() < 2 * std::size_t{shell.nodes}) queue.resize(2 * std::size_t{shell.nodes});
}

Status traverse(const PointshellView& shell, const VoxelmapView& map, const Pose& shell_to_map,
                const QueryOptions& options, Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  result = {};
  if (map.field == Field::none) return Status::missing_part;
  return start(shell, MapAdapter{map}, shell_to_map, options, scratch, out, result);
}
Status traverse(const PointshellView& shell, const BoxField& field, const Pose& shell_to_field,
                const QueryOptions& options, Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  return start(shell, BoxAdapter{field}, shell_to_field, options, scratch, out, result);
}
Status traverse(const PointshellView& shell, const SphereField& field, const Pose& shell_to_field,
                const QueryOptions& options, Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  return start(shell, SphereAdapter{field}, shell_to_field, options, scratch, out, result);
}
Status traverse(const PointshellView& shell, const HalfSpaceField& field, const Pose& shell_to_field,
                const QueryOptions& options, Scratch& scratch, std::span<Contact> out, QueryResult& result) noexcept {
  return start(shell, PlaneAdapter{field}, shell_to_field, options, scratch, out, result);
}

}  // namespace vps
