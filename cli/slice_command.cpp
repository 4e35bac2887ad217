// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/slice_command.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>

#include "bake/plan.h"
#include "cli/exit_code.h"
#include "cli/open_asset.h"
#include "cli/output_file.h"
#include "cli/picture.h"
#include "cli/stored_field.h"

namespace vps::cli {
namespace {

struct Arguments {
  std::string asset;
  std::string output;
  std::string axis = "z";
  std::string field;         ///< empty: the finest stored
  std::optional<double> at;  ///< none: the middle of the body. [m]
  int width = 900;           ///< of the picture. [px]
};

constexpr Colour kInk = {20, 22, 26};
constexpr int kTop = 44, kLeft = 96, kRight = 150, kBottom = 58;  // round the plot, for numbers. [px]
constexpr int kLeastRows = 120, kMostRows = 3000;

// The unit in which a length of this size is read best.
struct Unit {
  const char* name;
  double size;
  explicit Unit(double length)
      : name(length < 1e-3 ? "um"
             : length < 1  ? "mm"
                           : "m"),
        size(length < 1e-3 ? 1e-6
             : length < 1  ? 1e-3
                           : 1) {}
  [[nodiscard]] std::string text(double length) const {
    const double number = length / size;
    return fmt::format("{:.6g}", std::abs(number) < 1e-9 ? 0 : number);
  }
};

// 1, 2 or 5 times a power of ten, no less than x.
double nice_step(double x) {
  const double power = std::pow(10, std::floor(std::log10(x)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (x <= factor * power) return factor * power;
  }
  return 10 * power;
}

// The field across an axis: where it is drawn, and the picture.
class Slice {
 public:
  Slice(const AssetInfo& info, const VoxelmapView& map, std::size_t axis, double at, int width)
      : map_(map),
        across_(axis),
        right_(axis == 0 ? 1 : 0),
        up_(axis == 2 ? 1 : 2),
        at_(at),
        voxel_(info.voxel_size),
        layers_(static_cast<int>(std::ceil(std::max(info.band_inner, info.band_outer) / info.voxel_size - 1e-6))),
        low_{low(info, right_), low(info, up_)},
        extent_{high(info, right_) - low_[0], high(info, up_) - low_[1]},
        columns_(width - kLeft - kRight),
        // A tall body is drawn narrower, and of a flat one the numbers still have room.
        step_(std::max(extent_[0] / columns_, extent_[1] / kMostRows)),
        rows_(std::clamp(static_cast<int>(std::ceil(extent_[1] / step_)), kLeastRows, kMostRows)),
        picture_(width, kTop + rows_ + kBottom) {
    low_[0] -= (columns_ * step_ - extent_[0]) / 2;
    low_[1] -= (rows_ * step_ - extent_[1]) / 2;
  }

  /// Range of places that can be drawn: the body and the band round it. [m]
  static double low(const AssetInfo& info, std::size_t axis) { return info.bounds_min[axis] - margin(info); }
  static double high(const AssetInfo& info, std::size_t axis) { return info.bounds_max[axis] + margin(info); }

  const Picture& draw(const std::string& title) {
    draw_field();
    picture_.frame(kLeft - 1, kTop - 1, columns_ + 2, rows_ + 2, kInk);
    draw_axes();
    draw_colours();
    picture_.write(kLeft + (columns_ - Picture::width_of(title)) / 2, 14, title);
    return picture_;
  }
  [[nodiscard]] double step() const { return step_; }

 private:
  static double margin(const AssetInfo& info) { return info.band_outer; }

  [[nodiscard]] float value(int column, int row) const {
    float p[3];
    p[across_] = float(at_);
    p[right_] = float(low_[0] + step_ * (column + 0.5));
    p[up_] = float(low_[1] + step_ * (rows_ - row - 0.5));
    return stored_penetration(map_, {p[0], p[1], p[2]});
  }
  // One for each voxel of distance. Of layers V is a multiple of the voxel, but for rounding.
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
        picture_.set(kLeft + x, kTop + y, zero ? Colour{0, 0, 0} : colour(v));
      }
      row.swap(row_above);
    }
  }

  // Multiples of `tick` within so many pixels from `low`. [m]
  [[nodiscard]] std::vector<double> ticks(double low, int pixels, double tick) const {
    std::vector<double> out;
    const double first = std::ceil(low / tick);
    for (int i = 0; (first + i) * tick < low + pixels * step_ && i < pixels; ++i) out.push_back((first + i) * tick);
    return out;
  }

  void draw_axes() {
    const Unit unit(std::max(extent_[0], extent_[1]));
    const double tick = nice_step(90 * step_);
    for (const double t : ticks(low_[0], columns_, tick)) {
      const int x = kLeft + static_cast<int>((t - low_[0]) / step_);
      picture_.fill(x, kTop + rows_, 1, 7, kInk);
      const std::string text = unit.text(t);
      picture_.write(x - Picture::width_of(text) / 2, kTop + rows_ + 10, text);
    }
    const double tick_up = nice_step(50 * step_);
    for (const double t : ticks(low_[1], rows_, tick_up)) {
      const int y = kTop + rows_ - 1 - static_cast<int>((t - low_[1]) / step_);
      picture_.fill(kLeft - 7, y, 7, 1, kInk);
      const std::string text = unit.text(t);
      picture_.write(kLeft - 10 - Picture::width_of(text), y - 7, text);
    }
    const auto label = [&](std::size_t axis) { return fmt::format("{} [{}]", "xyz"[axis], unit.name); };
    picture_.write(kLeft + columns_ / 2 - 30, kTop + rows_ + 34, label(right_));
    picture_.write(8, 14, label(up_));
  }

