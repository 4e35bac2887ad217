// SPDX-License-Identifier: Zlib
// Finds the triangle nearest to each point of the shell. The search goes down the tree of spheres with the list of the
// triangles within reach, which shrinks on the way. On flat parts of the sheet it stops at flat nodes.
#include "runtime/bullet/partners/triangle_contacts.h"

#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <algorithm>
#include <array>
#include <functional>
#include <optional>

#include "runtime/bullet/partners/triangles.h"

namespace vps::bullet {
namespace {

using namespace detail;

Box bounds(const AssetInfo& info, double grown) {
  Box box;
  for (std::size_t i = 0; i < 3; ++i) {
    box.low[i] = info.bounds_min[i] - grown;
    box.high[i] = info.bounds_max[i] + grown;
  }
  return box;
}

// Cosine. Where the sheet's plane and the body's surface make a larger angle, no face gives the direction.
constexpr float kAligned = 0.5F;
// Cosine. Where they make a smaller angle, the shell's normal alone says where the material is.
constexpr float kFacing = 0.966F;
// Cosine. Where they make a larger angle, neither side of the sheet has more of the body's material than the other.
constexpr float kUpright = 0.05F;
// Contacts slide over the sheet: what is near them has to be known. [voxels]
constexpr float kSlide_vx = 8;
// The body has no material where its field is farther outside. [voxels]
constexpr float kOutside_vx = 0.1F;

// The triangle nearest to p, and the nearest place on it; null if none is nearer than `place`.
// @param list  of what `triangle_of` takes to a triangle
template <class List, class TriangleOf>
const Triangle* nearest_triangle(const List& list, const TriangleOf& triangle_of, Vec3 p, NearestPlace& place) {
  const Triangle* best = nullptr;
  for (const auto& one : list) {
    const Triangle& triangle = triangle_of(one);
    if (!(triangle.least_squared(p) < place.squared)) continue;
    const NearestPlace found = triangle.nearest(p);
    if (!(found.squared < place.squared)) continue;
    place = found;
    best = &triangle;
  }
  return best;
}

// Whether the contacts' areas are used: springs have the areas of all points.
enum class Areas : std::uint8_t { unused, used };

class Search {
 public:
  // @param areas  whether the area of every contact counts: then flat nodes are not used
  Search(const Shape& body, const QueryOptions& options, Areas areas, const Pose& to_asset, Sheets& sheets,
         SheetContacts& out)
      : shell_(body.pointshell()),
        map_(body.voxelmap()),
        solid_(map_.field != Field::none),
        has_flat_nodes_(solid_ && shell_.hull_offsets != nullptr && areas == Areas::unused),
        tolerance_(static_cast<float>(kHullTolerance) * shell_.feature_covering_radius),
        centre_of_mass_(to_vec3(body.centre_of_mass())),
        voxel_(static_cast<float>(body.info().voxel_size)),
        distance_(options.contact_distance),
        segment_level_(std::min(options.segment_level, shell_.levels)),
        to_asset_(to_asset),
        sheets_(sheets),
        out_(out) {}

  // Searches the whole shell.
  void run(const AssetInfo& info, TriangleMemory& memory) {
    memory_ = &memory;
    relevant_ = distance_ + static_cast<float>(memory.room);
    place_triangles(bounds(info, double{std::max(least_reach(), kSlide_vx * voxel_)}));
    float reach = std::max(least_reach(), kRoom * leave_near());
    const float most = 2 * sphere_radius(shell_, 0) + relevant_;
    // The deepest contact may lie deeper than the reach, but others nearly as deep are then found: the reach is
    // doubled.
    for (;; reach *= 2) {
      reach_ = std::min(reach, most);
      memory.places.clear();
      start();
      visit(0, 1, 0);
      if (enough() || !(reach_ < most)) return;
    }
  }

