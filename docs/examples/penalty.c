// SPDX-License-Identifier: Zlib
// A penalty integrator in C: a torque turns a nut down a fixed bolt, without friction. Contacts are springs.
// cc -std=c99 penalty.c $(pkg-config --cflags --libs vps-shared) -lm; usage: penalty BOLT NUT
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "runtime/vps.h"

enum { kContacts = 32 };
static const double kStep = 5e-5, kSeconds = 0.4;      // [s]
static const double kDensity = 7800;                   // [kg/m^3]
static const double kStiffness = 2e9, kDamping = 3e5;  // of a surface, per area. [N/m^3, N s/m^3]
static const double kTorque = -1e-4;                   // about the bolt. [N m]
static const double kPitch = 0.0015, kTwoPi = 6.283185307179586;

typedef struct {
  double mass, inertia[3];  // about the asset's axes, which are the nut's axes of symmetry
  double centre[3];         // of mass, asset frame
  double position[3];       // of the centre of mass, world
  double velocity[3], momentum[3], spin[3];
  VpsStepBody body;
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
  for (int i = 0; i < 3; ++i) arm[i] = contact->position[i] - nut->position[i];
  cross(nut->spin, arm, turning);
  const double apart = dot(normal, nut->velocity) + dot(normal, turning);
  const double pressure = kStiffness * contact->penetration - kDamping * apart;
  const double size = fmax(pressure, 0) * contact->area;
  cross(arm, normal, moment);
  for (int i = 0; i < 3; ++i) {
    force[i] += size * normal[i];
    torque[i] += size * moment[i];
  }
}

// Semi-implicit Euler: velocities first, then the pose.
static void move(Nut* nut, const double force[3], const double torque[3]) {
  double* const r = nut->body.pose.rotation;  // row-major
  double axes[3][3], about[3];
  for (int i = 0; i < 3; ++i) {
    nut->velocity[i] += kStep * force[i] / nut->mass;
    nut->position[i] += kStep * nut->velocity[i];
    nut->momentum[i] += kStep * torque[i];
  }
  memset(nut->spin, 0, sizeof nut->spin);
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 3; ++i) axes[k][i] = r[3 * i + k];
    const double rate = dot(axes[k], nut->momentum) / nut->inertia[k];
    for (int i = 0; i < 3; ++i) nut->spin[i] += rate * axes[k][i];
  }
  for (int k = 0; k < 2; ++k) {  // turns two axes; the third is at right angles to both
    cross(nut->spin, axes[k], about);
    const double along = k == 1 ? dot(axes[0], axes[1]) + kStep * dot(axes[0], about) : 0;
    for (int i = 0; i < 3; ++i) axes[k][i] += kStep * about[i] - along * axes[0][i];
    const double size = sqrt(dot(axes[k], axes[k]));
    for (int i = 0; i < 3; ++i) axes[k][i] /= size;
  }
  cross(axes[0], axes[1], axes[2]);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) r[3 * i + k] = axes[k][i];
    nut->body.pose.translation[i] = nut->position[i] - dot(r + 3 * i, nut->centre);
  }
}

static VpsStatus open_body(const char* path, VpsAsset** asset, VpsStepBody* body) {
  const VpsVoxelmap* map = NULL;
  VpsStatus status = vps_asset_open(path, asset);
  if (status == vps_ok) status = vps_asset_voxelmap(*asset, vps_field_finest, &map);
  if (status == vps_ok) status = vps_asset_pointshell(*asset, &body->shell);
  body->field = vps_map_ref(map);
  for (int i = 0; i < 3; ++i) body->pose.rotation[4 * i] = 1;
  return status;
}

static VpsStatus turn(Nut* nut, const VpsStepBody* bolt, VpsScratch* scratch, double* off) {
  const VpsStepOptions options = {.use = vps_step_springs};
  const double start = nut->position[2];
  double turned = 0;
  for (int step = 1; step * kStep <= kSeconds; ++step) {
    VpsStepContact contacts[kContacts];
    size_t count = 0;
    const VpsStatus status = vps_step_contacts(&nut->body, bolt, &options, scratch, contacts, kContacts, &count);
    if (status != vps_ok) return status;
    double force[3] = {0, 0, -9.81 * nut->mass}, torque[3] = {0, 0, kTorque};
    for (size_t i = 0; i < count; ++i) press(nut, &contacts[i], force, torque);
    move(nut, force, torque);
    turned += kStep * nut->spin[2];
    const double fallen = start - nut->position[2];
    *off = fmax(*off, fabs(fallen + turned / kTwoPi * kPitch));
    if (step % 2000 == 0) printf("%.1f s: turned %6.2f rad, fallen %5.2f mm\n", step * kStep, turned, 1000 * fallen);
  }
  return vps_ok;
}

int main(int argc, char** argv) {
  VpsAsset *bolt_asset = NULL, *nut_asset = NULL;
  VpsScratch* scratch = NULL;
  VpsStepBody bolt = {0};
  VpsAssetInfo info;
  Nut nut = {0};
  double off = 0;
  VpsStatus status = argc == 3 ? open_body(argv[1], &bolt_asset, &bolt) : vps_bad_argument;
  if (status == vps_ok) status = open_body(argv[2], &nut_asset, &nut.body);
  if (status == vps_ok) status = vps_asset_info(nut_asset, &info);
  if (status == vps_ok) status = vps_scratch_create(&scratch);
  if (status == vps_ok) {
    nut.body.pose.translation[2] = 3 * kPitch;
    nut.mass = kDensity * info.volume;
    for (int i = 0; i < 3; ++i) {
      nut.inertia[i] = kDensity * info.inertia[i];
      nut.centre[i] = info.centre_of_mass[i];
      nut.position[i] = nut.centre[i] + nut.body.pose.translation[i];
    }
    status = turn(&nut, &bolt, scratch, &off);
  }
  vps_scratch_destroy(scratch);
  vps_asset_close(nut_asset);
  vps_asset_close(bolt_asset);
  if (status != vps_ok) {
    fprintf(stderr, "penalty: %s\n", vps_status_text(status));
    return 1;
  }
  printf("at most %.3f mm off the thread\n", 1000 * off);
  return off < 0.00015 ? 0 : 1;  // the play
}
