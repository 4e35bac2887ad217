// SPDX-License-Identifier: GPL-3.0-or-later
// Who plays the asset, and what it meets.
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <LinearMath/btConvexHullComputer.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "bake/vps_load.h"
#include "cli/evaluate/assets.h"
#include "cli/evaluate/hacd.h"
#include "cli/evaluate/stress.h"
#include "runtime/bullet/vps_bullet.h"
#include "sample_meshes/shapes.h"

namespace vps::stress {
namespace {

using evaluate::BulletShape;

std::vector<btVector3> hull_corners(const std::vector<std::array<double, 3>>& points) {
  std::vector<double> coordinates;
  for (const auto& p : points) coordinates.insert(coordinates.end(), p.begin(), p.end());
  btConvexHullComputer hull;
  hull.compute(coordinates.data(), 3 * sizeof(double), int(points.size()), 0, 0);
  std::vector<btVector3> corners;
  for (int i = 0; i < hull.vertices.size(); ++i) corners.push_back(hull.vertices[i]);
  return corners;
}

std::vector<std::array<double, 3>> shell_points(const Asset& asset) {
  std::vector<std::array<double, 3>> points;
  PointshellView shell;
  if (asset.pointshell(shell) != Status::ok) return points;
  const auto& c = asset.info().centre_of_mass;
  for (std::uint32_t i = 0; i < shell.points; ++i) {
    const Vec3 p = point_position(shell, i);
    points.push_back({double(p.x) - c[0], double(p.y) - c[1], double(p.z) - c[2]});
  }
  return points;
}

// Corners of what the shape is, its margin included where Bullet adds one.
std::vector<btVector3> corners_of(const btConvexHullShape& hull, const std::vector<btVector3>& grown_from) {
  std::vector<btVector3> corners = grown_from;
  for (int i = 0; i < hull.getNumPoints(); ++i) corners.push_back(hull.getUnscaledPoints()[i]);
  return corners;
}

Column absent(const char* name, std::string why) {
  Column column;
  column.name = name;
  column.absent = std::move(why);
  return column;
}

Column hull_column(const Subject& subject) {
  Column column;
  column.name = "hull";
  TriangleMesh points;
  if (subject.mesh) {
    points.vertices = subject.mesh->vertices;
  } else {
    points.vertices = shell_points(*subject.asset);
  }
  if (points.vertices.empty()) return absent("hull", "no mesh and no pointshell to make a hull of");
  // Bullet's margin lies outside a hull's vertices; a voxel of it would lift the body by one.
  column.body = evaluate::hull_of_42(points, 0.1 * subject.voxel);
  if (const std::string reason = evaluate::hull_refusal(column.body); !reason.empty()) return absent("hull", reason);
  column.corners = corners_of(static_cast<const btConvexHullShape&>(*column.body.shape), {});
  return column;
}

Column hacd_column(const Subject& subject, const TriangleMesh& mesh, const std::filesystem::path& cache) {
  Column column;
  column.name = "hacd";
  if (cache.empty())
    return absent("hacd", "HACD takes minutes, and there is no folder to keep its hulls; give --cache");
  const std::array<double, 3>& centre = subject.asset->info().centre_of_mass;
  try {
    column.body = evaluate::compound_of(evaluate::hacd_hulls(mesh, {}, cache), centre, 0.1 * subject.voxel);
  } catch (const std::exception& error) {
    return absent("hacd", error.what());
  }
  if (const std::string reason = evaluate::hull_refusal(column.body); !reason.empty()) return absent("hacd", reason);
  const auto& compound = static_cast<const btCompoundShape&>(*column.body.shape);
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    column.corners = corners_of(static_cast<const btConvexHullShape&>(*compound.getChildShape(i)), column.corners);
  }
  return column;
}

Column gimpact_column(const Subject& subject) {
  Column column;
  column.name = "gimpact";
  column.body = evaluate::gimpact_of(*subject.mesh);
  column.body.shape->setMargin(btScalar(0.1 * subject.voxel));
  static_cast<btGImpactShapeInterface&>(*column.body.shape).updateBound();
  column.corners = subject.corners;
  column.triangles = subject.mesh->triangles.size();
  return column;
}

TriangleMesh cone(double radius, double height) {
  constexpr std::uint32_t kAround = 32;
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0, 0, height}};
  for (const samples::Point& p : samples::make_ring(kAround, height, samples::circle(radius)))
    mesh.vertices.push_back(p);
  for (std::uint32_t i = 0; i < kAround; ++i) {
    const std::uint32_t a = 2 + i;
    const std::uint32_t b = 2 + (i + 1) % kAround;
    mesh.triangles.push_back({0, b, a});
    mesh.triangles.push_back({1, a, b});
  }
  return mesh;
}

}  // namespace

