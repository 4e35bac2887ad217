// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time.
#include "runtime/queries/closest_pair.h"

#include "runtime/fields/place_field.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/queries/closest_pair.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "runtime/fields/field_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {

// One of the two shells. Its parts are numbered: its nodes, and then its points.
struct PairSide {
  const PointshellView* shell;
  Affine from_other;  // takes codes of the other shell's places to codes of this one's

  [[nodiscard]] bool is_point(std::uint32_t part) const { return part >= shell->nodes; }
  [[nodiscard]] float radius(std::uint32_t part) const { return is_point(part) ? 0 : sphere_radius(*shell, part); }
  [[nodiscard]] Vec3 code(std::uint32_t part) const {
    const std::uint16_t* const* const rows = is_point(part) ? shell->position : shell->sphere;
    const std::uint32_t at = is_point(part) ? part - shell->nodes : part;
    return {static_cast<float>(rows[0][at]), static_cast<float>(rows[1][at]), static_cast<float>(rows[2][at])};
  }
  [[nodiscard]] bool has_points_below(std::uint32_t node) const {
    return node >= shell->level_offsets[shell->levels - 1];
  }
};

class PairSearch {
 public:
  PairSearch(const PairSide (&sides)[2], float slack, const ClosestPairOptions& options, ClosestPair& result)
      : sides_(sides), slack_(slack), options_(options), result_(result) {}

  void run() {
    // The guess with all of the other shell, which comes first, and all with all.
    for (auto& parts : parts_) parts[0] = parts[1] = 0;
    parts_[0][1] = sides_[0].shell->nodes + options_.guess;
    bounds_[0] = bounds_[1] = 0;
    count_ = 2;
    while (count_ > 0) {
      --count_;
      if (bounds_[count_] >= limit()) {
        skip(bounds_[count_]);
        continue;
      }
      // The larger sphere is opened.
      const std::uint32_t parts[2] = {parts_[0][count_], parts_[1][count_]};
      const bool second = sides_[0].is_point(parts[0]) || sides_[1].radius(parts[1]) > sides_[0].radius(parts[0]);
      open(second ? 1 : 0, parts);
    }
    skip(hn::GetLane(hn::MinOfLanes(f32, passed_)));
    result_.bound = std::max(std::min(skipped_, result_.distance - slack_), 0.0F);
  }

 private:
  static constexpr float kFar = std::numeric_limits<float>::infinity();
  struct Entry {
    std::uint32_t number = 0;
    float bound = kFar;
  };

  // Parts that are at least this far apart are skipped. [m]
  [[nodiscard]] float limit() const {
    return std::min(result_.distance - options_.tolerance, (1 - options_.relative) * result_.distance);
  }
  void skip(float bound) { skipped_ = std::min(skipped_, bound); }

