// SPDX-License-Identifier: Zlib
// What the triangles near a leaf can be for it, told from the sphere round its points.
#include "runtime/bullet/partners/leaf_at_sheet.h"

#include <algorithm>

#include "runtime/fields/placed_field.h"

namespace vps::bullet {

using namespace detail;

bool PointOverFace::look(const SolidBody& body, std::uint32_t number, Vec3 p, const Triangle& triangle,
                         float relevant) noexcept {
  point = number;
  at = p;
  face = &triangle;
  height = triangle.height(p);
  along = body.facing(number, triangle);
  return !(std::abs(along) > SolidBody::kAligned && height * along > 0 && std::abs(height) > relevant);
}

void LeafAtSheet::look_at(IndexRange points, float relevant, float wanted, LeafPoints& out) const {
  const std::uint32_t count = points.end - points.begin;
  Spheres places;
  for (std::uint32_t k = 0; k < count; ++k) places.set(k, point_position(body_.shell, points.begin + k), 0);
  NearestFaces nearest;
  find_nearest_faces(part_.sheets.triangles.data(), part_.list, places, part_.reach, nearest);
  Places sides;
  for (std::uint32_t k = 0; k < count; ++k) {
    if (nearest.number[k] == NearestFaces::kNone || -(1 - kRounding) * std::sqrt(nearest.squared[k]) < wanted) continue;
    PointOverFace& one = out.all[out.count];
    if (nearest.beyond[k] > 0 || !body_.has_field()) {
      one.point = points.begin + k;
      one.face = nullptr;
    } else {
      const Vec3 p{places.x[k], places.y[k], places.z[k]};
      const Triangle& triangle = part_.sheets.triangles[nearest.number[k]];
      if (!one.look(body_, points.begin + k, p, triangle, relevant)) continue;
      if (has_samples() && SolidBody::needs_sides(one.along)) {
        sides.push(p + body_.voxel * triangle.normal);
        sides.push(p - body_.voxel * triangle.normal);
      }
    }
    ++out.count;
  }
  Values v;
  if (sides.count > 0) PlacedField(body_.map, Pose()).penetrations(sides, v);
  for (std::uint32_t i = 0, at = 0; i < out.count; ++i) {
    PointOverFace& one = out.all[i];
    if (one.face == nullptr) continue;
    if (has_samples() && SolidBody::needs_sides(one.along)) {
      const float above = v[at++];
      const float below = v[at++];
      if (body_.are_clear(above, below)) {
        one.side = body_.side_between(above, below);
        continue;
      }
    }
    one.side = body_.side_of(*one.face, one.at, one.along);
  }
}

bool LeafAtSheet::ends_near() {
  const auto ends = [this] {
    const float reach = radius_ + part_.reach;
    // Many slight bends are a sharp one together.
    const Vec3 normal = part_.sheets.triangles[part_.list.front()].normal;
    return std::any_of(part_.list.begin(), part_.list.end(), [&](std::uint32_t number) {
      const Triangle& t = part_.sheets.triangles[number];
      if (std::abs(dot(t.normal, normal)) < SolidBody::kFacing) return true;
      for (int k = 0; k < 3; ++k) {
        if (dot(t.side[k], centre_) - t.side_offset[k] <= reach && !part_.goes_on(t, k)) return true;
      }
      return false;
    });
  };
  if (!ends_near_) ends_near_ = ends();
  return *ends_near_;
}

bool LeafAtSheet::meets_sheet() const noexcept {
  return std::any_of(part_.list.begin(), part_.list.end(),
                     [&](std::uint32_t number) { return part_.sheets.triangles[number].is_within(centre_, extent()); });
}

bool LeafAtSheet::is_before_sheet() {
  if (!has_samples()) return false;
  const float outside = SolidBody::kOutside_vx * body_.voxel;
  if (!(gap() > std::max(body_.shell.covering_radius, outside)) || ends_near()) return false;
  // V of the true surface where a point seen in a triangle's plane as in a mirror is surely outside. [m]
  const float farthest = -(outside + field_error(body_.map) + (1 + kRounding) * radius_);
  std::optional<Vec3> asked;
  float there = 0;
  return std::all_of(part_.list.begin(), part_.list.end(), [&](std::uint32_t number) {
    const Triangle& t = part_.sheets.triangles[number];
    const Vec3 mirrored = centre_ - 2 * t.height(centre_) * t.normal;
    // Triangles of one plane have one answer.
    if (asked && there + length(mirrored - *asked) < farthest) return true;
    asked = mirrored;
    there = penetration_bound(body_.map, mirrored);
    return there < farthest;
  });
}

PlaceOnSheet LeafAtSheet::climb(Vec3 from) const {
  const auto place_at = [&](Vec3 p, float penetration) {
    return PlaceOnSheet{p, penetration, outward_normal(body_.map, p)};
  };
  PlaceOnSheet top = place_at(from, body_.penetration_at(from));
  const float gain = 0.02F * body_.voxel;
  float step = body_.voxel;
  for (int i = 0; i < 16 && step > 0.1F * body_.voxel && dot(top.out, top.out) > 0; ++i) {
    NearestPlace next;
    const bool found = part_.nearest(top.at - step * top.out, 2 * step, next) != nullptr;
    const float there = found ? body_.penetration_at(next.at) : top.penetration;
    if (there > top.penetration + gain) {
      top = place_at(next.at, there);
    } else {
      step /= 2;
    }
  }
  return top;
}

bool LeafAtSheet::is_end(const PlaceOnSheet& place) const {
  if (!(dot(place.out, place.out) > 0)) return false;
  NearestPlace found;
  const Triangle* const triangle = part_.nearest(place.at, body_.voxel, found);
  if (triangle == nullptr) return false;
  const float across = dot(triangle->normal, place.out);
  constexpr float kFlat = 0.9F;
  if (!(std::abs(across) < kFlat)) return false;
  const Vec3 deeper = across * triangle->normal - place.out;
  return !has_sheet_within(0.3F * body_.voxel, place.at + (body_.voxel / length(deeper)) * deeper);
}

bool LeafAtSheet::has_sheet_within(float near, Vec3 place) const {
  NearestPlace found;
  if (part_.nearest(place, near, found) != nullptr) return true;
  // The list ends with the leaf's reach.
  if (length(place - centre_) + near < radius_ + part_.reach) return false;
  const std::vector<Triangle>& all = part_.sheets.triangles;
  return std::any_of(all.begin(), all.end(), [&](const Triangle& t) {
    return t.is_within(place, near) && t.nearest(place).squared < near * near;
  });
}

}  // namespace vps::bullet
