// SPDX-License-Identifier: Zlib
// The extension module vps._runtime: the C interface for arrays. runtime/python/vps/__init__.py is what users see.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "runtime/vps.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace {

/// The asset's bytes cannot be used.
struct AssetError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The asset lacks what a query needs.
struct MissingPart : AssetError {
  using AssetError::AssetError;
};

void check(VpsStatus status, const std::string& what = {}) {
  const std::string text = (what.empty() ? what : what + ": ") + vps_status_text(status);
  switch (status) {
    case vps_ok:
    case vps_output_full:
      return;
    case vps_bad_argument:
    case vps_bad_pose:
      throw py::value_error(text);
    case vps_missing_part:
      throw MissingPart(text);
    case vps_no_memory:
      throw std::bad_alloc();
    default:
      throw AssetError(text);
  }
}

// An open asset with the bytes that it reads. Arrays and running queries share it, so closing waits for them.
class Held {
 public:
  Held(py::buffer_info&& bytes, double scale) : bytes_(std::move(bytes)) {
    if (bytes_.ndim != 1 || bytes_.itemsize != 1 || (bytes_.size > 1 && bytes_.strides[0] != 1)) {
      throw py::value_error("an asset is contiguous bytes");
    }
    check(vps_asset_open_memory(bytes_.ptr, static_cast<std::size_t>(bytes_.size), vps_use_everything, &asset_));
    if (vps_asset_scale(asset_, scale) != vps_ok) {
      vps_asset_close(asset_);
      throw py::value_error("scale: 0.001 to 1000");
    }
    (void)vps_asset_info(asset_, &info_);
    (void)vps_asset_voxelmap(asset_, vps_field_finest, &map_);
    (void)vps_asset_pointshell(asset_, &shell_);
    if (map_ != nullptr) (void)vps_voxelmap_field(map_, &field_);
  }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
  ~Held() { vps_asset_close(asset_); }

  [[nodiscard]] const VpsAsset* asset() const { return asset_; }
  [[nodiscard]] const VpsAssetInfo& info() const { return info_; }
  [[nodiscard]] VpsField field() const { return field_; }
  [[nodiscard]] const VpsVoxelmap* map() const {
    if (map_ == nullptr) throw MissingPart("the asset has no voxelmap: bake it with voxelmap=True");
    return map_;
  }
  // A map whose field is a distance.
  [[nodiscard]] const VpsVoxelmap* distances() const {
    if (map() != nullptr && field_ == vps_field_layers) {
      throw MissingPart("the asset has only layers, which are no distances: bake it with the field scaled");
    }
    return map_;
  }
  [[nodiscard]] const VpsPointshell* shell() const {
    if (shell_ == nullptr) throw MissingPart("the asset has no pointshell: bake it with pointshell=True");
    return shell_;
  }
  // What it has, for pairs in which either body may give the points.
  [[nodiscard]] VpsStepBody body() const {
    return {vps_map_ref(map_), {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, shell_, nullptr};
  }
  // Decoded on first use.
  [[nodiscard]] std::vector<VpsPoint>& points() {
    if (points_.empty()) {
      points_.resize(shell() == nullptr ? 0 : info_.points);
      for (std::uint32_t i = 0; i < points_.size(); ++i) (void)vps_pointshell_point(shell_, i, &points_[i]);
    }
    return points_;
  }

 private:
  py::buffer_info bytes_;
  VpsAsset* asset_ = nullptr;
  VpsAssetInfo info_{};
  const VpsVoxelmap* map_ = nullptr;
  const VpsPointshell* shell_ = nullptr;
  VpsField field_ = vps_field_finest;
  std::vector<VpsPoint> points_;
};

class Batch {
 public:
  explicit Batch(std::uint32_t threads) {
    if (threads > 1024) throw py::value_error("threads: 0 (as many as the machine has) to 1024");
    check(vps_batch_create(threads, &batch_));
  }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;
  ~Batch() { vps_batch_destroy(batch_); }
  // Runs call(batch) without the interpreter's lock.
  template <class Call>
  void run(const char* elements, const Call& call) {
    VpsStatus status = vps_ok;
    {
      const py::gil_scoped_release release;
      status = call(batch_);
    }
    std::size_t refused = 0;
    (void)vps_batch_refused(batch_, &refused);
    check(status, std::string(elements) + " number " + std::to_string(refused));
  }

