// SPDX-License-Identifier: GPL-3.0-or-later
// A haptic loop of 1 kHz without a device: a tool follows a synthetic or recorded trajectory over another body. Streams
// the force and torque on the hand, counts missed deadlines and measures the rendered stiffness.
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "runtime/vps_haptics.h"

namespace {

// The whole interface to a device: takes the wrench and returns the handle's pose, of the tool's asset in the scene's
// frame.
using Device = std::function<vps::Pose(double time, const vps::Wrench& felt)>;

struct Options {
  std::string tool, scene, motion = "press", trajectory, stream;
  double seconds = 10;
  double rate = 1000;  // [Hz]
  vps::CouplingOptions coupling;
  bool paced = true;
};

double now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
void sleep_until(double time) {
  timespec t{};
  t.tv_sec = static_cast<time_t>(time);
  t.tv_nsec = static_cast<long>((time - static_cast<double>(t.tv_sec)) * 1e9);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) != 0) {
  }
}

vps::Pose translation(double x, double y, double z) {
  vps::Pose pose;
  pose.translation[0] = x;
  pose.translation[1] = y;
  pose.translation[2] = z;
  return pose;
}

// Above the middle of the scene, with the bounds just touching.
vps::Pose above(const vps::AssetInfo& tool, const vps::AssetInfo& scene) {
  double at[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    at[axis] = 0.5 * (scene.bounds_min[axis] + scene.bounds_max[axis] - tool.bounds_min[axis] - tool.bounds_max[axis]);
  }
  return translation(at[0], at[1], scene.bounds_max[2] - tool.bounds_min[2]);
}

// press: up and down four times, 5 mm beyond the pose where the bounds touch.
// insert: from 2 mm above to 2 mm below the scene's height and back, with a tremor of 0.3 mm.
// slide: pressed down while the hand moves along a circle.
Device synthetic(const std::string& motion, const vps::AssetInfo& tool, const vps::AssetInfo& scene, double seconds) {
  const vps::Pose start = above(tool, scene);
  const double height = scene.bounds_max[2] - scene.bounds_min[2];
  const double width = scene.bounds_max[0] - scene.bounds_min[0];
  return [=](double time, const vps::Wrench&) {
    constexpr double kTurn = 6.283185307179586;
    const double phase = kTurn * time / seconds;
    double by[3] = {0, 0, 0};
    if (motion == "press") {
      by[2] = 0.005 * std::cos(4 * phase);
    } else if (motion == "insert") {
      by[0] = 3e-4 * std::sin(37 * phase);
      by[1] = 3e-4 * std::sin(23 * phase);
      by[2] = -0.5 * (height + 0.004) * (1 - std::cos(phase)) + 0.002;
    } else {
      by[0] = 0.3 * width * std::sin(2 * phase);
      by[1] = 0.3 * width * (1 - std::cos(2 * phase));
      by[2] = 0.002 - 0.25 * height * (1 - std::cos(phase));
    }
    return translation(start.translation[0] + by[0], start.translation[1] + by[1], start.translation[2] + by[2]);
  };
}

// Lines of: seconds, x, y, z [m], qw, qx, qy, qz. The pose is constant between lines.
Device recorded(const std::string& path) {
  struct Sample {
    double time;
    vps::Pose pose;
  };
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  auto samples = std::make_shared<std::vector<Sample>>();
  std::string line;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    Sample s;
    double q[4];
    words >> s.time >> s.pose.translation[0] >> s.pose.translation[1] >> s.pose.translation[2];
    words >> q[0] >> q[1] >> q[2] >> q[3];
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!words || !(norm > 0)) throw std::runtime_error(path + ": not eight numbers: " + line);
    for (double& x : q) x /= norm;
    const auto [w, x, y, z] = q;
    const double r[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    std::copy(r, r + 9, s.pose.rotation);
    samples->push_back(s);
  }
  if (samples->empty()) throw std::runtime_error(path + ": no samples");
  return [samples](double time, const vps::Wrench&) {
    const auto after = std::upper_bound(samples->begin(), samples->end(), time,
                                        [](double t, const Sample& sample) { return t < sample.time; });
    return after == samples->begin() ? after->pose : std::prev(after)->pose;
  };
}

// Slope of force over displacement, by least squares.
class Slope {
 public:
  void add(double x, double y) {
    ++n_;
    x_ += x;
    y_ += y;
    xx_ += x * x;
    xy_ += x * y;
  }
  double value() const { return (n_ * xy_ - x_ * y_) / (n_ * xx_ - x_ * x_); }
  double count() const { return n_; }

 private:
  double n_ = 0, x_ = 0, y_ = 0, xx_ = 0, xy_ = 0;
};

void open(const std::string& path, vps::Asset& asset) {
  const vps::Status status = vps::Asset::open(path.c_str(), asset);
  if (status != vps::Status::ok) throw std::runtime_error(path + ": " + vps::describe(status));
}

