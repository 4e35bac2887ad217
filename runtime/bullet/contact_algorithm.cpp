// SPDX-License-Identifier: Zlib
// The collision algorithm that Bullet's dispatcher calls for each pair with a Shape. Paper: Secs. 2.4 and 3.2.
#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <utility>
#include <vector>

#include "runtime/bullet/arriving_contacts.h"
#include "runtime/bullet/between_samples.h"
#include "runtime/bullet/lint.h"
#include "runtime/bullet/manifolds.h"
#include "runtime/bullet/partners/partner_field.h"
#include "runtime/bullet/refine_contacts.h"

namespace vps::bullet {
namespace {

enum class LookAhead : std::uint8_t { no, yes };

// The contacts of one body's points in the other body.
class ShellContacts {
 public:
  /// @param looks_ahead  yes: finds speculative contacts of the step too; no: for contactTest and similar queries
  ShellContacts(btDispatcher* dispatcher, LookAhead looks_ahead) : manifolds_(dispatcher), looks_ahead_(looks_ahead) {}

  /// @param leaves_faces  see QueryOptions
  void find(const Pair& pair, bool leaves_faces, btScalar step, btManifoldResult* result);
  void append_to(btManifoldArray& manifolds) const { manifolds_.append_to(manifolds); }

 private:
  void leave_apart() {
    manifolds_.clear();
    if (memory_ != nullptr) memory_->touched = memory_->is_carried = false;
  }
  void fill_regular(const Pair& pair, const FoundContacts& found, btManifoldResult* result);
  void fill_springs(const Pair& pair, const FoundContacts& found, btManifoldResult* result);
  void fill_segments(const Pair& pair, std::uint32_t level, const FoundContacts& found, btManifoldResult* result);

  Manifolds manifolds_;
  const LookAhead looks_ahead_;
  std::unique_ptr<PairMemory> memory_;  // none before the bodies come near each other
};

class ContactAlgorithm final : public btCollisionAlgorithm {
 public:
  ContactAlgorithm(const btCollisionAlgorithmConstructionInfo& info, LookAhead looks_ahead)
      : btCollisionAlgorithm(info), contacts_(info.m_dispatcher1, looks_ahead), looks_ahead_(looks_ahead) {}

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo& info, btManifoldResult* result) override;

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override {
    contacts_.append_to(manifolds);
    if (others_ != nullptr) others_->append_to(manifolds);
  }