std::shared_ptr<const Asset> Props::baked(const TriangleMesh& mesh, double voxel_size, Part part) const {
  BakeSettings settings;
  settings.options.voxel_size = voxel_size;
  settings.options.pointshell = part == Part::mixed;
  return load_or_bake(mesh, settings, cache_).asset;
}

BulletShape Props::box(const Column& column, const btVector3& half, Part part) {
  if (!column.ours) {
    const auto box = std::make_shared<btBoxShape>(half);
    // Its margin lies inside; one that is larger than the box is thick would turn it inside out.
    box->setMargin(std::min(box->getMargin(), btScalar(0.1) * half[half.minAxis()]));
    return {{}, box};
  }
  const std::string key = fmt::format("{} {} {} {}", half.x(), half.y(), half.z(), int(part));
  for (const auto& [name, shape] : boxes_) {
    if (name == key) return shape;
  }
  const auto asset =
      baked(samples::make_box({double(half.x()), double(half.y()), double(half.z())}), voxel_size_, part);
  boxes_.emplace_back(key, evaluate::ours_of(asset));
  return boxes_.back().second;
}

BulletShape Props::needle(const Column& column, double radius, double height, std::vector<btVector3>& corners) {
  TriangleMesh mesh = cone(radius, height);
  for (auto& v : mesh.vertices) v[2] -= 0.75 * height;  // a cone's centre of mass
  corners = hull_corners(mesh.vertices);
  if (column.ours) return evaluate::ours_of(baked(mesh, voxel_size_, Part::mixed));
  const auto hull = std::make_shared<btConvexHullShape>();
  hull->setMargin(btScalar(0.1 * voxel_size_));
  for (const btVector3& corner : corners) hull->addPoint(corner, false);
  hull->recalcLocalAabb();
  return {{}, hull};
}

Subject make_subject(std::string name, std::shared_ptr<const Asset> asset, SubjectOptions options) {
  Subject subject;
  subject.name = std::move(name);
  subject.asset = std::move(asset);
  subject.mass = options.mass;
  subject.seed = options.seed;
  const AssetInfo& info = subject.asset->info();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    subject.size = std::max(subject.size, info.bounds_max[axis] - info.bounds_min[axis]);
  }
  subject.voxel = info.voxel_size;
  if (options.mesh) subject.mesh = evaluate::centred(*options.mesh, *subject.asset);
  const auto points = shell_points(*subject.asset);
  if (!points.empty()) subject.corners = hull_corners(points);
  subject.props = std::make_shared<Props>(subject.voxel, options.cache);

  const auto wanted = [&](const char* column) {
    return std::find(options.without.begin(), options.without.end(), column) == options.without.end();
  };
  for (const Motion motion : {Motion::discrete, Motion::continuous}) {
    Column column;
    column.name = motion == Motion::discrete ? "ours" : "continuous";
    column.ours = true;
    column.motion = motion;
    if (!subject.corners.empty()) column.body = evaluate::ours_of(subject.asset);
    column.absent = "the asset has no pointshell";
    column.corners = subject.corners;
    if (wanted(column.name.c_str())) subject.columns.push_back(std::move(column));
  }
  if (wanted("hull")) subject.columns.push_back(hull_column(subject));
  constexpr const char* kNoMesh = "an asset holds no mesh; give it with --mesh";
  if (wanted("hacd")) {
    subject.columns.push_back(options.mesh ? hacd_column(subject, *options.mesh, options.cache)
                                           : absent("hacd", kNoMesh));
  }
  if (wanted("gimpact")) subject.columns.push_back(options.mesh ? gimpact_column(subject) : absent("gimpact", kNoMesh));
  return subject;
}

}  // namespace vps::stress
