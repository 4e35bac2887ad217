// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/bake_arguments.h"

#include <algorithm>

namespace vps::cli {
namespace {

ImportOptions complete_import(const BakeArguments& arguments) {
  ImportOptions options = arguments.import_options;
  options.unit = (arguments.unit > 0 ? arguments.unit : 1) * arguments.scale;
  return options;
}

}  // namespace

bake::BakeSettings complete_settings(const BakeArguments& arguments) {
  const auto has = [](const std::vector<std::string>& list, const char* name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  bake::BakeSettings settings{arguments.options, complete_import(arguments), arguments.max_error};
  bake::BakeOptions& options = settings.options;
  options.layers = has(arguments.fields, "layers");
  options.scaled = has(arguments.fields, "scaled");
  options.real = has(arguments.fields, "real");
  options.voxelmap = has(arguments.parts, "voxelmap");
  options.pointshell = has(arguments.parts, "pointshell");
  return settings;
}

ImportedMesh import_with(const BakeArguments& arguments) {
  return import_mesh(arguments.mesh, complete_import(arguments));
}

std::function<bake::BakeRecord(const bake::BakeOptions&)> record_maker(const BakeArguments& arguments) {
  return [mesh = arguments.mesh, import = complete_import(arguments)](const bake::BakeOptions& options) {
    return bake::bake_record(mesh, {options, import}).value_or(bake::BakeRecord());
  };
}

}  // namespace vps::cli
