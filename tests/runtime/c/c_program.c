// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/runtime/c/c_program.h"

#include <math.h>

#define EXPECT(condition) \
  if (!(condition)) return __LINE__

const VpsBox kBox = {{0.04F, 0.05F, 0.06F}};
const VpsSphere kSphere = {0.05F};
const VpsHalfSpace kHalfSpace = {{0, 0, 1}, 0.01F};
const VpsQueryOptions kOptions = {.contact_distance = 0.001F, .weight = vps_per_point};

const VpsPenaltyLaw kLaw = {1e8, 1e5};
const VpsTwist kTwist = {{0.001F, 0.002F, 0.003F}, {0.01F, 0, 0}, {0, 0.5F, 0}};

const VpsSeparationOptions kSeparationOptions = {0.0001F, 3};
const VpsImpactOptions kImpactOptions = {0.002F, 0.0002F, vps_contactor_points, 100};
const VpsRay kRay = {{0.04F, 0.01F, 0.3F}, {0, 0, -1}, 1};
const VpsClosestPointOptions kClosestPointOptions = {0.02F, 100};

VpsSweep falling(const VpsPose* pose) {
  VpsSweep sweep = {{{0}, {0}}, {0.01, 0, -1}, {1, 2, 3}, 0.5};
  sweep.start = *pose;
  sweep.start.translation[2] += 0.2;
  return sweep;
}

int open_in_memory(const void* bytes, size_t count, VpsAssetInfo* info) {
  VpsAsset* asset = NULL;
  const VpsVoxelmap* map = NULL;
  const VpsPointshell* shell = NULL;
  EXPECT(vps_asset_open_memory((const char*)bytes + 1, count - 1, vps_use_everything, &asset) == vps_bad_argument);
  EXPECT(vps_asset_open_memory(bytes, count - 1, vps_use_everything, &asset) == vps_wrong_size && asset == NULL);
  EXPECT(vps_asset_open_memory(bytes, count, vps_use_pointshell, &asset) == vps_ok);
  EXPECT(vps_asset_pointshell(asset, &shell) == vps_ok);
  EXPECT(vps_asset_voxelmap(asset, vps_field_finest, &map) == vps_missing_part);
  EXPECT(vps_asset_close(asset) == vps_ok);
  EXPECT(vps_asset_open_memory(bytes, count, vps_use_everything, &asset) == vps_ok);
  EXPECT(vps_asset_verify(asset) == vps_ok);
  EXPECT(vps_asset_voxelmap(asset, vps_field_finest, &map) == vps_ok);
  EXPECT(vps_asset_info(asset, info) == vps_ok);
  EXPECT(vps_asset_close(asset) == vps_ok);
  return 0;
}

