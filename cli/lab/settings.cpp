// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/lab/units.h"

namespace vps::lab {
namespace {

class Sweep {
 public:
  Sweep(const bake::BakeOptions& base, SweepSize size)
      : base_(with_field(base, Field::scaled)), quick_(size == SweepSize::quick), unit_(unit_for({base.voxel_size})) {}

  std::vector<Setting> run(std::uint32_t levels) {
    add("base", base_);
    voxels_and_alphas();
    fields();
    if (!quick_) precisions();
    for (const std::uint32_t k : list<std::uint32_t>({4, 8, 14, 24, 40}, {})) {
      if (k == base_.branching) continue;
      bake::BakeOptions bake = base_;
      bake.branching = k;
      add("branching", bake, fmt::format(", K {}", k));
    }
    for (std::uint32_t level = 2; level <= levels; ++level) {
      if (!quick_ || level == levels) add_query("level", fmt::format("level {}", level)).level = level;
    }
    for (const std::uint32_t tests : list<std::uint32_t>({128, 256, 512, 1024, 2048, 4096}, {512})) {
      add_query("tests", fmt::format("{} tests", tests)).max_tests = tests;
    }
    for (const float us : list<float>({1, 2, 5, 10, 20, 50}, {5})) {
      add_query("time", fmt::format("{:g} us", us)).max_microseconds = us;
    }
    return std::move(settings_);
  }

 private:
  template <class T>
  std::vector<T> list(std::initializer_list<T> all, std::initializer_list<T> few) const {
    return quick_ ? few : all;
  }

  [[nodiscard]] std::string words(const bake::BakeOptions& bake) const {
    return fmt::format("{}, voxel {}, alpha {:.3g}", describe(field_of(bake)), unit_.text(bake.voxel_size), bake.alpha);
  }

  void add(const char* knob, const bake::BakeOptions& bake, const std::string& more = "") {
    Setting setting;
    setting.name = words(bake) + more;
    setting.series = describe(field_of(bake));
    setting.knob = knob;
    setting.bake = bake;
    const auto same = [&](const Setting& s) { return s.name == setting.name; };
    if (std::none_of(settings_.begin(), settings_.end(), same)) settings_.push_back(setting);
  }

  // Adds another query of the base asset.
  Setting& add_query(const char* knob, const std::string& more) {
    Setting setting = settings_.front();
    setting.name += ", " + more;
    setting.series = "scaled, " + std::string(std::string_view(knob) == "level" ? "coarser level" : "budget");
    setting.knob = knob;
    return settings_.emplace_back(std::move(setting));
  }

  void add_reading(const bake::BakeOptions& bake, Reading reading) {
    Setting setting;
    const char* const how = reading == Reading::nearest ? "not interpolated" : "interpolated";
    setting.name = words(bake) + ", " + how;
    setting.series = std::string(describe(field_of(bake))) + ", " + how;
    setting.knob = "field";
    setting.bake = bake;
    setting.reading = reading;
    settings_.push_back(std::move(setting));
  }

  bake::BakeOptions scaled_by(double voxel, double alpha, Field field = Field::scaled) const {
    bake::BakeOptions bake = with_field(base_, field);
    bake.voxel_size *= voxel;
    bake.alpha = std::clamp(bake.alpha * alpha, 0.25, 64.0);
    return bake;
  }

  void voxels_and_alphas() {
    const double root = std::sqrt(2.0);
    for (const double factor : list<double>({0.5, 1 / root, root, 2, 2 * root, 4}, {2}))
      add("voxel", scaled_by(factor, 1));
    for (const double factor : list<double>({0.5, 1 / root, root, 2, 2 * root, 4}, {2}))
      add("alpha", scaled_by(1, factor));
    for (const double voxel : list<double>({0.5, 2, 4}, {})) {
      for (const double alpha : {0.5, 2.0, 4.0}) add("voxel_alpha", scaled_by(voxel, alpha));
    }
  }

  void fields() {
    for (const Field field : {Field::real, Field::layers}) {
      for (const double voxel : list<double>({1, 0.5, 2}, {1})) add("field", scaled_by(voxel, 1, field));
    }
    for (const double voxel : list<double>({1, 0.5, 2}, {1})) {
      add_reading(scaled_by(voxel, 1), Reading::nearest);
      add_reading(scaled_by(voxel, 1, Field::real), Reading::nearest);
      add_reading(scaled_by(voxel, 1, Field::layers), Reading::trilinear);
    }
  }

  // Adds steps of 10^-p m, from the coarsest that may be stored to the finest that fits 16 bits: at most four.
  void precisions() {
    const double s = base_.voxel_size;
    const double band = std::max(base_.band_inside, base_.band_outside) * s;
    int count = 0;
    for (int p = std::max(0, int(std::ceil(-std::log10(s / 2)))); p <= 15 && band * std::pow(10.0, p) <= 32767; ++p) {
      bake::BakeOptions bake = base_;
      bake.precision = p;
      add("precision", bake, fmt::format(", p {}", p));
      if (++count == 4) return;
    }
  }

  const bake::BakeOptions base_;
  const bool quick_;
  const LengthUnit unit_;
  std::vector<Setting> settings_;
};

}  // namespace

const char* describe(Field field) {
  switch (field) {
    case Field::layers:
      return "layers";
    case Field::real:
      return "real";
    default:
      return "scaled";
  }
}

bake::BakeOptions with_field(bake::BakeOptions base, Field field) {
  base.layers = field == Field::layers;
  base.scaled = field == Field::scaled;
  base.real = field == Field::real;
  return base;
}

Field field_of(const bake::BakeOptions& options) {
  return options.real ? Field::real : options.scaled ? Field::scaled : Field::layers;
}

std::vector<Setting> sweep(const bake::BakeOptions& base, std::uint32_t levels, SweepSize size) {
  return Sweep(base, size).run(levels);
}

}  // namespace vps::lab
