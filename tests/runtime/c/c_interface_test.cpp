// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <type_traits>

#include "runtime/vps_contacts.h"
#include "runtime/vps_queries.h"
#include "tests/runtime/c/c_program.h"
#include "tests/support/baked.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

std::string write(const TemporaryFolder& folder, const std::string& name, const bake::BakeOptions& options) {
  const bake::BakedAsset result = bake::bake(make_torus(0.04, 0.015, 24, 10), options);
  write_asset(folder / name, result.info, result.sections);
  return (folder / name).string();
}

template <std::size_t n, class Array, class Other>
void expect_equal(const Array& a, const Other& b) {
  for (std::size_t i = 0; i < n; ++i) EXPECT_EQ(a[i], b[i]) << i;
}
void expect_equal(const float (&a)[3], Vec3 b) {
  EXPECT_EQ(a[0], b.x);
  EXPECT_EQ(a[1], b.y);
  EXPECT_EQ(a[2], b.z);
}
void expect_equal(const VpsCertificate& a, const FieldCertificate& b) {
  EXPECT_EQ(a.max, b.max);
  EXPECT_EQ(a.rms, b.rms);
  EXPECT_EQ(a.p99, b.p99);
  expect_equal<3>(a.worst_at, b.worst_at);
  EXPECT_EQ(a.bound, b.bound);
}
void expect_equal(const VpsQueryResult& a, const QueryResult& b) {
  EXPECT_EQ(a.delta, b.delta);
  EXPECT_EQ(a.delta_bound, b.delta_bound);
  expect_equal<3>(a.force, b.force);
  expect_equal<3>(a.torque, b.torque);
  EXPECT_EQ(a.contacts, b.contacts);
  EXPECT_EQ(a.nodes_tested, b.nodes_tested);
  EXPECT_EQ(a.points_tested, b.points_tested);
  EXPECT_EQ(a.complete, b.complete ? 1U : 0U);
}

void expect_equal(const VpsSeparation& a, const SeparationResult& b) {
  EXPECT_EQ(a.delta, b.delta);
  EXPECT_EQ(a.delta_bound, b.delta_bound);
  EXPECT_EQ(a.lower, b.lower);
  EXPECT_EQ(a.upper, b.upper);
  expect_equal(a.position, b.position);
  expect_equal(a.direction, b.direction);
  EXPECT_EQ(a.point, b.point);
  EXPECT_EQ(a.nodes_tested, b.nodes_tested);
  EXPECT_EQ(a.points_tested, b.points_tested);
}
void expect_equal(const VpsImpactResult& a, const ImpactResult& b) {
  EXPECT_EQ(a.impact, static_cast<VpsImpact>(b.impact));
  EXPECT_EQ(a.time, b.time);
  expect_equal(a.separation, b.separation);
  EXPECT_EQ(a.iterations, b.iterations);
}

// Compares separation and time of impact of the C program with those of the C++ interface.
template <class AnyField>
void expect_distances(const PointshellView& shell, const AnyField& field, const Sweep& fall, const Pose& pose,
                      const VpsSeparation& separated, const VpsImpactResult& impact) {
  // The C interface knows the shell of the map's asset, which is this one.
  Scratch scratch;
  constexpr bool kIsMap = std::is_same_v<AnyField, VoxelmapView>;
  SeparationOptions options;
  ImpactOptions impact_options;
  if (kIsMap) {
    options = {kSeparationOptions.tolerance, kSeparationOptions.guess};
    impact_options = {kImpactOptions.distance, kImpactOptions.tolerance, Contactor::points,
                      kImpactOptions.max_iterations};
    options.field_shell = impact_options.field_shell = &shell;
  }
  SeparationResult result;
  ASSERT_EQ(separation(shell, field, pose, options, scratch, result), Status::ok);
  expect_equal(separated, result);
  ImpactResult hit;
  ASSERT_EQ(time_of_impact(shell, field, fall, impact_options, scratch, hit), Status::ok);
  EXPECT_EQ(hit.impact, Impact::hit);
  expect_equal(impact, hit);
}