int ask(const char* path, const VpsPose* pose, const float point[3], const float inward_normal[3], Answers* answers) {
  VpsAsset* asset = NULL;
  VpsScratch* scratch = NULL;
  const VpsVoxelmap* map = NULL;
  const VpsPointshell* shell = NULL;
  EXPECT(vps_asset_open(path, &asset) == vps_ok);
  EXPECT(vps_asset_verify(asset) == vps_ok);
  EXPECT(vps_asset_info(asset, &answers->info) == vps_ok);
  EXPECT(vps_asset_pointshell(asset, &shell) == vps_ok);
  EXPECT(vps_pointshell_point(shell, 7, &answers->point) == vps_ok);
  for (VpsField field = vps_field_real; field >= vps_field_finest; --field) {
    EXPECT(vps_asset_voxelmap(asset, field, &map) == vps_ok);
    EXPECT(vps_voxelmap_field(map, &answers->finest) == vps_ok);
    EXPECT(vps_penetration(vps_map_ref(map), point, inward_normal, &answers->penetration[field]) == vps_ok);
    EXPECT(vps_penetration_bound(map, point, &answers->bound[field]) == vps_ok);
    EXPECT(vps_outward_normal(vps_map_ref(map), point, answers->normal[field]) == vps_ok);
  }
  EXPECT(vps_penetration(vps_box_ref(&kBox), point, NULL, &answers->box) == vps_ok);
  EXPECT(vps_penetration(vps_sphere_ref(&kSphere), point, NULL, &answers->sphere) == vps_ok);
  EXPECT(vps_penetration(vps_half_space_ref(&kHalfSpace), point, NULL, &answers->half_space) == vps_ok);

  const VpsPose origin = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  VpsPose moved;
  EXPECT(vps_check_pose(pose) == vps_ok);
  EXPECT(vps_relative_pose(&origin, pose, &moved) == vps_ok);
  EXPECT(vps_scratch_create(&scratch) == vps_ok);
  EXPECT(vps_scratch_reserve(scratch, shell, kContacts) == vps_ok);
  EXPECT(vps_traverse(shell, vps_map_ref(map), &moved, &kOptions, scratch, answers->contacts, kContacts,
                      &answers->map_result) == vps_ok);
  EXPECT(vps_traverse(shell, vps_map_ref(map), &moved, &kOptions, scratch, answers->contacts, 2,
                      &answers->few_result) == vps_output_full);
  EXPECT(vps_traverse(shell, vps_box_ref(&kBox), &moved, NULL, scratch, NULL, 0, &answers->box_result) ==
         vps_output_full);
  EXPECT(vps_traverse(shell, vps_sphere_ref(&kSphere), &moved, NULL, scratch, NULL, 0, &answers->sphere_result) ==
         vps_output_full);
  EXPECT(vps_traverse(shell, vps_half_space_ref(&kHalfSpace), &moved, NULL, scratch, NULL, 0,
                      &answers->half_space_result) == vps_output_full);

  EXPECT(vps_separation(shell, vps_map_ref(map), &moved, &kSeparationOptions, scratch, &answers->map_separation) ==
         vps_ok);
  EXPECT(vps_separation(shell, vps_box_ref(&kBox), &moved, NULL, scratch, &answers->box_separation) == vps_ok);
  EXPECT(vps_separation(shell, vps_sphere_ref(&kSphere), &moved, NULL, scratch, &answers->sphere_separation) == vps_ok);
  EXPECT(vps_separation(shell, vps_half_space_ref(&kHalfSpace), &moved, NULL, scratch,
                        &answers->half_space_separation) == vps_ok);
  const VpsSweep fall = falling(&moved);
  EXPECT(vps_time_of_impact(shell, vps_map_ref(map), &fall, &kImpactOptions, scratch, &answers->map_impact) == vps_ok);
  EXPECT(vps_time_of_impact(shell, vps_box_ref(&kBox), &fall, NULL, scratch, &answers->box_impact) == vps_ok);
  EXPECT(vps_time_of_impact(shell, vps_sphere_ref(&kSphere), &fall, NULL, scratch, &answers->sphere_impact) == vps_ok);
  EXPECT(vps_time_of_impact(shell, vps_half_space_ref(&kHalfSpace), &fall, NULL, scratch,
                            &answers->half_space_impact) == vps_ok);
  EXPECT(vps_sweep_pose(shell, &fall, answers->map_impact.time, &answers->impact_pose) == vps_ok);
  EXPECT(vps_cast_ray(map, &kRay, 0.001F, &answers->ray_hit) == vps_ok);
  EXPECT(vps_closest_point(map, point, &kClosestPointOptions, &answers->closest) == vps_ok);
  EXPECT(vps_choose_roles(asset, asset, &answers->role) == vps_ok);
  EXPECT(vps_pointshell_segment_level(shell, 15, &answers->segment_level) == vps_ok);
  EXPECT(vps_outward_normal(vps_box_ref(&kBox), point, answers->box_normal) == vps_ok);
  EXPECT(vps_outward_normal(vps_sphere_ref(&kSphere), point, answers->sphere_normal) == vps_ok);
  const VpsQueryOptions by_patch = {.weight = vps_per_patch};
  EXPECT(vps_traverse(shell, vps_half_space_ref(&kHalfSpace), &moved, &by_patch, scratch, NULL, 0,
                      &answers->patch_result) == vps_output_full);
  const VpsQueryOptions coarse = {.level = 2};
  const VpsQueryOptions hasty = {.max_tests = 300};
  EXPECT(vps_traverse(shell, vps_map_ref(map), &moved, &coarse, scratch, NULL, 0, &answers->coarse_result) ==
         vps_output_full);
  EXPECT(vps_traverse(shell, vps_map_ref(map), &moved, &hasty, scratch, NULL, 0, &answers->hasty_result) ==
         vps_output_full);
  EXPECT(vps_asset_voxelmap(asset, vps_field_scaled, &map) == vps_ok);
  VpsQueryOptions cached = kOptions;
  EXPECT(vps_contact_cache_create(&cached.cache) == vps_ok);
  for (int i = 0; i < 3; ++i) {
    EXPECT(vps_traverse(shell, vps_map_ref(map), &moved, &cached, scratch, NULL, 0, &answers->cached_result) ==
           vps_output_full);
  }
  EXPECT(vps_contact_cache_destroy(cached.cache) == vps_ok);
  const uint32_t count = answers->map_result.contacts;
  EXPECT(vps_penalty_wrench(answers->contacts, count, &kLaw, &kTwist, &answers->wrench) == vps_ok);
  EXPECT(vps_penalty_gradient(answers->contacts, NULL, count, &kLaw, &kTwist, &answers->gradient) == vps_ok);
  EXPECT(vps_reduce_contacts(answers->contacts, count, kTwist.centre, scratch, answers->kept, kKept,
                             &answers->reduction) == vps_ok);
  const VpsStepBody first = {vps_map_ref(map), *pose, shell, NULL};
  const VpsStepBody second = {vps_map_ref(map), origin, shell, NULL};
  const VpsStepMotion rising = {.way = {0, 0, 0.01f}, .turn = {0.01f, 0, 0}, .radius = 0.1f};
  const VpsStepBody ground = {vps_half_space_ref(&kHalfSpace), origin, NULL, &rising};
  const VpsStepBody points = {vps_map_ref(NULL), *pose, shell, NULL};
  VpsStepOptions springs = {.use = vps_step_springs};
  EXPECT(vps_step_memory_create(&springs.memory) == vps_ok);
  for (int i = 0; i < 2; ++i) {
    EXPECT(vps_step_contacts(&first, &second, &springs, scratch, answers->step_contacts, kKept, &answers->step_count) ==
           vps_ok);
  }
  EXPECT(vps_step_memory_destroy(springs.memory) == vps_ok);
  EXPECT(vps_step_contacts(&points, &ground, NULL, scratch, answers->ground_contacts, kKept, &answers->ground_count) ==
         vps_ok);
  EXPECT(vps_scratch_destroy(scratch) == vps_ok);
  EXPECT(vps_asset_close(asset) == vps_ok);
  return 0;
}

