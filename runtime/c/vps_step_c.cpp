// SPDX-License-Identifier: Zlib
// The C interface to step_contacts: checks arguments, converts, forwards.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <type_traits>

#include "runtime/c/vps_c.h"

namespace {

using namespace vps::c;

static_assert(vps_step_springs == static_cast<int>(vps::StepUse::springs));
// Contacts are copied as bytes.
static_assert(std::is_trivially_copyable_v<vps::StepContact> && sizeof(VpsStepContact) == sizeof(vps::StepContact));
static_assert(offsetof(VpsStepContact, normal) == offsetof(vps::StepContact, normal));
static_assert(offsetof(VpsStepContact, penetration) == offsetof(vps::StepContact, penetration));
static_assert(offsetof(VpsStepContact, area) == offsetof(vps::StepContact, area));
static_assert(offsetof(VpsStepContact, feature) == offsetof(vps::StepContact, feature));

vps::StepMotion to_motion(const VpsStepMotion& from) {
  vps::StepMotion motion;
  std::copy_n(from.centre, 3, motion.centre);
  motion.way = to_vec3(from.way);
  motion.turn = to_vec3(from.turn);
  motion.fall = to_vec3(from.fall);
  motion.radius = from.radius;
  motion.yields = from.yields != 0;
  return motion;
}

// Calls run(vps::StepBody).
template <class Run>
VpsStatus with_body(const VpsStepBody& body, const Run& run) {
  const vps::PointshellView* const shell = body.shell != nullptr ? &body.shell->view : nullptr;
  vps::StepMotion of_body;
  if (body.motion != nullptr) {
    const VpsStepMotion& given = *body.motion;
    const double* const centre = given.centre;
    if (!is_in_range(centre[0]) || !is_in_range(centre[1]) || !is_in_range(centre[2]) || !is_in_range(given.way) ||
        !is_in_range(given.turn) || !is_in_range(given.fall) || !(given.radius >= 0 && given.radius <= kFarthest)) {
      return vps_bad_argument;
    }
    of_body = to_motion(given);
  }
  const vps::StepMotion* const motion = body.motion != nullptr ? &of_body : nullptr;
  if (body.field.kind == vps_kind_map && body.field.field == nullptr && shell != nullptr) {
    return run(vps::StepBody{vps::VoxelmapView(), to_pose(body.pose), shell, motion});
  }
  return with_field(body.field, [&](vps::FieldRef field) {
    return run(vps::StepBody{field, to_pose(body.pose), shell, motion});
  });
}

}  // namespace

VpsStatus vps_step_memory_create(VpsStepMemory** memory) {
  if (memory == nullptr) return vps_bad_argument;
  *memory = new (std::nothrow) VpsStepMemory;
  return *memory == nullptr ? vps_no_memory : vps_ok;
}

VpsStatus vps_step_memory_destroy(VpsStepMemory* memory) {
  delete memory;
  return vps_ok;
}

VpsStatus vps_step_contacts(const VpsStepBody* first, const VpsStepBody* second, const VpsStepOptions* options,
                            VpsScratch* scratch, VpsStepContact* contacts, size_t capacity, size_t* count) {
  if (first == nullptr || second == nullptr || scratch == nullptr || contacts == nullptr || count == nullptr) {
    return vps_bad_argument;
  }
  const VpsStepOptions given = options == nullptr ? VpsStepOptions{} : *options;
  if (given.use < vps_step_constraints || given.use > vps_step_springs) return vps_bad_argument;
  if (!is_in_range(given.distance)) return vps_bad_argument;
  vps::StepOptions query;
  query.distance = given.distance;
  query.use = static_cast<vps::StepUse>(given.use);
  if (given.memory != nullptr) query.memory = &given.memory->memory;
  std::vector<vps::StepContact>& room = scratch->step_contacts;
  const VpsStatus grown = or_no_memory([&] { room.resize(std::min(capacity, kMostStepContacts)); });
  if (grown != vps_ok) return grown;
  return with_body(*first, [&](const vps::StepBody& a) {
    return with_body(*second, [&](const vps::StepBody& b) {
      std::span<vps::StepContact> found = room;
      const vps::Status status = vps::step_contacts(a, b, query, scratch->step, found);
      if (status != vps::Status::ok) return to_c(status);
      if (!found.empty()) std::memcpy(contacts, found.data(), found.size() * sizeof(VpsStepContact));
      *count = found.size();
      return VpsStatus{vps_ok};
    });
  });
}
