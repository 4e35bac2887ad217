// SPDX-License-Identifier: GPL-3.0-or-later
// Compares an asset with its mesh: CGAL's distances and sides at random points, and from the worst of them by climbing.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "bake/quantity_text.h"
#include "cli/lab/climb.h"
#include "cli/lab/oracle.h"
#include "cli/lab/random.h"
#include "cli/tools/nearest_point.h"
#include "cli/tools/stored_field.h"
#include "cli/tools/validate/check.h"

namespace vps::cli {
namespace {

using Point = std::array<double, 3>;
using Result = Check::Result;

// Queries compute in float.
constexpr double kRounding = 1e-6;  // of the coordinates

Vec3 to_float(const Point& p) {
  return {float(p[0]), float(p[1]), float(p[2])};
}
Point to_double(Vec3 p) {
  return {double(p.x), double(p.y), double(p.z)};
}
Eigen::Vector3d vector(const Point& p) {
  return {p[0], p[1], p[2]};
}

// Random points on the surface, evenly by area.
class SurfacePoints {
 public:
  explicit SurfacePoints(const TriangleMesh& mesh) : mesh_(mesh) {
    double sum = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
      const Eigen::Vector3d p = vector(mesh.vertices[a]);
      sum += (vector(mesh.vertices[b]) - p).cross(vector(mesh.vertices[c]) - p).norm() / 2;
      areas_.push_back(sum);
    }
  }
  [[nodiscard]] double area() const { return areas_.empty() ? 0 : areas_.back(); }
  [[nodiscard]] Point next(lab::Random& random) const {
    const auto found = std::upper_bound(areas_.begin(), areas_.end(), random.next() * area());
    const auto& t = mesh_.triangles[std::min(std::size_t(found - areas_.begin()), areas_.size() - 1)];
    const double root = std::sqrt(random.next()), part = random.next();
    const double weights[3] = {1 - root, root * (1 - part), root * part};
    Point p{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
      for (std::size_t axis = 0; axis < 3; ++axis) p[axis] += weights[corner] * mesh_.vertices[t[corner]][axis];
    }
    return p;
  }

