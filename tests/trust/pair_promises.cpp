// SPDX-License-Identifier: GPL-3.0-or-later
// Promises about a body and a copy of itself.
#include "runtime/fields/penetration.h"
#include "tests/trust/attacks.h"

namespace vps::test {
namespace {

// A shell in a copy of its own body.
class Pair {
 public:
  Pair(const Subject& the_subject, const VoxelmapView& the_map)
      : subject(the_subject), map(the_map), shell(the_subject.shell) {
    contacts.resize(std::size_t{shell.points} + shell.facets);
    values.resize(shell.points);
    scratch.reserve(shell);
    patches_known = find_flat_patches(shell, patches) == Status::ok;
    for (std::uint32_t i = 0; i < shell.points; ++i) {
      const Vec3 p = point_position(shell, i);
      const Vec3 c{shell.centre_of_mass[0], shell.centre_of_mass[1], shell.centre_of_mass[2]};
      arm = std::max(arm, double(detail::length(detail::operator-(p, c))));
    }
  }
  [[nodiscard]] Vec3 place(const Pose& pose, std::uint32_t i) const {
    return to_float(moved(pose, to_double(point_position(shell, i))));
  }
  // The least V within rounding of a point: where bricks of different levels meet, V jumps, and kernels round
  // otherwise.
  [[nodiscard]] float least_beside(const Pose& pose, std::uint32_t i) const {
    const Vec3 at = place(pose, i);
    const float step = 1e-4F * map.voxel_size;
    float least = penetration(map, at, {});
    for (const Vec3 way : {Vec3{step, 0, 0}, Vec3{0, step, 0}, Vec3{0, 0, step}}) {
      for (const float sign : {-1.0F, 1.0F}) {
        least = std::min(least, penetration(map, detail::operator+(at, detail::operator*(sign, way)), {}));
      }
    }
    return least;
  }
  // V of all points. @return the largest
  double look_up(const Pose& pose) {
    double largest = kNotCovered;
    for (std::uint32_t i = 0; i < shell.points; ++i) {
      values[i] = penetration(map, place(pose, i), {});
      largest = std::max(largest, double(values[i]));
    }
    return largest;
  }
  // The largest true V of the eight points with the largest V. @pre look_up
  double true_deepest(const Pose& pose) {
    order.resize(shell.points);
    for (std::uint32_t i = 0; i < shell.points; ++i) order[i] = i;
    const auto last = order.begin() + std::min<std::ptrdiff_t>(8, shell.points);
    std::partial_sort(order.begin(), last, order.end(),
                      [&](std::uint32_t a, std::uint32_t b) { return values[a] > values[b]; });
    double deepest = kNotCovered;
    for (auto at = order.begin(); at != last; ++at) {
      const Point p = moved(pose, to_double(point_position(shell, *at)));
      deepest = std::max(deepest, subject.oracle.penetration(p));
    }
    return deepest;
  }
  QueryResult query(const Pose& pose, const QueryOptions& options) {
    QueryResult result;
    if (traverse(shell, map, pose, options, scratch, contacts, result) != Status::ok) {
      throw std::logic_error("a query of a sound pair fails");
    }
    return result;
  }

