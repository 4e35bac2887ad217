// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/scenes/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <stdexcept>

#include "cli/lab/assets.h"
#include "cli/lab/hacd.h"
#include "formats/mesh/mesh_import.h"

namespace vps::scenes {
namespace {

Vec3 vec3(const btVector3& v) {
  return {float(v.x()), float(v.y()), float(v.z())};
}

// Calls visit(point, inward normal) for every point of the shell, in another frame.
// @param to_other  takes the mesh's frame there
template <class Visit>
void for_each_point(const bullet::Shape& shape, const btTransform& to_other, Visit visit) {
  const PointshellView& shell = shape.pointshell();
  for (std::uint32_t i = 0; i < shell.points; ++i) {
    const Vec3 p = point_position(shell, i);
    const Vec3 n = point_inward_normal(shell, i);
    visit(to_other * btVector3(p.x, p.y, p.z), to_other.getBasis() * btVector3(n.x, n.y, n.z));
  }
}

std::string median_and_99(std::vector<double> values) {
  if (values.empty()) return "-";
  std::sort(values.begin(), values.end());
  return fmt::format("{:.0f} / {:.0f}", values[values.size() / 2], values[values.size() * 99 / 100]);
}

}  // namespace

std::filesystem::path sample_mesh(const std::string& name) {
  return std::filesystem::path(VPS_SAMPLE_MESHES) / name;
}
std::filesystem::path shared_file(const std::string& relative) {
  return std::filesystem::path(VPS_SHARED_DIR) / relative;
}

Part bake_part(const TriangleMesh& mesh, double voxel_size) {
  bake::BakeOptions options;
  options.voxel_size = voxel_size;
  Part part;
  part.baked = std::make_unique<bullet::Shape>(lab::bake_in_memory(mesh, options));
  return part;
}

Part bake_part(const std::filesystem::path& mesh, double voxel_size) {
  Part part = bake_part(import_mesh(mesh), voxel_size);
  part.mesh = mesh;
  return part;
}

void use_hacd(Part& part, std::size_t hulls) {
  lab::HacdOptions options;
  options.hulls = hulls;
  const std::vector<lab::Hull> pieces = lab::hacd_hulls(import_mesh(part.mesh), options, VPS_SCENES_CACHE);
  const std::array<double, 3>& centre = part.baked->asset().info().centre_of_mass;
  part.hulls = lab::compound_of(pieces, centre, 0);
}

Run::Run(test::World& scene, double step, const Options& options) : scene_(scene), step_(step), options_(options) {
  // At 1 kHz a nut turns down its bolt with less depth so than with two voxels (docs/internals/decisions.md).
  scene.split_from(5e-6);
  if (options.trajectory.empty()) return;
  trajectory_ = std::fopen(options.trajectory.c_str(), "w");
  if (trajectory_ == nullptr) throw std::runtime_error(options.trajectory + ": cannot be written");
}
Run::~Run() {
  if (trajectory_ != nullptr) std::fclose(trajectory_);
}

btRigidBody& Run::add_mass(const Part& part, double mass, const btTransform& mesh_at) {
  btRigidBody& body = scene_.add(part.shape(), btScalar(mass), part.baked->body_pose(mesh_at));
  if (mass > 0) {
    // Hulls get the body's true inertia.
    btVector3 inertia;
    part.baked->calculateLocalInertia(btScalar(mass), inertia);
    body.setMassProps(btScalar(mass), inertia);
    body.updateInertiaTensor();
  }
  bodies_.push_back({&part, &body, {0, 0, 0}});
  if (trajectory_ != nullptr) {
    std::fprintf(trajectory_, "mesh %s\n", part.mesh.c_str());
  }
  return body;
}
btRigidBody& Run::add(const Part& part, double density, const btTransform& mesh_at) {
  return add_mass(part, density * part.volume(), mesh_at);
}

btRigidBody& Run::add_box(const btVector3& half_extents, const btVector3& at, Look look) {
  boxes_.push_back(std::make_unique<btBoxShape>(half_extents));
  btRigidBody& body = scene_.add(*boxes_.back(), 0, at);
  bodies_.push_back({nullptr, &body, half_extents});
  if (trajectory_ != nullptr) {
    std::fprintf(trajectory_, "box %.9g %.9g %.9g %s\n", double(half_extents.x()), double(half_extents.y()),
                 double(half_extents.z()), look == Look::shown ? "shown" : "hidden");
  }
  return body;
}

double Run::depth_of(const Body& a, const Body& b) const {
  double deepest = 0;
  if (a.part == nullptr) return deepest;
  const btTransform to_other = b.mesh_pose().inverseTimes(a.mesh_pose());
  if (b.part == nullptr) {
    const BoxField box{vec3(b.half_extents)};
    for_each_point(*a.part->baked, to_other, [&](const btVector3& p, const btVector3&) {
      deepest = std::max(deepest, double(penetration(box, vec3(p))));
    });
    return deepest;
  }
  const bullet::Shape& other = *b.part->baked;
  for_each_point(*a.part->baked, to_other, [&](const btVector3& p, const btVector3& n) {
    deepest = std::max(deepest, double(penetration(other.voxelmap(), vec3(p), vec3(n))));
  });
  return deepest;
}

Run::Depth Run::depth_now() const {
  Depth deepest;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Body& a = bodies_[i];
      const Body& b = bodies_[j];
      if (a.body->isStaticObject() && b.body->isStaticObject()) continue;
      btVector3 low[2], high[2];
      a.body->getAabb(low[0], high[0]);
      b.body->getAabb(low[1], high[1]);
      if (!TestAabbAgainstAabb2(low[0], high[0], low[1], high[1])) continue;
      // In both directions, as an edge of either body may penetrate the other.
      double& kept = a.part != nullptr && b.part != nullptr ? deepest.in_parts : deepest.in_boxes;
      kept = std::max({kept, depth_of(a, b), depth_of(b, a)});
    }
  }
  return deepest;
}

