// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The XML elements of a URDF: their lines, which urdfdom does not keep, and the elements that it ignores.
#pragma once

#include <tinyxml.h>

#include <string>
#include <vector>

#include "cli/scene/scene.h"

namespace vps::cli {

class UrdfElements {
 public:
  /// @throw SceneError when this is not XML in UTF-8, has no robot, lacks an attribute, or has an element or attribute
  /// with a mistyped name
  UrdfElements(std::string file, const std::string& text);

  [[nodiscard]] Place of_link(const std::string& name) const;
  /// @param number  index of the collision element in its link
  [[nodiscard]] Place of_geometry(const std::string& link, std::size_t number) const;
  /// Place of the first link or joint that urdfdom's messages name; the robot's place when they name none.
  [[nodiscard]] Place of_messages(const std::vector<std::string>& messages) const;
  /// Names the elements that are left out, one sentence for each kind.
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