 private:
  ShellContacts contacts_;
  std::unique_ptr<ShellContacts> others_;  // with the roles exchanged; none for shells with points everywhere
  const LookAhead looks_ahead_;
};
// Bullet allocates algorithms from a pool of fixed-size elements, and its release builds do not check the size.
static_assert(sizeof(ContactAlgorithm) <= 192);

// Penetrations of a flat contact differ by the rounding of the samples: a fiftieth of a voxel.
float alike_penetration(const Pair& pair) {
  return static_cast<float>(btScalar(0.02) * voxel_size(pair));
}

// Poses of bodies that are farther from each other are checked by the query. [m]
constexpr btScalar kFarthest = btScalar(1e6);

// A body that lands needs contacts wherever it may touch first. A level has some 12 times as many clusters as the one
// above it, so there are 23 segments at least, and 280 at most: with 19 a wheel at 5 m/s and 60 Hz hops and turns
// aside.
constexpr std::uint32_t kLandingSegments = 80;
constexpr std::uint32_t kJointSegments = 64;  // at least

// The level of a landing pair's segments. Where the partner is smaller than the shell, so are the segments: on a single
// one it would tip.
std::uint32_t landing_level(const Pair& pair) {
  const PointshellView& shell = pair.shell.vps->pointshell();
  if (shell.points == 0) return 0;
  btVector3 low;
  btVector3 high;
  pair.field.shape->getAabb(btTransform::getIdentity(), low, high);
  const double ratio = double(sphere_radius(shell, 0)) / std::max(0.5 * double((high - low).length()), 1e-9);
  const double wanted = kLandingSegments * std::max(1.0, ratio * ratio);
  return segment_level_for(shell, static_cast<std::uint32_t>(std::min<double>(wanted, shell.points)));
}

// Bodies that move together need many contacts: one of them may be stopped at any place. @return 1 is the root
std::uint32_t joint_level(const PointshellView& shell) {
  std::uint32_t level = 1;
  while (level < shell.levels && shell.level_offsets[level] - shell.level_offsets[level - 1] < kJointSegments) ++level;
  return level;
}

// Motion in a step that ends the rest of a pair. [vx]
constexpr double kCarried_vx = 0.05;

// A lower bound of the distance between the bodies: the shell's first sphere and the other body's box. Cheap, as most
// pairs whose boxes overlap are apart. [m]
btScalar least_distance(const Pair& pair) {
  const PointshellView& shell = pair.shell.vps->pointshell();
  if (shell.points == 0) return 0;
  const btVector3 centre = pair.shell.world * (pair.shell.asset_frame() * to_bt(sphere_centre(shell, 0)));
  btVector3 low;
  btVector3 high;
  pair.field.shape->getAabb(btTransform::getIdentity(), low, high);
  const btVector3 at = pair.field.world.invXform(centre);
  btVector3 outside = at;
  outside.setMax(low);
  outside.setMin(high);
  const btScalar rounding = 16 * SIMD_EPSILON * (centre.length() + pair.field.world.getOrigin().length());
  // For rotations that check_pose accepts, and for the surface between the points.
  constexpr btScalar kStretch = btScalar(1.001);
  const btScalar reach = kStretch * btScalar(sphere_radius(shell, 0)) + btScalar(shell.covering_radius);
  return (at - outside).length() - reach - margin_of(pair) - rounding;
}

void ContactAlgorithm::processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                                        const btDispatcherInfo& info, btManifoldResult* result) {
  const PairBody a(first);
  const PairBody b(second);
  if (a.vps == nullptr && b.vps == nullptr) return;  // another class with Shape's shape type
  const Pair pair = assign_roles(a, b);
  const bool both = needs_both_roles(pair);
  contacts_.find(pair, both, info.m_timeStep, result);
  if (!both) return others_.reset();
  if (others_ == nullptr) others_ = std::make_unique<ShellContacts>(m_dispatcher, looks_ahead_);
  others_->find({pair.field, pair.shell}, both, info.m_timeStep, result);
}

void ShellContacts::find(const Pair& pair, bool leaves_faces, btScalar step, btManifoldResult* result) {
  QueryOptions options;
  options.contact_distance =
      static_cast<float>(std::max(contact_distance(pair), result->m_closestPointDistanceThreshold));
  options.segment_level = pair.shell.vps->segment_level();
  options.leaves_faces = leaves_faces;
  auto [way, is_joint, phase] = looks_ahead_ == LookAhead::yes ? approach(pair, step) : Approach{};
  const btScalar near_enough = options.contact_distance + way;
  Stand now;
  if (memory_ != nullptr) {
    now = Stand(pair);
    const GapMemory& gap = memory_->gap;
    const double left = gap.distance - motion_between(pair, gap.stand, now) - double{margin_of(pair)};
    if (left > double{near_enough}) return leave_apart();
  }
  if (memory_ == nullptr || !memory_->touched) {
    const btScalar apart = least_distance(pair);
    if (apart > near_enough && apart < kFarthest) return leave_apart();
  }
  if (memory_ == nullptr) {
    memory_ = std::make_unique<PairMemory>();
    now = Stand(pair);
  }
  // A pair that touches and has not moved is carried. With a voxel smaller than the fall of a step, it would else get
  // contacts ahead for ever. It is carried until it moves more: with few contacts and many in turn, stacks sway.
  const double still = memory_->is_carried ? kCarried_vx : kStill_vx;
  memory_->is_carried =
      phase == Approach::Phase::still && memory_->touched && stands_still(pair, memory_->now, now, still);
  if (memory_->is_carried) way = 0;
  memory_->now = now;
  memory_->touched = false;
  if (way > 0) {
    options.contact_distance += static_cast<float>(way);
    // With more than one contact for each segment, the solver's iterations do not suffice to stop a landing body.
    if (phase == Approach::Phase::landing) memory_->segments.points.clear();
    if (options.segment_level == 0 && !(foundation_of(pair).stiffness > 0)) {
      const PointshellView& shell = pair.shell.vps->pointshell();
      options.segment_level = is_joint ? joint_level(shell) : landing_level(pair);
    }
  }
  FoundContacts found;
  found.reach = options.contact_distance;
  found.way = static_cast<float>(way);
  found.is_joint = is_joint;
  found.step = step;
  if (const Status status = find_contacts(pair, options, *memory_, found); status != Status::ok) {
    pair.shell.vps->report(status);
    if (pair.field.vps != nullptr) pair.field.vps->report(status);
    manifolds_.release();
    return;
  }
  if (way > 0) keep_arriving(pair, step, *memory_, found);
  if (found.most < 0 && found.hits.count == 0 && found.contacts.empty()) {
    // Every place of the surface is within the covering radius of a point.
    memory_->gap = {now, -double{found.most} - double{pair.shell.vps->pointshell().covering_radius}};
  }
  const auto near = static_cast<float>(contact_distance(pair));
  memory_->touched = found.hits.count > 0 || std::any_of(found.contacts.begin(), found.contacts.end(),
                                                         [=](const Contact& c) { return c.penetration >= -near; });
  if (options.segment_level == 0 || found.has_map_contacts) {
    fill_regular(pair, found, result);
  } else {
    fill_segments(pair, options.segment_level, found, result);
  }
}

