// SPDX-License-Identifier: Zlib
#include "runtime/python/pairs.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace vps::python {
namespace {

// An array of a vector that it owns.
template <class T>
py::array_t<T> owned(std::vector<T>&& from) {
  auto held = std::make_unique<std::vector<T>>(std::move(from));
  const auto count = static_cast<py::ssize_t>(held->size());
  const T* const data = held->data();
  const py::capsule owner(held.release(), [](void* vector) { delete static_cast<std::vector<T>*>(vector); });
  return py::array_t<T>(count, data, owner);
}

VpsPose inverse(const VpsPose& pose) {
  VpsPose out{};
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      out.rotation[3 * r + c] = pose.rotation[3 * c + r];
      out.translation[r] -= pose.rotation[3 * c + r] * pose.translation[c];
    }
  }
  return out;
}
void check_length(const std::string& name, float length) {
  if (!(length >= 0 && length <= 1e15F)) throw py::value_error(name + ": 0 to 1e15 m");
}
// Of an array [n,4,4] of homogeneous matrices.
std::vector<VpsPose> to_poses(const Doubles& matrices) {
  if (matrices.ndim() != 3 || matrices.shape(1) != 4 || matrices.shape(2) != 4) {
    throw py::value_error("poses: an array of shape (n, 4, 4)");
  }
  const auto at = matrices.unchecked<3>();
  std::vector<VpsPose> poses(static_cast<std::size_t>(at.shape(0)));
  for (py::ssize_t i = 0; i < at.shape(0); ++i) {
    for (py::ssize_t r = 0; r < 3; ++r) {
      for (py::ssize_t c = 0; c < 3; ++c) poses[i].rotation[3 * r + c] = at(i, r, c);
      poses[i].translation[r] = at(i, r, 3);
    }
    if (at(i, 3, 0) != 0 || at(i, 3, 1) != 0 || at(i, 3, 2) != 0 || at(i, 3, 3) != 1)
      throw py::value_error("poses number " + std::to_string(i) + ": its last row is not 0, 0, 0, 1");
    if (vps_check_pose(&poses[i]) != vps_ok) check(vps_bad_pose, "poses number " + std::to_string(i));
  }
  return poses;
}
void move_point(const VpsPose& pose, float (&p)[3]) {
  float out[3];
  for (int r = 0; r < 3; ++r) {
    const double* const m = pose.rotation + 3 * r;
    out[r] = static_cast<float>(m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + pose.translation[r]);
  }
  std::memcpy(p, out, sizeof(out));
}
void turn(const VpsPose& pose, float (&v)[3], double factor) {
  float out[3];
  for (int r = 0; r < 3; ++r) {
    const double* const m = pose.rotation + 3 * r;
    out[r] = static_cast<float>(factor * (m[0] * v[0] + m[1] * v[1] + m[2] * v[2]));
  }
  std::memcpy(v, out, sizeof(out));
}

// The roles of two bodies, and the poses between them.
struct Pair {
  SharedHeld shell, field;
  bool first_is_shell = false;
  std::vector<VpsPose> second_to_first, shell_to_field;

  Pair(const SharedHeld& first, const SharedHeld& second, const Doubles& matrices)
      : second_to_first(to_poses(matrices)) {
    VpsShellRole role = vps_shell_second;
    check(vps_choose_roles(first->asset(), second->asset(), &role),
          "one of the two needs a pointshell, the other a voxelmap");
    first_is_shell = role == vps_shell_first;
    shell = first_is_shell ? first : second;
    field = first_is_shell ? second : first;
    shell_to_field = second_to_first;
    if (first_is_shell) {
      for (VpsPose& pose : shell_to_field) pose = inverse(pose);
    }
  }

  // From the frame of the body with the field to the first one's.
  void move_result(std::size_t pose, bool field_is_second, float (&position)[3], float (&direction)[3]) const {
    if (!field_is_second) return;
    move_point(second_to_first[pose], position);
    turn(second_to_first[pose], direction, -1);
  }
};

// Whether a body's first point lies inside the other body. If they do not touch, the other one holds it wholly.
bool is_inside(const VpsStepBody& inner, const VpsStepBody& outer, const VpsPose& inner_to_outer) {
  VpsPoint point{};
  float penetration = 0;
  if (inner.shell == nullptr || vps_pointshell_point(inner.shell, 0, &point) != vps_ok) return false;
  move_point(inner_to_outer, point.position);
  turn(inner_to_outer, point.inward_normal, 1);
  return vps_penetration(outer.field, point.position, point.inward_normal, &penetration) == vps_ok && penetration > 0;
}

}  // namespace

