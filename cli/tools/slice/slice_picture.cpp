// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/slice/slice_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "cli/tools/stored_field.h"

namespace vps::cli {
namespace {

constexpr Colour kLineInk = {20, 22, 26};
constexpr int kLine = 22;                                           // from a line of text to the next. [px]
constexpr int kTop = 108, kLeft = 108, kRight = 160, kBottom = 58;  // margins around the plot. [px]
constexpr int kLeastRows = 120, kMostRows = 3000;
constexpr int kLeastLegend = 200, kMostLegend = 400;  // [px]

// 1, 2 or 5 times a power of ten, no less than x.
double nice_step(double x) {
  const double power = std::pow(10, std::floor(std::log10(x)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (x <= factor * power) return factor * power;
  }
  return 10 * power;
}

// At most `most` letters; those in the middle are left out.
std::string shortened(const std::string& text, std::size_t most) {
  if (text.size() <= most) return text;
  const std::size_t half = (most - 2) / 2;
  return text.substr(0, half) + ".." + text.substr(text.size() - half);
}

class SliceDrawing {
 public:
  SliceDrawing(const AssetInfo& info, const VoxelmapView& map, const SliceOptions& options)
      : map_(map),
        options_(options),
        right_(options.axis == 0 ? 1 : 0),
        up_(options.axis == 2 ? 1 : 2),
        voxel_(info.voxel_size),
        layers_(static_cast<int>(std::ceil(std::max(info.band_inner, info.band_outer) / info.voxel_size - 1e-6))),
        low_{slice_range(info, right_).low, slice_range(info, up_).low},
        extent_{slice_range(info, right_).high - low_[0], slice_range(info, up_).high - low_[1]},
        columns_(options.width - kLeft - kRight),
        // A tall body is drawn narrower. A flat one gets enough rows for the numbers.
        step_(std::max(extent_[0] / columns_, extent_[1] / kMostRows)),
        rows_(std::clamp(static_cast<int>(std::ceil(extent_[1] / step_)), kLeastRows, kMostRows)),
        legend_(std::clamp(rows_, kLeastLegend, kMostLegend)),
        picture_(options.width, kTop + std::max(rows_, legend_) + kBottom) {
    low_[0] -= (columns_ * step_ - extent_[0]) / 2;
    low_[1] -= (rows_ * step_ - extent_[1]) / 2;
    const SliceRange range = slice_range(info, options.axis);
    const LengthUnit unit(std::max(std::abs(range.low), std::abs(range.high)));
    place_ = fmt::format("{} = {} {}", "xyz"[options.axis], unit.number(options.at), unit.name());
  }

  SlicePicture draw() {
    draw_field();
    picture_.frame(kLeft - 1, kTop - 1, columns_ + 2, rows_ + 2, kLineInk);
    draw_head();
    draw_axes();
    draw_legend();
    return {std::move(picture_), step_, place_, no_line()};
  }

 private:
  [[nodiscard]] float value(int column, int row) const {
    float p[3];
    p[options_.axis] = float(options_.at);
    p[right_] = float(low_[0] + step_ * (column + 0.5));
    p[up_] = float(low_[1] + step_ * (rows_ - row - 0.5));
    return stored_penetration(map_, {p[0], p[1], p[2]});
  }
  // One colour for each voxel of distance. With layers V is a multiple of the voxel size, except for rounding.
  [[nodiscard]] Colour colour(double v) const {
    constexpr double kRounding = 1e-3;  // [vx]
    const double layer = std::clamp(std::floor(v / voxel_ + kRounding), -double(layers_), layers_ - 1.0);
    return diverging_colour((layer + 0.5) / (layers_ - 0.5));
  }

  void draw_field() {
    std::vector<float> row(static_cast<std::size_t>(columns_)), row_above = row;
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) row[std::size_t(x)] = value(x, y);
      for (int x = 0; x < columns_; ++x) {
        const float v = row[std::size_t(x)];
        const auto crossed = [&](float other) { return (v >= 0) != (other >= 0); };
        const bool zero = (x > 0 && crossed(row[std::size_t(x - 1)])) || (y > 0 && crossed(row_above[std::size_t(x)]));
        picture_.set(kLeft + x, kTop + y, zero ? Colour{0, 0, 0} : colour(double(v)));
        has_line_ |= zero;
        is_inside_ = v >= 0;
        in_band_ |= std::isfinite(v);
      }
      row.swap(row_above);
    }
  }

  [[nodiscard]] std::string no_line() const {
    if (has_line_) return "";
    return fmt::format("no zero line: all {}{}", is_inside_ ? "inside" : "outside",
                       in_band_ ? "" : ", out of the band");
  }

