// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A MuJoCo model from XML and meshes in memory, with baked meshes.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/mujoco/vps_mujoco.h"
#include "runtime/vps_queries.h"
#include "tests/support/baked.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {

/// A mesh with its asset, for one or more bodies of a model.
struct MujocoMesh {
  std::string name;
  TriangleMesh mesh;
  std::shared_ptr<Asset> asset;
};
inline MujocoMesh mujoco_mesh(const std::string& name, const TriangleMesh& mesh, double voxel) {
  bake::BakeOptions options;
  options.voxel_size = voxel;
  return {name, mesh, baked(mesh, options)};
}

/// `<inertial>` of a body of an asset's mass properties. @param density  [kg/m^3]
inline std::string inertial(const Asset& asset, double density) {
  const AssetInfo& info = asset.info();
  const auto& c = info.centre_of_mass;
  const auto& i = info.inertia;
  return fmt::format(R"(<inertial pos="{} {} {}" mass="{}" fullinertia="{} {} {} {} {} {}"/>)", c[0], c[1], c[2],
                     density * info.volume, density * i[0], density * i[1], density * i[2], density * i[3],
                     density * i[4], density * i[5]);
}

/// Whether meshes collide as assets or as MuJoCo's hulls.
enum class Collide { baked, as_hulls };

class MujocoWorld {
 public:
  /// @param options  attributes of <option>
  /// @param bodies   what <worldbody> holds; geoms refer to the meshes by their names
  MujocoWorld(const std::vector<MujocoMesh>& meshes, const std::string& options, const std::string& bodies) {
    // Without a handler MuJoCo writes a file of warnings.
    mju_user_warning = [](const char*) {};
    std::string xml =
        "<mujoco><compiler angle=\"degree\"/><size nconmax=\"500\" njmax=\"3000\"/><option " + options + "/><asset>";
    for (const MujocoMesh& mesh : meshes) {
      std::ofstream file(folder_ / (mesh.name + ".obj"));
      file.precision(9);
      for (const auto& v : mesh.mesh.vertices) file << "v " << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
      for (const auto& t : mesh.mesh.triangles) file << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
      xml += fmt::format(R"(<mesh name="{0}" file="{0}.obj"/>)", mesh.name);
    }
    xml += "</asset><worldbody>" + bodies + "</worldbody></mujoco>";
    const std::string path = folder_ / "model.xml";
    std::ofstream(path) << xml;
    char error[1000] = "";
    model.reset(mj_loadXML(path.c_str(), nullptr, error, sizeof error));
    EXPECT_NE(model, nullptr) << error;
    if (model != nullptr) data.reset(mj_makeData(model.get()));
  }

  struct Delete {
    void operator()(mjModel* m) const { mj_deleteModel(m); }
    void operator()(mjData* d) const { mj_deleteData(d); }
  };
  std::unique_ptr<mjModel, Delete> model;
  std::unique_ptr<mjData, Delete> data;

  [[nodiscard]] int body(const char* name) const { return mj_name2id(model.get(), mjOBJ_BODY, name); }
  [[nodiscard]] Pose pose(int body_id) const {
    Pose out;
    std::copy_n(data->xmat + 9 * body_id, 9, out.rotation);
    std::copy_n(data->xpos + 3 * body_id, 3, out.translation);
    return out;
  }
  /// Poses and contacts of the present coordinates.
  void forward() { mj_forward(model.get(), data.get()); }
  /// Leaves the poses of the step's end.
  void step() {
    mj_step(model.get(), data.get());
    mj_kinematics(model.get(), data.get());
    mj_comPos(model.get(), data.get());
  }
  /// Kinetic and potential energy. [J]
  [[nodiscard]] double energy() {
    mj_energyPos(model.get(), data.get());
    mj_energyVel(model.get(), data.get());
    return data->energy[0] + data->energy[1];
  }
  [[nodiscard]] std::span<const mjContact> contacts() const {
    return {data->contact, static_cast<std::size_t>(data->ncon)};
  }

 private:
  TemporaryFolder folder_;
};

/// V of the deepest of all points of either body in the other one. [m]
inline double depth(const Asset& a, const Pose& at_a, const Asset& b, const Pose& at_b) {
  const auto deepest = [](const Asset& shell, const Pose& at_shell, const Asset& map, const Pose& at_map) {
    PointshellView points;
    VoxelmapView field;
    EXPECT_EQ(shell.pointshell(points), Status::ok);
    EXPECT_EQ(map.voxelmap(field), Status::ok);
    Scratch scratch;
    SeparationResult result;
    EXPECT_EQ(separation(points, field, relative_pose(at_map, at_shell), {}, scratch, result), Status::ok);
    return result.delta;
  };
  return std::max(deepest(a, at_a, b, at_b), deepest(b, at_b, a, at_a));
}

}  // namespace vps::test
