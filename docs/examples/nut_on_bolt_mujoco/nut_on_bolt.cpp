// SPDX-License-Identifier: Zlib
// A torque turns a nut down a bolt in MuJoCo: docs/mujoco.md. Without assets both collide as MuJoCo's hulls.
// usage: nut_on_bolt MODEL [BOLT NUT]
#include <cmath>
#include <cstdio>

#include "runtime/mujoco/vps_mujoco.h"

namespace {

constexpr double kPitch = 0.0015;  // [m]
constexpr double kTorque = -1e-4;  // about the bolt's axis. [N m]
constexpr double kSeconds = 0.5;
constexpr double kTwoPi = 6.283185307179586;

bool bake(vps::mujoco::BakedModel& baked, const char* mesh, const char* file) {
  auto asset = std::make_shared<vps::Asset>();
  if (const vps::Status status = vps::Asset::open(file, *asset); status != vps::Status::ok) {
    std::fprintf(stderr, "nut_on_bolt: %s: %s\n", file, vps::describe(status));
    return false;
  }
  vps::mujoco::MeshOptions options;
  options.use = vps::StepUse::samples;  // they fit closely
  const std::string wrong = baked.bake(mesh, asset, options);
  if (!wrong.empty()) std::fprintf(stderr, "nut_on_bolt: %s: %s\n", file, wrong.c_str());
  return wrong.empty();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 4) {
    std::fprintf(stderr, "usage: nut_on_bolt MODEL [BOLT NUT]\n");
    return 1;
  }
  char error[500] = "";
  mjModel* const model = mj_loadXML(argv[1], nullptr, error, sizeof error);
  if (model == nullptr) {
    std::fprintf(stderr, "nut_on_bolt: %s\n", error);
    return 1;
  }
  mjData* const data = mj_makeData(model);
  bool follows = true;
  {
    // It must end before the model.
    vps::mujoco::BakedModel baked(*model);
    if (argc == 4 && !(bake(baked, "bolt", argv[2]) && bake(baked, "nut", argv[3]))) return 1;
    const int nut = mj_name2id(model, mjOBJ_BODY, "nut");
    const double start = data->qpos[2];
    double turned = 0;
    double last = 0;
    const int steps = static_cast<int>(kSeconds / model->opt.timestep);
    for (int step = 1; step <= steps; ++step) {
      data->xfrc_applied[6 * nut + 5] = kTorque;
      mj_step(model, data);
      const double angle = 2 * std::atan2(data->qpos[6], data->qpos[3]);
      turned += std::remainder(angle - last, kTwoPi);
      last = angle;
      const double fallen = start - data->qpos[2];
      // Within the play of the thread.
      follows = follows && std::abs(fallen + turned / kTwoPi * kPitch) < 0.00015;
      if (step % (steps / 5) == 0)
        std::printf("%.1f s: turned %6.2f rad, fallen %5.2f mm, %d contacts\n", data->time, turned, 1000 * fallen,
                    data->ncon);
    }
    follows = follows && turned < -5;
  }
  mj_deleteData(data);
  mj_deleteModel(model);
  std::puts(follows ? "the nut follows the thread" : "the nut does not follow the thread");
  return follows ? 0 : 1;
}
