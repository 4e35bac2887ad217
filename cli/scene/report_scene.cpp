// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/report_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bake/plan.h"
#include "bake/quantity_text.h"
#include "cli/scene/write_manifest.h"
#include "cli/tools/utf8.h"

namespace vps::cli {
namespace {

using Json = nlohmann::ordered_json;

// Whether everything was baked and written, as with --full, not for a comparison.
bool is_full(const SceneReport& report) {
  return !report.everything.empty() && report.ordinary.empty();
}

// Bytes and baking time of an asset, measured or predicted.
struct Cost {
  double bytes = 0, seconds = 0;
  bool bytes_measured = false, seconds_measured = false;
};

Cost measured(const BakedPart& part) {
  return {static_cast<double>(part.asset->bytes().size()), part.seconds, true, !part.from_cache};
}

Cost cost_of(const SceneReport& report, std::size_t i) {
  const PlannedAsset& asset = report.plan.assets[i];
  if (!asset.is_needed()) return {0, 0, true, true};
  if (report.baked[i].asset == nullptr)
    return {static_cast<double>(asset.predicted.predicted_asset_bytes), asset.seconds, false, false};
  Cost cost = measured(report.baked[i]);
  if (!cost.seconds_measured) cost.seconds = asset.seconds;
  return cost;
}

// Predicts the cost of an asset with more parts and fields than are needed.
Cost predicted_cost(const SceneReport& report, std::size_t i, const bake::BakePlan& predicted, double seconds) {
  const PlannedAsset& asset = report.plan.assets[i];
  const Cost planned = cost_of(report, i);
  const auto points_of = [](const bake::BakePlan& plan) {
    return bake::kPointBytes * static_cast<double>(plan.predicted_points);
  };
  const auto map_of = [&](const bake::BakePlan& plan) {
    return static_cast<double>(plan.predicted_asset_bytes) - points_of(plan);
  };
  // The predicted size of a voxelmap is an upper bound. A baked asset shows how much smaller it really is.
  constexpr double kUsually = 0.45;
  const bool shows = asset.options.voxelmap && report.baked[i].asset != nullptr;
  const double real = (planned.bytes - points_of(asset.predicted)) / map_of(asset.predicted);
  const double part = shows ? std::clamp(real, 0.0, 1.0) : kUsually;
  Cost cost;
  // First the difference: it is 0 where nothing else would be baked.
  const double more =
      points_of(predicted) - points_of(asset.predicted) + part * (map_of(predicted) - map_of(asset.predicted));
  cost.bytes = planned.bytes + more;
  cost.seconds = planned.seconds + seconds - asset.seconds;
  return cost;
}

Cost cost_of_ordinary(const SceneReport& report, std::size_t i) {
  const PlannedAsset& asset = report.plan.assets[i];
  if (report.ordinary.empty()) return predicted_cost(report, i, asset.predicted_ordinary, asset.seconds_ordinary);
  Cost cost = measured(report.ordinary[i]);
  if (!cost.seconds_measured) cost.seconds = asset.seconds_ordinary;
  return cost;
}

Cost cost_of_everything(const SceneReport& report, std::size_t i) {
  const PlannedAsset& asset = report.plan.assets[i];
  if (report.everything.empty()) return predicted_cost(report, i, asset.predicted_everything, asset.seconds_everything);
  Cost cost = measured(report.everything[i]);
  if (!cost.seconds_measured) cost.seconds = asset.seconds_everything;
  return cost;
}

std::vector<std::string> left_out(const PlannedAsset& asset) {
  std::vector<std::string> names;
  if (!asset.options.voxelmap) names.emplace_back("voxelmap");
  if (!asset.options.pointshell) names.emplace_back("pointshell");
  names.insert(names.end(), {"layers", "real"});
  return names;
}

// The bodies that use an asset, each once.
std::vector<std::size_t> users_of(const ScenePlan& plan, std::size_t asset) {
  std::vector<std::size_t> bodies;
  for (const PlannedShape& shape : plan.shapes) {
    if (shape.asset == asset && (bodies.empty() || bodies.back() != shape.body)) bodies.push_back(shape.body);
  }
  return bodies;
}

// The first bodies that a body can meet.
std::vector<std::size_t> first_partners(const SceneReport& report, std::size_t body, std::size_t most) {
  std::vector<std::size_t> partners;
  report.plan.meeting.for_each_partner(body, [&](std::size_t other) {
    partners.push_back(other);
    return partners.size() < most;
  });
  return partners;
}

// In large scenes all names would be too many: their number grows with the square of the bodies'.
std::size_t most_listed(const Scene& scene) {
  constexpr std::size_t kLargeScene = 1000;
  return scene.bodies.size() > kLargeScene ? 100 : kLargeScene;
}

std::string partner_names(const SceneReport& report, std::size_t body) {
  constexpr std::size_t kMost = 4;
  std::string names;
  for (const std::size_t other : first_partners(report, body, kMost))
    names += (names.empty() ? "" : ", ") + report.scene.bodies[other].name;
  const std::size_t count = report.plan.meeting.partners(body);
  return count > kMost ? fmt::format("{} and {} more", names, count - kMost) : names;
}

std::string left_out_to_text(const SceneReport& report, std::size_t asset) {
  const std::vector<std::size_t> users = users_of(report.plan, asset);
  const bool meets =
      std::any_of(users.begin(), users.end(), [&](std::size_t body) { return report.plan.meeting.partners(body) > 0; });
  std::string text;
  if (!report.plan.assets[asset].options.pointshell)
    text += meets ? "pointshell (its partners have finer voxels or fewer points), " : "pointshell, ";
  return text + "layers and real (scaled answers)";
}

std::string about(bool is_measured) {
  return is_measured ? "" : "about ";
}

std::string saving(const Cost& planned, const Cost& ordinary, const Cost& everything) {
  const auto against = [&](const Cost& other) -> std::string {
    const double bytes = std::max(0.0, other.bytes - planned.bytes);
    constexpr double kWorthSaying = 0.005;  // [s]
    double seconds = other.seconds - planned.seconds;
    if (std::abs(seconds) < kWorthSaying) seconds = 0;
    const std::string size =
        bytes == 0 ? "nothing" : about(planned.bytes_measured && other.bytes_measured) + bake::format_bytes(bytes);
    if (seconds == 0) return size;
    const std::string time =
        fmt::format("{}{:.2f} s", about(planned.seconds_measured && other.seconds_measured), std::abs(seconds));
    if (seconds < 0) return size + " and costs " + time;
    return bytes == 0 ? time : size + " and " + time;
  };
  return fmt::format("{}{} in {}{:.2f} s; saves {} against an ordinary bake, {} against everything",
                     about(planned.bytes_measured), bake::format_bytes(planned.bytes), about(planned.seconds_measured),
                     planned.seconds, against(ordinary), against(everything));
}

std::string shape_to_text(const SceneReport& report, const PlannedShape& planned) {
  const SceneBody& body = report.scene.bodies[planned.body];
  const SceneShape& shape = body.shapes[planned.shape];
  if (planned.asset == PlannedShape::kNone)
    return fmt::format("  {}: Bullet's own, nothing baked\n", solid_name(shape.solid));
  const PlannedAsset& asset = report.plan.assets[planned.asset];
  const std::string mesh = fmt::format("{} ({})", shape.mesh.filename().string(), report.meshes[asset.mesh].size());
  const auto saved = [&] {
    return saving(cost_of(report, planned.asset), cost_of_ordinary(report, planned.asset),
                  cost_of_everything(report, planned.asset));
  };
  const bool is_first = users_of(report.plan, planned.asset).front() == planned.body;
  if (!asset.is_needed() || !overlap(planned.parts, Use::everything)) {
    return fmt::format("  {}: meets nobody, nothing baked{}\n", mesh, is_first ? fmt::format("; {}", saved()) : "");
  }
  const bake::BakeOptions& o = asset.options;
  std::string text = fmt::format(
      "  {}: plays the {}, voxels of {}", mesh,
      std::string(part_name(planned.parts)) == "mixed" ? "pointshell or the voxelmap" : part_name(planned.parts),
      bake::format_length(o.voxel_size));
  if (o.pointshell) text += fmt::format(", points {} apart", bake::format_length(o.alpha * o.voxel_size));
  if (o.voxelmap) text += fmt::format(", band {:.3g}/{:.3g} vx in/out", o.band_inside, o.band_outside);
  if (planned.segments > 0) text += fmt::format(", {} segments", planned.segments);
  if (!is_first) return text + fmt::format("; shares {}\n", asset.file);
  const char* const left_out = is_full(report) ? "a plan leaves out" : "left out";
  text +=
      fmt::format("\n    {}: {}\n    {}: {}\n", left_out, left_out_to_text(report, planned.asset), asset.file, saved());
  return text;
}

struct Totals {
  Cost planned, ordinary, everything;
};

Totals totals_of(const SceneReport& report) {
  const Cost nothing{0, 0, true, true};
  Totals totals{nothing, nothing, nothing};
  const auto add = [](Cost& sum, const Cost& cost) {
    sum.bytes += cost.bytes;
    sum.seconds += cost.seconds;
    sum.bytes_measured = sum.bytes_measured && cost.bytes_measured;
    sum.seconds_measured = sum.seconds_measured && cost.seconds_measured;
  };
  for (std::size_t i = 0; i < report.plan.assets.size(); ++i) {
    add(totals.planned, cost_of(report, i));
    add(totals.ordinary, cost_of_ordinary(report, i));
    add(totals.everything, cost_of_everything(report, i));
  }
  return totals;
}

bool is_baked(const SceneReport& report) {
  return std::any_of(report.baked.begin(), report.baked.end(), [](const BakedPart& p) { return p.asset != nullptr; });
}

std::string wishes_to_text(const SceneReport& report) {
  const Scene& scene = report.scene;
  std::string text;
  if (scene.error.value > 0) {
    text += fmt::format("error         {} wished", bake::format_length(scene.error.value));
    if (is_baked(report))
      text += fmt::format(", {} reached (certificates and covering radii)",
                          bake::format_length(reached_error(report.plan, report.baked)));
    text += '\n';
  }
  text +=
      fmt::format("time          about {:.4g} us of contacts a step (estimated)", 1e6 * report.plan.seconds_per_step);
  text += scene.time.value > 0 ? fmt::format(", {:.4g} us wished\n", 1e6 * scene.time.value) : "\n";
  const Totals totals = totals_of(report);
  text += fmt::format("memory        {}{}", totals.planned.bytes_measured ? "" : "about ",
                      bake::format_bytes(totals.planned.bytes));
  text += scene.memory.value > 0 ? fmt::format(", {} wished\n", bake::format_bytes(scene.memory.value)) : "\n";
  return text;
}

Json cost_to_json(const Cost& cost) {
  return {{"bytes", static_cast<std::uint64_t>(cost.bytes)},
          {"seconds", cost.seconds},
          {"bytes_measured", cost.bytes_measured},
          {"seconds_measured", cost.seconds_measured}};
}

Json asset_to_json(const SceneReport& report, std::size_t i) {
  const PlannedAsset& asset = report.plan.assets[i];
  const bake::BakeOptions& o = asset.options;
  Json json = {{"file", asset.is_needed() ? Json(asset.file) : Json()},
               {"mesh", report.meshes[asset.mesh].file.string()},
               {"left_out", left_out(asset)},
               {"voxel_size", o.voxel_size},
               {"alpha", o.alpha},
               {"band_inside_vx", o.band_inside},
               {"band_outside_vx", o.band_outside},
               {"planned", cost_to_json(cost_of(report, i))},
               {"ordinary", cost_to_json(cost_of_ordinary(report, i))},
               {"everything", cost_to_json(cost_of_everything(report, i))}};
  for (const std::size_t body : users_of(report.plan, i)) json["bodies"].push_back(report.scene.bodies[body].name);
  if (report.baked[i].asset != nullptr) {
    json["from_cache"] = report.baked[i].from_cache;
    json["notes"] = report.baked[i].notes;
  }
  return json;
}

}  // namespace

double reached_error(const ScenePlan& plan, const std::vector<BakedPart>& baked) {
  double worst = 0;
  plan.meeting.for_each_pair([&](std::size_t a, std::size_t b) {
    for (std::size_t i = plan.first_shape[a]; i < plan.first_shape[a + 1]; ++i) {
      for (std::size_t j = plan.first_shape[b]; j < plan.first_shape[b + 1]; ++j) {
        const PlannedShape* const pair[] = {&plan.shapes[i], &plan.shapes[j]};
        for (int shell = 0; shell < 2; ++shell) {
          const PlannedShape& gives = *pair[shell];
          const PlannedShape& field = *pair[1 - shell];
          if (!overlap(gives.parts, Use::pointshell)) continue;
          const bool exact = field.asset == PlannedShape::kNone;
          if (!exact && !overlap(field.parts, Use::voxelmap)) continue;
          const double cover = baked[gives.asset].asset->info().covering_radius;
          worst = std::max(worst, cover + (exact ? 0 : baked[field.asset].asset->info().scaled_error.bound));
        }
      }
    }
  });
  return worst;
}

Json to_json(const SceneReport& report) {
  const Scene& scene = report.scene;
  const ScenePlan& plan = report.plan;
  const Totals totals = totals_of(report);
  Json json = {{"scene", report.scene_file},
               {"manifest", report.manifest.empty() ? Json() : Json(report.manifest)},
               {"pairs", scene.bodies.size() * (scene.bodies.size() - 1) / 2},
               {"pairs_that_meet", plan.meeting.pairs()},
               {"step", scene.step},
               {"planned", cost_to_json(totals.planned)},
               {"ordinary", cost_to_json(totals.ordinary)},
               {"everything", cost_to_json(totals.everything)}};
  const auto wish = [](const Wish& one) { return one.value > 0 ? Json(one.value) : Json(); };
  json["wishes"] = {
      {"error", wish(scene.error)}, {"time_budget", wish(scene.time)}, {"memory_bytes", wish(scene.memory)}};
  json["estimated_step_seconds"] = plan.seconds_per_step;
  json["reached_error"] = is_baked(report) ? Json(reached_error(plan, report.baked)) : Json();
  json["bodies"] = Json::array();
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    Json body = {
        {"name", scene.bodies[b].name}, {"type", motion_name(scene.bodies[b].motion)}, {"meets", Json::array()}};
    for (const std::size_t other : first_partners(report, b, most_listed(scene)))
      body["meets"].push_back(scene.bodies[other].name);
    for (std::size_t i = plan.first_shape[b]; i < plan.first_shape[b + 1]; ++i) {
      const PlannedShape& shape = plan.shapes[i];
      const bool own = shape.asset == PlannedShape::kNone;
      body["shapes"].push_back({{"solid", solid_name(scene.bodies[b].shapes[shape.shape].solid)},
                                {"asset", own ? Json() : Json(shape.asset)},
                                {"plays", own ? Json() : Json(part_name(shape.parts))},
                                {"segments", shape.segments}});
    }
    json["bodies"].push_back(body);
  }
  json["assets"] = Json::array();
  for (std::size_t i = 0; i < plan.assets.size(); ++i) json["assets"].push_back(asset_to_json(report, i));
  json["removed"] = report.removed;
  json["notes"] = scene.notes;
  return json;
}

