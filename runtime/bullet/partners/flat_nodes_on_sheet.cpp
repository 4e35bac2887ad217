// SPDX-License-Identifier: Zlib
// A flat node of the shell on a flat part of the sheet: either all corners of its hull are contacts, or no point is
// one.
#include "runtime/bullet/partners/flat_nodes_on_sheet.h"

#include <algorithm>

namespace vps::bullet {
namespace {

using namespace detail;

// Of flat nodes and of flat parts of the sheet. [m]
float flat_tolerance(const PointshellView& shell) noexcept {
  return static_cast<float>(kHullTolerance) * shell.feature_covering_radius;
}

// Whether the sheet lies below a point: if no end of it is near, it does so below all.
bool is_over_sheet(const SolidBody& body, const SheetPart& part, std::uint32_t point) noexcept {
  NearestPlace place;
  return part.nearest(point_position(body.shell, point), part.reach, place) != nullptr && place.on_face;
}

// Whether the sheet is a plane within some reach of a flat node's hull, and does not end there.
bool is_plane_near(const SolidBody& body, const SheetPart& part, const Triangle& plane, std::uint32_t node,
                   float reach) {
  const PointshellView& shell = body.shell;
  const Vec3 middle = sphere_centre(shell, node);
  const float radius = sphere_radius(shell, node) + reach;
  if (!plane.is_within(middle, radius)) return false;
  Box box;
  for (const std::uint32_t corner : hull_of(shell, node)) box.add(point_position(shell, corner), reach);
  return std::all_of(part.list.begin(), part.list.end(), [&](std::uint32_t number) {
    const Triangle& t = part.sheets.triangles[number];
    if (!t.is_within(middle, radius)) return true;
    const float same = dot(t.normal, plane.normal) < 0 ? -1 : 1;
    const float apart = std::abs(same * t.height(middle) - plane.height(middle));
    const float bent = radius * length(same * t.normal - plane.normal);
    if (!(apart + bent <= flat_tolerance(shell))) return false;
    for (int k = 0; k < 3; ++k) {
      if (box.meets(t.corners[k], t.corners[(k + 1) % 3]) && !part.goes_on(t, k)) return false;
    }
    return true;
  });
}

}  // namespace

FlatNode ask_flat_node(const SolidBody& body, const SheetPart& part, std::uint32_t node, float distance,
                       float relevant) {
  const PointshellView& shell = body.shell;
  NearestPlace place;
  const Triangle* const plane =
      part.nearest(sphere_centre(shell, node), sphere_radius(shell, node) + part.reach, place);
  if (plane == nullptr) return {};
  const std::span corners = hull_of(shell, node);
  float deepest = std::numeric_limits<float>::lowest();
  float shallowest = std::numeric_limits<float>::max();
  float side = 0;
  for (const std::uint32_t corner : corners) {
    const Vec3 p = point_position(shell, corner);
    const float of_corner = body.side_of(*plane, p, body.facing(corner, *plane));
    if (side == 0) side = of_corner;
    if (of_corner == 0 || of_corner != side) return {};
    const float v = -side * plane->height(p);
    deepest = std::max(deepest, v);
    shallowest = std::min(shallowest, v);
    if (!(shallowest >= -distance || deepest + 4 * flat_tolerance(shell) < -relevant)) return {};
  }
  const bool touches = shallowest >= -distance;
  const float reach = touches ? std::max({shell.covering_radius, deepest, -shallowest}) : part.reach;
  if (!(deepest <= part.reach) || !is_over_sheet(body, part, corners.front()) ||
      !is_plane_near(body, part, *plane, node, reach)) {
    return {};
  }
  const auto is_none = [&](std::uint32_t corner) {
    const Vec3 p = point_position(shell, corner);
    return body.is_beyond(p, side * plane->normal, -side * plane->height(p));
  };
  if (touches && std::any_of(corners.begin(), corners.end(), is_none)) return {};
  return {plane, side, touches};
}

}  // namespace vps::bullet
