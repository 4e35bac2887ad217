// SPDX-License-Identifier: GPL-3.0-or-later
// Batches of the C interface answer as the single calls do.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <vector>

#include "runtime/vps.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr std::size_t kCount = 3000;  // more than two blocks of points
const float kUp[3] = {0, 0, 1};

struct Torus {
  std::shared_ptr<Asset> bytes = baked(make_torus(0.04, 0.015, 24, 10), all_fields(0.002));
  VpsAsset* asset = nullptr;
  const VpsVoxelmap *map = nullptr, *layers = nullptr;
  const VpsPointshell* shell = nullptr;

  Torus() {
    EXPECT_EQ(vps_asset_open_memory(bytes->bytes().data(), bytes->bytes().size(), vps_use_everything, &asset), vps_ok);
    EXPECT_EQ(vps_asset_voxelmap(asset, vps_field_scaled, &map), vps_ok);
    EXPECT_EQ(vps_asset_voxelmap(asset, vps_field_layers, &layers), vps_ok);
    EXPECT_EQ(vps_asset_pointshell(asset, &shell), vps_ok);
  }
  Torus(const Torus&) = delete;
  Torus& operator=(const Torus&) = delete;
  ~Torus() { vps_asset_close(asset); }
};

struct Batch {
  VpsBatch* batch = nullptr;
  explicit Batch(std::uint32_t threads) { EXPECT_EQ(vps_batch_create(threads, &batch), vps_ok); }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;
  ~Batch() { vps_batch_destroy(batch); }
  operator VpsBatch*() const { return batch; }
  std::size_t refused() const {
    std::size_t index = 0;
    EXPECT_EQ(vps_batch_refused(batch, &index), vps_ok);
    return index;
  }
};

// A point and a normal as a program may hold them.
struct Particle {
  char name;
  float point[3];
  float inward_normal[3];
  float penetration;
};

std::vector<Particle> particles() {
  Random random;
  std::vector<Particle> out(kCount);
  for (Particle& particle : out) {
    for (float& x : particle.point) x = static_cast<float>(random.between(-0.06, 0.06));
    std::memcpy(particle.inward_normal, kUp, sizeof(kUp));
  }
  return out;
}
std::vector<VpsPose> poses(std::size_t count) {
  Random random;
  std::vector<VpsPose> out(count);
  for (VpsPose& pose : out) {
    const Pose from = random_pose(random, 0.05);
    std::copy_n(from.rotation, 9, pose.rotation);
    std::copy_n(from.translation, 3, pose.translation);
  }
  return out;
}