std::string to_text(const SceneReport& report) {
  const Scene& scene = report.scene;
  const ScenePlan& plan = report.plan;
  std::string text;
  for (const std::string& note : scene.notes) text += fmt::format("note: {}\n", note);
  for (const SceneMesh& mesh : report.meshes) {
    for (const std::string& note : mesh.notes)
      text += fmt::format("note: {}: {}\n", mesh.file.filename().string(), note);
  }
  for (std::size_t i = 0; i < plan.assets.size(); ++i) {
    for (const std::string& note : report.baked[i].notes)
      text += fmt::format("note: {}: {}\n", plan.assets[i].file, note);
  }
  if (plan.meeting.pairs() == 0) {
    const bool moves = std::any_of(scene.bodies.begin(), scene.bodies.end(),
                                   [](const SceneBody& body) { return body.motion == Motion::dynamic; });
    const bool bakes = is_full(report) || std::any_of(plan.assets.begin(), plan.assets.end(),
                                                      [](const PlannedAsset& asset) { return asset.is_needed(); });
    text += fmt::format("note: {}{}; name in a TOML what else is there (docs/scene.md)\n",
                        bakes ? "" : "nothing is baked: ",
                        moves ? "no two bodies can meet" : "no body has a mass, so none moves and meets another");
  }
  const std::size_t count = scene.bodies.size();
  text += fmt::format("{}: {} {}, {} of {} pairs can meet, steps of {:.3g} ms\n", one_line(report.scene_file), count,
                      count == 1 ? "body" : "bodies", plan.meeting.pairs(), count * (count - 1) / 2, 1e3 * scene.step);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const std::string partners = plan.meeting.partners(b) == 0 ? "meets nobody" : "meets " + partner_names(report, b);
    text += fmt::format("{} ({}) {}\n", scene.bodies[b].name, motion_name(scene.bodies[b].motion), partners);
    for (std::size_t i = plan.first_shape[b]; i < plan.first_shape[b + 1]; ++i) {
      text += shape_to_text(report, plan.shapes[i]);
    }
  }
  text += wishes_to_text(report);
  const Totals totals = totals_of(report);
  text += fmt::format("in all        {}\n", saving(totals.planned, totals.ordinary, totals.everything));
  if (!report.everything.empty() && !is_baked(report))
    text += fmt::format("written       {}: everything\n", bake::format_bytes(totals.everything.bytes));
  if (!report.removed.empty())
    text += fmt::format("removed       {}: of an earlier plan\n", fmt::join(report.removed, ", "));
  if (report.everything.empty() && is_baked(report))
    text += "              --compare bakes everything too, and measures it\n";
  return text;
}

}  // namespace vps::cli
