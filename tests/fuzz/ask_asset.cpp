// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/fuzz/ask_asset.h"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "runtime/vps.h"
#include "runtime/vps_contacts.h"
#include "runtime/vps_haptics.h"
#include "tests/fuzz/answers.h"
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

// Squares of larger coordinates are no floats.
bool is_near(Vec3 p) {
  constexpr float kFarthest = 1e15F;
  return std::abs(p.x) <= kFarthest && std::abs(p.y) <= kFarthest && std::abs(p.z) <= kFarthest;
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
  for (int i = 0; i < 100; ++i) {
    const Vec3 p = place(info, random);
    const float v = penetration(map, p, {0, 0, 1});
    const float bound = penetration_bound(map, p);
    const Vec3 normal = outward_normal(map, p);
    if (!is_near(p)) continue;
    expect_finite("V at a point", v, bound);
    expect_direction("a normal", normal);
  }
  for (int i = 0; i < 20; ++i) {
    Ray ray{place(info, random), {0, 0, i % 2 == 0 ? 1.0F : -1.0F}};
    if (i % 4 == 3) ray.direction = {0.6F, 0, -0.8F};
    RayHit hit;
    if (cast_ray(map, ray, {}, hit) == Status::ok) {
      expect_finite("a ray's way", hit.distance);
      expect_finite("a ray's end", hit.position);
      expect_direction("the normal at a ray's end", hit.outward_normal);
      if (hit.steps > 8 * (map.dims[0] + map.dims[1] + map.dims[2]) + 16)
        throw WrongAnswer("a ray takes more steps than the grid has");
    }
    ClosestPoint closest;
    if (closest_point(map, place(info, random), {}, closest) != Status::ok) continue;
    expect_finite("the bounds of a distance", closest.lower, closest.upper);
    if (!closest.converged) continue;
    expect_finite("a closest point", closest.position);
    expect_finite("the way to a closest point", closest.distance, closest.residual);
    expect_direction("the normal at a closest point", closest.outward_normal);
  }
}

void ask_contacts(std::span<const Contact> contacts) {
  for (const Contact& contact : contacts) expect_contact(contact);
  constexpr PenaltyLaw kLaw{1e8, 1e5};
  Wrench wrench;
  WrenchGradient gradient;
  if (penalty_wrench(contacts, kLaw, {}, wrench) == Status::ok)
    for (int i = 0; i < 3; ++i) expect_finite("a wrench", wrench.force[i], wrench.torque[i]);
  if (penalty_gradient(contacts, {}, kLaw, {}, gradient) == Status::ok)
    for (const double x : gradient.pose) expect_finite("a gradient", x);
  std::array<Contact, 4> kept;
  ReductionScratch scratch;
  Reduction reduction;
  if (reduce_contacts(contacts, {}, kept, scratch, reduction) != Status::ok) return;
  for (std::uint32_t i = 0; i < reduction.kept; ++i) expect_contact(kept[i]);
}

// Returns the contacts that were written.
std::span<const Contact> ask_traverse(const PointshellView& shell, FieldRef field, const Pose& at,
                                      const QueryOptions& options, Scratch& scratch, std::span<Contact> out) {
  QueryResult result;
  const Status status = traverse(shell, field, at, options, scratch, out, result);
  if (status != Status::ok && status != Status::output_full) return {};
  expect_result(result);
  return out.first(std::min<std::size_t>(result.contacts, out.size()));
}

void ask_sweep(const PointshellView& shell, FieldRef field, const AssetInfo& info, Scratch& scratch, Random& random) {
  Sweep sweep;
  sweep.start = pose(info, random);
  sweep.velocity[1] = 10 * info.voxel_size;
  sweep.angular_velocity[0] = 1;
  ImpactOptions options;
  options.max_iterations = 8;
  ImpactResult impact;
  if (time_of_impact(shell, field, sweep, options, scratch, impact) != Status::ok) return;
  expect_finite("the time of an impact", impact.time);
  expect_separation(impact.separation);
}

void ask_pair(const PointshellView& shell, FieldRef field, const AssetInfo& info, Random& random) {
  Scratch scratch;
  ContactCache cache;
  std::vector<Contact> out(64);
  std::vector<float> areas(shell.nodes);
  if (node_areas(shell, areas) == Status::ok)
    for (const float area : areas) expect_finite("an area", area);
  std::vector<FlatPatch> patches;
  (void)find_flat_patches(shell, patches);
  const int first = random.next() < 0.5 ? 0 : 4;
  for (int i = first; i < first + 4; ++i) {
    const Pose at = pose(info, random);
    QueryOptions options;
    options.contact_distance = i % 2 == 0 ? 0 : static_cast<float>(random.between(0, 1) * info.voxel_size * 20);
    options.segment_level = i < 4 ? 0 : static_cast<std::uint32_t>(random.between(0, 6));
    options.level = i == 0 ? 2 : 0;
    options.max_tests = i == 1 ? 50 : 0;
    options.weight = i % 4 == 1 ? Weight::per_patch : i % 4 == 2 ? Weight::per_point : Weight::per_area;
    options.node_areas = i < 2 ? std::span<const float>(areas) : std::span<const float>();
    options.leaves_faces = i == 5;
    if (i % 4 >= 2) options.flat_patches = patches;
    (void)ask_traverse(shell, field, at, options, scratch, out);
    options.cache = &cache;
    for (int again = 0; again < 3; ++again) (void)ask_traverse(shell, field, at, options, scratch, out);
    (void)ask_traverse(shell, field, at, options, scratch, {});
    ask_contacts(ask_traverse(shell, field, at, options, scratch, out));
    SeparationResult apart;
    if (separation(shell, field, at, {}, scratch, apart) == Status::ok) expect_separation(apart);
  }
  ask_sweep(shell, field, info, scratch, random);
}