template <class T>
VpsConstArray in(const T* first, std::ptrdiff_t stride = sizeof(T)) {
  return {first, stride};
}
template <class T>
VpsArray out(T* first, std::ptrdiff_t stride = sizeof(T)) {
  return {first, stride};
}
template <class T>
bool same_bytes(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

TEST(CBatch, PointsGetTheAnswersOfSingleCalls) {
  const Torus torus;
  std::vector<Particle> cloud = particles();
  for (const std::uint32_t threads : {1U, 3U, 0U}) {
    const Batch batch(threads);
    const VpsConstArray points = in(cloud[0].point, sizeof(Particle));
    std::vector<std::array<float, 3>> normals(kCount);
    std::vector<VpsClosestPoint> closest(kCount);
    for (const VpsVoxelmap* map : {torus.map, torus.layers}) {
      const VpsFieldRef field = vps_map_ref(map);
      ASSERT_EQ(vps_penetration_batch(batch, field, kCount, points, in(cloud[0].inward_normal, sizeof(Particle)),
                                      out(&cloud[0].penetration, sizeof(Particle))),
                vps_ok);
      ASSERT_EQ(vps_outward_normal_batch(batch, field, kCount, points, out(normals.data())), vps_ok);
      for (std::size_t i = 0; i < kCount; ++i) {
        float v = 0;
        float normal[3];
        ASSERT_EQ(vps_penetration(field, cloud[i].point, kUp, &v), vps_ok);
        ASSERT_EQ(vps_outward_normal(field, cloud[i].point, normal), vps_ok);
        ASSERT_EQ(cloud[i].penetration, v) << i;
        ASSERT_EQ(std::memcmp(normals[i].data(), normal, sizeof(normal)), 0) << i;
      }
    }
    ASSERT_EQ(vps_closest_point_batch(batch, torus.map, kCount, points, nullptr, out(closest.data())), vps_ok);
    for (std::size_t i = 0; i < kCount; ++i) {
      VpsClosestPoint one{};
      ASSERT_EQ(vps_closest_point(torus.map, cloud[i].point, nullptr, &one), vps_ok);
      ASSERT_TRUE(same_bytes(closest[i], one)) << i;
    }
    ASSERT_EQ(batch.refused(), kCount);
  }
}

TEST(CBatch, StridesMayBeZeroNegativeOrOdd) {
  const Torus torus;
  const Batch batch(2);
  const std::vector<Particle> cloud = particles();
  const VpsFieldRef field = vps_map_ref(torus.map);
  const VpsConstArray none{nullptr, 0};
  std::vector<char> room(5 * kCount + 1);
  const auto answer = [&](std::size_t i) {
    float v = 0;
    std::memcpy(&v, room.data() + 1 + 5 * i, sizeof(v));
    return v;
  };
  const auto expected = [&](std::size_t i) {
    float v = 0;
    EXPECT_EQ(vps_penetration(field, cloud[i].point, kUp, &v), vps_ok);
    return v;
  };
  const VpsArray results{room.data() + 1, 5};
  ASSERT_EQ(vps_penetration_batch(batch, field, kCount, {cloud[kCount - 1].point, -std::ptrdiff_t{sizeof(Particle)}},
                                  none, results),
            vps_ok);
  for (std::size_t i = 0; i < kCount; ++i) ASSERT_EQ(answer(i), expected(kCount - 1 - i));
  ASSERT_EQ(vps_penetration_batch(batch, field, kCount, {cloud[7].point, 0}, none, results), vps_ok);
  for (std::size_t i = 0; i < kCount; ++i) ASSERT_EQ(answer(i), expected(7));
}

TEST(CBatch, RaysGetTheAnswersOfSingleCalls) {
  const Torus torus;
  const Batch batch(0);
  const std::vector<Particle> cloud = particles();
  const VpsRays rays{in(cloud[0].point, sizeof(Particle)), {kUp, 0}, {nullptr, 0}};
  std::vector<VpsRayHit> hits(kCount);
  ASSERT_EQ(vps_cast_ray_batch(batch, torus.map, kCount, &rays, 1e-3F, out(hits.data())), vps_ok);
  const float limit = 0.01F;
  VpsRays short_rays = rays;
  short_rays.max_distances = {&limit, 0};
  std::vector<VpsRayHit> short_hits(kCount);
  ASSERT_EQ(vps_cast_ray_batch(batch, torus.map, kCount, &short_rays, 1e-3F, out(short_hits.data())), vps_ok);
  int found = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    VpsRay ray{{}, {0, 0, 1}, std::numeric_limits<float>::infinity()};
    std::memcpy(ray.origin, cloud[i].point, sizeof(ray.origin));
    VpsRayHit hit{};
    ASSERT_EQ(vps_cast_ray(torus.map, &ray, 1e-3F, &hit), vps_ok);
    ASSERT_TRUE(same_bytes(hits[i], hit)) << i;
    found += hit.hit;
    ray.max_distance = limit;
    ASSERT_EQ(vps_cast_ray(torus.map, &ray, 1e-3F, &hit), vps_ok);
    ASSERT_TRUE(same_bytes(short_hits[i], hit)) << i;
  }
  EXPECT_GT(found, 100);
}

TEST(CBatch, PosesGetTheAnswersOfSingleCalls) {
  const Torus torus;
  const std::vector<VpsPose> at = poses(60);
  constexpr std::size_t kRoom = 50;
  VpsScratch* scratch = nullptr;
  ASSERT_EQ(vps_scratch_create(&scratch), vps_ok);
  const VpsBox box{{0.02F, 0.02F, 0.02F}};
  for (const VpsFieldRef field : {vps_map_ref(torus.map), vps_box_ref(&box)}) {
    for (const std::uint32_t threads : {1U, 3U}) {
      const Batch batch(threads);
      std::vector<VpsSeparation> separations(at.size());
      ASSERT_EQ(
          vps_separation_batch(batch, torus.shell, field, at.size(), in(at.data()), nullptr, out(separations.data())),
          vps_ok);
      std::vector<VpsQueryResult> results(at.size());
      std::vector<VpsContact> contacts(kRoom * at.size());
      ASSERT_EQ(vps_traverse_batch(batch, torus.shell, field, at.size(), in(at.data()), nullptr,
                                   out(contacts.data(), kRoom * sizeof(VpsContact)), kRoom, out(results.data())),
                vps_output_full)
          << "some poses are deep";
      ASSERT_EQ(batch.refused(), at.size());
      for (std::size_t i = 0; i < at.size(); ++i) {
        VpsSeparation separation{};
        ASSERT_EQ(vps_separation(torus.shell, field, &at[i], nullptr, scratch, &separation), vps_ok);
        ASSERT_TRUE(same_bytes(separations[i], separation)) << i;
        VpsQueryResult result{};
        std::vector<VpsContact> one(kRoom);
        const VpsStatus status = vps_traverse(torus.shell, field, &at[i], nullptr, scratch, one.data(), kRoom, &result);
        ASSERT_EQ(status, result.contacts > kRoom ? vps_output_full : vps_ok);
        ASSERT_TRUE(same_bytes(results[i], result)) << i;
        ASSERT_EQ(std::memcmp(&contacts[kRoom * i], one.data(), kRoom * sizeof(VpsContact)), 0) << i;
      }
    }
  }
  vps_scratch_destroy(scratch);
}

