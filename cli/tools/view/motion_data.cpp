// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/view/motion_data.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>

#include "bake/quantity_text.h"
#include "cli/tools/output_file.h"
#include "cli/tools/pack_array.h"
#include "cli/tools/view/view_data.h"
#include "formats/mesh/mesh_import.h"

namespace vps::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxBodies = 10'000;
constexpr double kDrawnTriangles = 1.5e6;  // of all bodies together
constexpr double kLeastTriangles = 100;    // of a surface
constexpr double kFarthest = 1e12;         // [m]
constexpr double kFrameBytes = 9e6;        // of poses and contacts on the page, before base64
constexpr double kLongPath = 3;            // times the bodies' box at the start; the view follows longer ones
constexpr std::size_t kListed = 12;        // surfaces with a note in the facts

[[noreturn]] void refuse(const std::string& reason) {
  throw ImportError(ImportError::Kind::bad_input, reason + "; see docs/motion.md");
}

double number(const Json& value, const std::string& what) {
  if (!value.is_number()) refuse(what + " is not a number");
  const double x = value.get<double>();
  if (!(std::abs(x) <= kFarthest)) refuse(what + " is not a number below 1e12");
  return x;
}

const Json& member(const Json& object, const char* key, Json::value_t type) {
  const auto found = object.find(key);
  if (found == object.end() || found->type() != type)
    refuse(fmt::format("it has no {} \"{}\"", type == Json::value_t::array ? "array" : "text", key));
  return *found;
}

// An unknown key is probably mistyped.
void refuse_unknown(const Json& object, const std::string& what, const std::vector<std::string>& known) {
  for (const auto& [key, value] : object.items()) {
    if (std::find(known.begin(), known.end(), key) == known.end())
      refuse(fmt::format("{} has an unknown key \"{}\"; there are {}", what, key, fmt::join(known, ", ")));
  }
}

Json read_json(const std::filesystem::path& path) {
  check_is_file(path, "a recorded motion");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ImportError(ImportError::Kind::io, "it may not be read; check its permissions");
  Json json = Json::parse(file, nullptr, false);
  if (json.is_discarded()) refuse("it is not JSON");
  if (!json.is_object() || json.value("format", Json()) != "vps-motion 1")
    refuse("it is not a motion: \"format\" is not \"vps-motion 1\"");
  return json;
}

struct Box {
  std::array<double, 3> low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  [[nodiscard]] bool is_empty() const { return low[0] > high[0]; }
  [[nodiscard]] double diagonal() const { return std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]); }
  void add(const std::array<double, 3>& centre, double radius) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], centre[k] - radius);
      high[k] = std::max(high[k], centre[k] + radius);
    }
  }
};

