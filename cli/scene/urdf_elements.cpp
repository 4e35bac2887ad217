// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/urdf_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "cli/tools/nearest_name.h"

namespace vps::cli {
namespace {

// tinyxml recurses into nested elements: a file of opening tags alone would exhaust the stack.
void refuse_deep(const std::string& file, const std::string& text) {
  constexpr int kDeepest = 1000;  // a URDF has 6
  int depth = 0;
  int line = 1;
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text[i] == '\n') ++line;
    if (text[i] == '<' && text[i + 1] != '!' && text[i + 1] != '?') depth += text[i + 1] == '/' ? -1 : 1;
    if (text[i] == '/' && text[i + 1] == '>') --depth;
    if (depth > kDeepest) throw SceneError({file, line}, "the elements are nested too deeply for a URDF");
  }
}

// Names of links and meshes are written to JSON, which needs UTF-8.
void refuse_non_utf8(const std::string& file, const std::string& text) {
  int line = 1;
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(at < text.size() ? text[at] : 0); };
    const unsigned lead = byte(i);
    if (lead == '\n') ++line;
    const std::size_t size = lead < 0x80 ? 1 : (lead < 0xC2 ? 0 : (lead < 0xE0 ? 2 : (lead < 0xF0 ? 3 : 4)));
    bool good = size > 0 && lead < 0xF5 && lead != 0;
    for (std::size_t k = 1; k < size; ++k) good = good && (byte(i + k) & 0xC0) == 0x80;
    // Refuses overlong forms, surrogates and code points above U+10FFFF.
    if (lead == 0xE0) good = good && byte(i + 1) >= 0xA0;
    if (lead == 0xED) good = good && byte(i + 1) < 0xA0;
    if (lead == 0xF0) good = good && byte(i + 1) >= 0x90;
    if (lead == 0xF4) good = good && byte(i + 1) < 0x90;
    if (!good) throw SceneError({file, line}, "this is not a text in UTF-8; save it as one");
    i += size;
  }
}

// The children and attributes that a URDF's element may have, as far as they matter for collisions.
struct Known {
  const char* name;
  std::vector<std::string> children;
  std::vector<std::string> needed;    // attributes
  std::vector<std::string> optional;  // attributes
  std::vector<std::string> others;    // children that do not matter for collisions
};

// Null for elements that are not checked.
const Known* find_known(const std::string& name) {
  static const std::vector<Known> kElements = {
      {"robot",
       {"link", "joint"},
       {},
       {"name", "version"},
       {"material", "gazebo", "transmission", "sensor", "ros2_control"}},
      {"link", {"inertial", "collision"}, {"name"}, {"type"}, {"visual", "gazebo", "sensor"}},
      {"joint",
       {"origin", "parent", "child", "axis", "limit", "mimic", "dynamics", "calibration", "safety_controller"},
       {"name", "type"},
       {},
       {"gazebo"}},
      {"collision", {"geometry", "origin"}, {}, {"name", "group"}, {}},
      {"inertial", {"mass", "inertia", "origin"}, {}, {}, {}},
      {"geometry", {"mesh", "box", "sphere", "cylinder"}, {}, {}, {}},
      {"mesh", {}, {"filename"}, {"scale"}, {}},
      {"box", {}, {"size"}, {}, {}},
      {"sphere", {}, {"radius"}, {}, {}},
      {"cylinder", {}, {"radius", "length"}, {}, {}},
      {"origin", {}, {}, {"xyz", "rpy"}, {}},
      {"mass", {}, {"value"}, {}, {}},
      {"inertia", {}, {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}, {}, {}},
      {"parent", {}, {"link"}, {}, {}},
      {"child", {}, {"link"}, {}, {}},
  };
  const auto it = std::find_if(kElements.begin(), kElements.end(), [&](const Known& one) { return name == one.name; });
  return it == kElements.end() ? nullptr : &*it;
}

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Names of other programs, such as sim:friction.
bool has_namespace(const std::string& name) {
  return name.find(':') != std::string::npos || name == "xmlns";
}

// Checks the known elements of a robot.
class Checker {
 public:
  explicit Checker(const std::string& file) : file_(file) {}

  void check(const TiXmlElement& element) {
    const Known* const known = find_known(element.ValueStr());
    if (known == nullptr) return;
    check_attributes(element, *known);
    for (const auto* child = element.FirstChildElement(); child != nullptr; child = child->NextSiblingElement()) {
      const std::string& name = child->ValueStr();
      if (has(known->children, name)) {
        check(*child);
      } else if (name.starts_with("xacro:")) {
        throw SceneError({file_, child->Row()},
                         fmt::format("<{}>: this is a xacro file; make a URDF of it with the program xacro", name));
      } else if (!has(known->others, name) && !has_namespace(name)) {
        leave_out(*child, *known);
      }
    }
  }
  [[nodiscard]] std::vector<std::string> notes() const { return notes_; }