  const Subject& subject;
  const VoxelmapView& map;
  const PointshellView& shell;
  std::vector<Contact> contacts;
  std::vector<float> values;
  std::vector<std::uint32_t> order;
  std::vector<FlatPatch> patches;
  bool patches_known = false;
  double arm = 0;  // from the centre of mass to the farthest point. [m]
  Scratch scratch;
};

template <class Measured>
Found over_poses(const Subject& subject, const ClimbOptions& options, double reach_vx, const Measured& measure) {
  const VoxelmapView* const map = finest(subject);
  if (map == nullptr) return {};
  const Places places(subject);
  Pair pair(subject, *map);
  return found(climb(
      options, [&](Random& random) { return meet(places, reach_vx * places.voxel(), random); },
      [&](const Meeting& m, double step, Random& random) { return beside(places, m, step, random); },
      [&](const Meeting& m) { return measure(pair, m); }));
}

// Poses are in double, the kernels' coordinates in float.
double pose_rounding(const Pair& pair) {
  return 4 * rounding(pair.subject) + 1e-4 * double(pair.map.voxel_size);
}

// The largest V of a point that a traverse does not return, over minus the contact distance.
Found attack_contacts(const Subject& subject, const ClimbOptions& options) {
  return over_poses(subject, options, 4, [](Pair& pair, const Meeting& m) {
    QueryOptions query;
    query.contact_distance = 0.5F * pair.map.voxel_size;
    const QueryResult result = pair.query(m.pose, query);
    (void)pair.look_up(m.pose);
    for (std::uint32_t i = 0; i < result.contacts; ++i) pair.values[pair.contacts[i].point] = -1e9F;
    double missed = kNotCovered;
    for (std::uint32_t i = 0; i < pair.shell.points; ++i) {
      float v = pair.values[i];
      if (v >= -query.contact_distance) v = pair.least_beside(m.pose, i);
      missed = std::max(missed, double(v));
    }
    return (missed + double(query.contact_distance) - pose_rounding(pair)) / double(pair.map.voxel_size);
  });
}

template <class Change>
Found attack_delta_bound(const Subject& subject, const ClimbOptions& options, const Change& change) {
  return over_poses(subject, options, 12, [&](Pair& pair, const Meeting& m) {
    QueryOptions query;
    change(query);
    const QueryResult result = pair.query(m.pose, query);
    double deepest = pair.look_up(m.pose);
    // Farther outside V may be nearer to 0 than the true V.
    if (deepest < -double(detail::certified_band(pair.map).outer)) deepest = kNotCovered;
    const double error = double(detail::field_error(pair.map));
    const double truth = pair.true_deepest(m.pose) - error;
    return (std::max(truth, deepest) - result.delta_bound - pose_rounding(pair)) / double(pair.map.voxel_size);
  });
}

// Only where the deepest point lies in the band that the certificate covers: beyond it `delta` is a walk's length.
Found attack_delta(const Subject& subject, const ClimbOptions& options) {
  return over_poses(subject, options, 4, [](Pair& pair, const Meeting& m) {
    const double deepest = pair.look_up(m.pose);
    const detail::CertifiedBand band = detail::certified_band(pair.map);
    if (deepest > double(band.inner) || deepest < -double(band.outer)) return kNotCovered;
    SeparationResult result;
    if (separation(pair.shell, pair.map, m.pose, {}, pair.scratch, result) != Status::ok) return kNotCovered;
    return (deepest - result.delta - pose_rounding(pair)) / double(pair.map.voxel_size);
  });
}

// At any depth inside. `delta` itself is the length of a walk beyond the band, and more accurate than V there.
Found attack_deepest_point(const Subject& subject, const ClimbOptions& options) {
  return over_poses(subject, options, 4, [](Pair& pair, const Meeting& m) {
    const double deepest = pair.look_up(m.pose);
    SeparationResult result;
    if (separation(pair.shell, pair.map, m.pose, {}, pair.scratch, result) != Status::ok) return kNotCovered;
    if (deepest < 0) return kNotCovered;
    const double found = double(penetration(pair.map, result.position, {}));
    return (deepest - found - pose_rounding(pair)) / double(pair.map.voxel_size);
  });
}

// The least bounds of separation with the points of one body, and with those of both.
bool separate(Pair& pair, const Pose& pose, SeparationResult& result) {
  SeparationOptions options;
  if (separation(pair.shell, pair.map, pose, options, pair.scratch, result) != Status::ok) return false;
  options.field_shell = &pair.shell;
  SeparationResult of_both;
  if (separation(pair.shell, pair.map, pose, options, pair.scratch, of_both) != Status::ok) return false;
  result.delta_bound = std::min(result.delta_bound, of_both.delta_bound);
  result.upper = std::min(result.upper, of_both.upper);
  if (of_both.lower > result.lower) {
    result.lower = of_both.lower;
    result.position = of_both.position;
  }
  return true;
}

// Beyond the band too: no point has a V above delta_bound.
Found attack_separation_bound(const Subject& subject, const ClimbOptions& options) {
  return over_poses(subject, options, 40, [](Pair& pair, const Meeting& m) {
    (void)pair.look_up(m.pose);
    SeparationResult result;
    if (!separate(pair, m.pose, result)) return kNotCovered;
    const double bound = result.delta_bound + double(detail::field_error(pair.map));
    return (pair.true_deepest(m.pose) - bound - pose_rounding(pair)) / double(pair.map.voxel_size);
  });
}

Found attack_separation_interval(const Subject& subject, const ClimbOptions& options) {
  return over_poses(subject, options, 40, [](Pair& pair, const Meeting& m) {
    SeparationResult result;
    if (!separate(pair, m.pose, result)) return kNotCovered;
    const Oracle& oracle = pair.subject.oracle;
    const double surface = oracle.penetration(moved(m.pose, m.at)) - result.upper;
    const double deepest = result.lower - oracle.penetration(to_double(result.position));
    return (std::max(surface, deepest) - pose_rounding(pair)) / double(pair.map.voxel_size);
  });
}

// The body arrives at a meeting with a velocity, or would if nothing were in its way.
Found attack_time_of_impact(const Subject& subject, const ClimbOptions& options) {
  const VoxelmapView* const map = finest(subject);
  if (map == nullptr) return {};
  struct Flight {
    Meeting end;
    Eigen::Vector3d velocity, turn;
  };
  const Places places(subject);
  const double s = places.voxel();
  Pair pair(subject, *map);
  return found(climb(
      options,
      [&](Random& random) {
        Flight flight{meet(places, 2 * s, random), {}, {}};
        flight.velocity = 20 * s * random.next() * random_direction(random);
        flight.turn = random.next() * random_direction(random);
        return flight;
      },
      [&](const Flight& flight, double step, Random& random) {
        Flight out{beside(places, flight.end, step, random), flight.velocity, flight.turn};
        out.velocity += 2 * step * s * random.next() * random_direction(random);
        out.turn += 0.1 * step * random.next() * random_direction(random);
        return out;
      },
      [&](const Flight& flight) {
        Sweep sweep;
        Sweep back;
        back.start = flight.end.pose;
        for (int axis = 0; axis < 3; ++axis) {
          back.velocity[axis] = -(sweep.velocity[axis] = flight.velocity[axis]);
          back.angular_velocity[axis] = -(sweep.angular_velocity[axis] = flight.turn[axis]);
        }
        sweep.start = pose_at(pair.shell, back, 1);
        sweep.duration = 1.5;
        ImpactOptions how;
        how.distance = float(0.25 * s);
        how.tolerance = float(0.05 * s);
        ImpactResult result;
        if (time_of_impact(pair.shell, *map, sweep, how, pair.scratch, result) != Status::ok) return kNotCovered;
        if (!(result.time > 0)) return kNotCovered;
        double nearest = kNotCovered;
        for (const double part : {0.5, 0.9, 0.999999}) {
          const Pose pose = pose_at(pair.shell, sweep, part * result.time);
          nearest = std::max(nearest, subject.oracle.penetration(moved(pose, flight.end.at)));
        }
        return (nearest + double(how.distance) - pose_rounding(pair)) / s;
      }));
}

double length_between(const double (&a)[3], const double (&b)[3]) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Force and torque with flat patches against those of all points, over what docs/internals/bounds.md states.
Found attack_wrench(const Subject& subject, const ClimbOptions& options) {
  return over_poses(subject, options, 2, [](Pair& pair, const Meeting& m) {
    if (!pair.patches_known || pair.patches.empty()) return kNotCovered;
    QueryOptions query;
    const QueryResult all = pair.query(m.pose, query);
    double area = 0;
    double sum = 0;
    for (std::uint32_t i = 0; i < all.contacts; ++i) {
      const Contact& c = pair.contacts[i];
      if (c.penetration < 0) continue;
      area += double(c.area);
      sum += double(c.area) * double(c.penetration);
    }
    query.flat_patches = pair.patches;
    const QueryResult few = pair.query(m.pose, query);
    if (few.contacts == all.contacts || !(sum > 0)) return kNotCovered;
    const double f = 0.01 * double(pair.shell.feature_covering_radius);
    const double more = double(kPatchNormal) * sum + 1e-6 * sum + area * pose_rounding(pair) * 0.01;
    const double force = length_between(few.force, all.force) / (5 * f * area + more);
    const double torque = length_between(few.torque, all.torque) / (pair.arm * (6 * f * area + more));
    return std::max(force, torque);
  });
}

}  // namespace

void add_pair_promises(std::vector<Promise>& all) {
  constexpr double kEffort = 0.05;
  const auto add = [&](const char* name, const char* says, Measure measure, bool certified,
                       std::function<Found(const Subject&, const ClimbOptions&)> attack) {
    all.push_back({name, says, measure, certified, kEffort, std::move(attack)});
  };
  add("contacts", "`traverse` returns all points with V of at least minus the contact distance", Measure::excess, true,
      attack_contacts);
  add("delta bound", "no point of the shell has a true V above `QueryResult::delta_bound`", Measure::excess, true,
      [](const Subject& subject, const ClimbOptions& options) {
        return attack_delta_bound(subject, options, [](QueryOptions&) {});
      });
  add("delta bound, cut", "the same when a budget runs out", Measure::excess, true,
      [](const Subject& subject, const ClimbOptions& options) {
        return attack_delta_bound(subject, options, [](QueryOptions& query) { query.max_tests = 40; });
      });
  add("separation delta", "in the certified band no point has a V above `delta`", Measure::excess, true, attack_delta);
  add("separation point", "inside no point has a V above that of the point that `separation` returns", Measure::excess,
      true, attack_deepest_point);
  add("separation bound", "no point has a true V above `delta_bound` and the field's error", Measure::excess, true,
      attack_separation_bound);
  add("separation interval", "the largest true V of the true surface is from `lower` to `upper`", Measure::excess, true,
      attack_separation_interval);
  add("time of impact", "nothing is nearer than the distance before `time`", Measure::excess, true,
      attack_time_of_impact);
  add("wrench", "force and torque with flat patches are those of all points within the stated bound", Measure::ratio,
      false, attack_wrench);
}

}  // namespace vps::test