  // Compares the parts below one of two parts with the other one.
  HWY_INLINE void open(int at, const std::uint32_t (&parts)[2]) {
    const PairSide& side = sides_[at];
    const PairSide& other = sides_[1 - at];
    const std::uint32_t kept = parts[1 - at];
    const Vec3 code = other.code(kept);
    const Points place{set(code.x), set(code.y), set(code.z)};
    const Points to{row(side.from_other, 0, place), row(side.from_other, 1, place), row(side.from_other, 2, place)};
    const F step = set(side.shell->position_step);
    const F less = set(other.radius(kept) + slack_);
    const bool to_points = side.has_points_below(parts[at]);
    const auto [first, last] = children_of(*side.shell, parts[at]);
    (to_points ? result_.points_tested : result_.nodes_tested) += last - first;
    Entry closest;
    for (std::uint32_t child = first; child < last; child += kLanes) {
      const Batch batch{child, last - child < kLanes ? last - child : kLanes, 0};
      const Points p = to_points ? load_points(*side.shell, batch) : load_centres(*side.shell, batch);
      const F x = hn::Sub(p.x, to.x);
      const F y = hn::Sub(p.y, to.y);
      const F z = hn::Sub(p.z, to.z);
      F away = hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))));
      if (!to_points) away = hn::Sub(away, load_radii(*side.shell, batch));
      away = hn::IfThenElse(valid_lanes(batch), hn::Mul(away, step), set(kFar));
      if (to_points && other.is_point(kept)) {
        take_nearest(at, child, kept - other.shell->nodes, away);
      } else {
        push(at, to_points ? side.shell->nodes + child : child, kept, hn::Sub(away, less), closest);
      }
    }
    if (!(closest.bound < kFar)) return;
    // It is looked at next.
    std::swap(bounds_[closest.number], bounds_[count_ - 1]);
    for (auto& list : parts_) std::swap(list[closest.number], list[count_ - 1]);
  }

  HWY_INLINE void take_nearest(int at, std::uint32_t first, std::uint32_t other, F away) {
    const F least = hn::MinOfLanes(f32, away);
    const float distance = hn::GetLane(least);
    if (!(distance < result_.distance)) return;
    result_.distance = distance;
    const auto point = first + static_cast<std::uint32_t>(hn::FindFirstTrue(f32, hn::Eq(away, least)));
    result_.first = at == 0 ? point : other;
    result_.second = at == 0 ? other : point;
  }

  // @param closest  number and bound of the closest entry so far
  HWY_INLINE void push(int at, std::uint32_t first, std::uint32_t kept, F bounds, Entry& closest) {
    const Words u32;
    const M fits = hn::FirstN(f32, count_ + kLanes <= kMost ? kLanes : 0);
    const M closer = hn::And(hn::Lt(bounds, set(limit())), fits);
    const F left = hn::IfThenElse(closer, bounds, set(kFar));
    passed_ = hn::Min(passed_, hn::IfThenElse(closer, set(kFar), bounds));
    const F least = hn::MinOfLanes(f32, left);
    const float bound = hn::GetLane(least);
    if (!(bound < kFar)) return;
    if (bound < closest.bound) {
      const auto lane = static_cast<std::size_t>(hn::FindFirstTrue(f32, hn::Eq(left, least)));
      const std::size_t before = hn::CountTrue(f32, hn::And(closer, hn::FirstN(f32, lane)));
      closest = {count_ + static_cast<std::uint32_t>(before), bound};
    }
    hn::StoreU(hn::Set(u32, kept), u32, parts_[1 - at] + count_);
    store_packed(u32, numbers_from(first), hn::RebindMask(u32, closer), parts_[at] + count_);
    count_ += store_packed(f32, bounds, closer, bounds_ + count_);
  }

  static constexpr auto kLanes = static_cast<std::uint32_t>(hn::MaxLanes(Floats()));
  // Two trees of a few levels leave some hundred entries. What finds no room only makes the bound worse.
  static constexpr std::uint32_t kMost = 1024;

  const PairSide (&sides_)[2];
  const float slack_;  // of rounding. [m]
  const ClosestPairOptions& options_;
  ClosestPair& result_;
  float skipped_ = kFar;  // no two points of the skipped parts are closer. [m]
  F passed_ = set(kFar);  // the same
  // Pairs of parts that are left, and their bounds.
  std::uint32_t count_ = 0;
  HWY_ALIGN std::uint32_t parts_[2][kMost + kLanePadding];
  HWY_ALIGN float bounds_[kMost + kLanePadding];
};

// Takes codes of a shell's places to codes of the other one's.
Affine between(const PointshellView& from, const PointshellView& to, const Pose& pose) {
  Frame frame;
  frame.unit = to.position_step;
  for (int axis = 0; axis < 3; ++axis) frame.origin[axis] = to.position_origin[axis];
  return affine(pose, frame, from.position_origin, from.position_step);
}

void search_pair(const PointshellView& first, const PointshellView& second, const Pose& first_to_second,
                 const ClosestPairOptions& options, ClosestPair& result) {
  const Pose second_to_first = relative_pose(first_to_second, Pose());
  const PairSide sides[2] = {{&first, between(second, first, second_to_first)},
                             {&second, between(first, second, first_to_second)}};
  const float slack = rounding(first, first_to_second, Frame()) + rounding(second, second_to_first, Frame());
  PairSearch(sides, slack, options, result).run();
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(search_pair);
ClosestPair find_closest_pair(const PointshellView& first, const PointshellView& second, const Pose& first_to_second,
                              const ClosestPairOptions& options) noexcept {
  ClosestPair result;
  HWY_DYNAMIC_DISPATCH(search_pair)(first, second, first_to_second, options, result);
  return result;
}

}  // namespace vps::detail
#endif
