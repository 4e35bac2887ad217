// SPDX-License-Identifier: GPL-3.0-or-later
// How the cost of a query grows with points, area in touch, speed, pairs and threads, in stock Bullet, with fitted
// exponents. Prints Markdown, the steepest curve first.
#include <LinearMath/btThreads.h>
#include <btBulletCollisionCommon.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <barrier>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <thread>

#include "cli/lab/pair.h"
#include "tests/bench/growth/bodies.h"
#include "tests/bench/growth/curves.h"
#include "tests/bench/growth/plays.h"
#include "tests/bench/query_report.h"

namespace vps::bench {
namespace {

using lab::Clock;
using lab::microseconds_since;

constexpr double kMostExponent = 0.5;                               // of face on face
constexpr double kMostApart = 0.1;                                  // for a pair that is apart. [us]
constexpr double kSpeeds[] = {0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30};  // voxels a step

constexpr const char* kFloorCurve = "box, fresh pair";

struct Options {
  std::string mesh, work, only, json;
  double scale = 1, most_points = 1e6;
  int rounds = 3;
};

// --- points, area, speed

std::string power_of_ten(double size) {
  return fmt::format("10^{:.0f}", std::log10(size));
}

std::vector<double> sizes_of(const Options& options) {
  std::vector<double> sizes;
  for (double size = 1e3; size < 1.5 * options.most_points; size *= 10) sizes.push_back(size);
  return sizes;
}

Section points_section(const Options& options, Bodies& bodies) {
  Section out{"Points of the shell", "points"};
  for (const double size : sizes_of(options)) {
    const ShapePtr shape = bodies.bunny(size);
    const auto poses = std::make_shared<std::vector<btTransform>>(pair_poses(*shape));
    btTransform rest;
    ride(*shape, box_ground(), standing(*shape), {480}, &rest);
    const auto add = [&](const std::string& what, const std::function<Times()>& run) {
      out.jobs.push_back({what, power_of_ten(size), double(shape->pointshell().points), run});
    };
    add("two bunnies, fresh poses", [=] { return fresh(*shape, {"twin", shape}, *poses); });
    add("bunny on box, fresh pair", [=] { return fresh(*shape, box_ground(), jittered(*shape, rest)); });
    for (const double rate : {240.0, 1000.0}) {
      add(fmt::format("bunny on box, at rest, {} Hz", rate), [=] {
        return ride(*shape, box_ground(), rest, {30, rate});
      });
    }
  }
  return out;
}

Section area_section(const Options& options, Bodies& bodies) {
  Section out{"Area in touch", "points in contact"};
  out.most_exponent = kMostExponent;
  for (const double size : sizes_of(options)) {
    const ShapePtr plate = bodies.plate(size);
    const double points = face_of(*plate).contacts;
    for (const Ground& ground : grounds_of(bodies, size)) {
      const auto add = [&](const std::string& what, const std::function<Times()>& run) {
        out.jobs.push_back({fmt::format("{}, {}", ground.name, what), power_of_ten(size), points, run});
      };
      add("fresh pair", [=] { return fresh(*plate, ground, jittered(*plate, lying(*plate, 0))); });
      for (const double rate : {240.0, 1000.0}) {
        add(fmt::format("at rest, {} Hz", rate), [=] { return ride(*plate, ground, lying(*plate, 0), {30, rate}); });
      }
      add("slides, 1000 Hz", [=] { return ride(*plate, ground, lying(*plate, -0.02), {30, 1000, 0.1}); });
    }
  }
  return out;
}

// Back and forth over 40 mm.
std::vector<btTransform> slide_path(const bullet::Shape& plate, double speed) {
  std::vector<btTransform> path;
  for (int i = 0; i < 100; ++i) {
    const double way = std::fmod(i * speed * voxel_of(plate), 0.08);
    path.push_back(lying(plate, std::abs(way - 0.04) - 0.02));
  }
  return path;
}

// Turns in touch with its copy, half a voxel deep. A point at half of the radius moves by `speed` voxels a step.
std::vector<btTransform> turn_path(const bullet::Shape& shape, double speed, std::uint64_t seed) {
  lab::Random random(seed);
  btMatrix3x3 basis = rotation(random);
  const btVector3 along = direction(random);
  const btQuaternion turn(direction(random), btScalar(2 * speed * voxel_of(shape) / radius_of(shape)));
  std::vector<btTransform> path;
  for (int i = 0; i < 24; ++i) {
    path.push_back(touching(shape, basis, along, 0.5 * voxel_of(shape)));
    basis = btMatrix3x3(turn) * basis;
  }
  return path;
}

Section speed_section(const Options& options, Bodies& bodies) {
  Section out{"Speed", "voxels a step"};
  const double size = std::min(1e5, options.most_points);
  const ShapePtr plate = bodies.plate(size);
  const ShapePtr bunny = bodies.bunny(size);
  for (const double speed : kSpeeds) {
    const auto add = [&](const std::string& what, const std::function<Times()>& run) {
      out.jobs.push_back({what, fmt::format("{:g}", speed), speed, run});
    };
    for (const Ground& ground : grounds_of(bodies, size)) {
      add("plate slides on " + ground.name, [=] { return drive(*plate, ground, slide_path(*plate, speed)); });
    }
    std::vector<std::vector<btTransform>> paths;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) paths.push_back(turn_path(*bunny, speed, seed));
    add("bunny turns on its twin", [=] {
      Times us;
      for (const auto& path : paths) {
        const Times some = drive(*bunny, {"twin", bunny}, path);
        us.insert(us.end(), some.begin(), some.end());
      }
      return us;
    });
  }
  return out;
}

// --- pairs

std::vector<Places> touching_places(const bullet::Shape& shape) {
  std::vector<Places> places;
  for (const btTransform& at : pair_poses(shape)) places.push_back({btTransform::getIdentity(), at});
  return places;
}

Section pairs_section(const Options& options, Bodies& bodies) {
  Section out{"Pairs in a scene", "pairs"};
  out.most_us = kMostApart;
  out.judged = "apart";
  const ShapePtr bunny = bodies.bunny(std::min(1e4, options.most_points));
  const std::vector<Places> apart = apart_places(*bunny);
  const std::vector<Places> far = apart_places(*bunny, 16);
  std::vector<Places> mixed = apart;
  const std::vector<Places> touch = touching_places(*bunny);
  for (std::size_t i = 0; i < mixed.size(); i += 10) mixed[i] = touch[i];
  const auto ball = std::make_shared<btSphereShape>(btScalar(0.1));
  const btTransform beside(btQuaternion::getIdentity(), {btScalar(0.15), btScalar(0.15), btScalar(0.15)});
  const std::vector<Places> balls = {{btTransform::getIdentity(), beside}};
  for (const int pairs : {10, 100, 1000, 10000}) {
    const auto add = [&](const std::string& what, const std::shared_ptr<btCollisionShape>& shape,
                         const std::vector<Places>& places, Play play, double step) {
      out.jobs.push_back(
          {what, power_of_ten(pairs), double(pairs), [=] { return many_pairs(*shape, places, pairs, play, step); }});
    };
    const double step = 0.1 * voxel_of(*bunny);
    add("apart, first step", bunny, apart, Play::first, 0);
    add("apart, still", bunny, apart, Play::still, 0);
    add("apart, 0.1 voxel a step", bunny, apart, Play::placed, step);
    add("apart, drift together, 3 voxels a step", bunny, apart, Play::drifting, 30 * step);
    add("apart, one turns by 1 voxel a step", bunny, far, Play::turning, 10 * step);
    add("apart, one flies 3 voxels a step", bunny, far, Play::flying, 30 * step);
    add("one in ten touches, still", bunny, mixed, Play::still, 0);
    add("one in ten touches, 0.1 voxel a step", bunny, mixed, Play::placed, step);
    add("Bullet's spheres, apart, still", ball, balls, Play::still, 0);
  }
  return out;
}

// Tests of the library for the pairs that are apart.
std::string apart_table(const bullet::Shape& shape, nlohmann::ordered_json& json) {
  double rejected = 0, spheres = 0, points = 0;
  const std::vector<Places> all = apart_places(shape);
  for (const auto& [first, second] : all) {
    const Pose pose = pose_of(shape, second);
    const QueryResult result =
        ask(shape, shape.voxelmap(), relative_pose(pose_of(shape, first), pose), 0.1 * voxel_of(shape));
    rejected += result.nodes_tested == 1 ? 1 : 0;
    spheres += result.nodes_tested;
    points += result.points_tested;
  }
  const double n = double(all.size());
  json["apart"] = {{"by_first_sphere", rejected / n}, {"spheres", spheres / n}, {"points", points / n}};
  return "\n" + row({"pairs apart", "of them by their first sphere", "spheres tested, mean", "points tested, mean"}) +
         row({"---", "---", "---", "---"}) +
         row({number(n), number(rejected), number(spheres / n), number(points / n)});
}

std::string memory_table(const Options& options, Bodies& bodies, nlohmann::ordered_json& json) {
  const ShapePtr bunny = bodies.bunny(std::min(1e4, options.most_points));
  std::string out =
      apart_table(*bunny, json) + "\n" + row({"memory on the heap", "bytes per pair"}) + row({"---", "---"});
  for (const auto& [name, places] : {std::pair{"touch", touching_places(*bunny)}, {"apart", apart_places(*bunny)}}) {
    double bytes = 0;
    (void)many_pairs(*bunny, places, 10000, Play::still, 0, &bytes);
    out += row({fmt::format("10,000 pairs, {}", name), number(bytes)});
    json["bytes_per_pair"][name] = bytes;
  }
  return out;
}

// --- the least that a fresh query can take

// Bytes that the tests read and the hits write, and the time to copy as many. A sphere with its children is 24 bytes, a
// point's codes are 6, a hit is 20. What is read of the ground is not counted.
std::string floor_table(Bodies& bodies, const Section& area, nlohmann::ordered_json& json) {
  std::string out =
      "\n" + row({"plate on a box, fresh pair", "points", "voxel, mm", "file, MB", "spheres tested", "points tested",
                  "in contact", "kB touched", "copied in, us", "query / copy", "ns per point in contact"});
  out += row(std::vector<std::string>(11, "---"));
  for (const Job& job : area.jobs) {
    if (job.curve != kFloorCurve) continue;
    const ShapePtr plate = bodies.plate(std::pow(10, std::round(std::log10(job.size))));
    const QueryResult face = face_of(*plate);
    const double bytes = 24.0 * face.nodes_tested + 6.0 * face.points_tested + 20.0 * face.contacts;
    std::vector<char> from(std::size_t(bytes / 2), 1);
    std::vector<char> to(from.size());
    Times copies;
    for (std::size_t i = 0; i < 50; ++i) {
      const auto begin = Clock::now();
      std::memcpy(to.data(), from.data(), from.size());
      copies.push_back(microseconds_since(begin));
      from[i] = char(to.back() + 1);
    }
    const double us = median(job.us);
    out += row({job.column, std::to_string(plate->pointshell().points), number(1e3 * voxel_of(*plate)),
                number(1e-6 * double(plate->asset().bytes().size())), std::to_string(face.nodes_tested),
                std::to_string(face.points_tested), std::to_string(face.contacts), number(bytes / 1e3),
                number(median(copies)), number(us / median(copies)), number(1e3 * us / job.size)});
    json["floor"].push_back({{"points", job.size}, {"bytes", bytes}, {"copy_us", median(copies)}, {"us", us}});
  }
  return out;
}

// --- threads

// All threads ask the same queries, each with memory of its own. @return time of a query of one thread. [us]
double time_of(const bullet::Shape& shape, const std::vector<Pose>& poses, unsigned threads) {
  constexpr int kRepeats = 40;
  std::barrier start(std::ptrdiff_t(threads) + 1);
  const auto ask_all = [&] {
    for (const Pose& pose : poses) ask(shape, shape.voxelmap(), pose, 0);
  };
  std::vector<std::thread> all;
  for (unsigned i = 0; i < threads; ++i) {
    all.emplace_back([&] {
      ask_all();
      start.arrive_and_wait();
      for (int repeat = 0; repeat < kRepeats; ++repeat) ask_all();
    });
  }
  start.arrive_and_wait();
  const auto begin = Clock::now();
  for (std::thread& thread : all) thread.join();
  return microseconds_since(begin) / double(kRepeats * poses.size());
}

std::string threads_table(const Options& options, Bodies& bodies, nlohmann::ordered_json& json) {
  const ShapePtr bunny = bodies.bunny(std::min(1e5, options.most_points));
  std::vector<Pose> poses;
  for (const btTransform& at : pair_poses(*bunny)) poses.push_back(pose_of(*bunny, at));
  const unsigned most = std::max(2U, std::thread::hardware_concurrency());
  std::map<unsigned, Times> us = {{most, {}}};
  for (unsigned threads = 1; threads < most; threads *= 2) us[threads];
  for (int round = 0; round < 3 * options.rounds; ++round) {
    for (auto& [threads, times] : us) times.push_back(time_of(*bunny, poses, threads));
  }
  std::string out = "\n## Threads\n\n" + row({"threads", "us per query of a thread", "speed-up"});
  out += row({"---", "---", "---"});
  for (const auto& [threads, times] : us) {
    const double speed_up = threads * median(us[1]) / median(times);
    out += row({std::to_string(threads), number(median(times)), number(speed_up)});
    json["threads"].push_back({{"threads", threads}, {"us", median(times)}, {"speed_up", speed_up}});
  }
  const std::unique_ptr<btITaskScheduler> scheduler(btCreateDefaultTaskScheduler());
  return out + fmt::format("\nBullet's own threads: {}.\n",
                           scheduler != nullptr ? "there, not measured" : "none, it was built without BT_THREADSAFE");
}

// --- all of it

bool is_chosen(const std::string& title, const Options& options) {
  return title.starts_with(options.only) || options.only.starts_with(title + ",");
}

void run(const Options& options) {
  Bodies bodies(options.mesh, options.scale, options.work);
  nlohmann::ordered_json json;
  const std::pair<const char*, Section (*)(const Options&, Bodies&)> sections[] = {
      {"Points of the shell", points_section},
      {"Area in touch", area_section},
      {"Speed", speed_section},
      {"Pairs in a scene", pairs_section}};
  for (const auto& [title, make] : sections) {
    if (!is_chosen(title, options)) continue;
    Section section = make(options, bodies);
    std::erase_if(section.jobs,
                  [&](const Job& job) { return name_of(section, job).find(options.only) == std::string::npos; });
    if (section.jobs.empty()) continue;
    measure(section, options.rounds);
    fmt::print("{}", markdown(section, json));
    if (options.only.starts_with(std::string(title) + ",")) continue;  // some curves only
    if (make == area_section) fmt::print("{}", floor_table(bodies, section, json));
    if (make == pairs_section) fmt::print("{}", memory_table(options, bodies, json));
  }
  if (is_chosen("Threads", options)) fmt::print("{}", threads_table(options, bodies, json));
  if (json.empty()) throw std::runtime_error("nothing is called " + options.only);
  if (options.json.empty()) return;
  std::ofstream out(options.json);
  out << json.dump(1) << '\n';
  out.close();
  if (!out) throw std::runtime_error(options.json + ": cannot be written");
}

}  // namespace
}  // namespace vps::bench

int main(int argc, char** argv) {
  vps::bench::Options options;
  CLI::App app("How the cost of a query grows with points, area, speed, pairs and threads");
  app.add_option("mesh", options.mesh, "The bunny: a closed mesh")->required();
  app.add_option("--scale", options.scale, "Metres per unit of the mesh");
  app.add_option("--work", options.work, "Folder for assets that the next run finds again");
  app.add_option("--only", options.only, "A section's title; after it a comma and a part of 'CURVE, SIZE'");
  app.add_option("--points", options.most_points, "Most points of a shell, and in contact")
      ->check(CLI::Range(1e3, 1e7));
  app.add_option("--rounds", options.rounds, "Measured rounds")->check(CLI::PositiveNumber);
  app.add_option("--json", options.json, "Also write the numbers there");
  CLI11_PARSE(app, argc, argv);
  try {
    vps::bench::run(options);
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    fmt::print(stderr, "growth_bench: error: {}\n", error.what());
    return EXIT_FAILURE;
  }
}
