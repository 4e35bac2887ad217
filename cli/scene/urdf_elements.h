// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The elements of a URDF as they are written: their lines, which urdfdom does not keep, and what it passes over.
#pragma once

#include <tinyxml.h>

#include <string>
#include <vector>

#include "cli/scene/scene.h"

namespace vps::cli {

class UrdfElements {
 public:
  /// @throw SceneError when this is not XML in UTF-8, has no robot, lacks an attribute, or has an element or attribute
  /// whose name is almost that of another
  UrdfElements(std::string file, const std::string& text);

  [[nodiscard]] Place of_link(const std::string& name) const;
  /// @param number  of the collision element in its link
  [[nodiscard]] Place of_geometry(const std::string& link, std::size_t number) const;
  /// Of the first link or joint that one of urdfdom's messages names; the robot's when none does.
  [[nodiscard]] Place of_messages(const std::vector<std::string>& messages) const;
  /// What of a robot's bodies is left out, one sentence for each kind of element.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  [[nodiscard]] const TiXmlElement* find(const char* kind, const std::string& name) const;
  [[nodiscard]] Place at(const TiXmlElement& element) const { return {file_, element.Row()}; }

  std::string file_;
  TiXmlDocument document_;
  const TiXmlElement* robot_ = nullptr;
  std::vector<std::string> notes_;
};

}  // namespace vps::cli