 private:
  VpsBatch* batch_ = nullptr;
};

using Floats = py::array_t<float>;
using Doubles = py::array_t<double>;

// Rows of three floats; rows may have any stride.
VpsConstArray rows(const Floats& array, const char* name) {
  if (array.ndim() != 2 || array.shape(1) != 3 || (array.shape(0) > 0 && array.strides(1) != sizeof(float))) {
    throw py::value_error(std::string(name) + ": an array of shape (n, 3)");
  }
  return {array.data(), array.strides(0)};
}

template <class T>
VpsArray out(py::array_t<T>& array) {
  return {array.mutable_data(), sizeof(T)};
}
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
      if (at(i, 3, r) != 0) throw py::value_error("poses: the last row of each is 0, 0, 0, 1");
    }
    if (at(i, 3, 3) != 1) throw py::value_error("poses: the last row of each is 0, 0, 0, 1");
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
void turn_back(const VpsPose& pose, float (&v)[3]) {
  float out[3];
  for (int r = 0; r < 3; ++r) {
    const double* const m = pose.rotation + 3 * r;
    out[r] = static_cast<float>(-(m[0] * v[0] + m[1] * v[1] + m[2] * v[2]));
  }
  std::memcpy(v, out, sizeof(out));
}

class Asset;
// The roles of two bodies, and the poses between them.
struct Pair {
  std::shared_ptr<Held> shell, field;
  bool first_is_shell = false;
  std::vector<VpsPose> second_to_first, shell_to_field;

  Pair(const Asset& first, const Asset& second, const Doubles& poses);
};

class Asset {
 public:
  Asset(const py::buffer& bytes, double scale) : held_(std::make_shared<Held>(bytes.request(), scale)), scale_(scale) {}

  void close() { held_.reset(); }
  [[nodiscard]] bool is_closed() const { return held_ == nullptr; }
  [[nodiscard]] std::shared_ptr<Held> held() const {
    if (held_ == nullptr) throw py::value_error("the asset is closed");
    return held_;
  }
  [[nodiscard]] double scale() const { return scale_; }

  [[nodiscard]] Floats distance(const Floats& points, std::uint32_t threads) const {
    const auto held = this->held();
    const VpsFieldRef field = vps_map_ref(held->distances());
    const VpsConstArray in = rows(points, "points");
    const auto count = static_cast<std::size_t>(points.shape(0));
    Floats distances(points.shape(0));
    float* const data = distances.mutable_data();
    Batch(threads).run("points", [&](VpsBatch* batch) {
      const VpsStatus status = vps_penetration_batch(batch, field, count, in, {nullptr, 0}, {data, sizeof(float)});
      for (std::size_t i = 0; i < count; ++i) data[i] = -data[i];
      return status;
    });
    return distances;
  }

  [[nodiscard]] Floats gradient(const Floats& points, std::uint32_t threads) const {
    const auto held = this->held();
    const VpsFieldRef field = vps_map_ref(held->map());
    const VpsConstArray in = rows(points, "points");
    const auto count = static_cast<std::size_t>(points.shape(0));
    Floats normals({points.shape(0), py::ssize_t{3}});
    const VpsArray result{normals.mutable_data(), 3 * sizeof(float)};
    Batch(threads).run("points",
                       [&](VpsBatch* batch) { return vps_outward_normal_batch(batch, field, count, in, result); });
    return normals;
  }

  [[nodiscard]] py::array_t<VpsClosestPoint> closest_point(const Floats& points, std::uint32_t threads) const {
    const auto held = this->held();
    const VpsVoxelmap* const map = held->distances();
    const VpsConstArray in = rows(points, "points");
    const auto count = static_cast<std::size_t>(points.shape(0));
    py::array_t<VpsClosestPoint> found(points.shape(0));
    const VpsArray result = out(found);
    Batch(threads).run(
        "points", [&](VpsBatch* batch) { return vps_closest_point_batch(batch, map, count, in, nullptr, result); });
    return found;
  }

