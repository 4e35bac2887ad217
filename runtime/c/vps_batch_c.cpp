// SPDX-License-Identifier: Zlib
// Batches of the C interface: the single calls for every element of the caller's arrays, over threads.
#include <atomic>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <new>

#include "runtime/c/vps_c.h"

struct VpsBatch {
  struct Worker {
    VpsScratch scratch;
    size_t refused = 0;  // first element that it refused
    VpsStatus status = vps_ok;
  };
  vps::Executor executor;
  std::vector<Worker> workers;
  size_t refused = 0;
};

namespace {

using namespace vps::c;

struct Triple {
  float values[3];
};

// Elements are copied as bytes, because arrays may have any alignment.
template <class T>
T read(VpsConstArray array, size_t i) {
  T value;
  std::memcpy(&value, static_cast<const char*>(array.first) + static_cast<ptrdiff_t>(i) * array.stride, sizeof(T));
  return value;
}
void* element(VpsArray array, size_t i) {
  return static_cast<char*>(array.first) + static_cast<ptrdiff_t>(i) * array.stride;
}

bool is_input(VpsConstArray array, size_t count) {
  return array.first != nullptr || count == 0;
}
bool is_output(VpsArray array, size_t count, size_t element_bytes) {
  if (array.first == nullptr) return count == 0;
  const auto bytes = static_cast<ptrdiff_t>(element_bytes);
  return count <= 1 || array.stride >= bytes || array.stride <= -bytes;
}

// The elements of a batch, which its workers share in blocks.
template <class Answer>
struct Work {
  const Answer& answer;
  size_t count, block;
  std::vector<VpsBatch::Worker>& workers;
  std::atomic<size_t> next{0};

  static void run(void* work, std::uint32_t worker) {
    static_cast<Work*>(work)->run(static_cast<Work*>(work)->workers[worker]);
  }
  void run(VpsBatch::Worker& worker) {
    for (size_t at = next.fetch_add(block); at < count; at = next.fetch_add(block)) {
      for (size_t i = at; i < std::min(at + block, count); ++i) {
        const VpsStatus status = answer(i, worker.scratch);
        if (status == vps_ok || worker.refused < count) continue;
        worker.status = status;
        if (status != vps_output_full) worker.refused = i;
      }
    }
  }
};

// Calls answer(i, scratch) for every element.
// @param block  elements that a worker takes at once
template <class Answer>
VpsStatus answer_all(VpsBatch& batch, size_t count, size_t block, const Answer& answer) {
  Work<Answer> work{answer, count, block, batch.workers};
  const size_t blocks = count / block + 1;
  const auto workers = static_cast<std::uint32_t>(std::min<size_t>(batch.workers.size(), blocks));
  for (VpsBatch::Worker& worker : batch.workers) worker.refused = count, worker.status = vps_ok;
  if (workers == 1) {
    work.run(batch.workers.front());
  } else {
    batch.executor.run(batch.executor.context, workers, Work<Answer>::run, &work);
  }
  batch.refused = count;
  VpsStatus status = vps_ok;
  for (const VpsBatch::Worker& worker : batch.workers) {
    if (worker.refused < batch.refused || (worker.status != vps_ok && status == vps_ok)) status = worker.status;
    batch.refused = std::min(batch.refused, worker.refused);
  }
  return status;
}

// For queries of a point: some microseconds of work.
constexpr size_t kPoints = 1024;
// For queries of a pose.
constexpr size_t kPoses = 8;

}  // namespace

VpsStatus vps_batch_create(uint32_t threads, VpsBatch** batch) {
  if (batch == nullptr) return vps_bad_argument;
  *batch = nullptr;
  if (threads > 1024) return vps_bad_argument;
  try {
    auto created = std::make_unique<VpsBatch>();
    created->executor = vps::thread_executor(threads);
    created->workers.resize(created->executor.workers);
    *batch = created.release();
  } catch (const std::bad_alloc&) {
    return vps_no_memory;
  }
  return vps_ok;
}