py::tuple contacts(const SharedHeld& first, const SharedHeld& second, const Doubles& matrices, float distance,
                   std::uint32_t threads) {
  check_length("distance", distance);
  const Pair pair(first, second, matrices);
  const VpsFieldRef field = vps_map_ref(pair.field->map());
  const VpsPointshell* const shell = pair.shell->shell();
  VpsQueryOptions options{};
  options.contact_distance = distance;
  const std::size_t count = pair.shell_to_field.size();
  py::array_t<VpsQueryResult> results(static_cast<py::ssize_t>(count));
  VpsQueryResult* const result = results.mutable_data();
  std::vector<VpsContact> all;
  std::vector<std::int64_t> pose_of;
  const VpsStepBody with_points = pair.shell->body();
  const VpsStepBody with_field = pair.field->body();
  // Poses with more contacts than there is room for are asked again. So are those where the body with the points holds
  // the other one, whose own points are then in contact.
  constexpr std::size_t kPoses = 512;
  constexpr std::size_t kRoom = 128;
  Batch(threads).run("poses", count, [&](VpsBatch* batch, Batch::Part part) {
    try {
      const std::size_t end = part.begin + part.count;
      std::vector<VpsContact> room(std::min(part.count, kPoses) * kRoom);
      std::vector<VpsContact> more;
      for (std::size_t begin = part.begin; begin < end; begin += kPoses) {
        const std::size_t n = std::min(kPoses, end - begin);
        const VpsStatus status = vps_traverse_batch(
            batch, shell, field, n, {&pair.shell_to_field[begin], sizeof(VpsPose)}, &options,
            {room.data(), kRoom * sizeof(VpsContact)}, kRoom, {result + begin, sizeof(VpsQueryResult)});
        if (status != vps_ok && status != vps_output_full) return status;
        for (std::size_t i = begin; i < begin + n; ++i) {
          VpsContact* from = &room[kRoom * (i - begin)];
          VpsPose pose = inverse(pair.shell_to_field[i]);
          const bool is_held = result[i].contacts == 0 && is_inside(with_field, with_points, pose);
          if (is_held || result[i].contacts > kRoom) {
            if (!is_held) pose = pair.shell_to_field[i];
            more.resize(is_held ? pair.field->info().points : result[i].contacts);
            from = more.data();
            const VpsStatus again = vps_traverse_batch(
                batch, is_held ? with_field.shell : shell, is_held ? with_points.field : field, 1,
                {&pose, sizeof(VpsPose)}, &options, {from, 0}, more.size(), {result + i, sizeof(VpsQueryResult)});
            if (again != vps_ok) return again;
          }
          for (std::size_t c = 0; c < result[i].contacts; ++c) {
            pair.move_result(i, pair.first_is_shell != is_held, from[c].position, from[c].inward_normal);
          }
          all.insert(all.end(), from, from + result[i].contacts);
          pose_of.insert(pose_of.end(), result[i].contacts, static_cast<std::int64_t>(i));
        }
      }
    } catch (const std::bad_alloc&) {
      return VpsStatus{vps_no_memory};
    }
    return VpsStatus{vps_ok};
  });
  return py::make_tuple(owned(std::move(all)), owned(std::move(pose_of)), results);
}