TEST(CInterface, SaysWhatTheCppInterfaceSays) {
  const TemporaryFolder folder;
  const std::string path = write(folder, "torus.vps.hdf", all_fields(0.001));
  Asset asset;
  ASSERT_EQ(Asset::open(path.c_str(), asset), Status::ok);
  PointshellView shell;
  ASSERT_EQ(asset.pointshell(shell), Status::ok);

  Random random;
  VpsPose c_pose{};
  Pose pose;
  const std::array<double, 9> rotation = random.rotation();
  for (std::size_t i = 0; i < 9; ++i) c_pose.rotation[i] = pose.rotation[i] = rotation[i];
  for (std::size_t i = 0; i < 3; ++i) c_pose.translation[i] = pose.translation[i] = 0.003 * static_cast<double>(i + 1);
  const float point[3] = {0.04F, 0.002F, 0.0141F};
  const float normal[3] = {0, 0.6F, 0.8F};
  const Vec3 p{point[0], point[1], point[2]};

  const auto c = std::make_unique<Answers>();
  ASSERT_EQ(ask(path.c_str(), &c_pose, point, normal, c.get()), 0) << "line of tests/runtime/c/c_program.c";

  const AssetInfo& info = asset.info();
  expect_equal<3>(c->info.bounds_min, info.bounds_min);
  expect_equal<3>(c->info.bounds_max, info.bounds_max);
  EXPECT_EQ(c->info.triangles, info.triangles);
  EXPECT_EQ(c->info.vertices, info.vertices);
  EXPECT_EQ(c->info.surface_area, info.surface_area);
  EXPECT_EQ(c->info.volume, info.volume);
  expect_equal<3>(c->info.centre_of_mass, info.centre_of_mass);
  expect_equal<6>(c->info.inertia, info.inertia);
  EXPECT_EQ(c->info.voxel_size, 0.001);
  expect_equal<3>(c->info.dims, info.dims);
  expect_equal<3>(c->info.origin, info.origin);
  EXPECT_EQ(c->info.band_inner, info.band_inner);
  EXPECT_EQ(c->info.band_outer, info.band_outer);
  EXPECT_EQ(c->info.points, shell.points);
  EXPECT_EQ(c->info.levels, shell.levels);
  EXPECT_EQ(c->info.branching, info.branching);
  EXPECT_EQ(c->info.spacing, info.spacing);
  EXPECT_EQ(c->info.covering_radius, info.covering_radius);
  EXPECT_EQ(c->info.normal_error_mean, info.normal_error_mean);
  EXPECT_EQ(c->info.normal_error_max, info.normal_error_max);
  expect_equal(c->info.layers_error, info.layers_error);
  expect_equal(c->info.scaled_error, info.scaled_error);
  expect_equal(c->info.real_error, info.real_error);
  EXPECT_EQ(c->info.far_spacing, info.far_spacing);
  EXPECT_EQ(c->info.far_range, info.far_range);
  expect_equal(c->info.far_error, info.far_error);
  EXPECT_EQ(c->info.certificate_samples, info.certificate_samples);
  EXPECT_STREQ(c->info.generator, info.generator.data());

  expect_equal(c->point.position, point_position(shell, 7));
  expect_equal(c->point.inward_normal, point_inward_normal(shell, 7));
  EXPECT_EQ(c->point.area, point_area(shell, 7));

  VoxelmapView map;
  for (const Field field : {Field::layers, Field::scaled, Field::real, Field::none}) {
    ASSERT_EQ(asset.voxelmap(map, field), Status::ok);
    const auto at = static_cast<std::size_t>(field);
    EXPECT_EQ(c->penetration[at], penetration(map, p, {normal[0], normal[1], normal[2]}));
    EXPECT_EQ(c->bound[at], penetration_bound(map, p));
    expect_equal(c->normal[at], outward_normal(map, p));
  }
  EXPECT_EQ(c->finest, vps_field_real);
  const BoxField box{{0.04F, 0.05F, 0.06F}};
  const SphereField sphere{0.05F};
  const HalfSpaceField half_space{{0, 0, 1}, 0.01F};
  EXPECT_EQ(c->box, penetration(box, p));
  EXPECT_EQ(c->sphere, penetration(sphere, p));
  EXPECT_EQ(c->half_space, penetration(half_space, p));

  QueryOptions options;
  options.contact_distance = 0.001F;
  options.weight = Weight::per_point;
  Scratch scratch;
  std::vector<Contact> contacts(shell.points);
  QueryResult result;
  ASSERT_EQ(traverse(shell, map, pose, options, scratch, contacts, result), Status::ok);
  ASSERT_GT(result.contacts, 2U);
  expect_equal(c->map_result, result);
  expect_equal(c->few_result, result);
  for (std::uint32_t i = 0; i < result.contacts; ++i) {
    expect_equal(c->contacts[i].position, contacts[i].position);
    expect_equal(c->contacts[i].inward_normal, contacts[i].inward_normal);
    EXPECT_EQ(c->contacts[i].penetration, contacts[i].penetration);
    EXPECT_EQ(c->contacts[i].area, contacts[i].area);
    EXPECT_EQ(c->contacts[i].point, contacts[i].point);
    EXPECT_EQ(c->contacts[i].node, contacts[i].node);
  }
  const std::span<const Contact> all = std::span(contacts).first(result.contacts);
  const PenaltyLaw law{kLaw.stiffness, kLaw.damping};
  const auto vec3 = [](const float(&v)[3]) { return Vec3{v[0], v[1], v[2]}; };
  const Twist twist{vec3(kTwist.centre), vec3(kTwist.linear), vec3(kTwist.angular)};
  Wrench wrench;
  ASSERT_EQ(penalty_wrench(all, law, twist, wrench), Status::ok);
  WrenchGradient gradient;
  ASSERT_EQ(penalty_gradient(all, {}, law, twist, gradient), Status::ok);
  // The C interface adds up in the same order.
  expect_equal<3>(c->wrench.force, wrench.force);
  expect_equal<3>(c->wrench.torque, wrench.torque);
  for (std::size_t i = 0; i < 36; ++i) {
    EXPECT_NEAR(c->gradient.pose[i], gradient.pose[i], 1e-9 * std::abs(gradient.pose[0]));
    EXPECT_EQ(c->gradient.twist[i], gradient.twist[i]);
  }
  std::vector<Contact> kept(kKept);
  ReductionScratch reduction_scratch;
  Reduction reduction;
  ASSERT_EQ(reduce_contacts(all, twist.centre, kept, reduction_scratch, reduction), Status::ok);
  EXPECT_EQ(c->reduction.kept, reduction.kept);
  EXPECT_EQ(c->reduction.force_residual, reduction.force_residual);
  EXPECT_EQ(c->reduction.torque_residual, reduction.torque_residual);
  for (std::size_t i = 0; i < kKept; ++i) {
    EXPECT_EQ(c->kept[i].point, kept[i].point);
    EXPECT_EQ(c->kept[i].area, kept[i].area);
  }
  VoxelmapView of_step;
  ASSERT_EQ(asset.voxelmap(of_step, Field::scaled), Status::ok);
  StepScratch step;
  std::vector<StepContact> room(kKept);
  const auto expect_steps = [&](const VpsStepContact* from_c, std::size_t count, std::span<const StepContact> found) {
    ASSERT_EQ(count, found.size());
    ASSERT_GT(count, 0U);
    EXPECT_EQ(std::memcmp(from_c, found.data(), count * sizeof(StepContact)), 0);
  };
  std::span<StepContact> found = room;
  ASSERT_EQ(step_contacts({of_step, pose, &shell}, {of_step, Pose(), &shell}, {0, StepUse::springs}, step, found),
            Status::ok);
  expect_steps(c->step_contacts, c->step_count, found);
  found = room;
  StepMotion rising;
  rising.way = {0, 0, 0.01F};
  rising.turn = {0.01F, 0, 0};
  rising.radius = 0.1F;
  const StepBody ground{half_space, Pose(), nullptr, &rising};
  ASSERT_EQ(step_contacts({VoxelmapView(), pose, &shell}, ground, {}, step, found), Status::ok);
  expect_steps(c->ground_contacts, c->ground_count, found);

  ShellRole role{};
  ASSERT_EQ(choose_roles(asset, asset, role), Status::ok);
  EXPECT_EQ(c->role, static_cast<VpsShellRole>(role));
  EXPECT_EQ(c->segment_level, segment_level_for(shell, 15));
  expect_equal(c->box_normal, outward_normal(box, p));
  expect_equal(c->sphere_normal, outward_normal(sphere, p));

  std::vector<float> areas(shell.nodes);
  ASSERT_EQ(node_areas(shell, areas), Status::ok);
  QueryOptions coarse;
  coarse.level = 2;
  coarse.node_areas = areas;
  ASSERT_EQ(traverse(shell, map, pose, coarse, scratch, contacts, result), Status::ok);
  ASSERT_GT(result.contacts, 0U);
  expect_equal(c->coarse_result, result);
  QueryOptions hasty;
  hasty.max_tests = 300;
  hasty.node_areas = areas;
  ASSERT_EQ(traverse(shell, map, pose, hasty, scratch, contacts, result), Status::ok);
  ASSERT_FALSE(result.complete);
  expect_equal(c->hasty_result, result);
  VoxelmapView scaled;
  ASSERT_EQ(asset.voxelmap(scaled, Field::scaled), Status::ok);
  ContactCache cache;
  options.cache = &cache;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(traverse(shell, scaled, pose, options, scratch, contacts, result), Status::ok);
  }
  ASSERT_EQ(result.nodes_tested, 0U) << "remembered";
  expect_equal(c->cached_result, result);

  ASSERT_EQ(traverse(shell, box, pose, {}, scratch, contacts, result), Status::ok);
  expect_equal(c->box_result, result);
  ASSERT_EQ(traverse(shell, sphere, pose, {}, scratch, contacts, result), Status::ok);
  expect_equal(c->sphere_result, result);
  ASSERT_EQ(traverse(shell, half_space, pose, {}, scratch, contacts, result), Status::ok);
  expect_equal(c->half_space_result, result);
  QueryOptions by_patch;
  by_patch.weight = Weight::per_patch;
  QueryResult of_patches;
  ASSERT_EQ(traverse(shell, half_space, pose, by_patch, scratch, contacts, of_patches), Status::ok);
  ASSERT_NE(of_patches.force[2], result.force[2]) << "the asset has facets";
  expect_equal(c->patch_result, of_patches);

  const VpsSweep c_fall = falling(&c_pose);
  Sweep fall;
  fall.start = pose;
  fall.start.translation[2] = c_fall.start.translation[2];
  std::copy_n(c_fall.velocity, 3, fall.velocity);
  std::copy_n(c_fall.angular_velocity, 3, fall.angular_velocity);
  fall.duration = c_fall.duration;
  expect_distances(shell, map, fall, pose, c->map_separation, c->map_impact);
  expect_distances(shell, box, fall, pose, c->box_separation, c->box_impact);
  expect_distances(shell, sphere, fall, pose, c->sphere_separation, c->sphere_impact);
  expect_distances(shell, half_space, fall, pose, c->half_space_separation, c->half_space_impact);
  const Pose there = pose_at(shell, fall, c->map_impact.time);
  expect_equal<9>(c->impact_pose.rotation, there.rotation);
  expect_equal<3>(c->impact_pose.translation, there.translation);

  RayHit hit;
  ASSERT_EQ(cast_ray(map, {vec3(kRay.origin), vec3(kRay.direction), kRay.max_distance}, {0.001F}, hit), Status::ok);
  EXPECT_TRUE(hit.hit);
  EXPECT_EQ(c->ray_hit.hit, 1);
  EXPECT_EQ(c->ray_hit.distance, hit.distance);
  expect_equal(c->ray_hit.position, hit.position);
  expect_equal(c->ray_hit.outward_normal, hit.outward_normal);
  EXPECT_EQ(c->ray_hit.steps, hit.steps);
  ClosestPoint closest;
  ASSERT_EQ(closest_point(map, p, {kClosestPointOptions.tolerance_vx, kClosestPointOptions.max_iterations}, closest),
            Status::ok);
  EXPECT_TRUE(closest.converged);
  EXPECT_EQ(c->closest.converged, 1);
  EXPECT_EQ(c->closest.inside, closest.inside ? 1 : 0);
  expect_equal(c->closest.position, closest.position);
  expect_equal(c->closest.outward_normal, closest.outward_normal);
  EXPECT_EQ(c->closest.distance, closest.distance);
  EXPECT_EQ(c->closest.residual, closest.residual);
  EXPECT_EQ(c->closest.lower, closest.lower);
  EXPECT_EQ(c->closest.upper, closest.upper);
}

