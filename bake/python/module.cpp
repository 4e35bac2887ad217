// SPDX-License-Identifier: GPL-3.0-or-later
// The extension module vps._bake: bakes meshes, and rebuilds the surface of a baked field. It shares nothing with
// vps._runtime but the bytes of assets.
#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bake/store/vps_store.h"
#include "cli/tools/field_surface.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace {

using vps::TriangleMesh;

template <class T>
using Array = py::array_t<T, py::array::c_style>;

TriangleMesh to_mesh(const Array<double>& vertices, const Array<std::int64_t>& faces) {
  if (vertices.ndim() != 2 || vertices.shape(1) != 3) throw py::value_error("vertices: an array of shape (n, 3)");
  if (faces.ndim() != 2 || faces.shape(1) != 3) throw py::value_error("faces: an array of shape (m, 3)");
  TriangleMesh mesh;
  mesh.vertices.resize(static_cast<std::size_t>(vertices.shape(0)));
  mesh.triangles.resize(static_cast<std::size_t>(faces.shape(0)));
  std::memcpy(mesh.vertices.data(), vertices.data(), mesh.vertices.size() * sizeof(mesh.vertices[0]));
  const auto at = faces.unchecked<2>();
  for (py::ssize_t i = 0; i < at.shape(0); ++i) {
    for (py::ssize_t k = 0; k < 3; ++k) {
      if (at(i, k) < 0 || at(i, k) >= vertices.shape(0)) {
        throw py::value_error("faces[" + std::to_string(i) + "] names vertex " + std::to_string(at(i, k)) + " of " +
                              std::to_string(vertices.shape(0)));
      }
      mesh.triangles[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)] = static_cast<std::uint32_t>(at(i, k));
    }
  }
  return mesh;
}

vps::bake::Repair to_repair(const std::string& name) {
  using vps::bake::Repair;
  std::string names;
  for (const Repair repair :
       {Repair::none, Repair::weld, Repair::stitch, Repair::fill, Repair::wrap, Repair::automatic}) {
    if (name == describe(repair)) return repair;
    names += std::string(names.empty() ? "" : ", ") + describe(repair);
  }
  throw py::value_error("repair: one of " + names + ", not '" + name + "'");
}

// The settings by the names of vps.bake, which checks that all are known.
vps::bake::BakeSettings to_settings(const py::dict& given) {
  vps::bake::BakeSettings settings;
  vps::bake::BakeOptions& options = settings.options;
  const auto take = [&](const char* name, auto& value) {
    if (!given.contains(name)) return;
    try {
      value = given[name].cast<std::remove_reference_t<decltype(value)>>();
    } catch (const py::cast_error&) {
      throw py::type_error(std::string(name) + ": " + std::string(py::repr(given[name])) +
                           " is no value of this option");
    }
  };
  take("voxel", options.voxel_size);
  take("resolution", options.resolution);
  take("max_error", settings.max_error);
  take("unit", settings.import.unit);
  take("layers", options.layers);
  take("scaled", options.scaled);
  take("real", options.real);
  take("voxelmap", options.voxelmap);
  take("pointshell", options.pointshell);
  take("field_error", options.field_error);
  take("prove_bound", options.prove_bound);
  take("band_inside", options.band_inside);
  take("band_outside", options.band_outside);
  take("alpha", options.alpha);
  take("thin_faces", options.thin_faces);
  take("memory", options.memory_limit_bytes);
  take("sheet_thickness", options.sheet_thickness);
  std::string repair = describe(options.repair);
  take("repair", repair);
  options.repair = to_repair(repair);
  return settings;
}

// Messages name options as the command line does, with lengths in other units than metres.
std::string with_python_names(std::string message) {
  constexpr std::pair<std::string_view, std::string_view> kNames[] = {
      {"--open-surface thicken=", "sheet_thickness="},
      {"--field-error", "field_error"},
      {"--import-memory", "--import-memory of vpsbake"},  // vps.bake has none
      {"--import-timeout", "--import-timeout of vpsbake"},
      {"--max-error", "max_error"},
      {"--memory", "memory"},
      {"--repair ", "repair="},
      {"--resolution", "resolution"},
      {"--step", "step"},
      {"--unit", "unit"},
      {"--voxel", "voxel"},
      {"thin-faces", "thin_faces"},
  };
  for (const auto& [option, name] : kNames) {
    for (std::size_t at = 0; (at = message.find(option, at)) != std::string::npos; at += name.size())
      message.replace(at, option.size(), name);
  }
  static const std::map<std::string, double> kUnits = {{"nm", 1e-9}, {"um", 1e-6}, {"mm", 1e-3}, {"m", 1}, {"km", 1e3}};
  static const std::regex kThickness("sheet_thickness=([0-9.]+)(nm|um|mm|m|km)");
  std::smatch found;
  if (std::regex_search(message, found, kThickness)) {
    const double metres = std::stod(found[1]) * kUnits.at(found[2]);
    return fmt::format("{}sheet_thickness={:.4g}{}", found.prefix().str(), metres, found.suffix().str());
  }
  return message;
}