#define REFUSED(call) EXPECT((call) == vps_bad_argument)

static int misuse_assets(const char* path, const char* no_map, const char* no_shell) {
  VpsAsset* asset = NULL;
  VpsAssetInfo info;
  const VpsVoxelmap* map = NULL;
  const VpsPointshell* shell = NULL;
  VpsField field;
  VpsPoint point;
  REFUSED(vps_asset_open(path, NULL));
  REFUSED(vps_asset_open(NULL, &asset));
  EXPECT(vps_asset_open("/", &asset) == vps_cannot_open && asset == NULL);
  EXPECT(vps_asset_close(NULL) == vps_ok);
  REFUSED(vps_asset_verify(NULL));
  REFUSED(vps_asset_info(NULL, &info));
  REFUSED(vps_asset_voxelmap(NULL, vps_field_finest, &map));
  REFUSED(vps_asset_pointshell(NULL, &shell));
  REFUSED(vps_voxelmap_field(NULL, &field));
  REFUSED(vps_pointshell_point(NULL, 0, &point));

  const double aligned[8] = {0};
  REFUSED(vps_asset_open_memory(NULL, sizeof(aligned), vps_use_everything, &asset));
  REFUSED(vps_asset_open_memory(aligned, sizeof(aligned), vps_use_everything, NULL));
  REFUSED(vps_asset_open_memory(aligned, sizeof(aligned), vps_use_everything + 1, &asset));
  EXPECT(vps_asset_open_memory(aligned, sizeof(aligned), vps_use_everything, &asset) == vps_too_short && asset == NULL);
  EXPECT(vps_asset_open(path, &asset) == vps_ok);
  REFUSED(vps_asset_info(asset, NULL));
  REFUSED(vps_asset_scale(NULL, 1));
  REFUSED(vps_asset_scale(asset, 0));
  REFUSED(vps_asset_scale(asset, -2));
  REFUSED(vps_asset_scale(asset, NAN));
  REFUSED(vps_asset_voxelmap(asset, vps_field_finest, NULL));
  REFUSED(vps_asset_voxelmap(asset, -1, &map));
  REFUSED(vps_asset_voxelmap(asset, vps_field_real + 1, &map));
  REFUSED(vps_asset_pointshell(asset, NULL));
  EXPECT(vps_asset_voxelmap(asset, vps_field_finest, &map) == vps_ok);
  EXPECT(vps_asset_pointshell(asset, &shell) == vps_ok);
  EXPECT(vps_asset_info(asset, &info) == vps_ok);
  REFUSED(vps_voxelmap_field(map, NULL));
  VpsShellRole role;
  uint32_t level;
  REFUSED(vps_choose_roles(NULL, asset, &role));
  REFUSED(vps_choose_roles(asset, NULL, &role));
  REFUSED(vps_choose_roles(asset, asset, NULL));
  REFUSED(vps_pointshell_segment_level(NULL, 15, &level));
  REFUSED(vps_pointshell_segment_level(shell, 15, NULL));
  REFUSED(vps_pointshell_point(shell, (uint32_t)info.points, &point));
  REFUSED(vps_pointshell_point(shell, 0, NULL));
  EXPECT(vps_asset_close(asset) == vps_ok);

  EXPECT(vps_asset_open(no_map, &asset) == vps_ok);
  EXPECT(vps_asset_voxelmap(asset, vps_field_finest, &map) == vps_missing_part && map == NULL);
  EXPECT(vps_choose_roles(asset, asset, &role) == vps_missing_part);
  EXPECT(vps_asset_pointshell(asset, &shell) == vps_ok);
  EXPECT(vps_asset_close(asset) == vps_ok);
  EXPECT(vps_asset_open(no_shell, &asset) == vps_ok);
  EXPECT(vps_asset_pointshell(asset, &shell) == vps_missing_part && shell == NULL);
  EXPECT(vps_asset_voxelmap(asset, vps_field_scaled, &map) == vps_ok);
  EXPECT(vps_asset_voxelmap(asset, vps_field_real, &map) == vps_missing_part && map == NULL);
  EXPECT(vps_asset_close(asset) == vps_ok);

  EXPECT(vps_asset_open_for(path, vps_use_pointshell, &asset) == vps_ok);
  EXPECT(vps_asset_voxelmap(asset, vps_field_finest, &map) == vps_missing_part && map == NULL);
  EXPECT(vps_asset_pointshell(asset, &shell) == vps_ok);
  EXPECT(vps_asset_close(asset) == vps_ok);
  REFUSED(vps_asset_open_for(path, 2 * vps_use_everything, &asset));
  REFUSED(vps_asset_open_for(path, -1, &asset));
  return 0;
}