TEST(CBatch, ContactsOfStepsAreThoseOfSingleCalls) {
  const Torus torus;
  const std::vector<VpsPose> at = poses(40);
  constexpr std::size_t kRoom = 6;
  VpsScratch* scratch = nullptr;
  ASSERT_EQ(vps_scratch_create(&scratch), vps_ok);
  VpsStepBody first{vps_map_ref(torus.map), {}, torus.shell, nullptr};
  const VpsStepBody second{vps_map_ref(torus.map), {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, torus.shell, nullptr};
  for (const std::uint32_t threads : {1U, 3U}) {
    const Batch batch(threads);
    std::vector<VpsStepContact> contacts(kRoom * at.size());
    std::vector<std::uint32_t> counts(at.size());
    ASSERT_EQ(vps_step_contacts_batch(batch, &first, &second, at.size(), in(at.data()), nullptr,
                                      out(contacts.data(), kRoom * sizeof(VpsStepContact)), kRoom, out(counts.data())),
              vps_ok);
    std::size_t all = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      VpsStepContact one[kRoom];
      std::size_t count = 0;
      first.pose = at[i];
      ASSERT_EQ(vps_step_contacts(&first, &second, nullptr, scratch, one, kRoom, &count), vps_ok);
      ASSERT_EQ(counts[i], count);
      ASSERT_EQ(std::memcmp(&contacts[kRoom * i], one, count * sizeof(VpsStepContact)), 0) << i;
      all += count;
    }
    EXPECT_GT(all, at.size());
  }
  vps_scratch_destroy(scratch);
}

TEST(CBatch, RefusesElementsOneByOne) {
  const Torus torus;
  std::vector<Particle> cloud = particles();
  cloud[2500].point[1] = cloud[1100].point[2] = cloud[1200].point[0] = kNaN;
  for (Particle& particle : cloud) particle.penetration = 7;
  const VpsConstArray points = in(cloud[0].point, sizeof(Particle));
  for (const std::uint32_t threads : {1U, 3U}) {
    const Batch batch(threads);
    EXPECT_EQ(vps_penetration_batch(batch, vps_map_ref(torus.map), kCount, points, {nullptr, 0},
                                    out(&cloud[0].penetration, sizeof(Particle))),
              vps_bad_argument);
    EXPECT_EQ(batch.refused(), 1100U);
    for (const Particle& particle : cloud) {
      const float* p = particle.point;
      ASSERT_EQ(particle.penetration == 7, std::isnan(p[0] + p[1] + p[2])) << "the others are answered";
    }
    std::vector<VpsPose> at = poses(40);
    at[33].rotation[0] = 2;
    at[21].translation[0] = kNaN;
    std::vector<VpsQueryResult> results(at.size());
    EXPECT_EQ(vps_traverse_batch(batch, torus.shell, vps_map_ref(torus.map), at.size(), in(at.data()), nullptr,
                                 {nullptr, 0}, 0, out(results.data())),
              vps_bad_pose)
        << "not output_full, although there is no room for contacts";
    EXPECT_EQ(batch.refused(), 21U);
    EXPECT_GT(results[39].nodes_tested + results[39].points_tested, 0U);
  }
}

