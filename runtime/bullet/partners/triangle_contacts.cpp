// SPDX-License-Identifier: Zlib
// Finds the triangle nearest to each point of the shell. The search goes down the tree of spheres with the list of the
// triangles within reach, which shrinks on the way. On flat parts of the sheet it stops at flat nodes.
#include "runtime/bullet/partners/triangle_contacts.h"

#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <algorithm>
#include <array>
#include <optional>

#include "runtime/bullet/partners/flat_nodes_on_sheet.h"

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
        solid_(body_.map.field != Field::none),
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
    descend(node, level, to);
    sheets_.lists.resize(to);
  }

  // The same for all children of a node, whose list is at `from`. Levels are few.
  void visit_children(IndexRange children, std::uint32_t level, std::size_t from) {
    const std::size_t to = sheets_.lists.size();
    const std::size_t masks = sheets_.masks.size();
    for (std::uint32_t first = children.begin; first < children.end; first += Spheres::kMost) {
      const std::uint32_t count = std::min<std::uint32_t>(children.end - first, Spheres::kMost);
      Spheres spheres;
      for (std::uint32_t k = 0; k < count; ++k) {
        spheres.set(k, centre(first + k), sphere_radius(shell_, first + k) + part_.reach);
      }
      sheets_.masks.resize(masks);
      for (std::size_t i = from; i < to; ++i) {
        sheets_.masks.push_back(within_reach(sheets_.triangles[sheets_.lists[i]], spheres));
      }
      for (std::uint32_t k = 0; k < count; ++k) {
        for (std::size_t i = from; i < to; ++i) {
          if ((sheets_.masks[masks + (i - from)] >> k & 1) != 0) sheets_.lists.push_back(sheets_.lists[i]);
        }
        descend(first + k, level, to);
        sheets_.lists.resize(to);
      }
    }
    sheets_.masks.resize(masks);
  }

  // @param to  where the node's list begins, which is the last one
  void descend(std::uint32_t node, std::uint32_t level, std::size_t to) {
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
      has_climbed_ = false;
      ends_near_.reset();
      for (std::uint32_t point = children.begin; point < children.end; ++point) {
        if (is_sought(point, point)) test_point(point);
      }
      if (solid_ && is_sought(shell_.points, ~0U)) test_corners();
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

  // Whether the sheet ends or bends within reach of the leaf.
  bool ends_near() {
    const Vec3 p = centre(leaf_);
    const float reach = sphere_radius(shell_, leaf_) + part_.reach;
    // Many slight bends are a sharp one together.
    const Vec3 normal = sheets_.triangles[part_.list.front()].normal;
    return std::any_of(part_.list.begin(), part_.list.end(), [&](std::uint32_t number) {
      const Triangle& t = sheets_.triangles[number];
      if (std::abs(dot(t.normal, normal)) < SolidBody::kFacing) return true;
      for (int k = 0; k < 3; ++k) {
        if (dot(t.side[k], p) - t.side_offset[k] <= reach && !part_.goes_on(t, k)) return true;
      }
      return false;
    });
  }

  void test_point(std::uint32_t point) {
    const Vec3 p = point_position(shell_, point);
    NearestPlace place;
    const Triangle* const triangle = part_.nearest(p, part_.reach, place);
    if (triangle == nullptr) return;
    const ManifoldContact contact{{p, {}, 0, point_area(shell_, point), point, leaf_}, point};
    if (!solid_) return test_by_normal(contact, point_inward_normal(shell_, point), *triangle, place);
    if (!place.on_face) return climb_from(contact, place.at);
    const float height = triangle->height(p);
    const float along = body_.facing(point, *triangle);
    // The most frequent case, decided without the field: a face that looks at the sheet from a distance.
    if (std::abs(along) > SolidBody::kAligned && height * along > 0 && std::abs(height) > relevant_) return;
    const float side = body_.side_of(*triangle, p, along);
    if (side == 0) return climb_from(contact, place.at);
    ManifoldContact seen = contact;
    seen.area *= std::max(side * along, 0.0F);  // projected along the direction
    emit_on_face(seen, side * triangle->normal, -side * height);
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
    return std::any_of(part_.list.begin(), part_.list.end(),
                       [&](std::uint32_t number) { return sheets_.triangles[number].is_within(centre(leaf_), near); });
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
  void test_corners() {
    const float near = sphere_radius(shell_, leaf_) + shell_.covering_radius;
    for (const std::uint32_t number : part_.list) {
      const Triangle& triangle = sheets_.triangles[number];
      for (unsigned k = 0; k < 3; ++k) {
        const Vec3 away = triangle.corners[k] - centre(leaf_);
        if ((sheets_.met[number] & 1U << k) != 0 || !(dot(away, away) <= near * near)) continue;
        sheets_.met[number] = static_cast<std::uint8_t>(sheets_.met[number] | 1U << k);
        if (body_.penetration_at(triangle.corners[k]) < -relevant_) continue;
        ManifoldContact contact;
        contact.area = shell_.feature_covering_radius * shell_.feature_covering_radius;
        contact.point = children_of(shell_, leaf_).begin;
        contact.node = leaf_;
        contact.feature = corner_feature(shell_, triangle.id, k);
        climb(triangle.corners[k], contact);
      }
    }
  }

  // Follows the sheet into the body while it gets deeper. If the sheet ends or bends there, that place is a contact. In
  // the middle of a face, the shell's points already give the contacts.
  void climb(Vec3 at, ManifoldContact contact) {
    float v = body_.penetration_at(at);
    Vec3 out = outward_normal(body_.map, at);
    const float gain = 0.02F * voxel_;
    float step = voxel_;
    NearestPlace place;
    for (int i = 0; i < 16 && step > 0.1F * voxel_ && dot(out, out) > 0; ++i) {
      const bool found = part_.nearest(at - step * out, 2 * step, place) != nullptr;
      const float there = found ? body_.penetration_at(place.at) : v;
      if (!(there > v + gain)) {
        step /= 2;
        continue;
      }
      at = place.at;
      v = there;
      out = outward_normal(body_.map, at);
    }
    deepest_ = std::max(deepest_, v);
    if (v < -relevant_) return;
    remember();
    if (v < -distance_ || !(dot(out, out) > 0)) return;
    const Triangle* const triangle = part_.nearest(at, voxel_, place);
    if (triangle == nullptr) return;
    const float across = dot(triangle->normal, out);
    constexpr float kFlat = 0.9F;
    if (!(std::abs(across) < kFlat)) return;
    const Vec3 along = across * triangle->normal - out;
    const Vec3 next = at + (voxel_ / length(along)) * along;
    if (part_.nearest(next, 0.3F * voxel_, place) != nullptr) return;  // the sheet continues
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
  bool has_climbed_ = false;          // from one of the leaf's points
  std::optional<bool> ends_near_;
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
