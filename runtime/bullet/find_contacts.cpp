// SPDX-License-Identifier: Zlib
#include "runtime/bullet/find_contacts.h"

#include <algorithm>
#include <array>
#include <type_traits>

#include "runtime/bullet/partner_field.h"
#include "runtime/penetration.h"
#include "runtime/vps_queries.h"

namespace vps::bullet {

using detail::operator-;

Workspace& Workspace::of_this_thread(const PointshellView& shell) {
  thread_local Workspace space;
  if (space.contacts.size() < shell.points) space.contacts.resize(shell.points);
  return space;
}

namespace {

// Shell points lie so far apart that the faces of an edge are told apart no better.
constexpr btScalar kAlikeFaces_vx = btScalar(0.5);

std::array<HalfSpaceField, 6> faces_of(const BoxField& box) {
  const Vec3 half = box.half_extents;
  return {{{{1, 0, 0}, half.x},
           {{-1, 0, 0}, half.x},
           {{0, 1, 0}, half.y},
           {{0, -1, 0}, half.y},
           {{0, 0, 1}, half.z},
           {{0, 0, -1}, half.z}}};
}

// Once a contact has its direction: what it presses on is its area as seen along it. Beside an edge of the field the
// shell's points are near without being about to touch: their contacts would stop a body that slides by.
// @return whether it is such a one
bool weigh(Contact& contact, Vec3 into_shell) {
  constexpr float kGrazing = 0.3F;
  const float agreement = detail::dot(contact.inward_normal, into_shell);
  contact.area *= std::max(agreement, 0.0F);
  return contact.penetration < 0 && agreement < kGrazing;
}

}  // namespace

Status find_contacts(const Pair& pair, QueryOptions options, PairMemory& memory, FoundContacts& found) {
  const PointshellView& shell = pair.shell.vps->pointshell();
  Workspace& space = Workspace::of_this_thread(shell);
  const float margin = margin_of(pair);
  const auto alike = static_cast<float>(kAlikeFaces_vx * voxel_size(pair));
  options.contact_distance += margin;
  options.cache = &memory.cache;
  const Pose shell_pose = to_pose(pair.shell.world, pair.shell.asset_frame());
  // `frame`: of the field, in its shape's.
  const auto query = [&](const auto& field, const btTransform& frame) {
    const Pose pose = relative_pose(to_pose(pair.field.world, frame), shell_pose);
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field)>, PolytopeField>) {
      if (!memory.planes.has_faces()) options.cache = nullptr;
    }
    QueryResult result;
    const Status status = traverse(shell, field, pose, options, space.scratch, space.contacts, result);
    if (status != Status::ok) return status;
    found.contacts = {space.contacts.data(), result.contacts};
    found.frame = pair.field.world * frame;
    return status;
  };
  Status status{};
  if (pair.field.vps != nullptr) {
    status = query(pair.field.vps->voxelmap(), pair.field.asset_frame());
  } else if (is_triangle_mesh(pair.field.shape->getShapeType())) {
    std::uint32_t count = 0;
    status = find_triangle_contacts(pair, options, memory.triangles, space.contacts, count);
    found.contacts = {space.contacts.data(), count};
    found.frame = pair.shell.world * pair.shell.asset_frame();
  } else {
    const btVector3 from = pair.field.world.invXform(pair.shell.world.getOrigin());
    status = on_partner(*pair.field.shape, from, memory.planes, [&](const auto& field, const btTransform& frame) {
      const Status queried = query(field, frame);
      if (queried != Status::ok) return queried;
      using Field = std::remove_cvref_t<decltype(field)>;
      const auto is_none = [&](Contact& contact) {
        const Vec3 into_shell = contact.inward_normal;
        if constexpr (std::is_same_v<Field, PolytopeField>) {
          memory.planes.finish(contact, alike);
          // The planes may have said more than there is.
          if (!(contact.penetration >= -options.contact_distance)) return true;
        } else if constexpr (std::is_same_v<Field, BoxField>) {
          if (contact.penetration < 0 || !face_shell(faces_of(field), alike, contact)) {
            contact.inward_normal = outward_normal(field, contact.position);
          }
        } else {
          contact.inward_normal = outward_normal(field, contact.position);
        }
        return weigh(contact, into_shell);
      };
      const auto last = std::remove_if(found.contacts.begin(), found.contacts.end(), is_none);
      found.contacts = {found.contacts.begin(), last};
      return queried;
    });
  }
  if (status != Status::ok) return status;
  if (margin > 0) {
    for (Contact& contact : found.contacts) contact.penetration += margin;
  }
  return status;
}

std::size_t refine(const Pair& pair, float reach, std::span<Contact> contacts) {
  if (pair.field.vps == nullptr) return contacts.size();
  const VoxelmapView& map = pair.field.vps->voxelmap();
  const float margin = margin_of(pair);
  const auto is_none = [&](Contact& contact) {
    const Vec3 into_shell = contact.inward_normal;
    // Beyond the band V and its gradient are rough.
    ClosestPoint closest;
    if (contact.penetration - margin < -0.75F * map.band_outer &&
        closest_point(map, contact.position, {}, closest) == Status::ok && closest.converged && closest.distance > 0) {
      const Vec3 away = contact.position - closest.position;
      contact.inward_normal = {away.x / closest.distance, away.y / closest.distance, away.z / closest.distance};
      contact.penetration = margin - closest.distance;
      return weigh(contact, into_shell) || contact.penetration < -reach;
    }
    const Vec3 outward = outward_normal(map, contact.position);
    if (!(detail::dot(outward, outward) > 0)) return false;
    contact.inward_normal = outward;
    contact.penetration = penetration(map, contact.position, outward) + margin;
    return weigh(contact, into_shell);
  };
  return static_cast<std::size_t>(std::remove_if(contacts.begin(), contacts.end(), is_none) - contacts.begin());
}

}  // namespace vps::bullet