TEST(CBatch, MisuseGetsAStatus) {
  const Torus torus;
  VpsBatch* none = nullptr;
  EXPECT_EQ(vps_batch_create(1, nullptr), vps_bad_argument);
  EXPECT_EQ(vps_batch_create(1025, &none), vps_bad_argument);
  EXPECT_EQ(vps_batch_destroy(nullptr), vps_ok);
  const Batch batch(2);
  const VpsFieldRef field = vps_map_ref(torus.map);
  const float point[6] = {};
  float v[6];
  const VpsConstArray points{point, 12};
  const VpsArray results{v, 12};
  std::size_t index = 0;
  EXPECT_EQ(vps_batch_refused(nullptr, &index), vps_bad_argument);
  EXPECT_EQ(vps_batch_refused(batch, nullptr), vps_bad_argument);
  EXPECT_EQ(vps_penetration_batch(nullptr, field, 2, points, {nullptr, 0}, results), vps_bad_argument);
  EXPECT_EQ(vps_penetration_batch(batch, {99, torus.map}, 2, points, {nullptr, 0}, results), vps_bad_argument);
  EXPECT_EQ(vps_penetration_batch(batch, field, 2, {nullptr, 12}, {nullptr, 0}, results), vps_bad_argument);
  EXPECT_EQ(vps_penetration_batch(batch, field, 2, points, {nullptr, 0}, {nullptr, 12}), vps_bad_argument);
  EXPECT_EQ(vps_penetration_batch(batch, field, 2, points, {nullptr, 0}, {v, 3}), vps_bad_argument) << "they overlap";
  EXPECT_EQ(vps_penetration_batch(batch, vps_map_ref(torus.layers), 2, points, {nullptr, 0}, results), vps_bad_argument)
      << "layers need normals";
  EXPECT_EQ(vps_penetration_batch(batch, field, 0, {nullptr, 0}, {nullptr, 0}, {nullptr, 0}), vps_ok) << "no points";
  EXPECT_EQ(vps_outward_normal_batch(batch, field, 2, points, {v, 8}), vps_bad_argument);
  VpsClosestPoint closest[2];
  EXPECT_EQ(vps_closest_point_batch(batch, nullptr, 0, points, nullptr, out(closest)), vps_bad_argument);
  EXPECT_EQ(vps_closest_point_batch(batch, torus.layers, 2, points, nullptr, out(closest)), vps_missing_part);
  VpsRayHit hits[2];
  EXPECT_EQ(vps_cast_ray_batch(batch, torus.map, 2, nullptr, 1e-3F, out(hits)), vps_bad_argument);
  const VpsRays rays{points, points, {nullptr, 0}};
  EXPECT_EQ(vps_cast_ray_batch(batch, torus.map, 2, &rays, 1e-3F, out(hits)), vps_bad_argument) << "no direction";
  const VpsPose pose{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  VpsSeparation separation;
  EXPECT_EQ(vps_separation_batch(batch, nullptr, field, 1, in(&pose), nullptr, out(&separation)), vps_bad_argument);
  VpsQueryResult result;
  VpsContact contacts[2];
  VpsContactCache* cache = nullptr;
  ASSERT_EQ(vps_contact_cache_create(&cache), vps_ok);
  VpsQueryOptions options{};
  options.cache = cache;
  EXPECT_EQ(vps_traverse_batch(batch, torus.shell, field, 1, in(&pose), &options, out(contacts), 2, out(&result)),
            vps_bad_argument)
      << "a cache is of one thread";
  vps_contact_cache_destroy(cache);
  EXPECT_EQ(vps_traverse_batch(batch, torus.shell, field, 1, in(&pose), nullptr,
                               {reinterpret_cast<char*>(contacts) + 1, 80}, 1, out(&result)),
            vps_bad_argument)
      << "misaligned";
  const VpsStepBody body{field, pose, torus.shell, nullptr};
  VpsStepContact steps[2];
  std::uint32_t counts[1];
  const auto step = [&](const VpsStepOptions& of, std::size_t capacity, VpsArray to) {
    return vps_step_contacts_batch(batch, &body, &body, 1, in(&pose), &of, to, capacity, out(counts));
  };
  EXPECT_EQ(step({}, 2, out(steps)), vps_ok);
  EXPECT_EQ(step({}, 0, out(steps)), vps_bad_argument);
  EXPECT_EQ(step({}, 1025, out(steps)), vps_bad_argument);
  EXPECT_EQ(step({}, 2, {nullptr, 0}), vps_bad_argument);
  VpsStepMemory* memory = nullptr;
  ASSERT_EQ(vps_step_memory_create(&memory), vps_ok);
  EXPECT_EQ(step({0, vps_step_samples, memory}, 2, out(steps)), vps_bad_argument) << "a memory is of one thread";
  vps_step_memory_destroy(memory);
  EXPECT_EQ(vps_traverse_batch(batch, torus.shell, field, 1, in(&pose), nullptr, out(contacts), SIZE_MAX, out(&result)),
            vps_bad_argument);
}

}  // namespace
}  // namespace vps::test
