// SPDX-License-Identifier: GPL-3.0-or-later
// Scanned household objects (YCB) come to rest, placed on a table as in a published layout or dropped into a bin.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "formats/mesh/mesh_import.h"
#include "tests/scenes/scene.h"

namespace {

using namespace vps;
using namespace vps::scenes;

constexpr double kVoxel = 0.001;     // [m]
constexpr double kStep = 1.0 / 240;  // [s]

// Masses are from model.urdf. Positions and rotations about z are from graspa_layouts/layout_0.sdf; its table is z = 0.
struct Object {
  const char* name;
  double mass;        // [kg]
  double x, y, turn;  // [m], [rad]
  bool in_layout;
};
constexpr Object kObjects[] = {
    {"YcbBanana", 0.066, -0.196, 0.11794, -2.9845, true},
    {"YcbMustardBottle", 0.603, -0.07479, 0.161, 1.9390639, true},
    {"YcbPottedMeatCan", 0.370, -0.229, 0.224, -1.7217114, true},
    {"YcbGelatinBox", 0.097, -0.430, 0.23849, 0, true},
    {"YcbFoamBrick", 0.028, -0.374, 0.13899, 0, true},
    {"YcbCrackerBox", 0.411, 0, 0, 0, false},
    {"YcbMasterChefCan", 0.404, 0, 0, 0, false},
    {"YcbPowerDrill", 0.895, 0, 0, 0, false},
    {"YcbScissors", 0.082, 0, 0, 0, false},
    {"YcbTomatoSoupCan", 0.349, 0, 0, 0, false},
};

// Splits a mesh of several hulls into its pieces.
std::vector<lab::Hull> pieces_of(const TriangleMesh& mesh) {
  std::vector<std::size_t> root(mesh.vertices.size());
  std::iota(root.begin(), root.end(), 0u);
  const auto find = [&](std::size_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto& t : mesh.triangles) root[find(t[0])] = root[find(t[1])] = find(t[2]);
  std::vector<lab::Hull> pieces;
  std::vector<std::size_t> piece(mesh.vertices.size(), mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    std::size_t& at = piece[find(v)];
    if (at == mesh.vertices.size()) {
      at = pieces.size();
      pieces.emplace_back();
    }
    pieces[at].push_back(mesh.vertices[v]);
  }
  return pieces;
}

Part object_part(const Object& object, const Options& options) {
  const std::string folder = std::string("scenes/ycb_tabletop/ycb_objects/") + object.name + "/";
  Part part = bake_part(shared_file(folder + "textured_simple_reoriented.obj"), kVoxel);
  if (options.hulls) {
    part.hulls = lab::compound_of(pieces_of(import_mesh(shared_file(folder + "collision_vhacd.obj"))),
                                  part.baked->asset().info().centre_of_mass, 0);
  }
  return part;
}

int scene(const Options& options) {
  const bool bin = options.variant == "bin";
  std::vector<Part> parts;
  for (const Object& object : kObjects) {
    if (bin || object.in_layout) parts.push_back(object_part(object, options));
  }
  test::World world;
  Run run(world, kStep, options);
  run.measure_depth_every(24);
  run.frame_every(6);
  run.add_box({btScalar(0.5), btScalar(0.5), btScalar(0.05)},
              {btScalar(bin ? 0 : -0.25), btScalar(bin ? 0 : 0.17), btScalar(-0.05)}, Run::Look::shown);
  if (bin) {
    for (const btScalar side : {btScalar(-0.25), btScalar(0.25)}) {
      run.add_box({btScalar(0.05), btScalar(0.5), btScalar(0.5)}, {side, 0, btScalar(0.5)}, Run::Look::hidden);
      run.add_box({btScalar(0.5), btScalar(0.05), btScalar(0.5)}, {0, side, btScalar(0.5)}, Run::Look::hidden);
    }
  }
  double height = 0.02;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Object& object = kObjects[i];
    const AssetInfo& info = parts[i].baked->asset().info();
    btTransform at(btQuaternion({0, 0, 1}, btScalar(object.turn)),
                   {btScalar(object.x), btScalar(object.y), btScalar(0.001 - info.bounds_min[2])});
    if (bin) {
      // Stacked one above the other, each rotated by another 40 degrees.
      at = btTransform(
          btQuaternion({1, 0, 0}, btScalar(0.7 * double(i))),
          {i % 2 == 0 ? btScalar(0.04) : btScalar(-0.04), i % 3 == 0 ? btScalar(0.03) : btScalar(-0.03), 0});
      btVector3 low, high;
      parts[i].baked->getAabb(at, low, high);
      height -= double(low.z());
      const btVector3 centre = parts[i].baked->centre_of_mass();
      at.getOrigin() += btVector3(0, 0, btScalar(height)) - at.getBasis() * centre;
      height += double(high.z()) + 0.01;
    }
    run.add_mass(parts[i], object.mass, at);
  }
  for (const auto& body : world.bodies) body->setFriction(btScalar(0.7));
  const double seconds = bin ? 5 : 3;
  double off = 0;
  while (run.time() < seconds) run.step();
  for (const auto& body : world.bodies)
    off = std::min(off, body->isStaticObject() ? 0.0 : double(body->getWorldTransform().getOrigin().z()));
  run.print("tabletop, " + options.variant);
  const Run::Depth depth = run.depth_now();
  fmt::print("  kinetic energy {:.2g} J, fastest {:.2f} mm/s, at last {:.3f} / {:.3f} mm deep\n", run.kinetic(),
             1000 * run.fastest(), 1000 * depth.in_parts, 1000 * depth.in_boxes);
  Verdict verdict;
  verdict.expect(run.fastest() < (bin ? 0.1 : 0.02), "all rest but for jitter");
  verdict.expect(off >= 0, "none fell through or off the table");
  if (!bin)
    verdict.expect(std::max(depth.in_parts, depth.in_boxes) < kVoxel, "no point is deeper than a voxel in the end");
  verdict.expect(run.energy_gain() < 1e-3, "energy never exceeds what it started with by more than a millijoule");
  return verdict.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> ycb = {"scenes/ycb_tabletop"};
  return run_scene(argc, argv, {{"layout", ycb}, {"bin", ycb}}, scene);
}