// A body's bounding sphere in its own frame, for the camera.
struct Body {
  std::array<double, 3> centre{};
  double radius = 0;
  bool is_box = false;
  bool is_fixed = false;  ///< never moves
};

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : folder_(path.parent_path()), in_(read_json(path)) {}

  Json read() {
    refuse_unknown(in_, "it", {"format", "title", "up", "bodies", "times", "poses", "contacts"});
    const Json& bodies = member(in_, "bodies", Json::value_t::array);
    if (bodies.empty() || bodies.size() > kMaxBodies) refuse(fmt::format("it has not 1 to {} bodies", kMaxBodies));
    out_["title"] = in_.contains("title") ? member(in_, "title", Json::value_t::string).get<std::string>() : "Motion";
    out_["about"] = "";
    out_["facts"] = Json::array();
    const std::string up = in_.contains("up") ? member(in_, "up", Json::value_t::string).get<std::string>() : "z";
    if (up != "x" && up != "y" && up != "z") refuse("\"up\" is not x, y or z");
    out_["up"] = up;
    for (std::size_t i = 0; i < bodies.size(); ++i) read_body(bodies[i], fmt::format("body {}", i + 1));
    read_frames();
    frame_view();
    read_contacts();
    pack_frames();
    make_surfaces();
    describe();
    return std::move(out_);
  }

 private:
  void read_body(const Json& body, const std::string& what) {
    if (!body.is_object()) refuse(what + " is not an object");
    refuse_unknown(body, what, {"name", "asset", "box", "sphere"});
    Body shape;
    Json& out = out_["bodies"].emplace_back(Json::object());
    out["name"] = body.contains("name") ? member(body, "name", Json::value_t::string).get<std::string>() : what;
    if (body.contains("asset") + body.contains("box") + body.contains("sphere") != 1)
      refuse(what + " has not one of \"asset\", \"box\" and \"sphere\"");
    if (body.contains("box")) {
      const Json& half = member(body, "box", Json::value_t::array);
      if (half.size() != 3) refuse(what + ": a box is three half extents");
      std::array<double, 3> extents;
      for (std::size_t k = 0; k < 3; ++k) extents[k] = number(half[k], what + ": a half extent");
      if (!(std::min({extents[0], extents[1], extents[2]}) > 0)) refuse(what + ": a half extent is not positive");
      shape.radius = std::hypot(extents[0], extents[1], extents[2]);
      shape.is_box = true;
      out["box"] = extents;
      out["kind"] = fmt::format("box of {} x {} x {}", bake::format_length(2 * extents[0]),
                                bake::format_length(2 * extents[1]), bake::format_length(2 * extents[2]));
    } else if (body.contains("sphere")) {
      shape.radius = number(body["sphere"], what + ": the radius");
      if (!(shape.radius > 0)) refuse(what + ": the radius is not positive");
      out["sphere"] = shape.radius;
      out["kind"] = fmt::format("sphere of radius {}", bake::format_length(shape.radius));
    } else {
      read_asset(member(body, "asset", Json::value_t::string).get<std::string>(), what, shape);
    }
    bodies_.push_back(shape);
  }

  void read_asset(const std::string& name, const std::string& what, Body& shape) {
    const auto [found, is_new] = assets_.try_emplace(name, assets_.size());
    if (is_new) {
      opened_.emplace_back();
      Status status = Asset::open((folder_ / name).string().c_str(), opened_.back());
      if (status == Status::ok) status = opened_.back().verify();
      if (status != Status::ok)
        throw ImportError(status == Status::cannot_open ? ImportError::Kind::io : ImportError::Kind::bad_input,
                          fmt::format("{}: asset {}: {}", what, name, vps::describe(status)));
      if (!opened_.back().has_voxelmap()) refuse(fmt::format("{}: asset {} has no voxelmap to draw", what, name));
    }
    const AssetInfo& info = opened_[found->second].info();
    double squared = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      shape.centre[k] = (info.bounds_min[k] + info.bounds_max[k]) / 2;
      squared += std::pow((info.bounds_max[k] - info.bounds_min[k]) / 2, 2);
    }
    shape.radius = std::sqrt(squared);
    Json& out = out_["bodies"].back();
    out["surface"] = found->second;
    out["kind"] = asset_name(name);
  }

  void read_frames() {
    const Json& times = member(in_, "times", Json::value_t::array);
    const Json& poses = member(in_, "poses", Json::value_t::array);
    if (times.empty()) refuse("\"times\" is empty: a motion has one frame at least");
    if (times.size() != poses.size())
      refuse(fmt::format("\"times\" has {} frames and \"poses\" has {}", times.size(), poses.size()));
    for (std::size_t f = 0; f < times.size(); ++f) {
      const std::string frame = fmt::format("frame {}", f + 1);
      times_.push_back(number(times[f], frame + ": the time"));
      if (f > 0 && !(times_[f] > times_[f - 1])) refuse(frame + ": its time is not after the one before");
      if (!poses[f].is_array() || poses[f].size() != bodies_.size()) refuse(frame + " has not a pose for each body");
      for (std::size_t b = 0; b < bodies_.size(); ++b) read_pose(poses[f][b], fmt::format("{}, body {}", frame, b + 1));
    }
    const std::size_t row = 7 * bodies_.size();
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      bool fixed = times_.size() > 1;
      for (std::size_t f = 1; f < times_.size() && fixed; ++f) {
        const auto first = poses_.begin() + std::ptrdiff_t(7 * b);
        fixed = std::equal(first, first + 7, first + std::ptrdiff_t(f * row));
      }
      out_["bodies"][b]["fixed"] = fixed;
      bodies_[b].is_fixed = fixed || times_.size() == 1;
    }
  }

  void read_pose(const Json& pose, const std::string& what) {
    if (!pose.is_array() || pose.size() != 7) refuse(what + ": a pose is seven numbers, x y z qx qy qz qw");
    std::array<double, 7> p;
    for (std::size_t k = 0; k < 7; ++k) p[k] = number(pose[k], what + ": a pose");
    const double length = std::sqrt(p[3] * p[3] + p[4] * p[4] + p[5] * p[5] + p[6] * p[6]);
    if (!(std::abs(length - 1) <= 1e-3)) refuse(what + ": the quaternion is not of unit length");
    for (std::size_t k = 0; k < 7; ++k) poses_.push_back(static_cast<float>(k < 3 ? p[k] : p[k] / length));
  }

  // Centre of a body in a frame of the motion, world frame. [m]
  [[nodiscard]] std::array<double, 3> centre_of(std::size_t body, std::size_t frame) const {
    const Eigen::Map<const Eigen::Matrix<float, 7, 1>> pose(&poses_[7 * (frame * bodies_.size() + body)]);
    const Eigen::Vector3d position = pose.head<3>().cast<double>();
    const Eigen::Quaterniond orientation(Eigen::Vector4d(pose.tail<4>().cast<double>()));  // x, y, z, w
    const Eigen::Vector3d at = position + orientation * Eigen::Vector3d(bodies_[body].centre.data());
    return {at.x(), at.y(), at.z()};
  }

  // Bounds of the bodies in the first `frames` frames. Fixed boxes, mostly floors and walls, count only when there is
  // nothing else.
  [[nodiscard]] Box box_of(std::size_t frames) const {
    Box all, seen;
    for (std::size_t f = 0; f < frames; ++f) {
      for (std::size_t b = 0; b < bodies_.size(); ++b) {
        const std::array<double, 3> at = centre_of(b, f);
        all.add(at, bodies_[b].radius);
        if (!bodies_[b].is_box || !bodies_[b].is_fixed) seen.add(at, bodies_[b].radius);
      }
    }
    return seen.is_empty() ? all : seen;
  }

  // Sets the box that the page shows: the whole path, or only the start where the path is much longer than the bodies,
  // which would be tiny. The view then follows them.
  void frame_view() {
    const Box start = box_of(1), path = box_of(times_.size());
    const bool is_long = path.diagonal() > kLongPath * start.diagonal();
    out_["bounds_min"] = is_long ? start.low : path.low;
    out_["bounds_max"] = is_long ? start.high : path.high;
    if (is_long) out_["path"] = {path.low, path.high};
  }

  void read_contacts() {
    if (!in_.contains("contacts")) return;
    const Json& contacts = member(in_, "contacts", Json::value_t::array);
    if (contacts.size() != times_.size()) refuse("\"contacts\" has not as many frames as \"times\"");
    contact_first_ = {0};
    for (std::size_t f = 0; f < contacts.size(); ++f) {
      const std::string what = fmt::format("frame {}: a contact", f + 1);
      if (!contacts[f].is_array()) refuse(fmt::format("frame {} has no array of contacts", f + 1));
      for (const Json& contact : contacts[f]) {
        if (!contact.is_array() || contact.size() != 3) refuse(what + " is three numbers");
        for (const Json& x : contact) contacts_.push_back(static_cast<float>(number(x, what)));
      }
      contact_first_.push_back(static_cast<std::uint32_t>(contacts_.size() / 3));
      most_contacts_ = std::max<std::size_t>(most_contacts_, contacts[f].size());
    }
  }

  // Packs every frame, or every n-th and the last, to keep the page small.
  void pack_frames() {
    const double bytes = double(poses_.size() + contacts_.size()) * sizeof(float);
    stride_ = static_cast<std::size_t>(std::ceil(bytes / kFrameBytes));
    const std::size_t row = 7 * bodies_.size();
    std::vector<double> times;
    std::vector<float> poses, places;
    std::vector<std::uint32_t> first = {0};
    for (std::size_t f = 0; f < times_.size(); ++f) {
      if (f % stride_ != 0 && f + 1 < times_.size()) continue;
      times.push_back(times_[f]);
      const auto pose = poses_.begin() + std::ptrdiff_t(f * row);
      poses.insert(poses.end(), pose, pose + std::ptrdiff_t(row));
      if (contact_first_.empty()) continue;
      places.insert(places.end(), contacts_.begin() + 3 * std::ptrdiff_t(contact_first_[f]),
                    contacts_.begin() + 3 * std::ptrdiff_t(contact_first_[f + 1]));
      first.push_back(static_cast<std::uint32_t>(places.size() / 3));
    }
    out_["times"] = pack_array(times);
    out_["poses"] = pack_array(poses);
    if (!contact_first_.empty()) out_["contacts"] = {{"first", pack_array(first)}, {"places", pack_array(places)}};
  }

  void make_surfaces() {
    out_["surfaces"] = Json::array();
    if (opened_.empty()) return;
    std::size_t drawn = 0;
    for (const Json& body : out_["bodies"]) drawn += body.contains("surface") ? 1 : 0;
    const double triangles = std::min(double(kPageTriangles) / double(opened_.size()), kDrawnTriangles / double(drawn));
    for (const Asset& asset : opened_) {
      Json surface = pack_field_surface(asset, static_cast<std::size_t>(std::max(triangles, kLeastTriangles)));
      if (surface.contains("missing")) {
        surface = {{"low", asset.info().bounds_min},
                   {"high", asset.info().bounds_max},
                   {"note", "Thinner than its voxels, so that its field has no surface: its bounding box is drawn."}};
      }
      out_["surfaces"].push_back(std::move(surface));
    }
  }

  void describe() {
    const double length = times_.back() - times_.front();
    const std::size_t bodies = bodies_.size();
    out_["about"] =
        fmt::format("{} bod{} over {:.4g} s, recorded from a simulation.", bodies, bodies == 1 ? "y" : "ies", length);
    Json& facts = out_["facts"];
    facts.push_back({"Length", fmt::format("{:.4g} s", length)});
    std::string frames = fmt::format("{}", times_.size());
    if (stride_ > 1) frames += fmt::format("; one in {} is on this page, to keep it small", stride_);
    facts.push_back({"Frames", frames});
    if (in_.contains("contacts")) facts.push_back({"Contacts", fmt::format("{} at most in a frame", most_contacts_)});
    for (const auto& [name, number] : assets_) {
      if (number < kListed)
        facts.push_back({fmt::format("Surface of {}", asset_name(name)), out_["surfaces"][number]["note"]});
    }
    for (Json& fact : origin_facts()) facts.push_back(std::move(fact));
  }

  std::filesystem::path folder_;
  Json in_, out_;
  std::map<std::string, std::size_t> assets_;
  std::vector<Asset> opened_;
  std::vector<Body> bodies_;
  std::vector<double> times_;
  std::vector<float> poses_;
  std::vector<std::uint32_t> contact_first_;  ///< of each frame; empty when the motion has no contacts
  std::vector<float> contacts_;
  std::size_t most_contacts_ = 0;
  std::size_t stride_ = 1;  ///< from one frame of the page to the next
};

}  // namespace

Json motion_data(const std::filesystem::path& motion) {
  return Reader(motion).read();
}

}  // namespace vps::cli
