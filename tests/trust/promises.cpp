// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/trust/promises.h"

#include "cli/tools/nearest_point.h"
#include "cli/tools/stored_field.h"
#include "runtime/fields/penetration.h"
#include "tests/trust/attacks.h"

namespace vps::test {

Subject::Subject(TriangleMesh closed, const bake::BakeOptions& options)
    : mesh(std::move(closed)), oracle(mesh), surface(mesh) {
  const bake::BakedAsset baked = bake::bake(mesh, options);
  bytes_ = asset_bytes(baked.info, baked.sections);
  if (Asset::open(bytes_, asset) != Status::ok) throw std::logic_error("the asset does not open");
  for (const Field field : {Field::layers, Field::scaled, Field::real}) {
    VoxelmapView map;
    if (asset.voxelmap(map, field) == Status::ok) maps[field] = map;
  }
  if (asset.pointshell(shell) != Status::ok) throw std::logic_error("the asset has no pointshell");
}

namespace {

// Climbs over points of the space round a body. The measure takes a point as a query sees it, in float.
template <class Measured>
Found over_points(const Subject& subject, const ClimbOptions& options, double reach, const Measured& measure) {
  const Places places(subject);
  return found(climb(
      options, [&](Random& random) { return places.anywhere(random, reach); },
      [&](const Point& p, double step, Random& random) { return places.beside(p, step, random); },
      [&](const Point& p) { return measure(to_float(p), to_double(to_float(p))); }));
}

double wider_band(const Subject& subject) {
  const AssetInfo& info = subject.asset.info();
  return std::max(info.band_inner, info.band_outer);
}

Found attack_field(const Subject& subject, const ClimbOptions& options, Field field) {
  const VoxelmapView* const map = map_of(subject, field);
  if (map == nullptr) return {};
  const AssetInfo& info = subject.asset.info();
  const FieldCertificate& certificate = field == Field::layers   ? info.layers_error
                                        : field == Field::scaled ? info.scaled_error
                                                                 : info.real_error;
  const double margin = std::sqrt(0.75) * info.voxel_size;
  const double slack = rounding(subject);
  return over_points(subject, options, wider_band(subject), [&](Vec3 point, const Point& p) {
    const double truth = subject.oracle.penetration(p);
    if (truth > info.band_inner - margin || truth < margin - info.band_outer) return kNotCovered;
    Vec3 normal;
    if (field == Field::layers) {
      const detail::Voxel voxel = detail::find_voxel(*map, point);
      const float to_centre[3] = {voxel.to_centre.x, voxel.to_centre.y, voxel.to_centre.z};
      Point centre = p;
      for (std::size_t axis = 0; axis < 3; ++axis) centre[axis] += double(to_centre[axis]);
      normal = to_float(subject.oracle.outward_normal(centre));
    }
    const double error = std::abs(double(detail::own_penetration(*map, point, normal).v) - truth) - slack;
    return error / certificate.bound;
  });
}

Found attack_layers(const Subject& subject, const ClimbOptions& options) {
  const VoxelmapView* const map = map_of(subject, Field::layers);
  if (map == nullptr) return {};
  const double s = subject.asset.info().voxel_size;
  const double slack = rounding(subject) / s;
  return over_points(subject, options, wider_band(subject), [&](Vec3 point, const Point& p) {
    const detail::Voxel voxel = detail::find_voxel(*map, point);
    if (!detail::has_layer(*map, voxel)) return kNotCovered;
    const std::int32_t layer = detail::layer_of(*map, voxel);
    const double distance = subject.oracle.distance(p) / s;
    const double n = std::abs(layer);
    const double low = n - 1 - distance;
    if (n >= 127) return low - slack;
    return std::max(low, distance - std::sqrt(3.0) * (n + 1)) - slack;
  });
}

Found attack_coarse_layers(const Subject& subject, const ClimbOptions& options) {
  const VoxelmapView* const map = finest(subject);
  if (map == nullptr) return {};
  const double s = subject.asset.info().voxel_size;
  const double slack = rounding(subject) / s;
  return over_points(subject, options, wider_band(subject), [&](Vec3 point, const Point& p) {
    const detail::Voxel voxel = detail::find_voxel(*map, point);
    if (!voxel.in_grid) return kNotCovered;
    const double c = std::abs(map->coarse_layers[voxel.block]);
    const double reach = double(detail::length(voxel.to_block_centre)) / s;
    const double distance = subject.oracle.distance(p) / s;
    return std::max(c - reach - distance, distance - (c + double(kCoarseLayerSlack)) - reach) - slack;
  });
}

// @param sampled  whether to look in the band: beyond it bounds are tight along the mesh's own bounds, where a search
//                 would stay
Found attack_upper_bound(const Subject& subject, const ClimbOptions& options, Field field, bool sampled) {
  const VoxelmapView* const map = map_of(subject, field);
  if (map == nullptr) return {};
  const double slack = rounding(subject);
  return over_points(subject, options, wider_band(subject), [&](Vec3 point, const Point& p) {
    if (detail::own_penetration(*map, point, {}).sampled != sampled) return kNotCovered;
    return (subject.oracle.penetration(p) - double(penetration_bound(*map, point)) - slack) / double(map->voxel_size);
  });
}

Found attack_interval(const Subject& subject, const ClimbOptions& options, Field field, bool sampled) {
  const VoxelmapView* const map = map_of(subject, field);
  if (map == nullptr) return {};
  const double slack = rounding(subject);
  return over_points(subject, options, wider_band(subject), [&](Vec3 point, const Point& p) {
    if (detail::own_penetration(*map, point, {}).sampled != sampled) return kNotCovered;
    const detail::Interval interval = detail::penetration_interval(*map, point);
    const double truth = subject.oracle.penetration(p);
    return (std::max(truth - double(interval.high), double(interval.low) - truth) - slack) / double(map->voxel_size);
  });
}

Found attack_planes(const Subject& subject, const ClimbOptions& options) {
  const VoxelmapView* const map = map_of(subject, Field::scaled);
  if (map == nullptr || map->planes == nullptr) return {};
  const double slack = rounding(subject);
  const float end = detail::end_of_band(map->band_outer, map->voxel_size);
  return over_points(subject, options, 3 * wider_band(subject), [&](Vec3 point, const Point& p) {
    const detail::PlaneAt at = detail::find_plane(*map, point);
    if (!at.in_grid) return kNotCovered;
    const double truth = subject.oracle.penetration(p);
    double least = truth < 0 ? truth : -double(map->error);
    const detail::OwnPenetration own = detail::own_penetration(*map, point, {});
    if (own.sampled && own.v >= -end) least = std::max(least, double(own.v));
    return (least - double(at.height) - slack) / double(map->voxel_size);
  });
}

Found attack_far_grid(const Subject& subject, const ClimbOptions& options) {
  const VoxelmapView* const map = finest(subject);
  if (map == nullptr || map->far.values == nullptr) return {};
  const double slack = rounding(subject);
  return over_points(subject, options, double(map->far.range), [&](Vec3 point, const Point& p) {
    const double truth = subject.oracle.penetration(p);
    if (detail::own_penetration(*map, point, {}).sampled || truth < -double(map->far.range)) return kNotCovered;
    const double v = double(penetration(*map, point, {}));
    // On the wrong side a distance is wrong whatever its size.
    if ((v >= 0) != (truth >= 0) && std::abs(truth) > slack) return 2.0;
    return (std::abs(v - truth) - slack) / double(map->far.error);
  });
}

Found attack_closest_point(const Subject& subject, const ClimbOptions& options) {
  const VoxelmapView* const map = finest(subject);
  if (map == nullptr) return {};
  const double slack = rounding(subject);
  return over_points(subject, options, 2 * wider_band(subject), [&](Vec3 point, const Point& p) {
    ClosestPoint closest;
    if (closest_point(*map, point, {}, closest) != Status::ok) return kNotCovered;
    if (closest.inside != (penetration(*map, point, {}) >= 0)) return double(map->band_inner / map->voxel_size);
    const double distance = subject.oracle.distance(p);
    return (std::max(double(closest.lower) - distance, distance - double(closest.upper)) - slack) /
           double(map->voxel_size);
  });
}

// The largest V before a ray's hit. Rays start at a point and end at another, so that both can climb.
Found attack_rays(const Subject& subject, const ClimbOptions& options) {
  const VoxelmapView* const map = finest(subject);
  if (map == nullptr) return {};
  struct Path {
    Point from{}, to{};
  };
  const Places places(subject);
  const double s = places.voxel();
  const double reach = 2 * wider_band(subject);
  return found(climb(
      options,
      [&](Random& random) {
        return Path{places.anywhere(random, reach), places.near_surface(random, s)};
      },
      [&](const Path& path, double step, Random& random) {
        return Path{places.beside(path.from, step, random), places.beside(path.to, step, random)};
      },
      [&](const Path& path) {
        const Eigen::Vector3d way = vector_of(path.to) - vector_of(path.from);
        const double length = way.norm() + 3 * s;
        const Eigen::Vector3d along = way.normalized();
        if (!(way.norm() > 0)) return kNotCovered;
        Ray ray;
        ray.origin = to_float(path.from);
        ray.direction = to_float(point_of(along));
        ray.max_distance = float(length);
        RayHit hit;
        const RayOptions precise{1e-3F};
        if (cast_ray(*map, ray, precise, hit) != Status::ok) return kNotCovered;
        const double tolerance = 2 * double(precise.tolerance_vx) * s;
        const double end = (hit.hit ? double(hit.distance) : length) - tolerance;
        const std::uint64_t most = 16 + 8 * (std::uint64_t{map->dims[0]} + map->dims[1] + map->dims[2]);
        if (hit.steps > most) return double(hit.steps);
        constexpr int kSamples = 48;
        double highest = kNotCovered;
        for (int i = 0; i < kSamples && end > 0; ++i) {
          // Half of them in the last voxel, where the ray comes near the surface.
          const double t = i % 2 == 0 ? end * i / kSamples : std::max(end - s * (kSamples - i) / kSamples, 0.0);
          const Vec3 p = detail::operator+(ray.origin, detail::operator*(float(t), ray.direction));
          highest = std::max(highest, double(penetration(*map, p, {})));
        }
        return (highest - tolerance - rounding(subject)) / s;
      }));
}

Found attack_covering(const Subject& subject, const ClimbOptions& options) {
  const Places places(subject);
  const AssetInfo& info = subject.asset.info();
  const cli::NearestPoint nearest(subject.shell, std::max(info.covering_radius, info.position_step));
  return found(climb(
      options, [&](Random& random) { return places.on_surface(random); },
      [&](const Point& p, double step, Random& random) { return places.beside_on_surface(p, step, random); },
      [&](const Point& p) { return (nearest(vector_of(p)).distance - rounding(subject)) / info.covering_radius; }));
}

// Not a search: all points and spheres.
Found test_points(const Subject& subject, const ClimbOptions&) {
  Found out;
  const AssetInfo& info = subject.asset.info();
  const double most = std::sqrt(0.75) * info.position_step;
  for (std::uint32_t i = 0; i < subject.shell.points; ++i) {
    const double distance = subject.oracle.distance(to_double(point_position(subject.shell, i)));
    out.worst = std::max(out.worst, (distance - rounding(subject)) / most);
    ++out.measured;
  }
  out.started = out.worst;
  return out;
}

Found test_spheres(const Subject& subject, const ClimbOptions&) {
  Found out;
  const PointshellView& shell = subject.shell;
  const std::uint32_t leaves = shell.level_offsets[shell.levels - 1];
  for (std::uint32_t node = 0; node < shell.nodes; ++node) {
    std::uint32_t first = node;
    std::uint32_t last = node;
    while (first < leaves) {
      last = children_of(shell, last).end - 1;
      first = children_of(shell, first).begin;
    }
    const Eigen::Vector3d centre = vector_of(to_double(sphere_centre(shell, node)));
    for (std::uint32_t i = children_of(shell, first).begin; i < children_of(shell, last).end; ++i) {
      const double distance = (vector_of(to_double(point_position(shell, i))) - centre).norm();
      // Rounding in float: the check itself is exact to that.
      const double radius = double(sphere_radius(shell, node)) + 0.1 * rounding(subject);
      out.worst = std::max(out.worst, distance / radius);
      ++out.measured;
    }
  }
  out.started = out.worst;
  return out;
}

std::vector<Promise> all_promises() {
  std::vector<Promise> all;
  const auto add = [&](std::string name, const char* says, Measure measure, bool certified, double effort,
                       std::function<Found(const Subject&, const ClimbOptions&)> attack) {
    all.push_back({std::move(name), says, measure, certified, effort, std::move(attack)});
  };
  const auto of_field = [](auto attack, Field field) {
    return [=](const Subject& subject, const ClimbOptions& options) { return attack(subject, options, field); };
  };
  add("coarse layers", "the distance to the surface is within the bounds of a block's coarse layer", Measure::excess,
      false, 1, attack_coarse_layers);
  add("layers", "the distance to the surface is within the bounds of a voxel's layer", Measure::excess, false, 1,
      attack_layers);
  add("field layers", "the error of V by Eq. (4) is at most the certificate's bound", Measure::ratio, false, 1,
      of_field(attack_field, Field::layers));
  add("field scaled", "the error of the interpolated V is at most the certificate's bound", Measure::ratio, true, 1,
      of_field(attack_field, Field::scaled));
  add("field real", "the error of the interpolated V is at most the certificate's bound", Measure::ratio, true, 1,
      of_field(attack_field, Field::real));
  for (const Field field : {Field::layers, Field::scaled, Field::real}) {
    const bool certified = field != Field::layers;
    for (const bool sampled : {true, false}) {
      const std::string where = std::string(" ") + cli::field_name(field) + (sampled ? "" : ", beyond");
      add("bound" + where, "`penetration_bound` is at least the true V", Measure::excess, certified, 1,
          [=](const Subject& subject, const ClimbOptions& options) {
            return attack_upper_bound(subject, options, field, sampled);
          });
      add("interval" + where, "the true V is in the interval of a point", Measure::excess, certified, 1,
          [=](const Subject& subject, const ClimbOptions& options) {
            return attack_interval(subject, options, field, sampled);
          });
    }
  }
  add("planes", "the true V outside and the field's V are at most the plane of their cell", Measure::excess, false, 1,
      attack_planes);
  add("far grid", "beyond the band the error of V is at most `FarGridView::error`, and its sign is right",
      Measure::ratio, false, 1, attack_far_grid);
  add("closest point", "the distance to the surface is from `lower` to `upper`, and `inside` is V's sign",
      Measure::excess, true, 0.3, attack_closest_point);
  add("rays", "no point before a ray's hit is inside, and its steps are limited", Measure::excess, false, 0.3,
      attack_rays);
  add("covering", "every point of the surface is within the covering radius of a point of the shell", Measure::ratio,
      false, 1, attack_covering);
  add("points", "all points of the shell are within rounding of the surface", Measure::ratio, false, 1, test_points);
  add("spheres", "every sphere of the tree contains all points below it", Measure::ratio, false, 1, test_spheres);
  add_pair_promises(all);
  return all;
}

}  // namespace

const std::vector<Promise>& promises() {
  static const std::vector<Promise> all = all_promises();
  return all;
}

}  // namespace vps::test
