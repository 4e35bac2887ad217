// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/scenes/scenes.h"

#include <LinearMath/btConvexHullComputer.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/mesh/mesh_import.h"
#include "sample_meshes/shapes.h"
#include "tests/bench/query_assets.h"

namespace vps::bench {
namespace {

constexpr double kSteelDensity = 7800;  // [kg/m^3]
// Spacing of the bunny's points over its voxel size: the default, and one that gives it about the paper's 35,000.
constexpr double kBunnyAlphas[] = {2.1, 1.4142135623730951};

std::shared_ptr<scenes::Part> part_of(const std::shared_ptr<const Asset>& asset, lab::BulletShape shape = {}) {
  auto part = std::make_shared<scenes::Part>();
  part->baked = std::make_unique<bullet::Shape>(asset);
  part->hulls = std::move(shape);
  return part;
}

BodySide baked_side(const std::shared_ptr<const Asset>& asset) {
  const std::uint64_t points = asset->info().points;
  const std::string text =
      points < 1000 ? fmt::format("{}", points) : fmt::format("{},{:03}", points / 1000, points % 1000);
  return {fmt::format("baked, {} points", text), Kind::baked, part_of(asset)};
}

// Empty where Bullet must not query the shape.
void add_if_sound(std::vector<BodySide>& sides, const std::string& name, Kind kind, const lab::BulletShape& shape,
                  const std::shared_ptr<const Asset>& asset) {
  const std::string refusal = lab::hull_refusal(shape);
  if (refusal.empty()) {
    sides.push_back({name, kind, part_of(asset, shape)});
  } else {
    fmt::print(stderr, "scene_bench: {} left out: {}\n", name, refusal);
  }
}

// Of all points of the shell: it rolls and rocks as the surface does.
BodySide full_hull_side(const std::shared_ptr<const Asset>& asset) {
  BodySide side{"", Kind::hull, part_of(asset)};
  std::vector<btVector3> points = shell_points(*side.part->baked);
  btConvexHullComputer computer;
  computer.compute(points[0].m_floats, sizeof(btVector3), int(points.size()), 0, 0);
  const auto hull = std::make_shared<btConvexHullShape>();
  hull->setMargin(btScalar(lab::kPeerMargin));
  for (int i = 0; i < computer.vertices.size(); ++i) hull->addPoint(computer.vertices[i], false);
  hull->recalcLocalAabb();
  side.part->hulls = {{}, hull};
  const int count = hull->getNumPoints();
  side.name = fmt::format("hull of {},{:03} vertices", count / 1000, count % 1000);
  return side;
}

// @param mesh  in its own frame
void add_hacd(std::vector<BodySide>& sides, const TriangleMesh& mesh, const std::shared_ptr<const Asset>& asset,
              const std::string& work) {
  lab::HacdOptions options;
  options.announce = [] { fmt::print(stderr, "scene_bench: HACD takes minutes, once\n"); };
  const std::vector<lab::Hull> hulls = lab::hacd_hulls(mesh, options, work);
  for (const double margin : {lab::kPeerMargin, 0.0}) {
    add_if_sound(sides, fmt::format("HACD, margin {:g} mm", 1000 * margin), Kind::hacd,
                 lab::compound_of(hulls, asset->info().centre_of_mass, margin), asset);
  }
}

// Bullet's box of the same extents, about the same centre of mass.
BodySide box_side(const std::shared_ptr<const Asset>& asset) {
  const AssetInfo& info = asset->info();
  btVector3 half, centre;
  for (int i = 0; i < 3; ++i) {
    const auto axis = std::size_t(i);
    half[i] = btScalar((info.bounds_max[axis] - info.bounds_min[axis]) / 2);
    centre[i] = btScalar((info.bounds_max[axis] + info.bounds_min[axis]) / 2 - info.centre_of_mass[axis]);
  }
  const auto box = std::make_shared<btBoxShape>(half);
  if (centre.length() < btScalar(1e-3) * half.length()) return {"Bullet's box", Kind::box, part_of(asset, {{}, box})};
  const auto compound = std::make_shared<btCompoundShape>();
  compound->addChildShape(btTransform(btQuaternion::getIdentity(), centre), box.get());
  return {"Bullet's box", Kind::box, part_of(asset, {{box}, compound})};
}

Body make_part(const TriangleMesh& mesh, double voxel, double density) {
  bake::BakeOptions bake;
  bake.voxel_size = voxel;
  const std::shared_ptr<const Asset> asset = lab::bake_in_memory(mesh, bake);
  Body out;
  out.mass = density * asset->info().volume;
  out.voxel = voxel;
  out.sides.push_back(baked_side(asset));
  out.sides.push_back(box_side(asset));
  add_if_sound(out.sides, "hull", Kind::hull, lab::hull_of_42(lab::centred(mesh, *asset), lab::kPeerMargin), asset);
  return out;
}

double larger(double a, double b) {
  return std::isnan(a) ? b : std::isnan(b) ? a : std::max(a, b);
}

}  // namespace

void Quality::keep_worse(const Quality& other, int play) {
  if (!(other.deepest_late <= deepest_late)) deepest_play = play;
  if (!(other.drift <= drift)) drift_play = play;
  deepest = larger(deepest, other.deepest);
  deepest_late = larger(deepest_late, other.deepest_late);
  gain = larger(gain, other.gain);
  drift = larger(drift, other.drift);
  released = larger(released, other.released);
  drifts.push_back(other.drift);
  played = larger(played, other.played);
  stands.insert(stands.end(), other.stands.begin(), other.stands.end());
}

Body Bodies::make_bunny() {
  Body out;
  out.mass = 1;
  out.voxel = kVoxelSize;
  ImportOptions import;
  import.unit = options_.scale;
  const TriangleMesh mesh = import_mesh(options_.mesh, import);
  std::shared_ptr<const Asset> first;
  for (const double alpha : kBunnyAlphas) {
    bake::BakeOptions bake;
    bake.voxel_size = kVoxelSize;
    bake.alpha = alpha;
    const std::shared_ptr<const Asset> asset = lab::bake_in_memory(mesh, bake);
    if (first == nullptr) first = asset;
    out.sides.push_back(baked_side(asset));
  }
  bunny_mesh_ = lab::centred(mesh, *first);
  add_if_sound(out.sides, "hull", Kind::hull, lab::hull_of_42(bunny_mesh_, lab::kPeerMargin), first);
  out.sides.push_back(full_hull_side(first));
  if (options_.hacd == Hacd::with) add_hacd(out.sides, mesh, first, options_.work);
  return out;
}

const TriangleMesh& Bodies::bunny_mesh() {
  get("bunny");
  return bunny_mesh_;
}

const Body& Bodies::get(const std::string& name) {
  const auto found = bodies_.find(name);
  if (found != bodies_.end()) return found->second;
  const auto make = [&]() -> Body {
    if (name == "bunny") return make_bunny();
    if (name == "gear") return make_part(samples::make_gear(), 0.00025, kSteelDensity);
    if (name == "nut") return make_part(samples::make_nut(), 0.00015, kSteelDensity);
    if (name == "brick") return make_part(samples::make_box({0.02, 0.01, 0.005}), 0.0004, kSteelDensity);
    return make_part(samples::make_box({0.01, 0.01, 0.01}), name == "cube" ? 0.0004 : 0.0008, kSteelDensity);
  };
  return bodies_.emplace(name, make()).first->second;
}

std::vector<btVector3> shell_points(const bullet::Shape& shape) {
  std::vector<btVector3> points;
  for (std::uint32_t i = 0; i < shape.pointshell().points; ++i) {
    const Vec3 p = point_position(shape.pointshell(), i);
    points.push_back(btVector3(p.x, p.y, p.z) - shape.centre_of_mass());
  }
  return points;
}

void prepare(test::World& world, double voxel) {
  btContactSolverInfo& solver = world.world.getSolverInfo();
  solver.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  solver.m_numIterations = 10;
  solver.m_splitImpulse = 1;
  solver.m_splitImpulsePenetrationThreshold = btScalar(-2 * voxel);
}

double depth_of_all(const scenes::Run& run) {
  const scenes::Run::Depth depth = run.depth_now();
  return std::max(depth.in_parts, depth.in_boxes);
}

std::vector<double> record(test::World& world, const scenes::Run& run, const Script& script, Quality* quality) {
  std::vector<double> us;
  us.reserve(script.steps);
  const double start = run.energy();
  const double potential = start - run.kinetic();
  const auto second = std::min(script.steps, std::size_t(std::lround(1 / script.step)));
  std::vector<btVector3> starts, places;
  for (const auto& body : world.bodies) starts.push_back(body->getWorldTransform().getOrigin());
  // Sideways: with too few iterations a stack sinks first.
  const auto has_fallen = [&] {
    for (std::size_t b = 0; b < starts.size(); ++b) {
      const btVector3 way = world.bodies[b]->getWorldTransform().getOrigin() - starts[b];
      if (!(std::hypot(double(way.x()), double(way.y())) < script.fallen)) return true;  // or is nowhere
    }
    return false;
  };
  double stood = script.step * double(script.steps);
  bool stands = script.fallen > 0;
  double work = 0;
  Quality seen{0, 0, 0, 0, 0};
  for (std::size_t i = 0; i < script.steps; ++i) {
    if (script.drive) script.drive();
    world.dispatcher.last_us = 0;
    world.step(1, btScalar(script.step));
    us.push_back(world.dispatcher.last_us);
    if (quality == nullptr) continue;
    if (script.power) work += script.power() * script.step;
    const double energy = run.energy();
    seen.gain = std::max(seen.gain, energy - start - work);
    seen.released = std::max(seen.released, potential - (energy - run.kinetic()));
    if (stands && has_fallen()) {
      stands = false;
      stood = script.step * double(i + 1);
    }
    if (i % script.depth_every == 0) {
      const double depth = script.depth();
      seen.deepest = std::max(seen.deepest, depth);
      if (i >= script.steps - script.steps / 5) seen.deepest_late = std::max(seen.deepest_late, depth);
    }
    if (i + 1 == script.steps - second) {
      for (const auto& body : world.bodies) places.push_back(body->getWorldTransform().getOrigin());
    }
  }
  if (quality == nullptr) return us;
  for (std::size_t b = 0; b < places.size(); ++b) {
    const btVector3 way = world.bodies[b]->getWorldTransform().getOrigin() - places[b];
    seen.drift = std::max(seen.drift, double(way.length()) / (double(second) * script.step));
  }
  if (places.empty()) seen.drift = Quality::kUnknown;
  seen.released += std::max(0.0, work);
  if (script.fallen > 0) seen.stands = {stood};
  seen.played = script.step * double(script.steps);
  *quality = seen;
  return us;
}

}  // namespace vps::bench