 private:
  void leave_out(const TiXmlElement& element, const Known& parent) {
    const std::string& name = element.ValueStr();
    if (const auto meant = nearest_name(name, parent.children)) {
      throw SceneError({file_, element.Row()},
                       fmt::format("<{}> has no <{}>; did you mean <{}>?", parent.name, name, *meant));
    }
    if (left_out_.emplace(parent.name, name).second)
      notes_.push_back(fmt::format("{}:{}: <{}> in <{}> is left out", file_, element.Row(), name, parent.name));
  }

  void check_attributes(const TiXmlElement& element, const Known& known) const {
    std::vector<std::string> absent;
    for (const auto* names : {&known.needed, &known.optional}) {
      for (const std::string& name : *names) {
        if (element.Attribute(name) == nullptr) absent.push_back(name);
      }
    }
    const auto refuse = [&](const std::string& reason) { throw SceneError({file_, element.Row()}, reason); };
    for (const TiXmlAttribute* one = element.FirstAttribute(); one != nullptr; one = one->Next()) {
      const std::string name = one->NameTStr();
      if (has(known.needed, name) || has(known.optional, name) || has_namespace(name)) continue;
      if (const auto meant = nearest_name(name, absent))
        refuse(fmt::format("<{}> has no {}; did you mean {}?", known.name, name, *meant));
    }
    for (const std::string& name : known.needed) {
      if (has(absent, name)) refuse(fmt::format("<{}> needs {}", known.name, fmt::join(known.needed, ", ")));
    }
  }

  const std::string& file_;
  std::set<std::pair<std::string, std::string>> left_out_;  // parents and children
  std::vector<std::string> notes_;
};

}  // namespace

UrdfElements::UrdfElements(std::string file, const std::string& text) : file_(std::move(file)) {
  refuse_non_utf8(file_, text);
  refuse_deep(file_, text);
  document_.Parse(text.c_str(), nullptr, TIXML_ENCODING_UTF8);
  if (document_.Error()) {
    throw SceneError({file_, std::max(1, document_.ErrorRow())},
                     fmt::format("this is not XML: {}", document_.ErrorDesc()));
  }
  robot_ = document_.FirstChildElement("robot");
  if (robot_ == nullptr) throw SceneError({file_, 1}, "this is not a URDF: it has no <robot>; see docs/scene.md");
  Checker checker(file_);
  checker.check(*robot_);
  notes_ = checker.notes();
}

const TiXmlElement* UrdfElements::find(const char* kind, const std::string& name) const {
  for (const TiXmlElement* e = robot_->FirstChildElement(kind); e != nullptr; e = e->NextSiblingElement(kind)) {
    const char* const attribute = e->Attribute("name");
    if (attribute != nullptr && name == attribute) return e;
  }
  return nullptr;
}

Place UrdfElements::of_link(const std::string& name) const {
  const TiXmlElement* const link = find("link", name);
  return at(link != nullptr ? *link : *robot_);
}

Place UrdfElements::of_geometry(const std::string& name, std::size_t number) const {
  const TiXmlElement* const link = find("link", name);
  const TiXmlElement* collision = link != nullptr ? link->FirstChildElement("collision") : nullptr;
  for (std::size_t i = 0; i < number && collision != nullptr; ++i)
    collision = collision->NextSiblingElement("collision");
  if (collision == nullptr) return of_link(name);
  const TiXmlElement* const geometry = collision->FirstChildElement("geometry");
  const TiXmlElement* const inner = geometry != nullptr ? geometry->FirstChildElement() : nullptr;
  return at(inner != nullptr ? *inner : *collision);
}

Place UrdfElements::of_messages(const std::vector<std::string>& messages) const {
  for (const std::string& message : messages) {
    for (std::size_t begin = message.find_first_of("['"); begin != std::string::npos;
         begin = message.find_first_of("['", begin + 1)) {
      const std::size_t end = message.find(message[begin] == '[' ? ']' : '\'', begin + 1);
      if (end == std::string::npos) break;
      const std::string name = message.substr(begin + 1, end - begin - 1);
      for (const char* const kind : {"link", "joint"}) {
        if (const TiXmlElement* const element = find(kind, name)) return at(*element);
      }
    }
  }
  return at(*robot_);
}

}  // namespace vps::cli