double percentile(std::vector<double>& values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

int run(const Options& options) {
  vps::Asset tool_asset;
  vps::Asset scene_asset;
  open(options.tool, tool_asset);
  open(options.scene, scene_asset);
  vps::PointshellView tool;
  vps::VoxelmapView map;
  if (tool_asset.pointshell(tool) != vps::Status::ok) throw std::runtime_error(options.tool + ": has no pointshell");
  if (scene_asset.voxelmap(map) != vps::Status::ok) throw std::runtime_error(options.scene + ": has no voxelmap");
  const Device device = options.trajectory.empty()
                            ? synthetic(options.motion, tool_asset.info(), scene_asset.info(), options.seconds)
                            : recorded(options.trajectory);
  std::FILE* const stream = options.stream.empty() ? nullptr : std::fopen(options.stream.c_str(), "w");
  if (!options.stream.empty() && stream == nullptr) throw std::runtime_error(options.stream + ": cannot be written");
  if (stream != nullptr) std::fputs("time,fx,fy,fz,tx,ty,tz,x,y,z,penetration,contacts,microseconds\n", stream);

  vps::HapticCycle cycle;
  vps::VirtualTool virtual_tool(tool, map, device(0, cycle.felt), options.coupling);
  const auto cycles = static_cast<int>(options.seconds * options.rate);
  const double period = 1 / options.rate;
  std::vector<double> compute_us;
  int missed = 0;
  int woken_late = 0;
  int touching = 0;
  double strongest = 0;
  double deepest = -1;
  double largest_jump = 0;
  Slope slope;
  double last_force = 0;
  const double begin = now();
  for (int i = 0; i < cycles; ++i) {
    const double due = begin + i * period;
    if (options.paced) sleep_until(due);
    const double woken = now();
    const vps::Pose handle = device(i * period, cycle.felt);
    if (const vps::Status status = virtual_tool.step(handle, cycle); status != vps::Status::ok) {
      throw std::runtime_error(std::string("cycle failed: ") + vps::describe(status));
    }
    const double done = now();
    compute_us.push_back(1e6 * (done - woken));
    if (options.paced) {
      missed += done > due + period;
      woken_late += woken > due + 0.5 * period;
    }
    const double* const f = cycle.felt.force;
    const double force = std::hypot(f[0], f[1], f[2]);
    strongest = std::max(strongest, force);
    deepest = std::max(deepest, cycle.penetration);
    largest_jump = std::max(largest_jump, std::abs(force - last_force));
    last_force = force;
    touching += cycle.contacts > 0;
    // Only where contacts hold the tool and the force is below the device's limit.
    if (cycle.contacts > 0 && force > 0.5 && force < 0.95 * options.coupling.max_force) {
      slope.add(-handle.translation[2], f[2]);
    }
    if (stream != nullptr) {
      const double* const t = cycle.felt.torque;
      const double* const x = cycle.tool.translation;
      std::fprintf(stream, "%.4f,%.5g,%.5g,%.5g,%.5g,%.5g,%.5g,%.7g,%.7g,%.7g,%.3g,%u,%.1f\n", i * period, f[0], f[1],
                   f[2], t[0], t[1], t[2], x[0], x[1], x[2], cycle.penetration, cycle.contacts, compute_us.back());
    }
  }
  if (stream != nullptr && std::fclose(stream) != 0) throw std::runtime_error(options.stream + ": cannot be written");

  const double worst = *std::max_element(compute_us.begin(), compute_us.end());
  std::printf("cycles              %d of %.3g ms, %d in touch\n", cycles, 1000 * period, touching);
  std::printf("cycle, computed     %.1f us median, %.1f us 99 %%, %.1f us max\n", percentile(compute_us, 0.5),
              percentile(compute_us, 0.99), worst);
  if (options.paced) std::printf("deadlines missed    %d (woken late by the system: %d)\n", missed, woken_late);
  std::printf("force               %.2f N at most, %.3f N from one cycle to the next\n", strongest, largest_jump);
  std::printf("deepest penetration %.3f mm\n", 1000 * std::max(0.0, deepest));
  if (options.motion == "press" && options.trajectory.empty() && slope.count() > 100) {
    std::printf("stiffness           %.0f N/m rendered, %.0f N/m asked for\n", slope.value(),
                options.coupling.linear_stiffness);
  }
  return touching > 0 ? 0 : 4;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Leads a tool over a scene at 1 kHz and prints what a hand would feel.");
  app.add_option("TOOL", options.tool, "asset with a pointshell")->required();
  app.add_option("SCENE", options.scene, "asset with a voxelmap")->required();
  app.add_option("--motion", options.motion, "synthetic trajectory")
      ->check(CLI::IsMember({"press", "insert", "slide"}))
      ->capture_default_str();
  app.add_option("--trajectory", options.trajectory, "recorded one: lines of time,x,y,z,qw,qx,qy,qz");
  app.add_option("--stream", options.stream, "writes every cycle as CSV");
  app.add_option("--seconds", options.seconds, "how long")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--rate", options.rate, "cycles a second")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--stiffness", options.coupling.linear_stiffness, "of the coupling [N/m]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--max-microseconds", options.coupling.max_microseconds, "of each query; 0: no limit")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_flag("!--free-running", options.paced, "as fast as it goes, without deadlines");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "haptic_loop: error: %s\n", error.what());
    return 3;
  }
}