static int misuse_points(const VpsVoxelmap* map) {
  const float at[3] = {0, 0, 0};
  const float nowhere[3] = {0, NAN, 0};
  const float endless[3] = {0, 0, INFINITY};
  const float distant[3] = {0, -1e19F, 0};
  const VpsBox huge = {{1, 1e19F, 1}};
  const VpsBox negative = {{1, 1, -1}};
  const VpsSphere shapeless = {NAN};
  const VpsHalfSpace slanted = {{1, 1, 1}, 0};
  float v = 42;
  float n[3];
  REFUSED(vps_penetration(vps_map_ref(NULL), at, at, &v));
  REFUSED(vps_penetration(vps_map_ref(map), NULL, at, &v));
  REFUSED(vps_penetration(vps_map_ref(map), at, NULL, &v));
  REFUSED(vps_penetration(vps_map_ref(map), at, at, NULL));
  REFUSED(vps_penetration(vps_map_ref(map), nowhere, at, &v));
  REFUSED(vps_penetration(vps_map_ref(map), at, endless, &v));
  REFUSED(vps_penetration(vps_map_ref(map), distant, at, &v));
  REFUSED(vps_penetration_bound(NULL, at, &v));
  REFUSED(vps_penetration_bound(map, NULL, &v));
  REFUSED(vps_penetration_bound(map, at, NULL));
  REFUSED(vps_penetration_bound(map, endless, &v));
  REFUSED(vps_penetration_bound(map, distant, &v));
  REFUSED(vps_outward_normal(vps_map_ref(NULL), at, n));
  REFUSED(vps_outward_normal(vps_map_ref(map), NULL, n));
  REFUSED(vps_outward_normal(vps_map_ref(map), at, NULL));
  REFUSED(vps_outward_normal(vps_map_ref(map), nowhere, n));
  REFUSED(vps_outward_normal(vps_map_ref(map), distant, n));
  REFUSED(vps_penetration(vps_box_ref(NULL), at, NULL, &v));
  REFUSED(vps_penetration(vps_box_ref(&negative), at, NULL, &v));
  REFUSED(vps_penetration(vps_box_ref(&huge), at, NULL, &v));
  REFUSED(vps_penetration(vps_box_ref(&kBox), NULL, NULL, &v));
  REFUSED(vps_penetration(vps_box_ref(&kBox), at, NULL, NULL));
  REFUSED(vps_penetration(vps_sphere_ref(NULL), at, NULL, &v));
  REFUSED(vps_penetration(vps_sphere_ref(&shapeless), at, NULL, &v));
  REFUSED(vps_penetration(vps_sphere_ref(&kSphere), nowhere, NULL, &v));
  REFUSED(vps_outward_normal(vps_box_ref(&negative), at, n));
  REFUSED(vps_outward_normal(vps_sphere_ref(&kSphere), nowhere, n));
  REFUSED(vps_penetration(vps_half_space_ref(NULL), at, NULL, &v));
  REFUSED(vps_penetration(vps_half_space_ref(&slanted), at, NULL, &v));
  REFUSED(vps_penetration(vps_half_space_ref(&kHalfSpace), endless, NULL, &v));
  EXPECT(v == 42);
  return 0;
}

