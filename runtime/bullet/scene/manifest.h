// SPDX-License-Identifier: Zlib
/// @file Values of a scene's manifest, checked as they are read. Schema: docs/schemas/scene_manifest.schema.json.
/// Internal.
#pragma once

#include <LinearMath/btTransform.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/scene_manifest.h"

namespace vps::bullet::manifest {

using Json = nlohmann::json;

/// Thrown when a scene is refused, and caught in load_scene.
struct Refusal {
  std::string reason;
};

using scene_manifest::kFarthest;
using scene_manifest::kLeast;

/// A value of the manifest and its name for messages, such as bodies[3].mass.
class Value {
 public:
  Value(const Json& json, std::string name) : json_(&json), name_(std::move(name)) {}

  [[noreturn]] void refuse(const std::string& what) const { throw Refusal{name_ + " " + what}; }

  [[nodiscard]] bool has(const char* key) const { return json_->is_object() && json_->contains(key); }
  [[nodiscard]] Value operator[](const char* key) const {
    if (!has(key)) throw Refusal{inner(key) + " is missing"};
    return {json_->at(key), inner(key)};
  }
  /// Refuses all other keys: a reader that ignored one would load a different scene.
  void allow_only(std::initializer_list<std::string_view> keys) const {
    if (!json_->is_object()) return;
    for (const auto& [key, value] : json_->items()) {
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) throw Refusal{inner(key) + " is not a known key"};
    }
  }
  /// @param most  largest number of values
  [[nodiscard]] std::vector<Value> list(std::size_t most = scene_manifest::kMostBytes) const {
    if (!json_->is_array()) refuse("is not a list");
    if (json_->size() > most) refuse("has more than " + std::to_string(most) + " entries");
    std::vector<Value> values;
    for (const Json& one : *json_) values.emplace_back(one, name_ + "[" + std::to_string(values.size()) + "]");
    return values;
  }
  [[nodiscard]] std::string text() const {
    if (!json_->is_string()) refuse("is not a text");
    auto text = json_->get<std::string>();
    if (text.size() > scene_manifest::kLongestText)
      refuse("is longer than " + std::to_string(scene_manifest::kLongestText) + " bytes");
    return text;
  }
  /// A file in the manifest's folder or below.
  [[nodiscard]] std::filesystem::path file() const {
    const std::string name = text();
    if (name.empty() || name.find('\0') != std::string::npos) refuse("is not the name of a file");
    const std::filesystem::path path = name;
    if (path.is_absolute() || std::find(path.begin(), path.end(), "..") != path.end())
      refuse("leaves the manifest's folder; plan the scene again");
    return path.lexically_normal();
  }
  [[nodiscard]] double number(double low, double high) const {
    const double x = json_->is_number() ? json_->get<double>() : std::nan("");
    if (!(x >= low && x <= high)) refuse("is not a number in its range");
    return x;
  }
  [[nodiscard]] std::int64_t integer(std::int64_t low, std::int64_t high) const {
    if (!json_->is_number_integer()) refuse("is not a whole number");
    const auto x = json_->get<std::int64_t>();
    if (x < low || x > high || (json_->is_number_unsigned() && x < 0)) refuse("is out of its range");
    return x;
  }
  [[nodiscard]] btVector3 vector(double low, double high) const {
    const std::vector<Value> values = list();
    if (values.size() != 3) refuse("has not three numbers");
    btVector3 v;
    for (int axis = 0; axis < 3; ++axis)
      v[axis] = static_cast<btScalar>(values[static_cast<std::size_t>(axis)].number(low, high));
    return v;
  }
  [[nodiscard]] btQuaternion orientation() const {
    const std::vector<Value> values = list();
    if (values.size() != 4) refuse("is not a quaternion x, y, z, w");
    double q[4];
    double squares = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      q[i] = values[i].number(-2, 2);
      squares += q[i] * q[i];
    }
    if (!(std::abs(squares - 1) < 1e-3)) refuse("is not of unit length");
    const double scale = 1 / std::sqrt(squares);
    const auto at = [&](int i) { return static_cast<btScalar>(scale * q[i]); };
    return {at(0), at(1), at(2), at(3)};
  }
  [[nodiscard]] btTransform pose() const {
    return btTransform(has("orientation") ? (*this)["orientation"].orientation() : btQuaternion::getIdentity(),
                       has("position") ? (*this)["position"].vector(-kFarthest, kFarthest) : btVector3(0, 0, 0));
  }

 private:
  [[nodiscard]] std::string inner(const std::string& key) const { return name_.empty() ? key : name_ + "." + key; }

  const Json* json_;
  std::string name_;
};

template <class T>
T choose(const Value& value, std::initializer_list<std::pair<const char*, T>> choices) {
  const std::string text = value.text();
  for (const auto& [name, choice] : choices) {
    if (text == name) return choice;
  }
  value.refuse("is none of what it may be");
}

/// @throw Refusal when the file is missing, too large, unreadable or not a JSON object
[[nodiscard]] Json read_json(const std::string& path);

}  // namespace vps::bullet::manifest