  // Finds known contacts alone; false when one of them is missing.
  bool run_for(std::span<const ContactPlace> known) {
    std::array<TriangleMemory::Place, 4> places{};
    std::size_t count = 0;
    for (const ContactPlace& one : known) {
      if (count == 0 || places[count - 1].node != one.leaf) places[count++] = {one.leaf, kNoNode};
    }
    known_ = known;
    const bool suffice = run_again({places.data(), count});
    known_ = {};
    if (!suffice) return false;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < out_.contacts.size(); ++i) {
      const ContactPlace at{out_.contacts[i].node, out_.features[i]};
      if (!std::binary_search(known.begin(), known.end(), at)) continue;
      out_.contacts[kept] = out_.contacts[i];
      out_.features[kept++] = at.feature;
    }
    out_.contacts.resize(kept);
    out_.features.resize(kept);
    return kept == known.size();
  }

  // Searches remembered places alone; false when they are not enough.
  bool run_again(std::span<const TriangleMemory::Place> places) {
    start();
    if (places.empty()) return true;
    relevant_ = distance_;
    reach_ = least_reach();
    Box box;
    for (const auto& [node, segment] : places) {
      box.add(centre(node), sphere_radius(shell_, node) + std::max(reach_, kSlide_vx * voxel_));
    }
    place_triangles(box);
    start();
    for (const auto& [node, segment] : places) {
      if (segment != segment_.node) segment_ = {segment, out_.contacts.size()};
      visit(node, level_of(node), 0);
    }
    return enough();
  }

 private:
  static constexpr float kRoom = 1.5F;
  static constexpr std::uint32_t kNoNode = ~0U;

  // Every place of the body's surface is within the covering radius of a point of the shell.
  float least_reach() const noexcept { return std::max(shell_.covering_radius, relevant_); }
  bool enough() const noexcept { return !(kRoom * deepest_ > reach_); }

  float penetration_at(Vec3 p) const noexcept {
    return penetration(map_, p, map_.field == Field::layers ? outward_normal(map_, p) : Vec3());
  }

  // Leaves out the triangles that cannot touch the body: the sheet only goes on in them. Returns the largest
  // penetration of a triangle's centre, or 0.
  float leave_near() {
    if (!solid_) return 0;
    float most = 0;
    const auto is_far = [&](std::uint32_t number) {
      const Triangle& t = sheets_.triangles[number];
      const float bound = penetration_bound(map_, t.centre);
      if (bound >= 0) most = std::max(most, penetration_at(t.centre));
      return bound + t.radius < -relevant_;
    };
    sheets_.near.erase(std::remove_if(sheets_.near.begin(), sheets_.near.end(), is_far), sheets_.near.end());
    return most;
  }

  void place_triangles(const Box& box) {
    place(to_asset_, box, sheets_);
    sheets_.near.resize(sheets_.triangles.size());
    for (std::uint32_t i = 0; i < sheets_.near.size(); ++i) sheets_.near[i] = i;
    is_joined_ = false;
  }

  void start() {
    out_.contacts.clear();
    out_.features.clear();
    deepest_ = 0;
    segment_ = {};
    sheets_.met.assign(sheets_.triangles.size(), 0);
    sheets_.lists.assign(sheets_.near.begin(), sheets_.near.end());
  }

  // Remembers where contacts are possible: the topmost flat node on the way to the present leaf, or the leaf. A search
  // of these places alone then accepts the same nodes as a search of the whole shell.
  void remember() {
    if (memory_ == nullptr || !(memory_->room > 0)) return;
    std::vector<TriangleMemory::Place>& places = memory_->places;
    const std::uint32_t node = top_flat_ != kNoNode ? top_flat_ : leaf_;
    if (places.empty() || places.back().node != node) places.push_back({node, segment_.node});
  }

  Vec3 centre(std::uint32_t node) const noexcept { return sphere_centre(shell_, node); }
  std::uint32_t level_of(std::uint32_t node) const noexcept {
    const std::uint32_t* const offsets = shell_.level_offsets;
    return static_cast<std::uint32_t>(std::upper_bound(offsets, offsets + shell_.levels, node) - offsets);
  }
  std::uint32_t leaf_of(std::uint32_t point) const noexcept {
    std::uint32_t leaf = shell_.level_offsets[shell_.levels - 1];
    for (std::uint32_t count = shell_.nodes - leaf; count > 1;) {
      const std::uint32_t half = count / 2;
      if (shell_.children[2 * std::size_t{leaf + half}] <= point) leaf += half;
      count -= half;
    }
    return leaf;
  }
  // Whether one of some features is sought.
  bool is_sought(std::uint32_t first, std::uint32_t last) const noexcept {
    return known_.empty() || std::any_of(known_.begin(), known_.end(), [=](const ContactPlace& one) {
             return one.feature >= first && one.feature <= last;
           });
  }
  bool has_hull(std::uint32_t node) const noexcept {
    return has_flat_nodes_ && shell_.hull_offsets[node] < shell_.hull_offsets[node + 1];
  }

