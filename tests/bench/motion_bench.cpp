// SPDX-License-Identifier: GPL-3.0-or-later
// Bodies that roll and slide in Bullet, baked and as Bullet's own shapes, against what theory says. Worst rows first.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "cli/lab/assets.h"
#include "sample_meshes/shapes.h"
#include "tests/support/bullet_world.h"

namespace {

using namespace vps;
using namespace vps::samples;
using test::World;

constexpr double kPi = std::numbers::pi;
constexpr double kGravity = 9.81;
constexpr double kRadius = 0.1;      // of wheel, cylinder and ball. [m]
constexpr double kHalfWidth = 0.03;  // of wheel and cylinder. [m]
constexpr double kBoxVoxel = 0.002;  // of the baked parts that slide. [m]
constexpr double kSlabVoxel = 0.01;  // of baked ground. [m]
constexpr int kStarts = 4;           // rotations about the axis, at which a body begins
constexpr double kRates[] = {60, 240, 1000};

// One shape for a body.
struct Side {
  std::string name;
  std::shared_ptr<btCollisionShape> shape;
};

struct Row {
  std::string scene, side;
  double rate = 0;   // [Hz]
  double ratio = 0;  // worst of all starts: speed over that of theory
  double hop = 0;    // largest height above the surface. [m]
  double drift = 0;  // largest way aside. [m]
};

Side baked_side(const TriangleMesh& mesh, double voxel_size) {
  bake::BakeOptions options;
  options.voxel_size = voxel_size;
  return {"baked", std::make_shared<bullet::Shape>(lab::bake_in_memory(mesh, options))};
}

Side hull_side(const TriangleMesh& mesh) {
  auto hull = std::make_shared<btConvexHullShape>();
  for (const auto& v : mesh.vertices) hull->addPoint({btScalar(v[0]), btScalar(v[1]), btScalar(v[2])}, false);
  hull->recalcLocalAabb();
  hull->setMargin(btScalar(0.001));
  return {"hull", hull};
}

// A solid that rolls: its sides, and its moments of inertia at a mass of 1 kg.
struct Roller {
  std::string name;
  std::vector<Side> sides;
  btVector3 inertia;  // [kg m^2]
  double voxel;       // of the baked side. [m]
};

std::vector<Roller> make_rollers() {
  const double across = kRadius * kRadius / 4 + kHalfWidth * kHalfWidth / 3;
  const btVector3 disc{btScalar(across), btScalar(kRadius * kRadius / 2), btScalar(across)};
  const btScalar ball = btScalar(0.4 * kRadius * kRadius);
  const TriangleMesh wheel = make_wheel(kRadius, kHalfWidth, 256);
  const TriangleMesh sphere = make_sphere(kRadius, 5);
  const double fine = kRadius / 100;
  const double coarse = kRadius / 32;
  const btVector3 half{btScalar(kRadius), btScalar(kHalfWidth), btScalar(kRadius)};
  return {
      {"wheel",
       {baked_side(wheel, fine), hull_side(wheel), {"Bullet's", std::make_shared<btCylinderShape>(half)}},
       disc,
       fine},
      {"ball",
       {baked_side(sphere, coarse), {"Bullet's", std::make_shared<btSphereShape>(btScalar(kRadius))}},
       {ball, ball, ball},
       coarse},
      {"capsule", {{"Bullet's", std::make_shared<btCapsuleShape>(btScalar(kRadius), btScalar(kRadius))}}, disc, fine}};
}

// A flat grid of triangles on z = 0.
struct Grid {
  static constexpr int kCells = 100;
  static constexpr double kCell = 0.25;  // [m]
  btTriangleMesh mesh;
  std::unique_ptr<btBvhTriangleMeshShape> shape;
  Grid() {
    const auto corner = [](int i, int j) {
      return btVector3(btScalar((i - 2) * kCell), btScalar((j - kCells / 2) * kCell), 0);
    };
    for (int i = 0; i < kCells; ++i) {
      for (int j = 0; j < kCells; ++j) {
        mesh.addTriangle(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1));
        mesh.addTriangle(corner(i, j), corner(i + 1, j + 1), corner(i, j + 1));
      }
    }
    shape = std::make_unique<btBvhTriangleMeshShape>(&mesh, true);
  }
};

struct Ground {
  std::string name;
  std::shared_ptr<btCollisionShape> shape;
  btTransform at = btTransform::getIdentity();
  bool is_short = false;  // 4 m
  bool has_slots = false;
};

btTransform placed(const btVector3& at) {
  return btTransform(btMatrix3x3::getIdentity(), at);
}

