// SPDX-License-Identifier: Zlib
// Finds the triangle nearest to each point of the shell. The search goes down the tree of spheres with the list of the
// triangles within reach, which shrinks on the way. On flat parts of the sheet it stops at flat nodes.
#include "runtime/bullet/partners/triangle_contacts.h"

#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <algorithm>
#include <array>

#include "runtime/bullet/partners/flat_nodes_on_sheet.h"
#include "runtime/bullet/partners/leaf_at_sheet.h"

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

// Contacts slide over the sheet: what is near them has to be known. [voxels]
constexpr float kSlide_vx = 8;

// Whether the contacts' areas are used: springs have the areas of all points.
enum class Areas : std::uint8_t { unused, used };

class Search {
 public:
  // @param areas  whether the area of every contact counts: then flat nodes are not used
  Search(const Shape& body, const QueryOptions& options, Areas areas, const Pose& to_asset, Sheets& sheets,
         SheetContacts& out)
      : shell_(body.pointshell()),
        voxel_(static_cast<float>(body.info().voxel_size)),
        body_{shell_, body.voxelmap(), voxel_},
        solid_(body_.has_field()),
        has_flat_nodes_(solid_ && shell_.hull_offsets != nullptr && areas == Areas::unused),
        centre_of_mass_(to_vec3(body.centre_of_mass())),
        distance_(options.contact_distance),
        segment_level_(std::min(options.segment_level, shell_.levels)),
        to_asset_(to_asset),
        sheets_(sheets),
        part_{sheets},
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
      part_.reach = std::min(reach, most);
      memory.places.clear();
      start();
      visit(0, 1, 0);
      if (enough() || !(part_.reach < most)) return;
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
    part_.reach = least_reach();
    Box box;
    for (const auto& [node, segment] : places) {
      box.add(centre(node), sphere_radius(shell_, node) + std::max(part_.reach, kSlide_vx * voxel_));
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
  bool enough() const noexcept { return !(kRoom * deepest_ > part_.reach); }

  // Leaves out the triangles that cannot touch the body: the sheet only goes on in them. Returns the largest
  // penetration of a triangle's centre, or 0.
  float leave_near() {
    if (!solid_) return 0;
    float most = 0;
    const auto is_far = [&](std::uint32_t number) {
      const Triangle& t = sheets_.triangles[number];
      const float bound = penetration_bound(body_.map, t.centre);
      if (bound >= 0) most = std::max(most, body_.penetration_at(t.centre));
      return bound + t.radius < -relevant_;
    };
    sheets_.near.erase(std::remove_if(sheets_.near.begin(), sheets_.near.end(), is_far), sheets_.near.end());
    return most;
  }

  void place_triangles(const Box& box) {
    place(to_asset_, box, sheets_);
    sheets_.near.resize(sheets_.triangles.size());
    for (std::uint32_t i = 0; i < sheets_.near.size(); ++i) sheets_.near[i] = i;
  }

  void start() {
    out_.contacts.clear();
    out_.features.clear();
    deepest_ = 0;
    segment_ = {};
    sheets_.met.assign(sheets_.triangles.size(), 0);
    sheets_.lists.assign(sheets_.near.begin(), sheets_.near.end());
    sheets_.masks.clear();
  }

  bool is_remembering() const noexcept { return memory_ != nullptr && memory_->room > 0; }
  // Remembers where contacts are possible: the topmost flat node on the way to the present leaf, or the leaf. A search
  // of these places alone then accepts the same nodes as a search of the whole shell.
  void remember() {
    if (!is_remembering()) return;
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
      if (children_of(shell_, leaf + half).begin <= point) leaf += half;
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
  bool has_hull(std::uint32_t node) const noexcept { return has_flat_nodes_ && !hull_of(shell_, node).empty(); }

  // Goes down from a node with a new list: the triangles of the list at `from` that are within reach of its sphere.
  void visit(std::uint32_t node, std::uint32_t level, std::size_t from) {
    const std::size_t to = sheets_.lists.size();
    const float near = sphere_radius(shell_, node) + part_.reach;
    for (std::size_t i = from; i < to; ++i) {
      const std::uint32_t number = sheets_.lists[i];
      if (sheets_.triangles[number].is_within(centre(node), near)) sheets_.lists.push_back(number);
    }
    descend(node, level, to, 0);
    sheets_.lists.resize(to);
  }

  // The same for all children of a node, whose list is at `from`. Levels are few.
  void visit_children(IndexRange children, std::uint32_t level, std::size_t from) {
    const std::size_t to = sheets_.lists.size();
    const std::size_t masks = sheets_.masks.size();
    sheets_.masks.resize(masks + (to - from));
    for (std::uint32_t first = children.begin; first < children.end; first += Spheres::kMost) {
      const std::uint32_t count = std::min<std::uint32_t>(children.end - first, Spheres::kMost);
      Spheres spheres;
      for (std::uint32_t k = 0; k < count; ++k) {
        spheres.set(k, centre(first + k), sphere_radius(shell_, first + k) + part_.reach);
      }
      float least[Spheres::kMost];
      find_within(sheets_.triangles.data(), {sheets_.lists.data() + from, to - from}, spheres,
                  {sheets_.masks.data() + masks, to - from}, least);
      for (std::uint32_t k = 0; k < count; ++k) {
        for (std::size_t i = from; i < to; ++i) {
          if ((sheets_.masks[masks + (i - from)] >> k & 1) != 0) sheets_.lists.push_back(sheets_.lists[i]);
        }
        descend(first + k, level, to, least[k]);
        sheets_.lists.resize(to);
      }
    }
    sheets_.masks.resize(masks);
  }

  // @param to     where the node's list begins, which is the last one
  // @param least  no listed triangle is nearer to the centre of its sphere. [m^2]
  void descend(std::uint32_t node, std::uint32_t level, std::size_t to, float least) {
    if (sheets_.lists.size() == to) return;
    if (level == segment_level_ && node != segment_.node) segment_ = {node, out_.contacts.size()};
    const IndexRange children = children_of(shell_, node);
    part_.list = {sheets_.lists.data() + to, sheets_.lists.size() - to};
    leaf_ = node;
    const bool flat = level >= segment_level_ && has_hull(node);
    const bool is_top = flat && top_flat_ == kNoNode;
    if (is_top) top_flat_ = node;
    if (flat && is_answered_by_hull(node)) {
      // Its points need no tests.
    } else if (node >= shell_.level_offsets[shell_.levels - 1]) {
      test_leaf(children, least);
    } else {
      visit_children(children, level + 1, to);
    }
    if (is_top) top_flat_ = kNoNode;
  }

  // Whether the corners of a flat node's hull answer for all points below it. If they touch, they are the contacts.
  bool is_answered_by_hull(std::uint32_t node) {
    const FlatNode flat = ask_flat_node(body_, part_, node, distance_, relevant_);
    if (flat.plane == nullptr) return false;
    if (!flat.touches) return true;
    for (const std::uint32_t corner : hull_of(shell_, node)) {
      const Vec3 p = point_position(shell_, corner);
      const float area = point_area(shell_, corner) * std::max(flat.side * body_.facing(corner, *flat.plane), 0.0F);
      emit({{p, flat.side * flat.plane->normal, -flat.side * flat.plane->height(p), area, corner, leaf_of(corner)},
            corner});
    }
    remember();
    return true;
  }

  // Contacts that press less are not wanted. [m]
  float least_wanted() const noexcept {
    // A search that remembers places needs those of all contacts.
    return is_remembering() || !has_contact() ? -relevant_
                                              : std::max(-relevant_, out_.contacts[segment_.first].penetration);
  }

  void test_leaf(IndexRange points, float least) {
    LeafAtSheet leaf(body_, part_, leaf_, least);
    if (!known_.empty()) {
      for (std::uint32_t point = points.begin; point < points.end; ++point) {
        if (is_sought(point, point)) test_point(leaf, point);
      }
    } else if (!test_all_points(leaf, points)) {
      return;
    }
    if (solid_ && is_sought(shell_.points, ~0U)) test_corners(leaf);
  }

  // Tests the points side by side, with the same results.
  // @return false if the leaf has no contacts of corners either
  bool test_all_points(LeafAtSheet& leaf, IndexRange points) {
    const bool is_before = leaf.is_before_sheet();
    if (is_before && -leaf.gap() < least_wanted()) return false;
    constexpr float kNever = std::numeric_limits<float>::lowest();
    for (std::uint32_t first = points.begin; first < points.end; first += Spheres::kMost) {
      const IndexRange some{first, std::min(first + Spheres::kMost, points.end)};
      LeafPoints seen;
      leaf.look_at(some, relevant_, is_before ? least_wanted() : kNever, seen);
      for (std::uint32_t i = 0; i < seen.count; ++i) {
        const PointOverFace& one = seen.all[i];
        if (one.face == nullptr) {
          test_point(leaf, one.point);
        } else {
          emit_over_face(leaf, one);
        }
      }
    }
    return !is_before;
  }

  void test_point(LeafAtSheet& leaf, std::uint32_t point) {
    const Vec3 p = point_position(shell_, point);
    NearestPlace place;
    const Triangle* triangle = part_.face_over(p);
    if (triangle != nullptr) {
      place = triangle->below(p);
    } else {
      triangle = part_.nearest(p, part_.reach, place);
    }
    if (triangle == nullptr) return;
    if (!solid_) return test_by_normal(contact_at(point, p), point_inward_normal(shell_, point), *triangle, place);
    if (!place.on_face) return climb_from(leaf, contact_at(point, p), place.at);
    PointOverFace one;
    if (one.look(body_, point, p, *triangle, relevant_)) {
      one.side = body_.side_of(*triangle, p, one.along);
      emit_over_face(leaf, one);
    }
  }

  ManifoldContact contact_at(std::uint32_t point, Vec3 p) const noexcept {
    return {{p, {}, 0, point_area(shell_, point), point, leaf_}, point};
  }

  void emit_over_face(LeafAtSheet& leaf, const PointOverFace& one) {
    ManifoldContact contact = contact_at(one.point, one.at);
    if (one.side == 0) return climb_from(leaf, contact, one.face->below(one.at).at);
    contact.area *= std::max(one.side * one.along, 0.0F);  // projected along the direction
    emit_on_face(contact, one.side * one.face->normal, -one.side * one.height);
  }

  // Follows the sheet from near a point. Where it does not end or bend, the first of the leaf's points that need it
  // tells how deep it is.
  void climb_from(LeafAtSheet& leaf, const ManifoldContact& contact, Vec3 at) {
    if (leaf.ends_near() || (!leaf.has_climbed && leaf.meets_sheet())) climb(leaf, at, contact);
    leaf.has_climbed = true;
  }

  // @param direction  into the body at the point
  void emit_on_face(ManifoldContact contact, Vec3 direction, float penetration) {
    if (penetration < -relevant_) return;
    remember();
    if (penetration < -distance_ || is_beaten(penetration)) return;
    if (body_.is_beyond(contact.position, direction, penetration)) return;
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
    if (!(std::abs(along) > 0.5F * SolidBody::kAligned)) return;
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
  void test_corners(const LeafAtSheet& leaf) {
    for (const std::uint32_t number : part_.list) {
      const Triangle& triangle = sheets_.triangles[number];
      for (unsigned k = 0; k < 3; ++k) {
        const Vec3 away = triangle.corners[k] - leaf.centre();
        if ((sheets_.met[number] & 1U << k) != 0 || !(dot(away, away) <= leaf.extent() * leaf.extent())) continue;
        sheets_.met[number] = static_cast<std::uint8_t>(sheets_.met[number] | 1U << k);
        if (body_.penetration_at(triangle.corners[k]) < -relevant_) continue;
        ManifoldContact contact;
        contact.area = shell_.feature_covering_radius * shell_.feature_covering_radius;
        contact.point = children_of(shell_, leaf_).begin;
        contact.node = leaf_;
        contact.feature = corner_feature(shell_, triangle.id, k);
        climb(leaf, triangle.corners[k], contact);
      }
    }
  }

  // Follows the sheet into the body. If it ends or bends at the deepest place, that place is a contact. In the middle
  // of a face, the shell's points already give the contacts.
  void climb(const LeafAtSheet& leaf, Vec3 from, ManifoldContact contact) {
    const PlaceOnSheet top = leaf.climb(from);
    deepest_ = std::max(deepest_, top.penetration);
    if (top.penetration < -relevant_) return;
    remember();
    if (top.penetration < -distance_ || !leaf.is_end(top)) return;
    contact.position = top.at + top.penetration * top.out;
    contact.inward_normal = -1 * top.out;
    contact.penetration = top.penetration;
    emit(contact);
  }

  bool has_contact() const noexcept { return segment_level_ > 0 && out_.contacts.size() > segment_.first; }
  // Whether the segment has a deeper contact.
  bool is_beaten(float penetration) const noexcept {
    return has_contact() && !(penetration > out_.contacts[segment_.first].penetration);
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
  const float voxel_;
  const SolidBody body_;
  const bool solid_;
  const bool has_flat_nodes_;
  const Vec3 centre_of_mass_;
  const float distance_;
  const std::uint32_t segment_level_;
  const Pose& to_asset_;
  Sheets& sheets_;
  SheetPart part_;  // within reach of the leaf
  SheetContacts& out_;

  TriangleMemory* memory_ = nullptr;     // where places are remembered; null: nowhere
  std::span<const ContactPlace> known_;  // if not empty, no others are sought
  float relevant_ = 0;                   // contact distance, with the room for motion. [m]
  float deepest_ = 0;
  std::uint32_t leaf_ = 0;            // or a flat node whose corners are tested
  std::uint32_t top_flat_ = kNoNode;  // the topmost flat node on the way to it
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