// The bytes of an asset, which the array keeps open, and what was repaired.
py::tuple to_python(const vps::bake::StoredAsset& stored, const std::string& cache) {
  using Held = std::shared_ptr<const vps::Asset>;
  const std::span<const std::byte> bytes = stored.asset->bytes();
  const py::capsule owner(new Held(stored.asset), [](void* held) { delete static_cast<Held*>(held); });
  py::array_t<std::uint8_t> array(static_cast<py::ssize_t>(bytes.size()),
                                  reinterpret_cast<const std::uint8_t*>(bytes.data()), owner);
  array.attr("flags").attr("writeable") = false;
  std::vector<std::string> notes;
  for (const std::string& note : stored.report.notes) notes.push_back(with_python_names(note));
  if (!stored.warning.empty()) notes.push_back(cache + ": " + stored.warning + "; the asset is not kept there");
  return py::make_tuple(array, notes);
}

// Ends a bake that the user interrupts.
struct Interrupted {};

// Bakes in another thread, so that this one can look for signals: only Python's main thread gets them.
// @throw py::error_already_set  what a signal raised, as KeyboardInterrupt
template <class Mesh>
py::tuple bake(const Mesh& mesh, const py::dict& given, const std::string& cache) {
  vps::bake::BakeSettings settings = to_settings(given);
  std::atomic<bool> stop{false};
  settings.options.progress = [&](const char*, double) {
    if (stop) throw Interrupted();
  };
  const int threads = given["threads"].cast<int>();
  vps::bake::StoredAsset stored;
  const auto work = [&] {
    tbb::task_arena processors(threads > 0 ? threads : tbb::task_arena::automatic);
    processors.execute([&] { stored = vps::bake::load_or_bake(mesh, settings, cache); });
  };
  {
    const py::gil_scoped_release release;
    std::future<void> baking = std::async(std::launch::async, work);
    while (baking.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
      const py::gil_scoped_acquire acquire;
      if (!stop && PyErr_CheckSignals() != 0) stop = true;
    }
    try {
      baking.get();
    } catch (...) {
      if (!stop) throw;
    }
  }
  if (stop) throw py::error_already_set();
  return to_python(stored, cache);
}

template <class T>
py::array_t<T> rows_of(std::vector<std::array<T, 3>>&& from) {
  using Rows = std::vector<std::array<T, 3>>;
  auto held = std::make_unique<Rows>(std::move(from));
  const auto count = static_cast<py::ssize_t>(held->size());
  const T* const data = held->empty() ? nullptr : held->front().data();
  const py::capsule owner(held.release(), [](void* rows) { delete static_cast<Rows*>(rows); });
  return py::array_t<T>({count, py::ssize_t{3}}, data, owner);
}

// The surface of an asset's finest field as vertices and triangles. Without a step it has about 20000 triangles.
py::tuple surface(const py::buffer& source, double scale, std::optional<double> step) {
  const py::buffer_info bytes = source.request();
  constexpr double kTriangles = 20000;
  vps::cli::FieldSurface found;
  {
    const py::gil_scoped_release release;
    vps::Asset asset;
    vps::VoxelmapView map;
    vps::Status status = vps::Asset::open(
        std::span(static_cast<const std::byte*>(bytes.ptr), static_cast<std::size_t>(bytes.size * bytes.itemsize)),
        asset);
    if (status == vps::Status::ok) status = asset.voxelmap(map, vps::Field::none, scale);
    if (status != vps::Status::ok) throw std::invalid_argument(vps::describe(status));
    const double usual = scale * vps::cli::step_for(asset.info(), kTriangles);
    found = vps::cli::make_field_surface(map, step.value_or(usual));
  }
  if (found.mesh.triangles.empty())
    throw std::invalid_argument("no cell of this size has a part of the surface in it; choose a smaller step");
  return py::make_tuple(rows_of(std::move(found.mesh.vertices)), rows_of(std::move(found.mesh.triangles)));
}

}  // namespace

PYBIND11_MODULE(_bake, m) {
  // NOLINTNEXTLINE(performance-unnecessary-value-param): pybind11 wants this type.
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const vps::bake::LoadError& error) {
      const std::string file = error.file.empty() ? "" : error.file + ": ";
      const py::object type = py::module_::import("vps").attr("BakeError");
      const py::object raised = type(file + with_python_names(error.what()));
      raised.attr("stage") = error.stage;
      PyErr_SetObject(type.ptr(), raised.ptr());
    } catch (const vps::cli::FieldSurfaceError& error) {
      PyErr_SetString(PyExc_ValueError, with_python_names(error.what()).c_str());
    }
  });
  m.def("bake", &bake<std::string>, "file"_a, "settings"_a, "cache"_a);
  m.def(
      "bake",
      [](const Array<double>& vertices, const Array<std::int64_t>& faces, const py::dict& settings,
         const std::string& cache) { return bake(to_mesh(vertices, faces), settings, cache); },
      "vertices"_a, "faces"_a, "settings"_a, "cache"_a);
  m.def("surface", &surface, "asset"_a, "scale"_a, "step"_a);
}