  // Pushes a new list: the triangles of the list at `from` that are within reach of the node's sphere. Levels are few.
  void visit(std::uint32_t node, std::uint32_t level, std::size_t from) {
    const std::size_t to = sheets_.lists.size();
    const float near = sphere_radius(shell_, node) + reach_;
    for (std::size_t i = from; i < to; ++i) {
      const std::uint32_t number = sheets_.lists[i];
      if (sheets_.triangles[number].is_within(centre(node), near)) sheets_.lists.push_back(number);
    }
    if (sheets_.lists.size() > to) {
      if (level == segment_level_ && node != segment_.node) segment_ = {node, out_.contacts.size()};
      const std::uint32_t first = shell_.children[2 * std::size_t{node}];
      const std::uint32_t end = first + shell_.children[2 * std::size_t{node} + 1];
      list_ = {sheets_.lists.data() + to, sheets_.lists.size() - to};
      leaf_ = node;
      const bool flat = level >= segment_level_ && has_hull(node);
      const bool is_top = flat && top_flat_ == kNoNode;
      if (is_top) top_flat_ = node;
      if (flat && is_answered_by_hull(node)) {
        // Its points need no tests.
      } else if (node >= shell_.level_offsets[shell_.levels - 1]) {
        has_climbed_ = false;
        ends_near_.reset();
        for (std::uint32_t point = first; point < end; ++point) {
          if (is_sought(point, point)) test_point(point);
        }
        if (solid_ && is_sought(shell_.points, ~0U)) test_corners();
      } else {
        for (std::uint32_t child = first; child < end; ++child) visit(child, level + 1, to);
      }
      if (is_top) top_flat_ = kNoNode;
    }
    sheets_.lists.resize(to);
  }

  // Whether the corners of a flat node's hull answer for all points below it. The sheet is a plane there, and either
  // all corners are contacts, or no point is. Proof: docs/internals/bounds.md, "Flat nodes".
  bool is_answered_by_hull(std::uint32_t node) {
    NearestPlace place;
    const Triangle* const plane = nearest(centre(node), sphere_radius(shell_, node) + reach_, place);
    if (plane == nullptr) return false;
    const std::span corners(shell_.hull_points + shell_.hull_offsets[node],
                            shell_.hull_points + shell_.hull_offsets[node + 1]);
    float deepest = std::numeric_limits<float>::lowest();
    float shallowest = std::numeric_limits<float>::max();
    float side = 0;
    for (const std::uint32_t corner : corners) {
      const Vec3 p = point_position(shell_, corner);
      const float of_corner = side_of(*plane, p, facing(corner, *plane));
      if (side == 0) side = of_corner;
      if (of_corner == 0 || of_corner != side) return false;
      const float v = -side * plane->height(p);
      deepest = std::max(deepest, v);
      shallowest = std::min(shallowest, v);
      if (!(shallowest >= -distance_ || deepest + 4 * tolerance_ < -relevant_)) return false;
    }
    const bool touches = shallowest >= -distance_;
    const float reach = touches ? std::max({shell_.covering_radius, deepest, -shallowest}) : reach_;
    return deepest <= reach_ && is_over_sheet(corners.front()) && is_plane_near(*plane, node, corners, reach) &&
           (!touches || emit_corners(corners, *plane, side));
  }

  // Whether the sheet lies below a point: if no end of it is near, it does so below all.
  bool is_over_sheet(std::uint32_t point) const noexcept {
    NearestPlace place;
    return nearest(point_position(shell_, point), reach_, place) != nullptr && place.on_face;
  }

