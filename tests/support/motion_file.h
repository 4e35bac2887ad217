// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Records a Bullet simulation for `vpsbake view --motion`: docs/motion.md.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "runtime/bullet/vps_bullet.h"

namespace vps::test {

class MotionFile {
 public:
  /// @param asset  file of the shape; written as a path relative to the motion file's folder
  void add(const char* name, const btRigidBody& body, const bullet::Shape& shape, const std::filesystem::path& asset) {
    bodies_.push_back({&body, shape.asset_frame(), name, {}, asset});
  }
  void add(const char* name, const btRigidBody& body, const btBoxShape& box) {
    bodies_.push_back({&body, btTransform::getIdentity(), name, box.getHalfExtentsWithMargin(), {}});
  }

  /// Adds a frame with the present poses. @param contacts  of the whole world
  void record(double time, const std::vector<btManifoldPoint>& contacts) {
    const std::string comma = frames_++ == 0 ? "\n" : ",\n";
    print(times_, "%s%.6g", frames_ == 1 ? "" : ",", time);
    poses_ += comma + "[";
    for (const Body& body : bodies_) {
      const btTransform at = body.body->getWorldTransform() * body.frame;
      const btVector3& p = at.getOrigin();
      const btQuaternion q = at.getRotation();
      print(poses_, "%s[%.7g,%.7g,%.7g,%.7g,%.7g,%.7g,%.7g]", &body == bodies_.data() ? "" : ",", double(p.x()),
            double(p.y()), double(p.z()), double(q.x()), double(q.y()), double(q.z()), double(q.w()));
    }
    poses_ += "]";
    contacts_ += comma + "[";
    for (const btManifoldPoint& point : contacts) {
      const btVector3& p = point.getPositionWorldOnB();
      print(contacts_, "%s[%.7g,%.7g,%.7g]", &point == contacts.data() ? "" : ",", double(p.x()), double(p.y()),
            double(p.z()));
    }
    contacts_ += "]";
  }

  /// @param up  axis opposite to gravity. @return false when the file cannot be written
  [[nodiscard]] bool write(const std::filesystem::path& path, const char* title, char up) const {
    std::string text;
    print(text, "{\"format\":\"vps-motion 1\",\"title\":\"%s\",\"up\":\"%c\",\"bodies\":[", title, up);
    for (const Body& body : bodies_) {
      print(text, "%s\n{\"name\":\"%s\",", &body == bodies_.data() ? "" : ",", body.name);
      if (body.asset.empty()) {
        print(text, "\"box\":[%.7g,%.7g,%.7g]}", double(body.half.x()), double(body.half.y()), double(body.half.z()));
      } else {
        const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
        text += "\"asset\":\"" + std::filesystem::proximate(body.asset, folder).generic_string() + "\"}";
      }
    }
    text += "],\n\"times\":[" + times_ + "],\n\"poses\":[" + poses_ + "],\n\"contacts\":[" + contacts_ + "]}\n";
    std::FILE* const file = std::fopen(path.c_str(), "wb");
    if (file == nullptr) return false;
    const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
    return std::fclose(file) == 0 && written;
  }

 private:
  struct Body {
    const btRigidBody* body;
    btTransform frame;  ///< of the asset, in the body
    const char* name;
    btVector3 half;
    std::filesystem::path asset;
  };
  template <class... Values>
  static void print(std::string& text, const char* format, Values... values) {
    char line[256];
    const int length = std::snprintf(line, sizeof line, format, values...);
    text.append(line, static_cast<std::size_t>(std::max(0, std::min(length, int(sizeof line) - 1))));
  }
  std::vector<Body> bodies_;
  int frames_ = 0;
  std::string times_, poses_, contacts_;
};

}  // namespace vps::test