  [[nodiscard]] py::array_t<VpsRayHit> ray(const Floats& origins, const Floats& directions, const Floats& max_distances,
                                           std::uint32_t threads) const {
    const auto held = this->held();
    const VpsVoxelmap* const map = held->distances();
    if (origins.shape(0) != directions.shape(0) || max_distances.ndim() != 1 ||
        max_distances.shape(0) != origins.shape(0)) {
      throw py::value_error("origins, directions and max_distance differ in length");
    }
    const VpsRays rays{
        rows(origins, "origins"), rows(directions, "directions"), {max_distances.data(), max_distances.strides(0)}};
    const auto count = static_cast<std::size_t>(origins.shape(0));
    py::array_t<VpsRayHit> hits(origins.shape(0));
    const VpsArray result = out(hits);
    constexpr float kTolerance = 1e-3F;  // [vx]
    Batch(threads).run(
        "rays", [&](VpsBatch* batch) { return vps_cast_ray_batch(batch, map, count, &rays, kTolerance, result); });
    return hits;
  }

  [[nodiscard]] py::array_t<VpsPoint> points() const {
    auto held = std::make_unique<std::shared_ptr<Held>>(this->held());
    const std::vector<VpsPoint>& points = (*held)->points();
    const auto count = static_cast<py::ssize_t>(points.size());
    const py::capsule owner(held.release(), [](void* asset) { delete static_cast<std::shared_ptr<Held>*>(asset); });
    return py::array_t<VpsPoint>(count, points.data(), owner);
  }

  [[nodiscard]] py::array_t<VpsAssetInfo> info() const { return py::array_t<VpsAssetInfo>(1, &held()->info()); }
  [[nodiscard]] std::string field() const {
    constexpr const char* kNames[] = {"", "layers", "scaled", "real"};
    return kNames[held()->field()];
  }
  void verify() const {
    const auto held = this->held();
    VpsStatus status = vps_ok;
    {
      const py::gil_scoped_release release;
      status = vps_asset_verify(held->asset());
    }
    check(status);
  }

 private:
  std::shared_ptr<Held> held_;
  double scale_ = 1;
};

Pair::Pair(const Asset& first, const Asset& second, const Doubles& poses) : second_to_first(to_poses(poses)) {
  VpsShellRole role = vps_shell_second;
  check(vps_choose_roles(first.held()->asset(), second.held()->asset(), &role),
        "one of the two needs a pointshell, the other a voxelmap");
  first_is_shell = role == vps_shell_first;
  shell = first_is_shell ? first.held() : second.held();
  field = first_is_shell ? second.held() : first.held();
  shell_to_field = second_to_first;
  if (first_is_shell) {
    for (VpsPose& pose : shell_to_field) pose = inverse(pose);
  }
}