// Plates side by side, with slots of 30 mm between them.
TriangleMesh slotted_slab(double half_height) {
  constexpr int kPlates = 8;
  constexpr double kPitch = 0.5;
  TriangleMesh slab;
  for (int i = 0; i < kPlates; ++i) {
    const TriangleMesh plate =
        make_box({kPitch / 2 - 0.015, 0.2, half_height}, {kPitch * (i - (kPlates - 1) / 2.0), 0, 0});
    const auto first = std::uint32_t(slab.vertices.size());
    slab.vertices.insert(slab.vertices.end(), plate.vertices.begin(), plate.vertices.end());
    for (const auto& t : plate.triangles) slab.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  return slab;
}

// A slab that is oblique in the grid of its voxels, and level in the world.
Ground oblique_slab(const char* name, TriangleMesh slab, const btMatrix3x3& turn, const btVector3& at) {
  for (auto& v : slab.vertices) {
    const btVector3 turned = turn * btVector3(btScalar(v[0]), btScalar(v[1]), btScalar(v[2]));
    v = {double(turned.x()), double(turned.y()), double(turned.z())};
  }
  const Side side = baked_side(slab, kSlabVoxel);
  const btTransform frame = static_cast<const bullet::Shape&>(*side.shape).asset_frame();
  return {name, side.shape, btTransform(turn.transpose(), at) * frame.inverse(), true};
}

std::vector<Ground> make_grounds() {
  const double half_height = 0.05;
  const TriangleMesh slab = make_box({2, 0.2, half_height});
  const btVector3 below{0, 0, btScalar(-half_height)};
  const btVector3 ahead{btScalar(1.8), 0, btScalar(-half_height)};
  const btMatrix3x3 about_y(btQuaternion(btVector3(0, 1, 0), btScalar(0.4)));
  const btMatrix3x3 about_x(btQuaternion(btVector3(1, 0, 0), btScalar(0.3)));
  const auto grid = std::make_shared<Grid>();
  return {{"triangle grid", {grid, grid->shape.get()}},
          {"plane", std::make_shared<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0))},
          {"box", std::make_shared<btBoxShape>(btVector3(100, 100, btScalar(half_height))), placed(below)},
          {"baked slab", baked_side(slab, kSlabVoxel).shape, placed(ahead), true},
          {"baked slab with slots", baked_side(slotted_slab(half_height), kSlabVoxel).shape, placed(ahead), true, true},
          oblique_slab("oblique slab", slab, about_y, ahead),
          oblique_slab("slab oblique about two axes", slab, about_x * about_y, ahead)};
}

// What a body does in `seconds`: worst of all starts.
Row play(World& scene, btRigidBody& body, double seconds, double rate, double expected, double height) {
  Row row;
  row.rate = rate;
  const int steps = int(std::lround(seconds * rate));
  for (int i = 0; i < steps; ++i) {
    scene.step(1, btScalar(1 / rate));
    const btVector3& at = body.getWorldTransform().getOrigin();
    row.hop = std::max(row.hop, double(at.z()) - height);
    row.drift = std::max(row.drift, std::abs(double(at.y())));
  }
  row.ratio = double(body.getLinearVelocity().x()) / expected;
  return row;
}

void keep_worse(Row& worst, const Row& row) {
  if (worst.rate == 0 || std::abs(row.ratio - 1) > std::abs(worst.ratio - 1)) worst.ratio = row.ratio;
  worst.rate = row.rate;
  worst.hop = std::max(worst.hop, row.hop);
  worst.drift = std::max(worst.drift, row.drift);
}

// Of --only.
std::string chosen;

bool is_chosen(const Row& row) {
  return fmt::format("{}, {}", row.scene, row.side).find(chosen) != std::string::npos;
}

void prepare(World& scene) {
  scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
}

// Rolls from a start without slip: on the flat at a speed, down a slope from rest.
Row roll(const Roller& roller, const Side& side, const Ground& ground, double rate, double speed, double slope) {
  Row worst;
  worst.scene = fmt::format("{} {} {}", roller.name,
                            slope > 0 ? "down 10 degrees on" : fmt::format("at {:.2g} m/s on", speed), ground.name);
  worst.side = side.name;
  if (!is_chosen(worst)) return worst;
  const double seconds = slope > 0 ? 1 : ground.is_short ? 3.0 / speed : 4;
  for (int start = 0; start < kStarts; ++start) {
    World scene(roller.voxel);
    prepare(scene);
    scene.world.setGravity({btScalar(kGravity * std::sin(slope)), 0, btScalar(-kGravity * std::cos(slope))});
    scene.add(*ground.shape, 0, ground.at);
    const btQuaternion turn(btVector3(0, 1, 0), btScalar(0.37 * start));
    btRigidBody& body = scene.add(*side.shape, 1, btTransform(turn, {0, 0, btScalar(kRadius)}));
    body.setMassProps(1, roller.inertia);
    body.updateInertiaTensor();
    body.setLinearVelocity({btScalar(speed), 0, 0});
    body.setAngularVelocity({0, btScalar(speed / kRadius), 0});
    const double theory =
        speed + kGravity * std::sin(slope) * seconds / (1 + double(roller.inertia.y()) / (kRadius * kRadius));
    keep_worse(worst, play(scene, body, seconds, rate, theory, kRadius));
  }
  return worst;
}

// A part with a flat base, and how high its centre of mass is above it. [m]
struct Slider {
  std::string name;
  Side side;
  double height;
};

