// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/fuzz/ask_asset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "formats/fields.h"
#include "runtime/vps_contacts.h"
#include "runtime/vps_queries.h"
#include "runtime/vps_runtime.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

// A random point in or around the bounds, sometimes with extreme or invalid coordinates.
Vec3 place(const AssetInfo& info, Random& random) {
  float p[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double size = info.bounds_max[axis] - info.bounds_min[axis];
    p[axis] = static_cast<float>(random.between(info.bounds_min[axis] - size, info.bounds_max[axis] + size));
    constexpr float kExtremes[] = {0,
                                   -0.0F,
                                   1e30F,
                                   -1e30F,
                                   std::numeric_limits<float>::max(),
                                   std::numeric_limits<float>::infinity(),
                                   std::numeric_limits<float>::quiet_NaN()};
    if (random.next() < 0.05) p[axis] = kExtremes[static_cast<std::size_t>(random.between(0, 7))];
  }
  return {p[0], p[1], p[2]};
}

Pose pose(const AssetInfo& info, Random& random) {
  Pose out;
  const std::array<double, 9> rotation = random.rotation();
  std::copy(rotation.begin(), rotation.end(), out.rotation);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double size = info.bounds_max[axis] - info.bounds_min[axis];
    out.translation[axis] = random.between(-size, size);
  }
  if (random.next() < 0.1) out.translation[0] *= 1e12;
  return out;
}

void ask_points(const VoxelmapView& map, const AssetInfo& info, Random& random) {
  float sum = 0;
  for (int i = 0; i < 100; ++i) {
    const Vec3 p = place(info, random);
    sum += penetration(map, p, {0, 0, 1}) + penetration_bound(map, p) + outward_normal(map, p).x;
  }
  for (int i = 0; i < 20; ++i) {
    Ray ray{place(info, random), {0, 0, i % 2 == 0 ? 1.0F : -1.0F}};
    RayHit hit;
    (void)cast_ray(map, ray, {}, hit);
    ClosestPoint closest;
    (void)closest_point(map, place(info, random), {}, closest);
    sum += hit.distance + closest.distance;
  }
  // Uses the sum, so that no look-up is optimized away.
  volatile float kept = sum;
  (void)kept;
}

void ask_contacts(std::span<const Contact> contacts) {
  constexpr PenaltyLaw kLaw{1e8, 1e5};
  Wrench wrench;
  WrenchGradient gradient;
  (void)penalty_wrench(contacts, kLaw, {}, wrench);
  (void)penalty_gradient(contacts, {}, kLaw, {}, gradient);
  std::array<Contact, 4> kept;
  ReductionScratch scratch;
  Reduction reduction;
  (void)reduce_contacts(contacts, {}, kept, scratch, reduction);
}

template <class Field>
void ask_pair(const PointshellView& shell, const Field& field, const AssetInfo& info, Random& random) {
  Scratch scratch;
  ContactCache cache;
  std::vector<Contact> out(64);
  std::vector<float> areas(shell.nodes);
  (void)node_areas(shell, areas);
  std::vector<FlatPatch> patches;
  (void)find_flat_patches(shell, patches);
  QueryResult result;
  for (int i = 0; i < 8; ++i) {
    const Pose at = pose(info, random);
    QueryOptions options;
    options.contact_distance = i % 2 == 0 ? 0 : static_cast<float>(random.between(0, 1) * info.voxel_size * 20);
    options.segment_level = i < 4 ? 0 : static_cast<std::uint32_t>(random.between(0, 6));
    options.level = i == 0 ? 2 : 0;
    options.max_tests = i == 1 ? 50 : 0;
    options.weight = i % 4 == 1 ? Weight::per_patch : Weight::per_area;
    options.node_areas = i < 2 ? std::span<const float>(areas) : std::span<const float>();
    if (i % 4 >= 2) options.flat_patches = patches;
    (void)traverse(shell, field, at, options, scratch, out, result);
    options.cache = &cache;
    (void)traverse(shell, field, at, options, scratch, out, result);
    (void)traverse(shell, field, at, options, scratch, {}, result);
    ask_contacts(std::span(out).first(std::min<std::size_t>(result.contacts, out.size())));
    SeparationResult apart;
    (void)separation(shell, field, at, {}, scratch, apart);
  }
  Sweep sweep;
  sweep.start = pose(info, random);
  sweep.velocity[1] = 10 * info.voxel_size;
  sweep.angular_velocity[0] = 1;
  ImpactOptions options;
  options.max_iterations = 8;
  ImpactResult impact;
  (void)time_of_impact(shell, field, sweep, options, scratch, impact);
}

}  // namespace

void seal_header(std::span<std::byte> file) {
  if (file.size() < kUserBlockBytes) return;
  std::memset(file.data() + detail::kHashOffset, 0, sizeof(std::uint64_t));
  const std::uint64_t hash = hash_bytes(file.first(kUserBlockBytes));
  std::memcpy(file.data() + detail::kHashOffset, &hash, sizeof(hash));
}

Status ask_asset(std::span<const std::byte> file) {
  Asset asset;
  const Status opened = Asset::open(file, asset);
  if (opened != Status::ok) return opened;
  (void)asset.verify();
  // The bytes determine the queries.
  const std::uint64_t hash = hash_bytes(file);
  Random random;
  for (std::uint64_t skipped = 0; skipped < hash % 64; ++skipped) random.next();
  const AssetInfo& info = asset.info();
  PointshellView shell;
  const bool has_shell = asset.pointshell(shell) == Status::ok;
  for (const Field field : {Field::layers, Field::scaled, Field::real}) {
    VoxelmapView map;
    if (asset.voxelmap(map, field) != Status::ok) continue;
    ask_points(map, info, random);
    if (has_shell) ask_pair(shell, map, info, random);
  }
  if (has_shell) {
    ask_pair(shell, BoxField{{0.1F, 0.2F, 0.3F}}, info, random);
    ask_pair(shell, SphereField{0.2F}, info, random);
    ask_pair(shell, HalfSpaceField{}, info, random);
    ask_pair(shell, RevolvedField{RevolvedField::Profile::cone, 0.1F, 0.2F, 0.01F}, info, random);
    const HalfSpaceField planes[] = {{{0.6F, 0, 0.8F}, 0.1F}, {{-1, 0, 0}, 0.2F}};
    ask_pair(shell, PolytopeField{planes}, info, random);
  }
  return opened;
}

}  // namespace vps::test