static int misuse_queries(const VpsPointshell* shell, const VpsVoxelmap* map) {
  const VpsPose pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  const VpsPose mirror = {{1, 0, 0, 0, 1, 0, 0, 0, -1}, {0, 0, 0}};
  const VpsPose nowhere = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {NAN, 0, 0}};
  const VpsPose distant = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 1e300, 0}};
  const VpsQueryOptions inside = {.contact_distance = -1};
  const VpsQueryOptions endless = {.contact_distance = INFINITY};
  const VpsQueryOptions vast = {.contact_distance = 1e30F};
  const VpsQueryOptions weightless = {.weight = 7};
  const VpsQueryOptions deep = {.segment_level = UINT32_MAX};
  const VpsQueryOptions hasty = {.max_microseconds = -1};
  const VpsQueryOptions leisurely = {.max_microseconds = INFINITY};
  const VpsQueryOptions both = {.segment_level = 2, .level = 2};
  const VpsSphere negative = {-1};
  VpsScratch* s = NULL;
  VpsContact contact;
  VpsQueryResult r;
  VpsPose out;
  REFUSED(vps_check_pose(NULL));
  EXPECT(vps_check_pose(&mirror) == vps_bad_pose);
  REFUSED(vps_relative_pose(NULL, &pose, &out));
  REFUSED(vps_relative_pose(&pose, NULL, &out));
  REFUSED(vps_relative_pose(&pose, &pose, NULL));
  REFUSED(vps_relative_pose(&nowhere, &pose, &out));
  REFUSED(vps_scratch_create(NULL));
  EXPECT(vps_scratch_destroy(NULL) == vps_ok);
  EXPECT(vps_scratch_create(&s) == vps_ok);
  REFUSED(vps_scratch_reserve(NULL, shell, 0));
  REFUSED(vps_scratch_reserve(s, NULL, 0));
  EXPECT(vps_scratch_reserve(s, shell, SIZE_MAX) == vps_ok);

  r.contacts = 42;
  REFUSED(vps_traverse(NULL, vps_map_ref(map), &pose, NULL, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(NULL), &pose, NULL, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(map), NULL, NULL, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(map), &pose, NULL, NULL, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(map), &pose, NULL, s, NULL, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(map), &pose, NULL, s, &contact, 1, NULL));
  REFUSED(vps_traverse(shell, vps_map_ref(map), &pose, &inside, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(map), &pose, &endless, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(map), &pose, &vast, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(map), &pose, &weightless, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(map), &pose, &hasty, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(map), &pose, &leisurely, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_map_ref(map), &pose, &both, s, &contact, 1, &r));
  EXPECT(vps_traverse(shell, vps_map_ref(map), &mirror, NULL, s, &contact, 1, &r) == vps_bad_pose);
  EXPECT(vps_traverse(shell, vps_map_ref(map), &nowhere, NULL, s, &contact, 1, &r) == vps_bad_pose);
  REFUSED(vps_traverse(shell, vps_box_ref(NULL), &pose, NULL, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_sphere_ref(NULL), &pose, NULL, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_sphere_ref(&negative), &pose, NULL, s, &contact, 1, &r));
  REFUSED(vps_traverse(shell, vps_half_space_ref(NULL), &pose, NULL, s, &contact, 1, &r));
  const VpsFieldRef unknown = {vps_kind_half_space + 1, &kBox};
  REFUSED(vps_traverse(shell, unknown, &pose, NULL, s, &contact, 1, &r));
  EXPECT(r.contacts == 42);

  EXPECT(vps_traverse(shell, vps_map_ref(map), &pose, &deep, s, &contact, 1, &r) == vps_output_full);
  EXPECT(vps_traverse(shell, vps_map_ref(map), &distant, NULL, s, &contact, 1, &r) == vps_bad_pose);
  EXPECT(vps_scratch_destroy(s) == vps_ok);
  return 0;
}

