// SPDX-License-Identifier: Zlib
#include "runtime/bullet/find_contacts.h"

#include <algorithm>
#include <type_traits>

#include "runtime/bullet/partner_field.h"
#include "runtime/penetration.h"

namespace vps::bullet {

Workspace& Workspace::of_this_thread(const PointshellView& shell) {
  thread_local Workspace space;
  if (space.contacts.size() < shell.points) space.contacts.resize(shell.points);
  return space;
}

Status find_contacts(const Pair& pair, QueryOptions options, PairMemory& memory, FoundContacts& found) {
  const PointshellView& shell = pair.shell.vps->pointshell();
  Workspace& space = Workspace::of_this_thread(shell);
  const float margin = margin_of(pair);
  options.contact_distance += margin;
  options.cache = &memory.cache;
  const Pose shell_pose = to_pose(pair.shell.world, pair.shell.asset_frame());
  // `frame`: of the field, in its shape's.
  const auto query = [&](const auto& field, const btTransform& frame) {
    const Pose pose = relative_pose(to_pose(pair.field.world, frame), shell_pose);
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
  } else {
    status = on_partner(*pair.field.shape, memory.planes, [&](const auto& field, const btTransform& frame) {
      const Status queried = query(field, frame);
      if (queried != Status::ok) return queried;
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field)>, PolytopeField>) {
        const auto& convex = static_cast<const btConvexShape&>(*pair.field.shape);
        for (Contact& contact : found.contacts) make_exact(convex, field, contact);
        const auto last = std::remove_if(found.contacts.begin(), found.contacts.end(), [&](const Contact& contact) {
          return !(contact.penetration >= -options.contact_distance);
        });
        found.contacts = {found.contacts.begin(), last};
      } else {
        for (Contact& contact : found.contacts) contact.inward_normal = outward_normal(field, contact.position);
      }
      return queried;
    });
  }
  if (status != Status::ok) return status;
  if (margin > 0) {
    for (Contact& contact : found.contacts) contact.penetration += margin;
  }
  return status;
}

Contact refined(const Pair& pair, Contact contact) {
  if (pair.field.vps == nullptr) return contact;
  const VoxelmapView& map = pair.field.vps->voxelmap();
  const Vec3 outward = outward_normal(map, contact.position);
  if (detail::dot(outward, outward) > 0) {
    contact.inward_normal = outward;
    contact.penetration = penetration(map, contact.position, outward) + margin_of(pair);
  }
  return contact;
}

}  // namespace vps::bullet