  // Cosine of the angle between the inward normal at a point and a triangle's normal.
  float facing(std::uint32_t point, const Triangle& triangle) const noexcept {
    return dot(point_inward_normal(shell_, point), triangle.normal);
  }

  // Makes contacts of a flat node's corners; none if one of them is not a contact.
  bool emit_corners(std::span<const std::uint32_t> corners, const Triangle& plane, float side) {
    const Vec3 direction = side * plane.normal;
    const auto is_none = [&](std::uint32_t corner) {
      const Vec3 p = point_position(shell_, corner);
      return is_beyond(p, direction, -side * plane.height(p));
    };
    if (std::any_of(corners.begin(), corners.end(), is_none)) return false;
    for (const std::uint32_t corner : corners) {
      const Vec3 p = point_position(shell_, corner);
      const float area = point_area(shell_, corner) * std::max(side * facing(corner, plane), 0.0F);
      emit({{p, direction, -side * plane.height(p), area, corner, leaf_of(corner)}, corner});
    }
    remember();
    return true;
  }

  // Whether the sheet is a plane within some reach of a flat node's hull, and does not end there.
  bool is_plane_near(const Triangle& plane, std::uint32_t node, std::span<const std::uint32_t> corners, float reach) {
    const Vec3 middle = centre(node);
    const float radius = sphere_radius(shell_, node) + reach;
    if (!plane.is_within(middle, radius)) return false;
    Box box;
    for (const std::uint32_t corner : corners) box.add(point_position(shell_, corner), reach);
    return std::all_of(list_.begin(), list_.end(), [&](std::uint32_t number) {
      const Triangle& t = sheets_.triangles[number];
      if (!t.is_within(middle, radius)) return true;
      const float same = dot(t.normal, plane.normal) < 0 ? -1 : 1;
      const float apart = std::abs(same * t.height(middle) - plane.height(middle));
      const float bent = radius * length(same * t.normal - plane.normal);
      if (!(apart + bent <= tolerance_)) return false;
      for (int k = 0; k < 3; ++k) {
        if (box.meets(t.corners[k], t.corners[(k + 1) % 3]) && !goes_on(t, k)) return false;
      }
      return true;
    });
  }

  bool goes_on(const Triangle& triangle, int side) {
    if (!is_joined_) join(sheets_);
    is_joined_ = true;
    return triangle.goes_on[side];
  }

  // Whether the sheet ends or bends within reach of the leaf.
  bool ends_near() {
    const Vec3 p = centre(leaf_);
    const float reach = sphere_radius(shell_, leaf_) + reach_;
    // Many slight bends are a sharp one together.
    const Vec3 normal = sheets_.triangles[list_.front()].normal;
    return std::any_of(list_.begin(), list_.end(), [&](std::uint32_t number) {
      const Triangle& t = sheets_.triangles[number];
      if (std::abs(dot(t.normal, normal)) < kFacing) return true;
      for (int k = 0; k < 3; ++k) {
        if (dot(t.side[k], p) - t.side_offset[k] <= reach && !goes_on(t, k)) return true;
      }
      return false;
    });
  }

  // The list's triangle that is nearest to p, and the nearest place on it; null if none is within `reach`.
  const Triangle* nearest(Vec3 p, float reach, NearestPlace& place) const noexcept {
    place.squared = reach * reach;
    const auto listed = [this](std::uint32_t number) -> const Triangle& { return sheets_.triangles[number]; };
    return nearest_triangle(list_, listed, p, place);
  }

  void test_point(std::uint32_t point) {
    const Vec3 p = point_position(shell_, point);
    NearestPlace place;
    const Triangle* const triangle = nearest(p, reach_, place);
    if (triangle == nullptr) return;
    const ManifoldContact contact{{p, {}, 0, point_area(shell_, point), point, leaf_}, point};
    if (!solid_) return test_by_normal(contact, point_inward_normal(shell_, point), *triangle, place);
    if (!place.on_face) return climb_from(contact, place.at);
    const float height = triangle->height(p);
    const float along = facing(point, *triangle);
    // The most frequent case, decided without the field: a face that looks at the sheet from a distance.
    if (std::abs(along) > kAligned && height * along > 0 && std::abs(height) > relevant_) return;
    const float side = side_of(*triangle, p, along);
    if (side == 0) return climb_from(contact, place.at);
    ManifoldContact seen = contact;
    seen.area *= std::max(side * along, 0.0F);  // projected along the direction
    emit_on_face(seen, side * triangle->normal, -side * height);
  }