static int misuse_contacts(void) {
  const VpsContact contact = {{0, 0, 0}, {0, 0, 1}, 0.001F, 1e-6F, 0, 0};
  const VpsContact endless_area = {{0, 0, 0}, {0, 0, 1}, 0.001F, NAN, 0, 0};
  const VpsContact deep = {{0, 0, 0}, {0, 0, 1}, 1e3F, 1e3F, 0, 0};
  const VpsContact endless_depth = {{0, 0, 0}, {0, 0, 1}, INFINITY, 1e-6F, 0, 0};
  const VpsContact negative_area = {{0, 0, 0}, {0, 0, 1}, 0.001F, -1e-6F, 0, 0};
  const VpsPenaltyLaw pulling = {-1, 0};
  const VpsPenaltyLaw endless_force = {1e308, 1e308};
  const VpsTwist endless = {{0, 0, 0}, {INFINITY, 0, 0}, {0, 0, 0}};
  const float nowhere[3] = {NAN, 0, 0};
  VpsScratch* s = NULL;
  VpsContact kept;
  VpsReduction reduction;
  VpsWrench w;
  VpsWrenchGradient g;
  VpsContactCache* cache = NULL;
  REFUSED(vps_contact_cache_create(NULL));
  EXPECT(vps_contact_cache_create(&cache) == vps_ok);
  EXPECT(vps_contact_cache_destroy(cache) == vps_ok);
  EXPECT(vps_contact_cache_destroy(NULL) == vps_ok);
  w.force[0] = 42;
  REFUSED(vps_penalty_wrench(NULL, 1, &kLaw, &kTwist, &w));
  REFUSED(vps_penalty_wrench(&contact, 1, NULL, &kTwist, &w));
  REFUSED(vps_penalty_wrench(&contact, 1, &kLaw, NULL, &w));
  REFUSED(vps_penalty_wrench(&contact, 1, &kLaw, &kTwist, NULL));
  REFUSED(vps_penalty_wrench(&contact, 1, &pulling, &kTwist, &w));
  REFUSED(vps_penalty_wrench(&contact, 1, &kLaw, &endless, &w));
  REFUSED(vps_penalty_wrench(&endless_area, 1, &kLaw, &kTwist, &w));
  REFUSED(vps_penalty_wrench(&negative_area, 1, &kLaw, &kTwist, &w));
  REFUSED(vps_penalty_wrench(&deep, 1, &endless_force, &kTwist, &w));
  EXPECT(w.force[0] == 42);
  EXPECT(vps_penalty_wrench(NULL, 0, &kLaw, &kTwist, &w) == vps_ok && w.force[0] == 0);
  REFUSED(vps_penalty_gradient(NULL, NULL, 1, &kLaw, &kTwist, &g));
  REFUSED(vps_penalty_gradient(&contact, NULL, 1, NULL, &kTwist, &g));
  REFUSED(vps_penalty_gradient(&contact, NULL, 1, &kLaw, NULL, &g));
  REFUSED(vps_penalty_gradient(&contact, NULL, 1, &kLaw, &kTwist, NULL));
  REFUSED(vps_penalty_gradient(&contact, NULL, 1, &pulling, &kTwist, &g));
  REFUSED(vps_penalty_gradient(&contact, nowhere, 1, &kLaw, &kTwist, &g));
  REFUSED(vps_penalty_gradient(&deep, NULL, 1, &endless_force, &kTwist, &g));
  EXPECT(vps_scratch_create(&s) == vps_ok);
  REFUSED(vps_reduce_contacts(NULL, 1, kTwist.centre, s, &kept, 1, &reduction));
  REFUSED(vps_reduce_contacts(&contact, 1, NULL, s, &kept, 1, &reduction));
  REFUSED(vps_reduce_contacts(&endless_depth, 1, kTwist.centre, s, &kept, 1, &reduction));
  REFUSED(vps_reduce_contacts(&contact, 1, nowhere, s, &kept, 1, &reduction));
  REFUSED(vps_reduce_contacts(&contact, 1, kTwist.centre, NULL, &kept, 1, &reduction));
  REFUSED(vps_reduce_contacts(&contact, 1, kTwist.centre, s, NULL, 1, &reduction));
  REFUSED(vps_reduce_contacts(&contact, 1, kTwist.centre, s, &kept, 0, &reduction));
  REFUSED(vps_reduce_contacts(&contact, 1, kTwist.centre, s, &kept, 1, NULL));
  EXPECT(vps_reduce_contacts(NULL, 0, kTwist.centre, s, &kept, 1, &reduction) == vps_ok && reduction.kept == 0);
  EXPECT(vps_scratch_destroy(s) == vps_ok);
  return 0;
}

