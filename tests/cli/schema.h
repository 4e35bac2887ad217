// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Validates JSON files against the schemas of docs/schemas with Debian's python3-jsonschema.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace vps::test {

/// True where the check can run.
inline bool has_schema_check() {
  return std::system("/usr/bin/python3 -c 'import jsonschema' >/dev/null 2>&1") == 0;
}

/// @param schema  name in docs/schemas
inline bool follows_schema(const std::filesystem::path& json, const std::string& schema) {
  const std::string command =
      "/usr/bin/python3 -c 'import json, jsonschema, sys; schema = json.load(open(sys.argv[2])); "
      "jsonschema.Draft202012Validator.check_schema(schema); "
      "jsonschema.Draft202012Validator(schema).validate(json.load(open(sys.argv[1])))' " +
      json.string() + " " + VPS_DOCS + "/schemas/" + schema + " >/dev/null 2>&1";
  return std::system(command.c_str()) == 0;
}

}  // namespace vps::test

#define VPS_SCHEMA_CHECK_OR_SKIP() \
  if (!vps::test::has_schema_check()) GTEST_SKIP() << "needs python3-jsonschema, which is absent"