VpsStatus vps_batch_destroy(VpsBatch* batch) {
  delete batch;
  return vps_ok;
}

VpsStatus vps_batch_refused(const VpsBatch* batch, size_t* index) {
  if (batch == nullptr || index == nullptr) return vps_bad_argument;
  *index = batch->refused;
  return vps_ok;
}

VpsStatus vps_penetration_batch(VpsBatch* batch, VpsFieldRef field, size_t count, VpsConstArray points,
                                VpsConstArray inward_normals, VpsArray penetrations) {
  if (batch == nullptr || !is_input(points, count) || !is_output(penetrations, count, sizeof(float))) {
    return vps_bad_argument;
  }
  return with_field(field, [&](vps::FieldRef ref) -> VpsStatus {
    const vps::VoxelmapView* const map = ref.voxelmap();
    const bool needs_normals = map != nullptr && map->field == vps::Field::layers;
    if (needs_normals && !is_input(inward_normals, count)) return vps_bad_argument;
    return answer_all(*batch, count, kPoints, [&](size_t i, VpsScratch&) -> VpsStatus {
      const auto point = read<Triple>(points, i);
      const auto normal = needs_normals ? read<Triple>(inward_normals, i) : Triple{};
      if (!is_in_range(point.values) || !is_in_range(normal.values)) return vps_bad_argument;
      const float v = vps::penetration(ref, to_vec3(point.values), to_vec3(normal.values));
      std::memcpy(element(penetrations, i), &v, sizeof(v));
      return vps_ok;
    });
  });
}

VpsStatus vps_outward_normal_batch(VpsBatch* batch, VpsFieldRef field, size_t count, VpsConstArray points,
                                   VpsArray normals) {
  if (batch == nullptr || !is_input(points, count) || !is_output(normals, count, sizeof(Triple))) {
    return vps_bad_argument;
  }
  return with_field(field, [&](vps::FieldRef ref) {
    return answer_all(*batch, count, kPoints, [&](size_t i, VpsScratch&) -> VpsStatus {
      const auto point = read<Triple>(points, i);
      if (!is_in_range(point.values)) return vps_bad_argument;
      Triple normal;
      copy(vps::outward_normal(ref, to_vec3(point.values)), normal.values);
      std::memcpy(element(normals, i), &normal, sizeof(normal));
      return vps_ok;
    });
  });
}

VpsStatus vps_closest_point_batch(VpsBatch* batch, const VpsVoxelmap* map, size_t count, VpsConstArray points,
                                  const VpsClosestPointOptions* options, VpsArray results) {
  if (batch == nullptr || map == nullptr || !is_input(points, count) ||
      !is_output(results, count, sizeof(VpsClosestPoint))) {
    return vps_bad_argument;
  }
  return answer_all(*batch, count, kPoints, [&](size_t i, VpsScratch&) {
    VpsClosestPoint result{};
    const VpsStatus status = vps_closest_point(map, read<Triple>(points, i).values, options, &result);
    if (status == vps_ok) std::memcpy(element(results, i), &result, sizeof(result));
    return status;
  });
}

VpsStatus vps_cast_ray_batch(VpsBatch* batch, const VpsVoxelmap* map, size_t count, const VpsRays* rays,
                             float tolerance_vx, VpsArray hits) {
  if (batch == nullptr || map == nullptr || rays == nullptr || !is_input(rays->origins, count) ||
      !is_input(rays->directions, count) || !is_output(hits, count, sizeof(VpsRayHit))) {
    return vps_bad_argument;
  }
  return answer_all(*batch, count, kPoints, [&](size_t i, VpsScratch&) {
    VpsRay ray{{}, {}, std::numeric_limits<float>::infinity()};
    std::memcpy(ray.origin, read<Triple>(rays->origins, i).values, sizeof(ray.origin));
    std::memcpy(ray.direction, read<Triple>(rays->directions, i).values, sizeof(ray.direction));
    if (rays->max_distances.first != nullptr) ray.max_distance = read<float>(rays->max_distances, i);
    VpsRayHit hit{};
    const VpsStatus status = vps_cast_ray(map, &ray, tolerance_vx, &hit);
    if (status == vps_ok) std::memcpy(element(hits, i), &hit, sizeof(hit));
    return status;
  });
}