static int misuse_steps(const VpsPointshell* shell, const VpsVoxelmap* map) {
  const VpsPose pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  const VpsPose nowhere = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {NAN, 0, 0}};
  const VpsStepBody body = {vps_map_ref(map), pose, shell, NULL};
  const VpsStepBody lost = {vps_map_ref(map), nowhere, shell, NULL};
  const VpsStepBody nothing = {vps_map_ref(NULL), pose, NULL, NULL};
  const VpsStepBody ground = {vps_half_space_ref(&kHalfSpace), pose, NULL, NULL};
  const VpsStepMotion endless = {.way = {NAN, 0, 0}};
  const VpsStepMotion inverted = {.radius = -1};
  const VpsStepBody thrown = {vps_map_ref(map), pose, shell, &endless};
  const VpsStepBody negative = {vps_map_ref(map), pose, shell, &inverted};
  const VpsStepOptions inside = {-1, vps_step_samples, NULL};
  const VpsStepMotion far_off = {.centre = {2e15, 0, 0}};
  const VpsStepBody afar = {vps_map_ref(map), pose, shell, &far_off};
  const VpsStepOptions wide = {2e15F, vps_step_samples, NULL};
  const VpsStepOptions other = {0, vps_step_springs + 1, NULL};
  VpsStepMemory* memory = NULL;
  VpsScratch* s = NULL;
  VpsStepContact c;
  size_t count = 42;
  REFUSED(vps_step_memory_create(NULL));
  EXPECT(vps_step_memory_create(&memory) == vps_ok && vps_step_memory_destroy(memory) == vps_ok);
  EXPECT(vps_step_memory_destroy(NULL) == vps_ok);
  EXPECT(vps_scratch_create(&s) == vps_ok);
  REFUSED(vps_step_contacts(NULL, &ground, NULL, s, &c, 1, &count));
  REFUSED(vps_step_contacts(&body, NULL, NULL, s, &c, 1, &count));
  REFUSED(vps_step_contacts(&body, &ground, NULL, NULL, &c, 1, &count));
  REFUSED(vps_step_contacts(&body, &ground, NULL, s, NULL, 1, &count));
  REFUSED(vps_step_contacts(&body, &ground, NULL, s, &c, 0, &count));
  REFUSED(vps_step_contacts(&body, &ground, NULL, s, &c, 1, NULL));
  REFUSED(vps_step_contacts(&body, &ground, &inside, s, &c, 1, &count));
  REFUSED(vps_step_contacts(&body, &ground, &other, s, &c, 1, &count));
  REFUSED(vps_step_contacts(&nothing, &ground, NULL, s, &c, 1, &count));
  REFUSED(vps_step_contacts(&thrown, &ground, NULL, s, &c, 1, &count));
  REFUSED(vps_step_contacts(&negative, &ground, NULL, s, &c, 1, &count));
  REFUSED(vps_step_contacts(&afar, &ground, NULL, s, &c, 1, &count));
  REFUSED(vps_step_contacts(&body, &ground, &wide, s, &c, 1, &count));
  EXPECT(vps_step_contacts(&ground, &ground, NULL, s, &c, 1, &count) == vps_missing_part);
  EXPECT(vps_step_contacts(&lost, &ground, NULL, s, &c, 1, &count) == vps_bad_pose);
  EXPECT(count == 42);
  EXPECT(vps_scratch_destroy(s) == vps_ok);
  return 0;
}