TEST(CInterface, MisuseGetsAStatus) {
  const TemporaryFolder folder;
  const bake::BakeOptions whole = all_fields(0.002);
  bake::BakeOptions no_map = whole;
  no_map.voxelmap = false;
  bake::BakeOptions no_shell = whole;
  no_shell.pointshell = no_shell.real = false;
  EXPECT_EQ(misuse(write(folder, "whole.vps.hdf", whole).c_str(), write(folder, "no_map.vps.hdf", no_map).c_str(),
                   write(folder, "no_shell.vps.hdf", no_shell).c_str()),
            0)
      << "line of tests/runtime/c/c_program.c";
}

TEST(CInterface, OpensAssetsInMemory) {
  const TemporaryFolder folder;
  const std::string text = read_file(write(folder, "whole.vps.hdf", all_fields(0.002)));
  std::vector<double> bytes(text.size() / sizeof(double) + 1);
  std::memcpy(bytes.data(), text.data(), text.size());
  VpsAssetInfo info{};
  EXPECT_EQ(open_in_memory(bytes.data(), text.size(), &info), 0) << "line of tests/runtime/c/c_program.c";
  EXPECT_EQ(info.voxel_size, 0.002);
  EXPECT_GT(info.points, 0U);
}

TEST(CInterface, ScalesAnAsset) {
  const TemporaryFolder folder;
  const std::string path = write(folder, "torus.vps.hdf", all_fields(0.002));
  VpsAsset* c = nullptr;
  ASSERT_EQ(vps_asset_open(path.c_str(), &c), vps_ok);
  const VpsPointshell* c_shell = nullptr;
  const VpsVoxelmap* c_map = nullptr;
  ASSERT_EQ(vps_asset_pointshell(c, &c_shell), vps_ok);
  ASSERT_EQ(vps_asset_voxelmap(c, vps_field_real, &c_map), vps_ok);
  // The area that a node stands for.
  const auto coarse_area = [&] {
    const VpsHalfSpace all{{0, 0, 1}, 10};
    VpsPose pose{};
    pose.rotation[0] = pose.rotation[4] = pose.rotation[8] = 1;
    VpsQueryOptions options{};
    options.level = 1;
    VpsScratch* scratch = nullptr;
    EXPECT_EQ(vps_scratch_create(&scratch), vps_ok);
    VpsContact contact{};
    VpsQueryResult result{};
    EXPECT_EQ(vps_traverse(c_shell, vps_half_space_ref(&all), &pose, &options, scratch, &contact, 1, &result), vps_ok);
    EXPECT_EQ(vps_scratch_destroy(scratch), vps_ok);
    return contact.area;
  };
  const float area = coarse_area();
  EXPECT_GT(area, 0);
  EXPECT_EQ(vps_asset_scale(c, 3), vps_ok);
  EXPECT_EQ(vps_asset_scale(c, 1e9), vps_bad_argument);  // without a change
  EXPECT_NEAR(coarse_area(), 9 * area, 1e-4 * area);
  Asset asset;
  ASSERT_EQ(Asset::open(path.c_str(), asset), Status::ok);
  VoxelmapView map;
  PointshellView shell;
  ASSERT_EQ(asset.voxelmap(map, Field::real, 3), Status::ok);
  ASSERT_EQ(asset.pointshell(shell, 3), Status::ok);
  VpsAssetInfo info{};
  ASSERT_EQ(vps_asset_info(c, &info), vps_ok);
  EXPECT_DOUBLE_EQ(info.volume, 27 * asset.info().volume);
  EXPECT_DOUBLE_EQ(info.voxel_size, 0.006);
  VpsPoint point{};
  ASSERT_EQ(vps_pointshell_point(c_shell, 5, &point), vps_ok);
  expect_equal(point.position, point_position(shell, 5));
  EXPECT_EQ(point.area, point_area(shell, 5));
  const float at[3] = {0.12F, 0.01F, 0.04F};
  float v = 0;
  ASSERT_EQ(vps_penetration(vps_map_ref(c_map), at, nullptr, &v), vps_bad_argument);  // a map wants a normal
  const float normal[3] = {0, 0, 1};
  ASSERT_EQ(vps_penetration(vps_map_ref(c_map), at, normal, &v), vps_ok);
  EXPECT_EQ(v, penetration(map, {at[0], at[1], at[2]}, {0, 0, 1}));
  EXPECT_EQ(vps_asset_close(c), vps_ok);
}