py::tuple step_contacts(const SharedHeld& first, const SharedHeld& second, const Doubles& matrices, float distance,
                        std::uint32_t most, std::uint32_t threads) {
  check_length("distance", distance);
  if (most < 1 || most > 1024) throw py::value_error("most: 1 to 1024");
  const Pair pair(first, second, matrices);  // checks that one can give points to the other
  // Normals point into the second body, which moves.
  const VpsStepBody moving = second->body();
  const VpsStepBody fixed = first->body();
  VpsStepOptions options{};
  options.distance = distance;
  const std::size_t count = pair.second_to_first.size();
  py::array_t<VpsStepContact> contacts({count, std::size_t{most}});
  py::array_t<std::uint32_t> counts(static_cast<py::ssize_t>(count));
  const VpsArray to{contacts.mutable_data(), static_cast<ptrdiff_t>(most * sizeof(VpsStepContact))};
  const VpsArray to_counts = out(counts);
  VpsStepContact* const contact = contacts.mutable_data();
  std::uint32_t* const found = counts.mutable_data();
  Batch(threads).run("poses", count, [&](VpsBatch* batch, Batch::Part part) {
    const std::size_t begin = part.begin;
    VpsStatus status =
        vps_step_contacts_batch(batch, &moving, &fixed, part.count, {&pair.second_to_first[begin], sizeof(VpsPose)},
                                &options, after(to, begin), most, after(to_counts, begin));
    for (std::size_t i = begin; status == vps_ok && i < begin + part.count; ++i) {
      // Without contact one may hold the other. Then only the inner one may give its points.
      const VpsPose& pose = pair.second_to_first[i];
      const bool is_held = found[i] == 0 && is_inside(moving, fixed, pose);
      const bool holds = found[i] == 0 && is_inside(fixed, moving, inverse(pose));
      if (!is_held && !holds) continue;
      VpsStepBody outer = is_held ? fixed : moving;
      outer.shell = nullptr;
      status = vps_step_contacts_batch(batch, is_held ? &moving : &outer, is_held ? &outer : &fixed, 1,
                                       {&pose, sizeof(VpsPose)}, &options, {contact + most * i, 0}, most,
                                       {found + i, sizeof(std::uint32_t)});
    }
    return status;
  });
  return py::make_tuple(contacts, counts);
}

py::array_t<VpsSeparation> separation(const SharedHeld& first, const SharedHeld& second, const Doubles& matrices,
                                      float tolerance, std::uint32_t threads) {
  check_length("tolerance", tolerance);
  const Pair pair(first, second, matrices);
  const VpsFieldRef field = vps_map_ref(pair.field->distances());
  const VpsPointshell* const shell = pair.shell->shell();
  const VpsStepBody with_points = pair.shell->body();
  const VpsStepBody with_field = pair.field->body();
  const bool has_distances = pair.shell->field() != vps_field_layers;
  const VpsSeparationOptions options{tolerance, 0};
  const std::size_t count = pair.shell_to_field.size();
  py::array_t<VpsSeparation> found(static_cast<py::ssize_t>(count));
  VpsSeparation* const data = found.mutable_data();
  Batch(threads).run("poses", count, [&](VpsBatch* batch, Batch::Part part) {
    const std::size_t begin = part.begin;
    VpsStatus status =
        vps_separation_batch(batch, shell, field, part.count, {&pair.shell_to_field[begin], sizeof(VpsPose)}, &options,
                             {data + begin, sizeof(VpsSeparation)});
    for (std::size_t i = begin; status == vps_ok && i < begin + part.count; ++i) {
      // Surfaces may be apart though one body holds the other: then the inner one gives the points.
      const VpsPose back = inverse(pair.shell_to_field[i]);
      const bool is_held = data[i].delta < 0 && has_distances && is_inside(with_field, with_points, back);
      if (is_held) {
        status = vps_separation_batch(batch, with_field.shell, with_points.field, 1, {&back, sizeof(VpsPose)}, &options,
                                      {data + i, sizeof(VpsSeparation)});
      }
      pair.move_result(i, pair.first_is_shell != is_held, data[i].position, data[i].direction);
    }
    return status;
  });
  return found;
}

py::tuple time_of_impact(const SharedHeld& first, const SharedHeld& second, const Doubles& start, const Doubles& motion,
                         float distance, float tolerance) {
  const VpsImpactOptions options{distance, tolerance, vps_contactor_surface, 256};
  const VpsVoxelmap* const map = first->distances();
  const VpsPointshell* const points = second->shell();
  const std::vector<VpsPose> poses = to_poses(start);
  if (poses.size() != 1 || motion.ndim() != 1 || motion.shape(0) != 7) throw py::value_error("one pose, one motion");
  VpsSweep sweep{};
  sweep.start = poses.front();
  for (int i = 0; i < 3; ++i) {
    sweep.velocity[i] = motion.at(i);
    sweep.angular_velocity[i] = motion.at(3 + i);
  }
  sweep.duration = motion.at(6);
  VpsImpactResult result{};
  VpsScratch* scratch = nullptr;
  check(vps_scratch_create(&scratch));
  VpsStatus status = vps_ok;
  {
    const py::gil_scoped_release release;
    status = vps_time_of_impact(points, vps_map_ref(map), &sweep, &options, scratch, &result);
  }
  vps_scratch_destroy(scratch);
  check(status);
  return py::make_tuple(result.impact, result.time, py::array_t<VpsSeparation>(1, &result.separation));
}

}  // namespace vps::python