static int misuse_distances(const VpsPointshell* shell, const VpsVoxelmap* map) {
  const VpsPose pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
  const VpsPose mirror = {{1, 0, 0, 0, 1, 0, 0, 0, -1}, {0, 0, 0}};
  const VpsSeparationOptions less = {-1, 0};
  const VpsSeparationOptions beyond = {0, UINT32_MAX};
  const VpsSweep rest = {{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, {0, 0, 0}, {0, 0, 0}, 1};
  const VpsSweep endless = {{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, {0, 0, 0}, {0, NAN, 0}, 1};
  const VpsSeparationOptions rough = {2e15F, 0};
  const VpsSweep away = {{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, {0, 0, 1}, {0, 0, 0}, 1};
  const VpsImpactOptions shapeless = {0, 1e-4F, 7, 100};
  const VpsImpactOptions zero = {0, 0, 0, 0};
  const VpsImpactOptions wide = {2e15F, 1e-4F, vps_contactor_surface, 100};
  const VpsImpactOptions loose = {0, 2e15F, vps_contactor_surface, 100};
  const VpsRay nowhere = {{0, NAN, 0}, {0, 0, 1}, 1};
  const VpsRay lost = {{0, 0, 0}, {0, 0, 0}, 1};
  const VpsClosestPointOptions none = {0, 0};
  const VpsSphere negative = {-1};
  const float at[3] = {0, 0, 0};
  const float far_off[3] = {0, 0, INFINITY};
  VpsScratch* s = NULL;
  VpsSeparation r;
  VpsImpactResult impact;
  VpsPose out;
  VpsRayHit hit;
  VpsClosestPoint closest;
  EXPECT(vps_scratch_create(&s) == vps_ok);
  r.point = impact.iterations = hit.steps = 42;
  closest.upper = 42;
  REFUSED(vps_separation(NULL, vps_map_ref(map), &pose, NULL, s, &r));
  REFUSED(vps_separation(shell, vps_map_ref(NULL), &pose, NULL, s, &r));
  REFUSED(vps_separation(shell, vps_map_ref(map), NULL, NULL, s, &r));
  REFUSED(vps_separation(shell, vps_map_ref(map), &pose, NULL, NULL, &r));
  REFUSED(vps_separation(shell, vps_map_ref(map), &pose, NULL, s, NULL));
  REFUSED(vps_separation(shell, vps_map_ref(map), &pose, &less, s, &r));
  REFUSED(vps_separation(shell, vps_map_ref(map), &pose, &rough, s, &r));
  REFUSED(vps_separation(shell, vps_map_ref(map), &pose, &beyond, s, &r));
  EXPECT(vps_separation(shell, vps_map_ref(map), &mirror, NULL, s, &r) == vps_bad_pose);
  REFUSED(vps_separation(shell, vps_box_ref(NULL), &pose, NULL, s, &r));
  REFUSED(vps_separation(shell, vps_sphere_ref(&negative), &pose, NULL, s, &r));
  REFUSED(vps_separation(shell, vps_half_space_ref(NULL), &pose, NULL, s, &r));
  REFUSED(vps_time_of_impact(NULL, vps_map_ref(map), &rest, NULL, s, &impact));
  REFUSED(vps_time_of_impact(shell, vps_map_ref(NULL), &rest, NULL, s, &impact));
  REFUSED(vps_time_of_impact(shell, vps_map_ref(map), NULL, NULL, s, &impact));
  REFUSED(vps_time_of_impact(shell, vps_map_ref(map), &rest, NULL, NULL, &impact));
  REFUSED(vps_time_of_impact(shell, vps_map_ref(map), &rest, NULL, s, NULL));
  REFUSED(vps_time_of_impact(shell, vps_map_ref(map), &endless, NULL, s, &impact));
  REFUSED(vps_time_of_impact(shell, vps_map_ref(map), &rest, &shapeless, s, &impact));
  REFUSED(vps_time_of_impact(shell, vps_map_ref(map), &rest, &zero, s, &impact));
  REFUSED(vps_time_of_impact(shell, vps_map_ref(map), &rest, &wide, s, &impact));
  REFUSED(vps_time_of_impact(shell, vps_map_ref(map), &rest, &loose, s, &impact));
  REFUSED(vps_time_of_impact(shell, vps_box_ref(NULL), &rest, NULL, s, &impact));
  REFUSED(vps_time_of_impact(shell, vps_sphere_ref(&negative), &rest, NULL, s, &impact));
  REFUSED(vps_time_of_impact(shell, vps_half_space_ref(NULL), &rest, NULL, s, &impact));
  REFUSED(vps_sweep_pose(NULL, &rest, 0, &out));
  REFUSED(vps_sweep_pose(shell, NULL, 0, &out));
  REFUSED(vps_sweep_pose(shell, &rest, NAN, &out));
  REFUSED(vps_sweep_pose(shell, &away, 1e38, &out));
  REFUSED(vps_sweep_pose(shell, &rest, 0, NULL));
  REFUSED(vps_sweep_pose(shell, &endless, 0, &out));
  REFUSED(vps_cast_ray(NULL, &kRay, 0.01F, &hit));
  REFUSED(vps_cast_ray(map, NULL, 0.01F, &hit));
  REFUSED(vps_cast_ray(map, &kRay, 0, &hit));
  REFUSED(vps_cast_ray(map, &kRay, INFINITY, &hit));
  REFUSED(vps_cast_ray(map, &kRay, 0.01F, NULL));
  REFUSED(vps_cast_ray(map, &nowhere, 0.01F, &hit));
  REFUSED(vps_cast_ray(map, &lost, 0.01F, &hit));
  REFUSED(vps_closest_point(NULL, at, NULL, &closest));
  REFUSED(vps_closest_point(map, NULL, NULL, &closest));
  REFUSED(vps_closest_point(map, far_off, NULL, &closest));
  REFUSED(vps_closest_point(map, at, &none, &closest));
  REFUSED(vps_closest_point(map, at, NULL, NULL));
  EXPECT(r.point == 42 && impact.iterations == 42 && hit.steps == 42 && closest.upper == 42);
  EXPECT(vps_scratch_destroy(s) == vps_ok);
  return 0;
}

int misuse(const char* path, const char* no_map, const char* no_shell) {
  VpsAsset* asset = NULL;
  const VpsVoxelmap* map = NULL;
  const VpsPointshell* shell = NULL;
  int line = misuse_assets(path, no_map, no_shell);
  if (line != 0) return line;
  EXPECT(vps_asset_open(path, &asset) == vps_ok);
  EXPECT(vps_asset_voxelmap(asset, vps_field_finest, &map) == vps_ok);
  EXPECT(vps_asset_pointshell(asset, &shell) == vps_ok);
  line = misuse_points(map);
  if (line == 0) line = misuse_queries(shell, map);
  if (line == 0) line = misuse_contacts();
  if (line == 0) line = misuse_steps(shell, map);
  if (line == 0) line = misuse_distances(shell, map);
  EXPECT(vps_asset_close(asset) == vps_ok);
  return line;
}