double Run::kinetic() const {
  double sum = 0;
  for (const auto& body : scene_.bodies) sum += test::kinetic_energy(*body);
  return sum;
}
double Run::energy() const {
  const btVector3 gravity = scene_.world.getGravity();
  double sum = kinetic();
  for (const auto& body : scene_.bodies) {
    if (body->isStaticObject()) continue;
    sum -= double(gravity.dot(body->getWorldTransform().getOrigin())) / double(body->getInvMass());
  }
  return sum;
}
double Run::fastest() const {
  double fastest = 0;
  for (const auto& body : scene_.bodies) fastest = std::max(fastest, double(body->getLinearVelocity().length()));
  return fastest;
}

void Run::write_frame() const {
  std::fprintf(trajectory_, "frame %.6g %.9g\n", time(), energy());
  for (const Body& body : bodies_) {
    const btTransform at = body.mesh_pose();
    const btVector3& p = at.getOrigin();
    const btQuaternion q = at.getRotation();
    std::fprintf(trajectory_, "%.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", double(p.x()), double(p.y()), double(p.z()),
                 double(q.x()), double(q.y()), double(q.z()), double(q.w()));
  }
}

void Run::step() {
  if (steps_ == 0) {
    start_energy_ = energy();
    energies_.push_back(start_energy_);
    if (trajectory_ != nullptr) write_frame();
  }
  const auto begin = std::chrono::steady_clock::now();
  scene_.step(1, btScalar(step_));
  whole_us_.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  narrow_us_.push_back(scene_.dispatcher.last_us);
  ++steps_;
  energies_.push_back(energy());
  gain_ = std::max(gain_, energies_.back() - start_energy_ - work_);
  if (steps_ % depth_every_ == 0) {
    const Depth now = depth_now();
    deepest_.in_parts = std::max(deepest_.in_parts, now.in_parts);
    deepest_.in_boxes = std::max(deepest_.in_boxes, now.in_boxes);
  }
  if (trajectory_ != nullptr && steps_ % frame_every_ == 0) write_frame();
}

void Run::print(const std::string& title) const {
  const char* const shapes = options_.hulls ? "hulls" : "baked";
  fmt::print("{}, {} bodies, {}, {} steps of {:.3g} ms\n", title, bodies_.size(), shapes, steps_, 1000 * step_);
  fmt::print("  narrowphase / whole step, median / 99 %  {} / {} us\n", median_and_99(narrow_us_),
             median_and_99(whole_us_));
  fmt::print("  deepest point  {:.4f} mm in another part, {:.4f} mm in a box\n  energy  ", 1000 * deepest_.in_parts,
             1000 * deepest_.in_boxes);
  for (std::size_t k = 0; k <= 4; ++k) {
    const std::size_t at = k * (energies_.size() - 1) / 4;
    fmt::print("{:.4g} J at {:.2f} s{}", energies_[at], double(at) * step_, k < 4 ? ", " : "");
  }
  fmt::print("; at most {:.2g} J above what was put in\n", gain_);
  // Energies are printed as changes, as the zero of height is arbitrary.
  fmt::print("row | {} | {} | {:.3g} ms | {} | {} | {:.3f} / {:.3f} mm | {:+.2g} J | {:.1g} J |\n", title, shapes,
             1000 * step_, median_and_99(narrow_us_), median_and_99(whole_us_), 1000 * deepest_.in_parts,
             1000 * deepest_.in_boxes, energies_.back() - start_energy_ - work_, gain_);
}

void Verdict::expect(bool holds, const std::string& sentence) {
  fmt::print("  {}: {}\n", holds ? "holds" : "FAILS", sentence);
  failed_ = failed_ || !holds;
}

int run_scene(int argc, char** argv, const std::vector<Variant>& variants,
              const std::function<int(const Options&)>& scene) {
  Options options;
  const Variant* chosen = nullptr;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto found = std::find_if(variants.begin(), variants.end(), [&](const Variant& v) { return v.name == word; });
    if (found != variants.end()) {
      chosen = &*found;
      options.variant = word;
    } else if (word == "--hulls") {
      options.hulls = true;
    } else if (word == "--trajectory" && i + 1 < argc) {
      options.trajectory = argv[++i];
    } else {
      chosen = nullptr;
      break;
    }
  }
  const std::string program = std::filesystem::path(argv[0]).filename();
  if (chosen == nullptr) {
    std::string names;
    for (const Variant& v : variants) names += (names.empty() ? "" : "|") + v.name;
    fmt::print(stderr, "usage: {} {} [--hulls] [--trajectory FILE]\n", program, names);
    return kUsage;
  }
  for (const std::string& file : chosen->needs) {
    if (std::filesystem::exists(shared_file(file))) continue;
    fmt::print("{}: skipped: needs {}, which is absent\n", program, shared_file(file).string());
    return kSkipped;
  }
  try {
    return scene(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: error: {}\n", program, error.what());
    return kFailed;
  }
}

}  // namespace vps::scenes
