// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A C99 program that uses the runtime. The C++ test compares its results with those of the C++ interface.
#pragma once

#include "runtime/vps.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { kContacts = 20000, kKept = 8 };

typedef struct Answers {
  VpsAssetInfo info;
  VpsField finest;
  VpsPoint point;        // number 7
  float penetration[4];  // by VpsField
  float bound[4];
  float normal[4][3];
  float box, sphere, half_space;  // penetration
  VpsQueryResult map_result, box_result, sphere_result, half_space_result, few_result;
  VpsContact contacts[kContacts];  // of the map
  VpsShellRole role;
  uint32_t segment_level;  // for 15
  float box_normal[3], sphere_normal[3];
  VpsQueryResult coarse_result, hasty_result;  // level 2, 300 tests
  VpsQueryResult cached_result;                // second query with a cache, scaled field
  VpsQueryResult patch_result;                 // vps_per_patch, half-space
  VpsWrench wrench;                            // of the contacts
  VpsWrenchGradient gradient;
  VpsContact kept[kKept];
  VpsReduction reduction;
  VpsStepContact step_contacts[kKept];  // two steps with a memory: of itself, of the half space
  size_t step_count, ground_count;
  VpsStepContact ground_contacts[kKept];
  VpsSeparation map_separation, box_separation, sphere_separation, half_space_separation;
  VpsImpactResult map_impact, box_impact, sphere_impact, half_space_impact;
  VpsPose impact_pose;
  VpsRayHit ray_hit;
  VpsClosestPoint closest;
} Answers;

/// Inputs of `ask`.
extern const VpsPenaltyLaw kLaw;
extern const VpsTwist kTwist;
extern const VpsSeparationOptions kSeparationOptions;
extern const VpsImpactOptions kImpactOptions;
extern const VpsRay kRay;
extern const VpsClosestPointOptions kClosestPointOptions;

/// A sweep from the shell's pose downwards.
VpsSweep falling(const VpsPose* pose);

/// Calls every query once. Both bodies are the same asset, the shell moved by `pose`.
/// @return 0, or the line of the first call that did not return what it should
int ask(const char* path, const VpsPose* pose, const float point[3], const float inward_normal[3], Answers* answers);

/// Opens an asset in memory. Tries a misaligned address and truncated bytes as well.
/// @param bytes  of a whole file with both parts, aligned to 8
/// @param info   of the asset
/// @return 0, or the line of the first call that did not return what it should
int open_in_memory(const void* bytes, size_t count, VpsAssetInfo* info);

/// Passes NULL for every pointer in turn, and arguments out of range.
/// @param no_map    an asset without a voxelmap
/// @param no_shell  an asset without a pointshell
/// @return 0, or the line of the first call that did not return what it should
int misuse(const char* path, const char* no_map, const char* no_shell);

#ifdef __cplusplus
}
#endif