ManifoldContact with_feature(const FoundContacts& found, std::size_t i) {
  return {found.contacts[i], feature_of(found.contacts, found.features, i)};
}

void ShellContacts::fill_regular(const Pair& pair, const FoundContacts& found, btManifoldResult* result) {
  memory_->segments.points.clear();
  if (foundation_of(pair).stiffness > 0) return fill_springs(pair, found, result);
  std::array<ManifoldContact, MANIFOLD_CACHE_SIZE> few;
  std::array<std::uint32_t, MANIFOLD_CACHE_SIZE> chosen{};
  const PointshellView& shell = pair.shell.vps->pointshell();
  const std::size_t count =
      detail::choose_four(rows_of(shell, found), manifolds_.previous(), alike_penetration(pair), chosen);
  remember_choice(found, {chosen.data(), count}, *memory_);
  for (std::size_t i = 0; i < count; ++i) few[i] = contact_of_row(shell, found, chosen[i]);
  std::span<ManifoldContact> left(few.data(), refine(pair, *memory_, found, {few.data(), count}));
  left = left.first(move_between_samples(pair, found, *memory_, left));
  manifolds_.replace(pair, left, found, result);
}

// Fills the manifold with few springs that have the wrench of all penetrating points.
void ShellContacts::fill_springs(const Pair& pair, const FoundContacts& found, btManifoldResult* result) {
  thread_local ReductionScratch scratch;
  thread_local std::vector<ManifoldContact> pressing;
  thread_local std::vector<Contact> all;
  pressing.clear();
  for (std::size_t i = 0; i < found.contacts.size(); ++i) {
    if (found.contacts[i].penetration >= 0) pressing.push_back(with_feature(found, i));
  }
  pressing.resize(refine(pair, *memory_, found, pressing));
  // The reduction ignores features but keeps `point`: it holds the contact's index in `pressing` here.
  all.assign(pressing.begin(), pressing.end());
  for (std::size_t i = 0; i < all.size(); ++i) all[i].point = static_cast<std::uint32_t>(i);
  const Vec3 centre = to_vec3(found.frame.invXform(pair.shell.world.getOrigin()));
  std::array<Contact, MANIFOLD_CACHE_SIZE> reduced;
  Reduction reduction;
  if (reduce_contacts(all, centre, reduced, scratch, reduction) != Status::ok) reduction.kept = 0;
  std::array<ManifoldContact, MANIFOLD_CACHE_SIZE> few;
  for (std::size_t i = 0; i < reduction.kept; ++i) {
    const ManifoldContact& source = pressing[reduced[i].point];
    few[i] = {reduced[i], source.feature};
    few[i].point = source.point;
  }
  manifolds_.replace(pair, {few.data(), reduction.kept}, found, result);
}