  void draw_colours() {
    const int x = kLeft + columns_ + 24;
    const int bands = 2 * layers_;
    const int height = std::min(rows_, 400);
    const auto edge = [&](int band) { return kTop + (bands - band) * height / bands; };
    for (int band = 0; band < bands; ++band)
      picture_.fill(x, edge(band + 1), 26, edge(band) - edge(band + 1), colour((band - layers_ + 0.5) * voxel_));
    picture_.frame(x - 1, kTop - 1, 28, height + 2, kInk);
    picture_.fill(x, edge(layers_), 26, 1, {0, 0, 0});
    const Unit unit(layers_ * voxel_);
    const int every = 1 + 2 * layers_ * 18 / height;  // numbers must not touch
    for (int layer = 1 - layers_; layer < layers_; ++layer) {
      if (layer % every != 0) continue;
      picture_.fill(x + 26, edge(layer + layers_), 5, 1, kInk);
      picture_.write(x + 35, edge(layer + layers_) - 7, unit.text(layer * voxel_));
    }
    picture_.write(x + 35, kTop, "inside");
    picture_.write(x + 35, kTop + height - 14, "outside");
    picture_.write(x - 6, 14, fmt::format("V [{}]", unit.name));
  }

  const VoxelmapView& map_;
  std::size_t across_, right_, up_;
  double at_, voxel_;
  int layers_;  ///< on each side of the surface
  std::array<double, 2> low_, extent_;
  int columns_;
  double step_;  ///< metres per pixel
  int rows_;
  Picture picture_;
};

Field field_of(const std::string& name) {
  return name == "layers"   ? Field::layers
         : name == "scaled" ? Field::scaled
         : name == "real"   ? Field::real
                            : Field::none;
}

int draw_slice(const Arguments& arguments) {
  Asset asset;
  if (const int code = open_asset(arguments.asset, asset); code != kOk) return code;
  VoxelmapView map;
  if (!asset.has_voxelmap())
    return fail(kBadInput, arguments.asset, "it has no voxelmap; bake it with --parts voxelmap");
  if (asset.voxelmap(map, field_of(arguments.field)) != Status::ok) {
    return fail(kBadInput, arguments.asset,
                fmt::format("it has no field {0}; bake it with --fields {0}, or choose another", arguments.field));
  }
  const AssetInfo& info = asset.info();
  const auto axis = static_cast<std::size_t>(arguments.axis[0] - 'x');
  const double low = Slice::low(info, axis), high = Slice::high(info, axis);
  const double at = arguments.at.value_or((info.bounds_min[axis] + info.bounds_max[axis]) / 2);
  if (!(at >= low && at <= high)) {
    const Unit unit(std::max(std::abs(low), std::abs(high)));
    return fail(kCommandLine, arguments.asset,
                fmt::format("--at {}{} is beyond the field; {} goes from {}{} to {}{}", unit.text(at), unit.name,
                            arguments.axis, unit.text(low), unit.name, unit.text(high), unit.name));
  }
  const std::filesystem::path output = arguments.output.empty()
                                           ? beside(arguments.asset, ("_" + arguments.axis + ".png").c_str())
                                           : std::filesystem::path(arguments.output);
  if (const std::string reason = output_refusal(output, "\x89PNG\r\n", "a PNG picture"); !reason.empty())
    return fail(kIo, output.string(), reason);
  Slice slice(info, map, axis, at, arguments.width);
  const Unit unit(std::max(std::abs(low), std::abs(high)));
  const std::string place = fmt::format("{} = {} {}", arguments.axis, unit.text(at), unit.name);
  const std::string picture = slice.draw(fmt::format("{}, field {}", place, field_name(map.field))).png();
  const int code = write_output(output, picture);
  if (code == kOk) {
    fmt::print("field {} at {}, asset frame; a pixel is {}, a colour one voxel of {}\n", field_name(map.field), place,
               format_length(slice.step()), format_length(info.voxel_size));
  }
  return code;
}

}  // namespace

Command add_slice_command(CLI::App& app) {
  CLI::App* const slice = app.add_subcommand("slice", "Draw a slice of an asset's field as a PNG picture");
  const auto arguments = std::make_shared<Arguments>();
  slice->add_option("asset", arguments->asset, "Asset")->required()->option_text("ASSET");
  slice->add_option("--axis", arguments->axis, "Across which axis of the asset: x, y or z [default: z]")
      ->check(CLI::IsMember({"x", "y", "z"}))
      ->option_text("AXIS");
  slice
      ->add_option_function<std::string>(
          "--at", [arguments](const std::string& text) { arguments->at = parse_coordinate(text); },
          "Where on that axis, such as 12mm or -0.5in [default: the middle of the body]")
      ->option_text("LENGTH");
  slice->add_option("--field", arguments->field, "Field: layers, scaled or real [default: the finest stored]")
      ->check(CLI::IsMember({"layers", "scaled", "real"}))
      ->option_text("FIELD");
  add_integer(*slice, "--width", arguments->width, 600, 8000, "Width of the picture, 600 to 8000 pixels [default: 900]")
      ->option_text("PIXELS");
  slice->add_option("-o,--output", arguments->output, "Picture to write [default: NAME_AXIS.png beside the asset]")
      ->check(not_empty())
      ->option_text("FILE");
  return {slice, [arguments] { return guarded(arguments->asset, [&] { return draw_slice(*arguments); }); }};
}

}  // namespace vps::cli