  // The side of a triangle's plane on which the body's material is, at a place of its surface: 1 along the normal, -1
  // against it, 0 for neither.
  // @param along  cosine of the angle between the body's inward normal and the triangle's
  float side_of(const Triangle& triangle, Vec3 p, float along) const noexcept {
    if (std::abs(along) > kFacing) return along > 0 ? 1 : -1;
    if (std::abs(along) < kUpright) return 0;
    const float above = penetration_at(p + voxel_ * triangle.normal);
    const float below = penetration_at(p - voxel_ * triangle.normal);
    // A face, edge or corner that points to one side of the sheet has no material of the body on that side.
    if (!(std::min(above, below) <= -kAligned * voxel_) || !(std::abs(above - below) > 0.5F * kAligned * voxel_)) {
      return 0;
    }
    return above > below ? 1 : -1;
  }

  // Whether the sheet lies beyond the body's opposite side, seen from a point: the way out is shorter the other way. On
  // the shell V is about 0, and it changes by no more than the way.
  // @param direction  into the body at the point
  bool is_beyond(Vec3 p, Vec3 direction, float penetration) const noexcept {
    const float way = 2 * penetration;
    const float outside = kOutside_vx * voxel_;
    return way > outside && penetration_at(p + way * direction) < -outside;
  }

  // Follows the sheet from near a point. Where it does not end or bend, the first of the leaf's points that need it
  // tells how deep it is.
  void climb_from(const ManifoldContact& contact, Vec3 at) {
    if (!ends_near_) ends_near_ = ends_near();
    if (*ends_near_ || (!has_climbed_ && meets_sheet())) climb(at, contact);
    has_climbed_ = true;
  }

  // Whether the sheet may enter the body near the leaf. The surface there is within the covering radius of a point.
  bool meets_sheet() const noexcept {
    const float near = sphere_radius(shell_, leaf_) + shell_.covering_radius;
    return std::any_of(list_.begin(), list_.end(),
                       [&](std::uint32_t number) { return sheets_.triangles[number].is_within(centre(leaf_), near); });
  }

  // @param direction  into the body at the point
  void emit_on_face(ManifoldContact contact, Vec3 direction, float penetration) {
    if (penetration < -relevant_) return;
    remember();
    if (penetration < -distance_ || is_beaten(penetration)) return;
    if (is_beyond(contact.position, direction, penetration)) return;
    contact.inward_normal = direction;
    contact.penetration = penetration;
    emit(contact);
  }

  void test_by_normal(ManifoldContact contact, Vec3 inward, const Triangle& triangle, const NearestPlace& place) {
    Vec3 direction = triangle.normal;
    if (!place.on_face) {
      const Vec3 apart = place.at - contact.position;
      const float size = length(apart);
      if (size > 1e-3F * voxel_) direction = (1 / size) * apart;
    }
    const float along = dot(direction, inward);
    if (!(std::abs(along) > 0.5F * kAligned)) return;
    if (along < 0) direction = -1 * direction;
    contact.inward_normal = direction;
    contact.penetration = dot(direction, place.at - contact.position);
    if (contact.penetration < -relevant_) return;
    remember();
    if (contact.penetration < -distance_) return;
    if (contact.penetration > 0 && dot(centre_of_mass_ - place.at, direction) < 0) return;
    emit(contact);
  }

  // The sheet's corners may be sharper than the spacing of the shell's points resolves.
  void test_corners() {
    const float near = sphere_radius(shell_, leaf_) + shell_.covering_radius;
    for (const std::uint32_t number : list_) {
      const Triangle& triangle = sheets_.triangles[number];
      for (unsigned k = 0; k < 3; ++k) {
        const Vec3 away = triangle.corners[k] - centre(leaf_);
        if ((sheets_.met[number] & 1U << k) != 0 || !(dot(away, away) <= near * near)) continue;
        sheets_.met[number] = static_cast<std::uint8_t>(sheets_.met[number] | 1U << k);
        if (penetration_at(triangle.corners[k]) < -relevant_) continue;
        ManifoldContact contact;
        contact.area = shell_.feature_covering_radius * shell_.feature_covering_radius;
        contact.point = shell_.children[2 * std::size_t{leaf_}];
        contact.node = leaf_;
        contact.feature = corner_feature(shell_, triangle.id, k);
        climb(triangle.corners[k], contact);
      }
    }
  }