// Slides without friction.
Row slide(const Slider& part, const Ground& ground, double rate, double speed) {
  Row row;
  row.scene = fmt::format("{} slides at {:.2g} m/s on {}", part.name, speed, ground.name);
  row.side = part.side.name;
  if (!is_chosen(row)) return row;
  World scene(kBoxVoxel);
  prepare(scene);
  scene.add(*ground.shape, 0, ground.at).setFriction(0);
  btTransform at = placed({0, 0, btScalar(part.height)});
  if (const auto* const baked = dynamic_cast<const bullet::Shape*>(part.side.shape.get())) {
    at.setBasis(baked->asset_frame().getBasis().transpose());
  }
  btRigidBody& body = scene.add(*part.side.shape, 1, at);
  body.setFriction(0);
  body.setLinearVelocity({btScalar(speed), 0, 0});
  keep_worse(row, play(scene, body, std::min(3 / speed, 4.0), rate, speed, part.height));
  return row;
}

std::string millimetres(double metres) {
  const double mm = 1e3 * metres;
  return mm < 0.001 ? "0" : mm < 100 ? fmt::format("{:.2g}", mm) : fmt::format("{:.0f}", mm);
}

// Markdown: a line for each scene and shape, with a value for each rate, worst first.
std::string table(const std::vector<Row>& rows) {
  struct Line {
    std::vector<std::string> ratios, hops, drifts;
    double worst = 0;
  };
  std::map<std::string, Line> lines;
  for (const Row& row : rows) {
    Line& line = lines[fmt::format("| {} | {} |", row.scene, row.side)];
    line.ratios.push_back(fmt::format("{:.3f}", std::round(1e3 * row.ratio) / 1e3 + 0.0));
    line.hops.push_back(millimetres(row.hop));
    line.drifts.push_back(millimetres(row.drift));
    line.worst = std::max(line.worst, std::abs(row.ratio - 1));
  }
  std::vector<std::pair<double, std::string>> sorted;
  constexpr double kAlike = 0.01;
  for (const auto& [name, line] : lines) {
    if (!(line.worst > kAlike)) continue;
    sorted.emplace_back(-line.worst, fmt::format("{} {} | {} | {} |\n", name, fmt::join(line.ratios, ", "),
                                                 fmt::join(line.hops, ", "), fmt::join(line.drifts, ", ")));
  }
  std::sort(sorted.begin(), sorted.end());
  std::string out =
      "| scene | shape | speed / theory at 60, 240, 1000 Hz | hop, mm | aside, mm |\n|---|---|---|---|---|\n";
  for (const auto& [worst, line] : sorted) out += line;
  return out + fmt::format("\n{} rows within 1 % at every rate are left out.\n", lines.size() - sorted.size());
}

nlohmann::ordered_json to_json(const Row& row) {
  return {{"scene", row.scene}, {"side", row.side}, {"rate", row.rate},
          {"ratio", row.ratio}, {"hop", row.hop},   {"drift", row.drift}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Bodies that roll and slide in Bullet, against theory");
  std::string json;
  app.add_option("--json", json, "Write the rows there");
  app.add_option("--only", chosen, "Play only rows whose 'SCENE, SHAPE' contains this");
  CLI11_PARSE(app, argc, argv);
  const std::vector<Ground> grounds = make_grounds();
  const std::vector<Roller> rollers = make_rollers();
  TriangleMesh gear = make_gear();
  constexpr double kGearScale = 5;  // 0.22 m across
  for (auto& v : gear.vertices) v = {kGearScale * v[0], kGearScale * v[1], kGearScale * v[2]};
  const std::vector<Slider> sliders = {
      {"box", baked_side(make_box({0.05, 0.05, 0.05}), kBoxVoxel), 0.05},
      {"box", {"Bullet's", std::make_shared<btBoxShape>(btVector3(0.05F, 0.05F, 0.05F))}, 0.05},
      {"gear", baked_side(gear, kBoxVoxel), 0.004 * kGearScale}};
  std::vector<Row> rows;
  for (const double rate : kRates) {
    for (const Ground& ground : grounds) {
      for (const Roller& roller : rollers) {
        if (ground.has_slots) continue;  // they are to roll over a bump
        for (const Side& side : roller.sides) {
          rows.push_back(roll(roller, side, ground, rate, ground.is_short ? 1 : 5, 0));
          rows.push_back(roll(roller, side, ground, rate, 0, 10 * kPi / 180));
        }
      }
      for (const Slider& part : sliders) {
        for (const double speed : {0.1, 1.0, 3.0}) rows.push_back(slide(part, ground, rate, speed));
      }
    }
  }
  std::erase_if(rows, [](const Row& row) { return row.rate == 0; });
  fmt::print("{}", table(rows));
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const Row& row : rows) out.push_back(to_json(row));
  if (json.empty()) return 0;
  std::FILE* const file = std::fopen(json.c_str(), "w");
  if (file == nullptr) return 1;
  const std::string text = out.dump(1);
  const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  return std::fclose(file) == 0 && written ? 0 : 1;
}
