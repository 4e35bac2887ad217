// SPDX-License-Identifier: Zlib
// A penalty integrator in C: a torque turns a nut down a fixed bolt, without friction. Contacts are springs.
// cc -std=c99 penalty.c $(pkg-config --cflags --libs vps-shared) -lm
#include <math.h>
#include <stdio.h>

#include "runtime/vps.h"

enum { kContacts = 32 };
static const double kStep = 5e-5, kSeconds = 0.4;                       // [s]
static const double kDensity = 7800, kStiffness = 2e9, kDamping = 3e5;  // [kg/m^3; per area: N/m^3, N s/m^3]
static const double kTorque = -1e-4, kPitch = 0.0015;                   // about the bolt; of its thread. [N m, m]

typedef struct {
  VpsStepBody body;
  VpsAssetInfo info;  // the asset's axes are the nut's axes of symmetry
  double centre[3], velocity[3], momentum[3], spin[3];
} Nut;

static void cross(const double a[3], const double b[3], double out[3]) {
  for (int i = 0; i < 3; ++i) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}
static double dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Adds the force and torque of one spring.
static void press(const Nut* nut, const VpsStepContact* contact, double force[3], double torque[3]) {
  const double normal[3] = {contact->normal[0], contact->normal[1], contact->normal[2]};
  double arm[3], turning[3], moment[3];
  for (int i = 0; i < 3; ++i) arm[i] = contact->position[i] - nut->centre[i];
  cross(nut->spin, arm, turning);
  cross(arm, normal, moment);
  const double apart = dot(normal, nut->velocity) + dot(normal, turning);
  const double size = fmax(kStiffness * contact->penetration - kDamping * apart, 0) * contact->area;
  for (int i = 0; i < 3; ++i) {
    force[i] += size * normal[i];
    torque[i] += size * moment[i];
  }
}

// Semi-implicit Euler: velocities first, then the pose.
static VpsStatus move(Nut* nut, const double force[3], const double torque[3]) {
  VpsSweep sweep = {.start = nut->body.pose};
  double* const r = nut->body.pose.rotation;  // row-major
  for (int i = 0; i < 3; ++i) {
    nut->velocity[i] += kStep * force[i] / (kDensity * nut->info.volume);
    nut->momentum[i] += kStep * torque[i];
  }
  for (int i = 0; i < 3; ++i) {
    nut->spin[i] = 0;
    for (int k = 0; k < 3; ++k) {
      const double axis[3] = {r[k], r[3 + k], r[6 + k]};
      nut->spin[i] += axis[i] * dot(axis, nut->momentum) / (kDensity * nut->info.inertia[k]);
    }
    sweep.angular_velocity[i] = nut->spin[i];
    nut->centre[i] += kStep * (sweep.velocity[i] = nut->velocity[i]);
  }
  return vps_sweep_pose(nut->body.shell, &sweep, kStep, &nut->body.pose);
}

static VpsStatus open_body(const char* path, double height, VpsStepBody* body, VpsAssetInfo* info) {
  VpsAsset* asset = NULL;  // open until the program ends
  const VpsVoxelmap* map = NULL;
  VpsStatus status = vps_asset_open(path, &asset);
  if (status == vps_ok) status = vps_asset_info(asset, info);
  if (status == vps_ok) status = vps_asset_voxelmap(asset, vps_field_finest, &map);
  if (status == vps_ok) status = vps_asset_pointshell(asset, &body->shell);
  body->field = vps_map_ref(map);
  for (int i = 0; i < 3; ++i) body->pose.rotation[4 * i] = 1;
  body->pose.translation[2] = height;
  return status;
}

int main(int argc, char** argv) {
  const VpsStepOptions options = {.use = vps_step_springs};
  VpsScratch* scratch = NULL;
  VpsStepBody bolt = {0};
  Nut nut = {0};
  double turned = 0, fallen = 0, off = 0;
  if (argc != 3) {
    fprintf(stderr, "usage: penalty BOLT NUT\n");
    return 1;
  }
  VpsStatus status = open_body(argv[1], 0, &bolt, &nut.info);
  if (status == vps_ok) status = open_body(argv[2], 3 * kPitch, &nut.body, &nut.info);
  if (status == vps_ok) status = vps_scratch_create(&scratch);
  for (int i = 0; i < 3; ++i) nut.centre[i] = nut.info.centre_of_mass[i] + nut.body.pose.translation[i];
  for (int step = 1; status == vps_ok && step * kStep <= kSeconds; ++step) {
    VpsStepContact contacts[kContacts];
    size_t count = 0;
    double force[3] = {0, 0, -9.81 * kDensity * nut.info.volume}, torque[3] = {0, 0, kTorque};
    status = vps_step_contacts(&nut.body, &bolt, &options, scratch, contacts, kContacts, &count);
    for (size_t i = 0; i < count; ++i) press(&nut, &contacts[i], force, torque);
    if (status == vps_ok) status = move(&nut, force, torque);
    turned += kStep * nut.spin[2];
    fallen -= kStep * nut.velocity[2];
    off = fmax(off, fabs(fallen + turned / 6.283185307179586 * kPitch));
    if (step % 2000 == 0) printf("%.1f s: turned %6.2f rad, fallen %5.2f mm\n", step * kStep, turned, 1000 * fallen);
  }
  vps_scratch_destroy(scratch);
  printf("%s; at most %.3f mm off the thread\n", vps_status_text(status), 1000 * off);
  return status == vps_ok && off < 0.00015 ? 0 : 1;  // the play
}