  // Follows the sheet into the body while it gets deeper. If the sheet ends or bends there, that place is a contact. In
  // the middle of a face, the shell's points already give the contacts.
  void climb(Vec3 at, ManifoldContact contact) {
    float v = penetration_at(at);
    Vec3 out = outward_normal(map_, at);
    const float gain = 0.02F * voxel_;
    float step = voxel_;
    NearestPlace place;
    for (int i = 0; i < 16 && step > 0.1F * voxel_ && dot(out, out) > 0; ++i) {
      const bool found = nearest(at - step * out, 2 * step, place) != nullptr;
      const float there = found ? penetration_at(place.at) : v;
      if (!(there > v + gain)) {
        step /= 2;
        continue;
      }
      at = place.at;
      v = there;
      out = outward_normal(map_, at);
    }
    deepest_ = std::max(deepest_, v);
    if (v < -relevant_) return;
    remember();
    if (v < -distance_ || !(dot(out, out) > 0)) return;
    const Triangle* const triangle = nearest(at, voxel_, place);
    if (triangle == nullptr) return;
    const float across = dot(triangle->normal, out);
    constexpr float kFlat = 0.9F;
    if (!(std::abs(across) < kFlat)) return;
    const Vec3 along = across * triangle->normal - out;
    const Vec3 next = at + (voxel_ / length(along)) * along;
    if (nearest(next, 0.3F * voxel_, place) != nullptr) return;  // the sheet continues
    contact.position = at + v * out;
    contact.inward_normal = -1 * out;
    contact.penetration = v;
    emit(contact);
  }

  // Whether the segment has a deeper contact.
  bool is_beaten(float penetration) const noexcept {
    return segment_level_ > 0 && out_.contacts.size() > segment_.first &&
           !(penetration > out_.contacts[segment_.first].penetration);
  }

  // Keeps only the deepest contact of a segment.
  void emit(ManifoldContact contact) {
    deepest_ = std::max(deepest_, contact.penetration);
    if (is_beaten(contact.penetration)) return;
    if (segment_level_ > 0) {
      contact.node = segment_.node;
      out_.contacts.resize(segment_.first);
      out_.features.resize(segment_.first);
    }
    out_.contacts.push_back(contact);
    out_.features.push_back(contact.feature);
  }

  const PointshellView& shell_;
  const VoxelmapView& map_;
  const bool solid_;
  const bool has_flat_nodes_;
  const float tolerance_;  // of flat nodes and of flat parts of the sheet. [m]
  const Vec3 centre_of_mass_;
  const float voxel_, distance_;
  const std::uint32_t segment_level_;
  const Pose& to_asset_;
  Sheets& sheets_;
  SheetContacts& out_;

  TriangleMemory* memory_ = nullptr;     // where places are remembered; null: nowhere
  std::span<const ContactPlace> known_;  // if not empty, no others are sought
  float relevant_ = 0;                   // contact distance, with the room for motion. [m]
  float reach_ = 0;                      // points and triangles farther apart are not paired. [m]
  float deepest_ = 0;
  std::uint32_t leaf_ = 0;            // or a flat node whose corners are tested
  std::uint32_t top_flat_ = kNoNode;  // the topmost flat node on the way to it
  bool has_climbed_ = false;          // from one of the leaf's points
  std::optional<bool> ends_near_;
  bool is_joined_ = false;               // the triangles know where the sheet goes on
  std::span<const std::uint32_t> list_;  // triangles within reach of the leaf
  struct {
    std::uint32_t node = kNoNode;
    std::size_t first = 0;
  } segment_;  // the node, and the index of its contact
};

bool has_triangles(const btCollisionShape& shape) {
  return shape.getShapeType() != GIMPACT_SHAPE_PROXYTYPE ||
         static_cast<const btGImpactShapeInterface&>(shape).getGImpactShapeType() != CONST_GIMPACT_COMPOUND_SHAPE;
}

}  // namespace