// @return contacts of all poses one after the other, in the first body's frame; the pose of each; the result of each
// pose
py::tuple contacts(const Asset& first, const Asset& second, const Doubles& matrices, float distance,
                   std::uint32_t threads) {
  if (!(distance >= 0) || !std::isfinite(distance)) throw py::value_error("distance: finite, at least 0 m");
  Pair pair(first, second, matrices);
  const VpsFieldRef field = vps_map_ref(pair.field->map());
  const VpsPointshell* const shell = pair.shell->shell();
  VpsQueryOptions options{};
  options.contact_distance = distance;
  const std::size_t count = pair.shell_to_field.size();
  py::array_t<VpsQueryResult> results(static_cast<py::ssize_t>(count));
  VpsQueryResult* const result = results.mutable_data();
  std::vector<VpsContact> all;
  std::vector<std::int64_t> pose_of;
  // Poses with more contacts than there is room for are asked again.
  constexpr std::size_t kPoses = 512;
  constexpr std::size_t kRoom = 128;
  Batch(threads).run("poses", [&](VpsBatch* batch) {
    try {
      std::vector<VpsContact> room(std::min(count, kPoses) * kRoom);
      std::vector<VpsContact> more;
      for (std::size_t begin = 0; begin < count; begin += kPoses) {
        const std::size_t n = std::min(kPoses, count - begin);
        const VpsPose* const poses = &pair.shell_to_field[begin];
        const VpsStatus status = vps_traverse_batch(batch, shell, field, n, {poses, sizeof(VpsPose)}, &options,
                                                    {room.data(), kRoom * sizeof(VpsContact)}, kRoom,
                                                    {result + begin, sizeof(VpsQueryResult)});
        if (status != vps_ok && status != vps_output_full) return status;
        for (std::size_t i = 0; i < n; ++i) {
          const VpsContact* from = &room[kRoom * i];
          const std::size_t found = result[begin + i].contacts;
          if (found > kRoom) {
            more.resize(found);
            const VpsStatus again =
                vps_traverse_batch(batch, shell, field, 1, {poses + i, sizeof(VpsPose)}, &options, {more.data(), 0},
                                   found, {result + begin + i, sizeof(VpsQueryResult)});
            if (again != vps_ok) return again;
            from = more.data();
          }
          all.insert(all.end(), from, from + found);
          pose_of.insert(pose_of.end(), found, static_cast<std::int64_t>(begin + i));
        }
      }
    } catch (const std::bad_alloc&) {
      return VpsStatus{vps_no_memory};
    }
    if (!pair.first_is_shell) return VpsStatus{vps_ok};
    for (std::size_t i = 0; i < all.size(); ++i) {
      const VpsPose& pose = pair.second_to_first[static_cast<std::size_t>(pose_of[i])];
      move_point(pose, all[i].position);
      turn_back(pose, all[i].inward_normal);
    }
    return VpsStatus{vps_ok};
  });
  return py::make_tuple(owned(std::move(all)), owned(std::move(pose_of)), results);
}

// @param most  for each pose
// @return room for `most` contacts of each pose, in the first body's frame; how many there are
py::tuple step_contacts(const Asset& first, const Asset& second, const Doubles& matrices, float distance,
                        std::uint32_t most, std::uint32_t threads) {
  if (!(distance >= 0) || !std::isfinite(distance)) throw py::value_error("distance: finite, at least 0 m");
  if (most < 1 || most > 1024) throw py::value_error("most: 1 to 1024");
  const Pair pair(first, second, matrices);  // checks that one can give points to the other
  const std::shared_ptr<Held> held_first = first.held();
  const std::shared_ptr<Held> held_second = second.held();
  // Normals point into the second body, which moves.
  const VpsStepBody moving = held_second->body();
  const VpsStepBody fixed = held_first->body();
  VpsStepOptions options{};
  options.distance = distance;
  const std::size_t count = pair.second_to_first.size();
  py::array_t<VpsStepContact> contacts({count, std::size_t{most}});
  py::array_t<std::uint32_t> counts(static_cast<py::ssize_t>(count));
  const VpsArray to{contacts.mutable_data(), static_cast<ptrdiff_t>(most * sizeof(VpsStepContact))};
  const VpsArray to_counts = out(counts);
  Batch(threads).run("poses", [&](VpsBatch* batch) {
    return vps_step_contacts_batch(batch, &moving, &fixed, count, {pair.second_to_first.data(), sizeof(VpsPose)},
                                   &options, to, most, to_counts);
  });
  return py::make_tuple(contacts, counts);
}

// @return the results in the first body's frame; `direction` points from the first body to the second
py::array_t<VpsSeparation> separation(const Asset& first, const Asset& second, const Doubles& matrices, float tolerance,
                                      std::uint32_t threads) {
  if (!(tolerance >= 0) || !std::isfinite(tolerance)) throw py::value_error("tolerance: finite, at least 0 m");
  Pair pair(first, second, matrices);
  const VpsFieldRef field = vps_map_ref(pair.field->distances());
  const VpsPointshell* const shell = pair.shell->shell();
  const VpsSeparationOptions options{tolerance, 0};
  const std::size_t count = pair.shell_to_field.size();
  py::array_t<VpsSeparation> found(static_cast<py::ssize_t>(count));
  VpsSeparation* const data = found.mutable_data();
  Batch(threads).run("poses", [&](VpsBatch* batch) {
    const VpsStatus status =
        vps_separation_batch(batch, shell, field, count, {pair.shell_to_field.data(), sizeof(VpsPose)}, &options,
                             {data, sizeof(VpsSeparation)});
    for (std::size_t i = 0; status == vps_ok && pair.first_is_shell && i < count; ++i) {
      move_point(pair.second_to_first[i], data[i].position);
      turn_back(pair.second_to_first[i], data[i].direction);
    }
    return status;
  });
  return found;
}