VpsStatus vps_separation_batch(VpsBatch* batch, const VpsPointshell* shell, VpsFieldRef field, size_t count,
                               VpsConstArray poses, const VpsSeparationOptions* options, VpsArray results) {
  if (batch == nullptr || shell == nullptr || !is_input(poses, count) ||
      !is_output(results, count, sizeof(VpsSeparation))) {
    return vps_bad_argument;
  }
  return answer_all(*batch, count, kPoses, [&](size_t i, VpsScratch& scratch) {
    const auto pose = read<VpsPose>(poses, i);
    VpsSeparation result{};
    const VpsStatus status = vps_separation(shell, field, &pose, options, &scratch, &result);
    if (status == vps_ok) std::memcpy(element(results, i), &result, sizeof(result));
    return status;
  });
}

VpsStatus vps_traverse_batch(VpsBatch* batch, const VpsPointshell* shell, VpsFieldRef field, size_t count,
                             VpsConstArray poses, const VpsQueryOptions* options, VpsArray contacts, size_t capacity,
                             VpsArray results) {
  constexpr auto kAlignment = static_cast<std::uintptr_t>(alignof(VpsContact));
  const bool has_room = capacity <= PTRDIFF_MAX / sizeof(VpsContact) &&
                        is_output(contacts, capacity == 0 ? 0 : count, capacity * sizeof(VpsContact)) &&
                        reinterpret_cast<std::uintptr_t>(contacts.first) % kAlignment == 0 &&
                        static_cast<std::uintptr_t>(contacts.stride) % kAlignment == 0;
  if (batch == nullptr || shell == nullptr || !is_input(poses, count) || !has_room ||
      !is_output(results, count, sizeof(VpsQueryResult)) || (options != nullptr && options->cache != nullptr)) {
    return vps_bad_argument;
  }
  return answer_all(*batch, count, kPoses, [&](size_t i, VpsScratch& scratch) {
    const auto pose = read<VpsPose>(poses, i);
    auto* const out = capacity == 0 ? nullptr : static_cast<VpsContact*>(element(contacts, i));
    VpsQueryResult result{};
    const VpsStatus status = vps_traverse(shell, field, &pose, options, &scratch, out, capacity, &result);
    if (status == vps_ok || status == vps_output_full) std::memcpy(element(results, i), &result, sizeof(result));
    return status;
  });
}

VpsStatus vps_step_contacts_batch(VpsBatch* batch, const VpsStepBody* first, const VpsStepBody* second, size_t count,
                                  VpsConstArray poses, const VpsStepOptions* options, VpsArray contacts,
                                  size_t capacity, VpsArray counts) {
  if (batch == nullptr || first == nullptr || capacity == 0 || capacity > kMostStepContacts ||
      !is_input(poses, count) || !is_output(contacts, count, capacity * sizeof(VpsStepContact)) ||
      !is_output(counts, count, sizeof(uint32_t)) || (options != nullptr && options->memory != nullptr)) {
    return vps_bad_argument;
  }
  return answer_all(*batch, count, kPoses, [&](size_t i, VpsScratch& scratch) {
    VpsStepBody moved = *first;
    moved.pose = read<VpsPose>(poses, i);
    auto* const out = static_cast<VpsStepContact*>(element(contacts, i));
    size_t found = 0;
    const VpsStatus status = vps_step_contacts(&moved, second, options, &scratch, out, capacity, &found);
    const auto written = static_cast<uint32_t>(found);
    if (status == vps_ok) std::memcpy(element(counts, i), &written, sizeof(written));
    return status;
  });
}
