// SPDX-License-Identifier: Zlib
// The collision functions for meshes in MuJoCo's table. Only this file knows the table and mjContact, which newer
// versions change: docs/mujoco.md.
#include "runtime/mujoco/collide.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <shared_mutex>

namespace vps::mujoco {
namespace {

// MuJoCo's own functions for a mesh with each type of geom.
std::array<mjfCollision, mjNGEOMTYPES> stock{};

// All models. A thread asks again only after a change: most calls are for the model of the last one.
class Registry {
 public:
  bool add(const mjModel* model, const Meshes* meshes) {
    const std::unique_lock lock(mutex_);
    ++changes_;
    return models_.emplace(model, meshes).second;
  }
  void remove(const mjModel* model) {
    const std::unique_lock lock(mutex_);
    ++changes_;
    models_.erase(model);
  }
  const Meshes* find(const mjModel* model) {
    thread_local const mjModel* last = nullptr;
    thread_local const Meshes* found = nullptr;
    thread_local std::uint64_t seen = 0;
    const std::uint64_t now = changes_.load();
    if (last == model && seen == now) return found;
    const std::shared_lock lock(mutex_);
    const auto at = models_.find(model);
    last = model;
    seen = now;
    found = at == models_.end() ? nullptr : at->second;
    return found;
  }

 private:
  std::shared_mutex mutex_;
  std::map<const mjModel*, const Meshes*> models_;
  std::atomic<std::uint64_t> changes_{1};
};
Registry registry;

Pose pose_of(const mjData& data, int geom) {
  Pose pose;
  std::copy_n(data.geom_xmat + 9 * geom, 9, pose.rotation);
  std::copy_n(data.geom_xpos + 3 * geom, 3, pose.translation);
  return pose;
}

const BakedMesh* baked_mesh(const mjModel& model, const Meshes& meshes, int geom) {
  if (model.geom_type[geom] != mjGEOM_MESH) return nullptr;
  const BakedMesh& mesh = meshes.baked[static_cast<std::size_t>(model.geom_dataid[geom])];
  return mesh.asset != nullptr ? &mesh : nullptr;
}

// Calls run(StepBody) with a geom. @return what it returns; -1 for geoms that are no fields
template <class Run>
int with_body(const mjModel& model, const mjData& data, const Meshes& meshes, int geom, const Run& run) {
  const Pose pose = pose_of(data, geom);
  if (const BakedMesh* const mesh = baked_mesh(model, meshes, geom); mesh != nullptr) {
    return run(StepBody{mesh->map, compose(pose, mesh->asset_in_geom), &mesh->shell});
  }
  const auto size = [&](int i) { return static_cast<float>(model.geom_size[3 * geom + i]); };
  switch (model.geom_type[geom]) {
    case mjGEOM_PLANE:
      return run(StepBody{HalfSpaceField{}, pose});
    case mjGEOM_SPHERE:
      return run(StepBody{SphereField{size(0)}, pose});
    case mjGEOM_CAPSULE:
      return run(StepBody{RevolvedField{RevolvedField::Profile::capsule, size(0), size(1), 0}, pose});
    case mjGEOM_CYLINDER:
      return run(StepBody{RevolvedField{RevolvedField::Profile::cylinder, size(0), size(1), 0}, pose});
    case mjGEOM_BOX:
      return run(StepBody{BoxField{{size(0), size(1), size(2)}}, pose});
    case mjGEOM_MESH: {
      const std::vector<HalfSpaceField>& planes = meshes.hulls[static_cast<std::size_t>(model.geom_dataid[geom])];
      return planes.empty() ? -1 : run(StepBody{PolytopeField{planes}, pose});
    }
    default:
      return -1;
  }
}

// Their normals go from the first geom to the second; depths are negative. mj_collideGeoms completes the frames.
void write(const StepContact& from, mjContact& to) {
  to.dist = -mjtNum(from.penetration);
  std::copy_n(from.position, 3, to.pos);
  to.frame[0] = mjtNum(from.normal.x);
  to.frame[1] = mjtNum(from.normal.y);
  to.frame[2] = mjtNum(from.normal.z);
  mju_normalize3(to.frame);
  mju_zero3(to.frame + 3);
}

int collide(const mjModel* model, const mjData* data, mjContact* contacts, int first, int second, mjtNum margin) {
  const Meshes* const meshes = registry.find(model);
  const BakedMesh* const a = meshes != nullptr ? baked_mesh(*model, *meshes, first) : nullptr;
  const BakedMesh* const b = meshes != nullptr ? baked_mesh(*model, *meshes, second) : nullptr;
  const auto as_hulls = [&] {
    return stock[static_cast<std::size_t>(model->geom_type[first])](model, data, contacts, first, second, margin);
  };
  if (a == nullptr && b == nullptr) return as_hulls();
  const BakedMesh& leader = a == nullptr || (b != nullptr && b->contacts > a->contacts) ? *b : *a;
  const StepOptions options{static_cast<float>(std::max(margin, mjtNum(0))), leader.use};
  const int count = with_body(*model, *data, *meshes, first, [&](const StepBody& of_first) {
    return with_body(*model, *data, *meshes, second, [&](const StepBody& of_second) {
      thread_local StepScratch scratch;
      std::array<StepContact, mjMAXCONPAIR> room;
      std::span<StepContact> found(room.data(), static_cast<std::size_t>(leader.contacts));
      // Into the second geom.
      const Status status = step_contacts(of_second, of_first, options, scratch, found);
      // Poses that are no numbers are MuJoCo's to report.
      if (status != Status::ok && status != Status::bad_pose) mju_warning(describe(status));
      for (const StepContact& contact : found) write(contact, *contacts++);
      return static_cast<int>(found.size());
    });
  });
  return count < 0 ? as_hulls() : count;
}

void install() {
  static const bool installed = [] {
    for (std::size_t type = 0; type < mjNGEOMTYPES; ++type) {
      stock[type] = mjCOLLISIONFUNC[type][mjGEOM_MESH];
      if (stock[type] != nullptr) mjCOLLISIONFUNC[type][mjGEOM_MESH] = collide;
    }
    return true;
  }();
  (void)installed;
}

}  // namespace

bool add_meshes(const mjModel& model, const Meshes& meshes) {
  install();
  return registry.add(&model, &meshes);
}

void remove_meshes(const mjModel& model) {
  registry.remove(&model);
}

}  // namespace vps::mujoco
