// SPDX-License-Identifier: Zlib
// The extension module vps._runtime: the C interface for arrays. runtime/python/vps/__init__.py is what users see.
#include "runtime/python/pairs.h"

using namespace pybind11::literals;

namespace vps::python {
namespace {

constexpr const char* kPointLimits = "coordinates are finite, at most 1e15 m";

// Rows of three floats; rows may have any stride.
VpsConstArray rows(const Floats& array, const char* name) {
  if (array.ndim() != 2 || array.shape(1) != 3 || (array.shape(0) > 0 && array.strides(1) != sizeof(float))) {
    throw py::value_error(std::string(name) + ": an array of shape (n, 3)");
  }
  return {array.data(), array.strides(0)};
}

class Asset {
 public:
  Asset(const py::buffer& bytes, double scale) : held_(std::make_shared<Held>(bytes.request(), scale)), scale_(scale) {}

  void close() { held_.reset(); }
  [[nodiscard]] bool is_closed() const { return held_ == nullptr; }
  [[nodiscard]] SharedHeld held() const {
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
    Batch(threads).run(
        "points", count,
        [&](VpsBatch* batch, Batch::Part part) {
          float* const first = data + part.begin;
          const VpsStatus status = vps_penetration_batch(batch, field, part.count, after(in, part.begin), {nullptr, 0},
                                                         {first, sizeof(float)});
          for (std::size_t i = 0; i < part.count; ++i) first[i] = -first[i];
          return status;
        },
        kPointLimits);
    return distances;
  }

  [[nodiscard]] Floats gradient(const Floats& points, std::uint32_t threads) const {
    const auto held = this->held();
    const VpsFieldRef field = vps_map_ref(held->map());
    const VpsConstArray in = rows(points, "points");
    const auto count = static_cast<std::size_t>(points.shape(0));
    Floats normals({points.shape(0), py::ssize_t{3}});
    const VpsArray result{normals.mutable_data(), 3 * sizeof(float)};
    Batch(threads).run(
        "points", count,
        [&](VpsBatch* batch, Batch::Part part) {
          return vps_outward_normal_batch(batch, field, part.count, after(in, part.begin), after(result, part.begin));
        },
        kPointLimits);
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
        "points", count,
        [&](VpsBatch* batch, Batch::Part part) {
          return vps_closest_point_batch(batch, map, part.count, after(in, part.begin), nullptr,
                                         after(result, part.begin));
        },
        kPointLimits);
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
        "rays", count,
        [&](VpsBatch* batch, Batch::Part part) {
          const VpsRays of_part{after(rays.origins, part.begin), after(rays.directions, part.begin),
                                after(rays.max_distances, part.begin)};
          return vps_cast_ray_batch(batch, map, part.count, &of_part, kTolerance, after(result, part.begin));
        },
        "origins are at most 1e6 m away, and max_distance is at least 0");
    return hits;
  }

  [[nodiscard]] py::array_t<VpsPoint> points() const {
    auto held = std::make_unique<SharedHeld>(this->held());
    const std::vector<VpsPoint>& points = (*held)->points();
    const auto count = static_cast<py::ssize_t>(points.size());
    const py::capsule owner(held.release(), [](void* asset) { delete static_cast<SharedHeld*>(asset); });
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
  SharedHeld held_;
  double scale_ = 1;
};

// Takes the assets of a query of two.
template <class Result, class... Rest>
auto of_assets(Result (*query)(const SharedHeld&, const SharedHeld&, Rest...)) {
  return [query](const Asset& first, const Asset& second, Rest... rest) {
    return query(first.held(), second.held(), rest...);
  };
}

}  // namespace
}  // namespace vps::python

PYBIND11_MODULE(_runtime, m) {
  using namespace vps::python;
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
  m.def("contacts", of_assets(&contacts));
  m.def("step_contacts", of_assets(&step_contacts));
  m.def("separation", of_assets(&separation));
  m.def("time_of_impact", of_assets(&time_of_impact));
}
