// SPDX-License-Identifier: Zlib
/// @file What all queries of the extension module vps._runtime share: errors, open assets, threads. Internal.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/vps.h"

namespace vps::python {

namespace py = pybind11;

/// The asset's bytes cannot be used.
struct AssetError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The asset lacks what a query needs.
struct MissingPart : AssetError {
  using AssetError::AssetError;
};

inline void check(VpsStatus status, const std::string& what = {}) {
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

/// An open asset with the bytes that it reads. Arrays and running queries share it, so closing waits for them.
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
  /// A map whose field is a distance.
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
  /// What it has, for pairs in which either body may give the points.
  [[nodiscard]] VpsStepBody body() const {
    return {vps_map_ref(map_), {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}, shell_, nullptr};
  }
  /// Decoded on first use.
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

using SharedHeld = std::shared_ptr<Held>;
using Floats = py::array_t<float>;
using Doubles = py::array_t<double>;

/// Threads of a query.
class Batch {
 public:
  /// Elements of a call.
  struct Part {
    std::size_t begin = 0, count = 0;
  };
  explicit Batch(std::uint32_t threads) {
    if (threads > 1024) throw py::value_error("threads: 0 (as many as the machine has) to 1024");
    check(vps_batch_create(threads, &batch_));
  }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;
  ~Batch() { vps_batch_destroy(batch_); }
  /// Runs call(batch, part) without the interpreter's lock, part after part, so that Ctrl-C ends it.
  /// @param elements  such as "points", for the message about a refused one
  /// @param limits    of an element
  template <class Call>
  void run(const char* elements, std::size_t count, const Call& call,
           const char* limits = vps_status_text(vps_bad_argument)) {
    using Clock = std::chrono::steady_clock;
    constexpr std::chrono::milliseconds kTurn(100);
    std::size_t most = 64;
    for (Part part; part.begin < count; part.begin += part.count) {
      part.count = std::min(most, count - part.begin);
      VpsStatus status = vps_ok;
      {
        const py::gil_scoped_release release;
        const Clock::time_point begin = Clock::now();
        status = call(batch_, part);
        most = Clock::now() - begin < kTurn ? 4 * most : std::max<std::size_t>(most / 4, 1);
      }
      if (status != vps_ok) {
        std::size_t refused = 0;
        (void)vps_batch_refused(batch_, &refused);
        const std::string which = std::string(elements) + " number " + std::to_string(part.begin + refused);
        if (status == vps_bad_argument) throw py::value_error(which + ": " + limits);
        check(status, which);
      }
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
  }

 private:
  VpsBatch* batch_ = nullptr;
};

/// What is left of an array after its first elements.
inline VpsArray after(VpsArray array, std::size_t elements) {
  return {static_cast<char*>(array.first) + static_cast<ptrdiff_t>(elements) * array.stride, array.stride};
}
inline VpsConstArray after(VpsConstArray array, std::size_t elements) {
  return {static_cast<const char*>(array.first) + static_cast<ptrdiff_t>(elements) * array.stride, array.stride};
}

template <class T>
VpsArray out(py::array_t<T>& array) {
  return {array.mutable_data(), sizeof(T)};
}

}  // namespace vps::python