// Sec. 2.4: up to three manifolds for each segment, with one contact each. A contact keeps its manifold from step to
// step.
void ShellContacts::fill_segments(const Pair& pair, std::uint32_t level, const FoundContacts& found,
                                  btManifoldResult* result) {
  const std::uint32_t base = pair.shell.vps->pointshell().level_offsets[level - 1];
  thread_local std::vector<ManifoldContact> contacts;
  contacts.clear();
  for (std::size_t i = 0; i < found.contacts.size(); ++i) contacts.push_back(with_feature(found, i));
  contacts.resize(refine(pair, *memory_, found, contacts));
  thread_local std::vector<ManifoldContact> few;
  few.clear();
  for (const SegmentPoint& kept :
       keep_segments(contacts, static_cast<float>(beside(pair)), alike_penetration(pair), memory_->segments)) {
    few.push_back(*kept.at);
    few.back().slot = static_cast<int>(kept.node - base) * kContactsPerSegment + kept.place;
  }
  // Who asks for segments gets samples: their normals carry a nut down its thread, and one slid over a field does not.
  if (pair.shell.vps->segment_level() == 0) few.resize(move_between_samples(pair, found, *memory_, few));
  manifolds_.replace(pair, few, found, result);
}

std::atomic<bool> registered{false};

template <LookAhead looks_ahead>
struct CreateContactAlgorithm final : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper*,
                                                 const btCollisionObjectWrapper*) override {
    void* const memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(ContactAlgorithm));
    return new (memory) ContactAlgorithm(info, looks_ahead);
  }
};

}  // namespace

bool is_any_dispatcher_registered() {
  return registered.load(std::memory_order_relaxed);
}

void register_algorithm(btCollisionDispatcher& dispatcher) {
  registered.store(true, std::memory_order_relaxed);
  // Stateless: one instance serves every dispatcher and outlives them all. The algorithm finds the bodies' roles by
  // their shapes, so it needs no swapped variant.
  static CreateContactAlgorithm<LookAhead::yes> create;
  static CreateContactAlgorithm<LookAhead::no> create_for_tests;
  for (int partner = 0; partner < CONCAVE_SHAPES_END_HERE; ++partner) {
    if (partner != kProxyType && !is_partner_field(partner) && !is_triangle_mesh(partner)) continue;
    dispatcher.registerCollisionCreateFunc(kProxyType, partner, &create);
    dispatcher.registerCollisionCreateFunc(partner, kProxyType, &create);
    dispatcher.registerClosestPointsCreateFunc(kProxyType, partner, &create_for_tests);
    dispatcher.registerClosestPointsCreateFunc(partner, kProxyType, &create_for_tests);
  }
  // GImpact's algorithm would use the surfels of Shapes in compounds. Bullet's own algorithm queries each child.
  btCollisionConfiguration* const stock = dispatcher.getCollisionConfiguration();
  for (const auto& [first, second] : {std::pair{COMPOUND_SHAPE_PROXYTYPE, GIMPACT_SHAPE_PROXYTYPE},
                                      std::pair{GIMPACT_SHAPE_PROXYTYPE, COMPOUND_SHAPE_PROXYTYPE}}) {
    dispatcher.registerCollisionCreateFunc(first, second, stock->getCollisionAlgorithmCreateFunc(first, second));
  }
}

bool is_registered(btDispatcher& dispatcher, const Shape& shape) {
  btCollisionObject object;
  object.setCollisionShape(const_cast<Shape*>(&shape));
  const btCollisionObjectWrapper wrap(nullptr, &shape, &object, object.getWorldTransform(), -1, -1);
  btCollisionAlgorithm* const found = dispatcher.findAlgorithm(&wrap, &wrap, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  if (found == nullptr) return false;
  const bool ours = dynamic_cast<ContactAlgorithm*>(found) != nullptr;
  found->~btCollisionAlgorithm();
  dispatcher.freeCollisionAlgorithm(found);
  return ours;
}

}  // namespace vps::bullet
