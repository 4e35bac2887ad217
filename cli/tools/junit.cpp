// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/junit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <pugixml.hpp>
#include <sstream>

#include "cli/tools/utf8.h"

namespace vps::cli {
namespace {

using nlohmann::ordered_json;

// XML 1.0 has no control characters, and pugixml would write them as references that no parser takes.
std::string xml_text(std::string text) {
  for (char& c : text) {
    if (std::iscntrl(static_cast<unsigned char>(c)) != 0 && c != '\n') c = '?';
  }
  return valid_utf8(text);
}

void set(pugi::xml_node node, const char* name, const std::string& value) {
  node.append_attribute(name).set_value(xml_text(value).c_str());
}

void set_time(pugi::xml_node node, const std::optional<double>& seconds) {
  if (seconds) set(node, "time", fmt::format("{:.3f}", *seconds));
}

void add_properties(pugi::xml_node suite, const ordered_json& provenance) {
  pugi::xml_node properties = suite.append_child("properties");
  const ordered_json flat = provenance.flatten();
  for (const auto& [key, value] : flat.items()) {
    std::string name = key.substr(1);  // without the first /
    std::replace(name.begin(), name.end(), '/', '.');
    pugi::xml_node property = properties.append_child("property");
    set(property, "name", name);
    set(property, "value", value.is_string() ? value.get<std::string>() : value.dump());
  }
}

void add_case(pugi::xml_node suite, const JUnitCase& one) {
  pugi::xml_node node = suite.append_child("testcase");
  set(node, "classname", one.classname);
  set(node, "name", one.name);
  set_time(node, one.seconds);
  if (one.failure) {
    pugi::xml_node failure = node.append_child("failure");
    set(failure, "message", one.failure->message);
    failure.text().set(xml_text(one.failure->text).c_str());
  }
  if (one.skipped) set(node.append_child("skipped"), "message", *one.skipped);
  node.append_child("system-out").text().set(xml_text(one.output).c_str());
}

void add_suite(pugi::xml_node suites, const JUnitSuite& suite, const ordered_json& provenance) {
  const auto count = [&](const auto& is_counted) {
    return std::to_string(std::count_if(suite.cases.begin(), suite.cases.end(), is_counted));
  };
  pugi::xml_node node = suites.append_child("testsuite");
  set(node, "name", suite.name);
  set(node, "tests", std::to_string(suite.cases.size()));
  set(node, "failures", count([](const JUnitCase& one) { return one.failure.has_value(); }));
  set(node, "errors", "0");
  set(node, "skipped", count([](const JUnitCase& one) { return one.skipped.has_value(); }));
  set_time(node, suite.seconds);
  add_properties(node, provenance);
  for (const JUnitCase& one : suite.cases) add_case(node, one);
}

}  // namespace

std::string to_junit(const std::vector<JUnitSuite>& suites, const ordered_json& provenance) {
  pugi::xml_document document;
  pugi::xml_node declaration = document.append_child(pugi::node_declaration);
  set(declaration, "version", "1.0");
  set(declaration, "encoding", "UTF-8");
  pugi::xml_node root = document.append_child("testsuites");
  for (const JUnitSuite& suite : suites) add_suite(root, suite, provenance);
  std::ostringstream out;
  document.save(out, "  ", pugi::format_indent, pugi::encoding_utf8);
  return out.str();
}

}  // namespace vps::cli