SheetField::SheetField(std::span<const Triangle> triangles, const Contact& contact, float reach)
    : side_(contact.inward_normal) {
  std::copy_if(triangles.begin(), triangles.end(), std::back_inserter(near_),
               [&](const Triangle& t) { return t.is_within(contact.position, reach); });
}

Vec3 SheetField::outward_normal(Vec3 place) const noexcept {
  NearestPlace found;
  const Triangle* const triangle = nearest_triangle(near_, std::identity(), place, found);
  if (triangle == nullptr) return {};
  return dot(triangle->normal, side_) < 0 ? -1 * triangle->normal : triangle->normal;
}

void SheetField::penetrations(const Places& places, Values& out) const noexcept {
  for (std::uint32_t i = 0; i < places.count; ++i) {
    NearestPlace found;
    const Triangle* const triangle = nearest_triangle(near_, std::identity(), places[i], found);
    const float distance = std::sqrt(found.squared);
    const bool is_behind = triangle != nullptr && triangle->height(places[i]) * dot(triangle->normal, side_) < 0;
    out[i] = is_behind ? distance : -distance;
  }
}

Status find_triangle_contacts(const Pair& pair, const QueryOptions& options, std::span<const ContactPlace> known,
                              TriangleMemory& memory, SheetContacts& found) {
  const Shape& body = *pair.shell.vps;
  if (body.pointshell().points == 0 || !has_triangles(*pair.field.shape)) return Status::missing_part;
  const Pose asset = to_pose(pair.shell.world, pair.shell.asset_frame());
  const Pose mesh = to_pose(pair.field.world, btTransform::getIdentity());
  for (const Pose& pose : {asset, mesh}) {
    if (const Status status = check_pose(pose); status != Status::ok) return status;
  }
  const Pose to_asset = relative_pose(asset, mesh);
  const Pose to_mesh = relative_pose(mesh, asset);
  const PointshellView& shell = body.pointshell();
  const auto& sheet = static_cast<const btConcaveShape&>(*pair.field.shape);
  thread_local Sheets sheets;
  const bool has_springs = options.segment_level == 0 && foundation_of(pair).stiffness > 0;
  Search search(body, options, has_springs ? Areas::used : Areas::unused, to_asset, sheets, found);
  const auto finish = [&] {
    memory.near = sheets.triangles;
    return Status::ok;
  };

  const double step = largest_displacement(shell, memory.last, to_mesh);
  memory.last = to_mesh;
  found.are_known = false;
  if (memory.room > 0 && memory.shell == shell.position[0] && memory.scale == shell.scale &&
      memory.level == options.segment_level && memory.distance >= options.contact_distance &&
      largest_displacement(shell, memory.reference, to_mesh) <= memory.room &&
      memory.mesh == gather(sheet, memory.low, memory.high, sheets)) {
    found.are_known = !known.empty() && search.run_for(known);
    if (found.are_known || search.run_again(memory.places)) return finish();
  }
  // Room for some steps like the last one. None for a fast body, which would remember too many places.
  constexpr double kSteps = 8;
  const double least = 0.05 * static_cast<double>(shell.feature_covering_radius);
  memory.room = kSteps * step > 10 * least ? 0 : std::max(least, kSteps * step);
  memory.reference = to_mesh;
  memory.distance = options.contact_distance;
  memory.level = options.segment_level;
  memory.shell = shell.position[0];
  memory.scale = shell.scale;
  const AssetInfo& info = body.info();
  // Twice the room: the box also holds contacts of places that move into it.
  const double grown = double{options.contact_distance} + 2 * memory.room +
                       std::max(info.voxel_size, static_cast<double>(shell.covering_radius));
  turn_box(bounds(info, grown), to_asset, memory.low, memory.high);
  memory.mesh = gather(sheet, memory.low, memory.high, sheets);
  search.run(info, memory);
  return finish();
}

}  // namespace vps::bullet
