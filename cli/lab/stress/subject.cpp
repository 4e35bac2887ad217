// SPDX-License-Identifier: GPL-3.0-or-later
// The shapes for the asset in each column, and the props of the cases.
#include <LinearMath/btConvexHullComputer.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "bake/store/vps_store.h"
#include "cli/lab/assets.h"
#include "cli/lab/hacd.h"
#include "cli/lab/stress/world.h"
#include "runtime/bullet/vps_bullet.h"
#include "sample_meshes/shapes.h"

namespace vps::stress {
namespace {

using lab::BulletShape;

using Points = std::vector<std::array<double, 3>>;

// The shell's points about the centre of mass.
Points shell_points(const Asset& asset) {
  Points points;
  PointshellView shell;
  if (asset.pointshell(shell) != Status::ok) return points;
  const auto& c = asset.info().centre_of_mass;
  for (std::uint32_t i = 0; i < shell.points; ++i) {
    const Vec3 p = point_position(shell, i);
    points.push_back({double(p.x) - c[0], double(p.y) - c[1], double(p.z) - c[2]});
  }
  return points;
}

// Appends a hull's vertices, without its margin, to the corners in `grown_from`.
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

Points scaled(Points points, double scale) {
  for (auto& p : points) {
    for (double& x : p) x *= scale;
  }
  return points;
}

Column peer_column(const char* name, const Subject& subject, std::string from,
                   std::function<BulletShape(double, double)> resized) {
  Column column;
  column.name = name;
  column.from = std::move(from);
  column.resized = std::move(resized);
  // Bullet's margin lies outside a hull's vertices. A margin of a voxel would lift the body by a voxel.
  column.body = column.resized(1, 0.1 * subject.voxel);
  return column;
}

// A hull of the mesh's vertices, or of the shell's points without a mesh.
Column hull_column(const Subject& subject, const SubjectOptions& options) {
  const Points points = options.mesh ? subject.mesh->vertices : shell_points(*subject.asset);
  if (points.empty()) return absent("hull", "no mesh and no pointshell to make a hull of");
  Column column = peer_column("hull", subject, options.mesh ? options.mesh->from : "the pointshell",
                              [points](double scale, double margin) {
                                return lab::hull_of_42({scaled(points, scale), {}}, margin);
                              });
  if (const std::string reason = lab::hull_refusal(column.body); !reason.empty()) return absent("hull", reason);
  column.corners = corners_of(static_cast<const btConvexHullShape&>(*column.body.shape), {});
  return column;
}

// The given mesh, or the zero set where there is no mesh or it has too many triangles.
const PeerMesh* light_mesh(const SubjectOptions& options) {
  if (options.mesh && (options.mesh->mesh.triangles.size() <= kMostTriangles || !options.zero_set))
    return &*options.mesh;
  return options.zero_set ? &*options.zero_set : nullptr;
}

Column hacd_column(const Subject& subject, const SubjectOptions& options) {
  const PeerMesh* const mesh = !options.cache.empty() && options.mesh ? &*options.mesh : light_mesh(options);
  if (mesh == nullptr) return absent("hacd", why_no_mesh(*subject.asset));
  const bool takes_minutes = mesh->mesh.triangles.size() > 2 * kMostTriangles;
  if (options.cache.empty() && takes_minutes)
    return absent("hacd", "HACD takes minutes, and there is no folder to keep its hulls; give --cache");
  std::vector<lab::Hull> hulls;
  try {
    lab::HacdOptions hacd;
    if (takes_minutes) hacd.announce = options.announce_hacd;
    hulls = lab::hacd_hulls(mesh->mesh, hacd, options.cache);
  } catch (const std::exception& error) {
    return absent("hacd", error.what());
  }
  // Some of HACD's hulls are flat, without volume. They are left out.
  const auto is_flat = [](const lab::Hull& hull) {
    return !lab::hull_refusal(lab::compound_of({hull}, {}, 0)).empty();
  };
  const std::size_t flat = std::erase_if(hulls, is_flat);
  if (hulls.empty()) return absent("hacd", "all of HACD's hulls are flat: Bullet's EPA fails on them");
  std::string from = mesh->from;
  if (flat > 0) from += fmt::format(", {} of {} hulls left out, as they are flat", flat, flat + hulls.size());
  const std::array<double, 3> centre = subject.asset->info().centre_of_mass;
  Column column = peer_column("hacd", subject, from, [hulls, centre](double scale, double margin) {
    std::vector<lab::Hull> larger;
    for (const lab::Hull& hull : hulls) larger.push_back(scaled(hull, scale));
    return lab::compound_of(larger, scaled({centre}, scale)[0], margin);
  });
  const auto& compound = static_cast<const btCompoundShape&>(*column.body.shape);
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    column.corners = corners_of(static_cast<const btConvexHullShape&>(*compound.getChildShape(i)), column.corners);
  }
  return column;
}

Column gimpact_column(const Subject& subject, const SubjectOptions& options) {
  const PeerMesh* const mesh = light_mesh(options);
  if (mesh == nullptr) return absent("gimpact", why_no_mesh(*subject.asset));
  const TriangleMesh body = lab::centred(mesh->mesh, *subject.asset);
  Column column = peer_column("gimpact", subject, mesh->from, [body](double scale, double margin) {
    return lab::gimpact_of({scaled(body.vertices, scale), body.triangles}, margin);
  });
  column.corners = hull_corners(body.vertices);
  column.triangles = body.triangles.size();
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

std::vector<btVector3> hull_corners(const std::vector<std::array<double, 3>>& points) {
  std::vector<double> coordinates;
  for (const auto& p : points) coordinates.insert(coordinates.end(), p.begin(), p.end());
  btConvexHullComputer hull;
  hull.compute(coordinates.data(), 3 * sizeof(double), int(points.size()), 0, 0);
  std::vector<btVector3> corners;
  for (int i = 0; i < hull.vertices.size(); ++i) corners.push_back(hull.vertices[i]);
  return corners;
}

std::vector<btVector3> shell_corners(const Asset& asset) {
  const Points points = shell_points(asset);
  return points.empty() ? std::vector<btVector3>{} : hull_corners(points);
}

std::shared_ptr<const Asset> Props::baked(const TriangleMesh& mesh, double voxel_size, Role role) const {
  bake::BakeSettings settings;
  settings.options.voxel_size = voxel_size;
  settings.options.pointshell = role == Role::mixed;
  return bake::load_or_bake(mesh, settings, cache_).asset;
}

BulletShape Props::box(const Column& column, const btVector3& half, Role role) {
  if (!column.ours) {
    const auto box = std::make_shared<btBoxShape>(half);
    // Its margin lies inside. A margin larger than the half thickness would turn the box inside out.
    box->setMargin(std::min(box->getMargin(), btScalar(0.1) * half[half.minAxis()]));
    return {{}, box};
  }
  const std::string key = fmt::format("{} {} {} {}", half.x(), half.y(), half.z(), int(role));
  for (const auto& [name, shape] : boxes_) {
    if (name == key) return shape;
  }
  const auto asset =
      baked(samples::make_box({double(half.x()), double(half.y()), double(half.z())}), voxel_size_, role);
  boxes_.emplace_back(key, lab::ours_of(asset));
  return boxes_.back().second;
}

BulletShape Props::needle(const Column& column, double radius, double height, std::vector<btVector3>& corners) {
  TriangleMesh mesh = cone(radius, height);
  for (auto& v : mesh.vertices) v[2] -= 0.75 * height;  // a cone's centre of mass
  corners = hull_corners(mesh.vertices);
  if (column.ours) return lab::ours_of(baked(mesh, voxel_size_, Role::mixed));
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
  subject.solver = options.solver;
  const AssetInfo& info = subject.asset->info();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    subject.size = std::max(subject.size, info.bounds_max[axis] - info.bounds_min[axis]);
  }
  subject.voxel = info.voxel_size;
  if (const PeerMesh* const mesh = options.mesh ? &*options.mesh : light_mesh(options); mesh != nullptr)
    subject.mesh = lab::centred(mesh->mesh, *subject.asset);
  subject.corners = shell_corners(*subject.asset);
  subject.props = std::make_shared<Props>(subject.voxel, options.cache);

  const auto wanted = [&](const char* column) {
    return std::find(options.without.begin(), options.without.end(), column) == options.without.end();
  };
  for (const Detection detection : {Detection::discrete, Detection::continuous}) {
    Column column;
    column.name = detection == Detection::discrete ? "ours" : "continuous";
    column.ours = true;
    column.detection = detection;
    if (!subject.corners.empty()) column.body = lab::ours_of(subject.asset);
    column.absent = "the asset has no pointshell";
    column.corners = subject.corners;
    if (wanted(column.name.c_str())) subject.columns.push_back(std::move(column));
  }
  subject.hull = hull_column(subject, options);
  if (wanted("hull")) subject.columns.push_back(subject.hull);
  if (wanted("hacd")) subject.columns.push_back(hacd_column(subject, options));
  if (wanted("gimpact")) subject.columns.push_back(gimpact_column(subject, options));
  return subject;
}

}  // namespace vps::stress