// Programs that are built for libvps.so.0 rely on it: another size needs another soname.
TEST(CInterface, StructsKeepTheirSizes) {
  const std::size_t sizes[] = {sizeof(VpsAssetInfo),
                               sizeof(VpsBox),
                               sizeof(VpsCertificate),
                               sizeof(VpsClosestPoint),
                               sizeof(VpsClosestPointOptions),
                               sizeof(VpsConstArray),
                               sizeof(VpsContact),
                               sizeof(VpsFieldRef),
                               sizeof(VpsHalfSpace),
                               sizeof(VpsImpactOptions),
                               sizeof(VpsImpactResult),
                               sizeof(VpsPenaltyLaw),
                               sizeof(VpsPoint),
                               sizeof(VpsPose),
                               sizeof(VpsQueryOptions),
                               sizeof(VpsQueryResult),
                               sizeof(VpsRay),
                               sizeof(VpsRayHit),
                               sizeof(VpsRays),
                               sizeof(VpsReduction),
                               sizeof(VpsSeparation),
                               sizeof(VpsSeparationOptions),
                               sizeof(VpsSphere),
                               sizeof(VpsSweep),
                               sizeof(VpsTwist),
                               sizeof(VpsWrench),
                               sizeof(VpsWrenchGradient)};
  const std::size_t expected[] = {552, 12, 56, 48, 8,  16, 40, 16, 16, 16,  96, 16, 28, 96,
                                  32,  80, 28, 36, 48, 24, 72, 8,  4,  152, 36, 48, 576};
  ASSERT_EQ(std::size(sizes), std::size(expected));
  for (std::size_t i = 0; i < std::size(sizes); ++i) EXPECT_EQ(sizes[i], expected[i]) << i;
}

TEST(CInterface, KnowsEveryStatus) {
  for (VpsStatus status = vps_ok; status <= vps_bad_argument; ++status) {
    EXPECT_STREQ(vps_status_text(status), describe(static_cast<Status>(status)));
  }
  EXPECT_STREQ(vps_status_text(vps_no_memory), describe(Status::no_memory));
  for (const VpsStatus unknown : {vps_bad_argument + 1, 255, 256, -1, INT32_MAX, INT32_MIN}) {
    EXPECT_STREQ(vps_status_text(unknown), "unknown status") << "a status that runtime/vps.h does not have";
  }
}

}  // namespace
}  // namespace vps::test