// The second body moves, and plays the pointshell.
py::tuple time_of_impact(const Asset& first, const Asset& second, const Doubles& start, const Doubles& motion,
                         const VpsImpactOptions& options) {
  const auto field = first.held();
  const auto shell = second.held();
  const VpsVoxelmap* const map = field->distances();
  const VpsPointshell* const points = shell->shell();
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

}  // namespace

PYBIND11_MODULE(_runtime, m) {
  m.attr("__version__") = VPS_VERSION;
  PYBIND11_NUMPY_DTYPE(VpsCertificate, max, rms, p99, worst_at, bound);
  PYBIND11_NUMPY_DTYPE(VpsAssetInfo, bounds_min, bounds_max, triangles, vertices, surface_area, volume, centre_of_mass,
                       inertia, voxel_size, dims, origin, band_inner, band_outer, points, levels, branching, spacing,
                       covering_radius, feature_covering_radius, layers_error, scaled_error, real_error, far_spacing,
                       far_range, far_error, certificate_samples);
  PYBIND11_NUMPY_DTYPE(VpsPoint, position, inward_normal, area);
  PYBIND11_NUMPY_DTYPE(VpsClosestPoint, converged, inside, position, outward_normal, distance, residual, lower, upper);
  PYBIND11_NUMPY_DTYPE(VpsRayHit, hit, distance, position, outward_normal, steps);
  PYBIND11_NUMPY_DTYPE(VpsContact, position, inward_normal, penetration, area, point, node);
  PYBIND11_NUMPY_DTYPE(VpsQueryResult, delta, delta_bound, force, torque, contacts, nodes_tested, points_tested,
                       complete);
  PYBIND11_NUMPY_DTYPE(VpsStepContact, position, normal, penetration, area, feature);
  PYBIND11_NUMPY_DTYPE(VpsSeparation, delta, delta_bound, lower, upper, position, direction, point, nodes_tested,
                       points_tested);
  static const py::exception<AssetError> asset_error(m, "AssetError", PyExc_ValueError);
  static const py::exception<MissingPart> missing_part(m, "MissingPart", asset_error);
  // NOLINTNEXTLINE(performance-unnecessary-value-param): pybind11 wants this type.
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const MissingPart& error) {
      PyErr_SetString(missing_part.ptr(), error.what());
    } catch (const AssetError& error) {
      PyErr_SetString(asset_error.ptr(), error.what());
    }
  });

  py::class_<Asset>(m, "Asset")
      .def(py::init<const py::buffer&, double>(), "bytes"_a, "scale"_a)
      .def("close", &Asset::close)
      .def("distance", &Asset::distance)
      .def("gradient", &Asset::gradient)
      .def("closest_point", &Asset::closest_point)
      .def("ray", &Asset::ray)
      .def("points", &Asset::points)
      .def("info", &Asset::info)
      .def("verify", &Asset::verify)
      .def_property_readonly("closed", &Asset::is_closed)
      .def_property_readonly("scale", &Asset::scale)
      .def_property_readonly("field", &Asset::field);
  m.def("contacts", &contacts);
  m.def("step_contacts", &step_contacts);
  m.def("separation", &separation);
  m.def("time_of_impact", [](const Asset& first, const Asset& second, const Doubles& start, const Doubles& motion,
                             float distance, float tolerance) {
    return time_of_impact(first, second, start, motion, {distance, tolerance, vps_contactor_surface, 256});
  });
}