 private:
  const TriangleMesh& mesh_;
  std::vector<double> areas_;  // cumulative: of all triangles up to this one
};

class MeshChecks {
 public:
  MeshChecks(const Asset& asset, const TriangleMesh& mesh, const MeshCheckOptions& options, std::vector<Check>& checks)
      : asset_(asset), info_(asset.info()), mesh_(mesh), options_(options), checks_(checks), surface_(mesh) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      slack_ = std::max(
          {slack_, kRounding * std::abs(info_.bounds_min[axis]), kRounding * std::abs(info_.bounds_max[axis])});
    }
  }

  void run() {
    check_mesh();
    check_mass();
    try {
      const lab::Oracle oracle(mesh_);
      if (asset_.has_voxelmap()) {
        for (const Field field : {Field::layers, Field::scaled, Field::real}) check_field(oracle, field);
        check_far(oracle);
        check_coarse_layers(oracle);
        check_planes(oracle);
      }
      if (asset_.pointshell(shell_) == Status::ok) {
        check_covering();
        check_points(oracle);
        check_normals(oracle);
      }
    } catch (const lab::MeasureError& error) {
      add("oracle", Result::skipped, error.what());
    }
  }

 private:
  void add(std::string name, Result result, std::string says, nlohmann::ordered_json figures = nullptr) {
    checks_.push_back({std::move(name), result, std::move(says), std::move(figures)});
  }
  static Result passed(bool good) { return good ? Result::ok : Result::failed; }

  // A measured length against the allowed one, for people.
  static std::string against(double found, double allowed) {
    return fmt::format("{} of {} ({:.0f} %)", bake::format_length(found), bake::format_length(allowed),
                       allowed > 0 ? 100 * found / allowed : 0);
  }

  // Whether the mesh has the bytes that were baked. Others may describe the same surface.
  void check_mesh() {
    const std::uint64_t parts[2] = {hash_bytes(std::as_bytes(std::span(mesh_.vertices))),
                                    hash_bytes(std::as_bytes(std::span(mesh_.triangles)))};
    const bool same = hash_bytes(std::as_bytes(std::span(parts))) == info_.mesh_hash;
    add("mesh", same ? Result::ok : Result::warning,
        same ? "the very mesh that was baked"
             : "not the very mesh that was baked: another file, or other options of reading and repairing it");
  }

  void check_mass() {
    double volume = 0;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const auto& [a, b, c] : mesh_.triangles) {
      // Tetrahedra with an apex at a corner of the bounds keep rounding small.
      const Eigen::Vector3d origin = vector(info_.bounds_min);
      const Eigen::Vector3d p = vector(mesh_.vertices[a]) - origin, q = vector(mesh_.vertices[b]) - origin,
                            r = vector(mesh_.vertices[c]) - origin;
      const double part = p.dot(q.cross(r)) / 6;
      volume += part;
      moment += part / 4 * (p + q + r);
    }
    for (const auto& v : mesh_.vertices) {
      low = low.cwiseMin(vector(v));
      high = high.cwiseMax(vector(v));
    }
    const Eigen::Vector3d centre = moment / volume + vector(info_.bounds_min);
    const double size = (high - low).norm();
    const double volume_off = std::abs(volume - info_.volume),
                 area_off = std::abs(surface_.area() - info_.surface_area);
    const double centre_off = (centre - vector(info_.centre_of_mass)).norm();
    const double bounds_off =
        std::max((low - vector(info_.bounds_min)).norm(), (high - vector(info_.bounds_max)).norm());
    constexpr double kTolerance = 1e-6;
    const bool good = volume_off <= kTolerance * std::max(std::abs(volume), 1e-6 * size * size * size) &&
                      area_off <= kTolerance * surface_.area() && centre_off <= kTolerance * size &&
                      bounds_off <= kTolerance * size;
    add("mass", passed(good),
        fmt::format("off the mesh's: volume by {:.2g} m^3, surface by {:.2g} m^2, centre by {}, bounds by {}",
                    volume_off, area_off, bake::format_length(centre_off), bake::format_length(bounds_off)),
        {{"volume", volume},
         {"surface_area", surface_.area()},
         {"centre_off", centre_off},
         {"bounds_off", bounds_off}});
  }

  // Random places, then climbs from the worst of them.
  // @param check  its number, so that each check has places of its own
  template <class Start, class Beside, class Measure>
  lab::Climbed<Point> climb_from(std::uint64_t check, const Start& start, const Beside& beside,
                                 const Measure& measure) const {
    lab::ClimbOptions climb;
    climb.starts = options_.samples;
    climb.climbs = 16;
    climb.seed = options_.seed + check;
    return lab::climb(climb, start, beside, measure);
  }
  // In the space round the body.
  template <class Start, class Measure>
  lab::Climbed<Point> climb_in_space(std::uint64_t check, const Start& start, const Measure& measure) const {
    const auto beside = [&](const Point& p, double step, lab::Random& random) {
      return rounded(moved(p, step * info_.voxel_size, random));
    };
    return climb_from(check, start, beside, measure);
  }

  // In a random direction by up to `farthest`.
  static Point moved(const Point& p, double farthest, lab::Random& random) {
    const std::array<double, 9> turn = random.rotation();  // its first row: a random direction
    const double length = random.between(0, farthest);
    return {p[0] + length * turn[0], p[1] + length * turn[1], p[2] + length * turn[2]};
  }
  // As in a query.
  static Point rounded(const Point& p) { return to_double(to_float(p)); }

  // A random point within `reach` of the surface.
  Point near_surface(lab::Random& random, double reach) const {
    return rounded(moved(surface_.next(random), reach, random));
  }

  // A random point in a box.
  static Point within(lab::Random& random, const Point& low, const Point& high) {
    return rounded({random.between(low[0], high[0]), random.between(low[1], high[1]), random.between(low[2], high[2])});
  }

  void check_field(const lab::Oracle& oracle, Field field) {
    VoxelmapView map;
    if (asset_.voxelmap(map, field) != Status::ok) return;
    const FieldCertificate& certificate = field == Field::layers   ? info_.layers_error
                                          : field == Field::scaled ? info_.scaled_error
                                                                   : info_.real_error;
    const double most = std::max(certificate.bound, info_.far_error.bound);
    const double margin = std::sqrt(0.75) * info_.voxel_size;  // excluded from the certificate at the band's ends
    double squares = 0;                                        // at random points
    int tries = 0, random_points = 0, count = 0, above = 0;
    bool proven = true;
    const auto error_at = [&](const Point& p) {
      ++tries;
      const double truth = oracle.penetration(p);
      if (truth > info_.band_inner - margin || truth < margin - info_.band_outer) return lab::kNotCovered;
      Vec3 normal;  // of a shell in flat contact, for Eq. (4)
      if (field == Field::layers) {
        const detail::Voxel voxel = detail::find_voxel(map, to_float(p));
        Point centre = p;
        const float to_centre[3] = {voxel.to_centre.x, voxel.to_centre.y, voxel.to_centre.z};
        for (std::size_t axis = 0; axis < 3; ++axis) centre[axis] += double(to_centre[axis]);
        normal = to_float(oracle.outward_normal(centre));
        proven = proven && layer_allows(map, voxel, truth);
      }
      const double error = std::abs(double(detail::own_penetration(map, to_float(p), normal).v) - truth);
      // At the band's end V changes over to the far grid, and may have its error.
      const double of_query = std::abs(double(penetration(map, to_float(p), normal)) - truth);
      if (tries <= options_.samples) {
        squares += error * error;
        ++random_points;
      }
      if (!(error <= certificate.bound + slack_ && of_query <= most + slack_)) ++above;
      ++count;
      return error;
    };
    const double reach = std::max(info_.band_inner, info_.band_outer);
    const auto worst = climb_in_space(
        0, [&](lab::Random& random) { return near_surface(random, reach); }, error_at);
    const std::string name = std::string("field ") + field_name(field);
    if (random_points == 0) return add(name, Result::skipped, "no random point fell into the band");
    const double rms = std::sqrt(squares / random_points);
    add(name, passed(proven && above == 0),
        fmt::format("largest error {} that queries reckon with, RMS {}, at {} points of the band",
                    against(worst.value, certificate.bound), bake::format_length(rms), count),
        {{"samples", count},
         {"max", worst.value},
         {"max_of_random", worst.started},
         {"rms", rms},
         {"worst_at", worst.place},
         {"bound", certificate.bound},
         {"above_bound", above}});
  }

  // Whether a voxel's layer allows this distance, see docs/internals/bounds.md, Layers.
  [[nodiscard]] bool layer_allows(const VoxelmapView& map, const detail::Voxel& voxel, double truth) const {
    const std::uint32_t brick = voxel.in_grid ? map.brick_index[voxel.brick] : kNoBrick;
    if (!is_stored(brick)) return false;
    const double layer = std::abs(layer_at(map, brick, voxel.voxel));
    return (layer - 1) * info_.voxel_size <= std::abs(truth) + slack_ &&
           std::abs(truth) <= std::sqrt(3.0) * (layer + 1) * info_.voxel_size + slack_;
  }

  // Beyond the band a query must give the right sign and a distance within the far grid's error. Without a far grid,
  // and beyond its range, it must give at most the true distance.
  void check_far(const lab::Oracle& oracle) {
    VoxelmapView map;
    if (asset_.voxelmap(map) != Status::ok) return;
    int count = 0, wrong = 0;
    double excess = 0, worst = 0;
    Point low, high;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double length = info_.bounds_max[axis] - info_.bounds_min[axis] + 2 * info_.band_outer;
      low[axis] = info_.bounds_min[axis] - length / 4;
      high[axis] = info_.bounds_max[axis] + length / 4;
    }
    const auto error_at = [&](const Point& p) {
      if (std::isfinite(stored_penetration(map, to_float(p)))) return lab::kNotCovered;
      ++count;
      const double truth = oracle.penetration(p), found = double(penetration(map, to_float(p), {}));
      if ((found >= 0) != (truth >= 0)) ++wrong;
      if (info_.far_spacing > 0 && truth > -info_.far_range) {
        worst = std::max(worst, std::abs(found - truth));
        return std::abs(found - truth);
      }
      excess = std::max(excess, std::abs(found) - std::abs(truth));
      return std::abs(found) - std::abs(truth);
    };
    (void)climb_in_space(
        1, [&](lab::Random& random) { return within(random, low, high); }, error_at);
    if (count == 0) return;
    // Distances that the far grid gives farther outside are within its error, too.
    const double allowed = std::max(double(map.error), info_.far_error.bound);
    const bool good = wrong == 0 && excess <= allowed + slack_ && worst <= info_.far_error.bound + slack_;
    add("far", passed(good),
        good ? fmt::format("{} points beyond the band: the right side, and the largest error {}", count,
                           against(worst, info_.far_error.bound))
             : fmt::format(
                   "of {} points beyond the band {} on the wrong side, errors up to {}, distances too large by up "
                   "to {}",
                   count, wrong, bake::format_length(worst), bake::format_length(std::max(excess, 0.0))),
        {{"samples", count},
         {"wrong_side", wrong},
         {"max", worst},
         {"bound", info_.far_error.bound},
         {"excess", std::max(excess, 0.0)}});
  }

  void check_coarse_layers(const lab::Oracle& oracle) {
    VoxelmapView map;
    if (asset_.voxelmap(map) != Status::ok) return;
    lab::Random random(options_.seed + 2);
    const std::uint32_t* const dims = map.root_dims;
    const auto blocks = double(dims[0]) * double(dims[1]) * double(dims[2]);
    const int count = static_cast<int>(std::min(blocks, double(options_.samples)));
    int wrong = 0;
    for (int i = 0; i < count; ++i) {
      const auto block = blocks <= options_.samples ? std::uint64_t(i) : std::uint64_t(random.next() * blocks);
      const std::uint64_t index[3] = {block % dims[0], block / dims[0] % dims[1], block / dims[0] / dims[1]};
      Point centre;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        centre[axis] = info_.origin[axis] + (double(index[axis]) + 0.5) * kCoarseEdge * info_.voxel_size;
      }
      const double truth = oracle.penetration(centre), layer = map.coarse_layers[block];
      const double s = info_.voxel_size;
      const bool far = std::abs(layer) >= 1;
      if (std::abs(layer) * s > std::abs(truth) + slack_ ||
          std::abs(truth) > (std::abs(layer) + double(kCoarseLayerSlack)) * s + slack_ ||
          (far && (layer > 0) != (truth > 0))) {
        ++wrong;
      }
    }
    add("coarse layers", passed(wrong == 0),
        fmt::format("{} of {} blocks' bounds of the distance are wrong", wrong == 0 ? "none" : std::to_string(wrong),
                    count),
        {{"blocks", count}, {"wrong", wrong}});
  }

  // Planes bound the true V of points outside, and the field's own values where these can be contacts.
  void check_planes(const lab::Oracle& oracle) {
    VoxelmapView map;
    if (asset_.voxelmap(map, Field::scaled) != Status::ok || map.planes == nullptr) return;
    const float end = detail::end_of_band(map.band_outer, map.voxel_size);
    int count = 0, wrong = 0;
    const auto height_over_plane = [&](const Point& p) {
      const detail::PlaneAt at = detail::find_plane(map, to_float(p));
      if (!at.in_grid) return lab::kNotCovered;
      const double truth = oracle.penetration(p);
      double least = truth < 0 ? truth : -double{map.error};
      const detail::OwnPenetration own = detail::own_penetration(map, to_float(p), {});
      if (own.sampled && own.v >= -end) least = std::max(least, double{own.v});
      ++count;
      if (least > double{at.height} + slack_) ++wrong;
      return least - double{at.height};
    };
    Point low, high;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = info_.origin[axis];
      high[axis] = info_.origin[axis] + info_.dims[axis] * info_.voxel_size;
    }
    (void)climb_in_space(
        3, [&](lab::Random& random) { return within(random, low, high); }, height_over_plane);
    add("planes", passed(wrong == 0),
        fmt::format("{} of {} points lie above the plane of their cell", wrong == 0 ? "none" : std::to_string(wrong),
                    count),
        {{"points", count}, {"wrong", wrong}});
  }

  void check_covering() {
    const NearestPoint nearest(shell_, std::max(info_.covering_radius, info_.position_step));
    const lab::SoupOracle surface(mesh_);
    const auto beside = [&](const Point& p, double step, lab::Random& random) {
      return surface.closest(moved(p, 4 * step * info_.voxel_size, random));
    };
    const auto worst = climb_from(
        5, [&](lab::Random& random) { return surface_.next(random); }, beside,
        [&](const Point& p) { return nearest(vector(p)).distance; });
    add("covering", passed(worst.value <= info_.covering_radius + slack_),
        fmt::format("the nearest point of the shell is {} of the covering radius away, at {} points of the surface",
                    against(worst.value, info_.covering_radius), worst.measured),
        {{"samples", worst.measured},
         {"max", worst.value},
         {"at", worst.place},
         {"covering_radius", info_.covering_radius}});
  }

  // Calls visit(index of a point) for all points of the shell, or for random ones. @return the number of calls
  template <class Visit>
  int for_some_points(const Visit& visit) const {
    lab::Random random(options_.seed + 4);
    const bool all = shell_.points <= std::uint32_t(options_.samples);
    const int count = all ? int(shell_.points) : options_.samples;
    for (int i = 0; i < count; ++i) visit(all ? std::uint32_t(i) : std::uint32_t(random.next() * shell_.points));
    return count;
  }

  void check_points(const lab::Oracle& oracle) {
    const double allowed = std::sqrt(0.75) * info_.position_step;
    double worst = 0;
    const int count = for_some_points(
        [&](std::uint32_t i) { worst = std::max(worst, oracle.distance(to_double(point_position(shell_, i)))); });
    add("points", passed(worst <= allowed + slack_),
        fmt::format("{} points of the shell lie within {} of rounding on the surface", count, against(worst, allowed)),
        {{"samples", count}, {"max", worst}, {"allowed", allowed}});
  }

  void check_normals(const lab::Oracle& oracle) {
    // Length of a step along the normal, longer than the rounding of positions.
    const double step = std::max(8 * info_.position_step, 1e-3 * info_.voxel_size) + slack_;
    int turned = 0;
    int thin = 0;
    const int count = for_some_points([&](std::uint32_t i) {
      const Eigen::Vector3d p = vector(to_double(point_position(shell_, i))),
                            n = vector(to_double(point_inward_normal(shell_, i)));
      const Eigen::Vector3d in = p + step * n, out = p - step * n;
      if (oracle.penetration({in.x(), in.y(), in.z()}) > oracle.penetration({out.x(), out.y(), out.z()})) return;
      // A wall or gap thinner than the step: the normal is that of one of its sides.
      ++(oracle.points_inward({p.x(), p.y(), p.z()}, {n.x(), n.y(), n.z()}, step) ? thin : turned);
    });
    add("normals", passed(turned == 0),
        fmt::format(
            "{} of {} do not point into the body{}", turned == 0 ? "none" : std::to_string(turned), count,
            thin == 0 ? "" : fmt::format("; {} at walls or gaps thinner than {}", thin, bake::format_length(step))),
        {{"samples", count}, {"turned", turned}, {"thin", thin}});
  }

  const Asset& asset_;
  const AssetInfo& info_;
  const TriangleMesh& mesh_;
  const MeshCheckOptions& options_;
  std::vector<Check>& checks_;
  SurfacePoints surface_;
  PointshellView shell_{};
  double slack_ = 0;  // [m]
};

}  // namespace

void check_against_mesh(const Asset& asset, const TriangleMesh& mesh, const MeshCheckOptions& options,
                        std::vector<Check>& checks) {
  MeshChecks(asset, mesh, options, checks).run();
}

}  // namespace vps::cli