void ask_batch_and_tool(const PointshellView& shell, const VoxelmapView& map, const AssetInfo& info, Random& random) {
  std::vector<Contact> out(64);
  std::vector<PairQuery> queries;
  for (int i = 0; i < 4; ++i) queries.push_back({&shell, &map, pose(info, random), pose(info, random), {}, out});
  std::vector<PairAnswer> answers(queries.size());
  BatchScratch scratch;
  if (traverse_batch(queries, answers, scratch, {}) == Status::ok) {
    for (const PairAnswer& answer : answers) expect_result(answer.result);
  }
  VirtualTool tool(shell, map, pose(info, random), {});
  for (int i = 0; i < 4; ++i) {
    HapticCycle cycle;
    if (tool.step(pose(info, random), cycle) != Status::ok) continue;
    for (int axis = 0; axis < 3; ++axis) {
      expect_finite("the felt force", cycle.felt.force[axis], cycle.felt.torque[axis], cycle.tool.translation[axis]);
    }
  }
}

void ask_analytic(const PointshellView& shell, const AssetInfo& info, Random& random) {
  ask_pair(shell, BoxField{{0.1F, 0.2F, 0.3F}}, info, random);
  ask_pair(shell, SphereField{0.2F}, info, random);
  ask_pair(shell, HalfSpaceField{}, info, random);
  using Profile = RevolvedField::Profile;
  for (const Profile profile : {Profile::capsule, Profile::cylinder, Profile::cone})
    ask_pair(shell, RevolvedField{profile, 0.1F, 0.2F, 0.01F}, info, random);
  const HalfSpaceField planes[] = {{{0.6F, 0, 0.8F}, 0.1F}, {{-1, 0, 0}, 0.2F}};
  ask_pair(shell, PolytopeField{planes}, info, random);
}

void ask_at_scale(const Asset& asset, double scale, Random& random) {
  const AssetInfo info = scaled(asset.info(), scale);
  PointshellView shell;
  const bool has_shell = asset.pointshell(shell, scale) == Status::ok;
  for (const Field field : {Field::layers, Field::scaled, Field::real}) {
    VoxelmapView map;
    if (asset.voxelmap(map, field, scale) != Status::ok) continue;
    ask_points(map, info, random);
    if (!has_shell) continue;
    ask_pair(shell, map, info, random);
    ask_batch_and_tool(shell, map, info, random);
  }
  if (has_shell && scale == 1) ask_analytic(shell, info, random);
}

// The functions of the C interface that do more than forward.
void ask_in_c(std::span<const std::byte> file) {
  VpsAsset* asset = nullptr;
  if (vps_asset_open_memory(file.data(), file.size(), vps_use_everything, &asset) != vps_ok) return;
  VpsAssetInfo info;
  (void)vps_asset_info(asset, &info);
  const VpsPointshell* shell = nullptr;
  const VpsVoxelmap* map = nullptr;
  VpsScratch* scratch = nullptr;
  (void)vps_asset_scale(asset, 1000);
  if (vps_asset_pointshell(asset, &shell) == vps_ok && vps_asset_voxelmap(asset, vps_field_finest, &map) == vps_ok &&
      vps_scratch_create(&scratch) == vps_ok) {
    const VpsPose pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {info.bounds_max[0], 0, 0}};
    std::vector<VpsContact> out(16);
    VpsQueryResult result;
    const VpsStatus status =
        vps_traverse(shell, vps_map_ref(map), &pose, nullptr, scratch, out.data(), out.size(), &result);
    if (status == vps_ok) expect_finite("delta in C", result.delta, result.force[0], result.torque[0]);
    VpsSeparation apart;
    if (vps_separation(shell, vps_map_ref(map), &pose, nullptr, scratch, &apart) == vps_ok)
      expect_finite("a separation in C", apart.delta, apart.upper);
    (void)vps_scratch_destroy(scratch);
  }
  (void)vps_asset_close(asset);
}

}  // namespace

Status ask_asset(std::span<const std::byte> file) {
  Asset asset;
  const Status opened = Asset::open(file, asset);
  if (opened != Status::ok) return opened;
  (void)asset.verify();
  // The bytes determine the queries.
  const std::uint64_t hash = hash_bytes(file);
  Random random(hash);
  ask_at_scale(asset, 1, random);
  ask_at_scale(asset, hash % 2 == 0 ? kLeastScale : kMostScale, random);
  ShellRole role{};
  (void)choose_roles(asset, asset, role);
  ask_in_c(file);
  return opened;
}

}  // namespace vps::test