  void draw_head() {
    const LengthUnit unit(layers_ * voxel_);  // as in the legend
    const std::string voxel = fmt::format(", voxel {} {}", unit.number(voxel_), unit.name());
    const auto letters = std::size_t(options_.width - 2 * kMargin) / std::size_t(Picture::width_of(" "));
    picture_.write(kMargin, 10, shortened(options_.name, letters - voxel.size()) + voxel);
    picture_.write(kMargin, 10 + kLine, fmt::format("{}, field {}", place_, field_name(map_.field)));
    picture_.write(kMargin, 10 + 2 * kLine, no_line());
  }

  // Multiples of `tick` within `pixels` pixels from `low`. [m]
  [[nodiscard]] std::vector<double> ticks(double low, int pixels, double tick) const {
    std::vector<double> out;
    const double first = std::ceil(low / tick);
    for (int i = 0; (first + i) * tick < low + pixels * step_ && i < pixels; ++i) out.push_back((first + i) * tick);
    return out;
  }
  // Ticks far enough apart for their numbers.
  [[nodiscard]] std::vector<double> ticks_across(const LengthUnit& unit) const {
    for (double apart = 70;; apart *= 1.25) {
      std::vector<double> out = ticks(low_[0], columns_, nice_step(apart * step_));
      int widest = 0;
      for (const double t : out) widest = std::max(widest, Picture::width_of(unit.number(t)));
      if (widest + 20 <= apart || out.size() < 2) return out;
    }
  }

  void draw_axes() {
    const LengthUnit unit(std::max(extent_[0], extent_[1]));
    for (const double t : ticks_across(unit)) {
      const int x = kLeft + static_cast<int>((t - low_[0]) / step_);
      picture_.fill(x, kTop + rows_, 1, 7, kLineInk);
      const std::string text = unit.number(t);
      picture_.write(x - Picture::width_of(text) / 2, kTop + rows_ + 10, text);
    }
    for (const double t : ticks(low_[1], rows_, nice_step(50 * step_))) {
      const int y = kTop + rows_ - 1 - static_cast<int>((t - low_[1]) / step_);
      picture_.fill(kLeft - 7, y, 7, 1, kLineInk);
      const std::string text = unit.number(t);
      picture_.write(kLeft - 10 - Picture::width_of(text), y - 7, text);
    }
    const auto label = [&](std::size_t axis) { return fmt::format("{} [{}]", "xyz"[axis], unit.name()); };
    picture_.write(kLeft + columns_ / 2 - 30, kTop + rows_ + 34, label(right_));
    picture_.write(kMargin, kTop - 26, label(up_));
  }

  // Draws "inside", the colours with their numbers, and "outside", in `legend_` rows.
  void draw_legend() {
    const int x = kLeft + columns_ + 24;
    const int bands = 2 * layers_;
    const int top = kTop + kLine, height = legend_ - 2 * kLine;
    const auto edge = [&](int band) { return top + (bands - band) * height / bands; };
    for (int band = 0; band < bands; ++band)
      picture_.fill(x, edge(band + 1), 26, edge(band) - edge(band + 1), colour((band - layers_ + 0.5) * voxel_));
    picture_.frame(x - 1, top - 1, 28, height + 2, kLineInk);
    picture_.fill(x, edge(layers_), 26, 1, {0, 0, 0});
    const LengthUnit unit(layers_ * voxel_);
    const int every = 1 + 2 * layers_ * 18 / height;  // numbers must not touch
    for (int layer = 1 - layers_; layer < layers_; ++layer) {
      if (layer % every != 0) continue;
      picture_.fill(x + 26, edge(layer + layers_), 5, 1, kLineInk);
      picture_.write(x + 35, edge(layer + layers_) - 7, unit.number(layer * voxel_));
    }
    picture_.write(x, kTop - 26, fmt::format("V [{}]", unit.name()));
    picture_.write(x, kTop, "inside");
    picture_.write(x, kTop + legend_ - 14, "outside");
  }

  static constexpr int kMargin = 8;  // [px]

  const VoxelmapView& map_;
  const SliceOptions& options_;
  std::size_t right_, up_;
  double voxel_;
  int layers_;  ///< on each side of the surface
  std::array<double, 2> low_, extent_;
  int columns_;
  double step_;  ///< metres per pixel
  int rows_, legend_;
  Picture picture_;
  std::string place_;
  bool has_line_ = false, is_inside_ = false, in_band_ = false;
};

}  // namespace

LengthUnit::LengthUnit(double length) {
  constexpr std::pair<const char*, double> kUnits[] = {{"um", 1e-6}, {"mm", 1e-3}, {"m", 1}, {"km", 1e3}};
  const auto* unit = std::begin(kUnits);
  while (unit + 1 != std::end(kUnits) && length >= unit[1].second) ++unit;
  std::tie(name_, size_) = *unit;
}

std::string LengthUnit::number(double length) const {
  const double number = length / size_;
  return fmt::format("{:.6g}", std::abs(number) < 1e-9 ? 0 : number);
}

SlicePicture draw_slice(const AssetInfo& info, const VoxelmapView& map, const SliceOptions& options) {
  return SliceDrawing(info, map, options).draw();
}

}  // namespace vps::cli
