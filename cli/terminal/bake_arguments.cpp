// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/bake_arguments.h"

#include <algorithm>

#include "cli/tools/standard_streams.h"

namespace vps::cli {
namespace {

ImportOptions complete_import(const BakeArguments& arguments) {
  ImportOptions options = arguments.import_options;
  options.unit = (arguments.unit > 0 ? arguments.unit : 1) * arguments.scale;
  if (is_standard_stream(arguments.mesh) && options.format.empty()) {
    options.format = detect_mesh_format(mesh_file(arguments));
    if (options.format.empty())
      throw ImportError(
          ImportError::Kind::bad_input,
          "standard input is no mesh of a known format; if it is one, add --format, such as --format obj");
  }
  return options;
}

}  // namespace

std::filesystem::path mesh_file(const BakeArguments& arguments) {
  return file_to_read(arguments.mesh, {arguments.import_options.memory_limit_bytes, arguments.import_options.timeout});
}

bake::BakeOptions complete_options(const BakeArguments& arguments) {
  const auto has = [](const std::vector<std::string>& list, const char* name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  bake::BakeOptions options = arguments.options;
  options.layers = has(arguments.fields, "layers");
  options.scaled = has(arguments.fields, "scaled");
  options.real = has(arguments.fields, "real");
  options.voxelmap = has(arguments.parts, "voxelmap");
  options.pointshell = has(arguments.parts, "pointshell");
  return options;
}

bake::BakeSettings complete_settings(const BakeArguments& arguments) {
  return {complete_options(arguments), complete_import(arguments), arguments.max_error};
}

ImportedMesh import_with(const BakeArguments& arguments) {
  return import_mesh(mesh_file(arguments), complete_import(arguments));
}

std::function<bake::BakeRecord(const bake::BakeOptions&)> record_maker(const BakeArguments& arguments) {
  return [mesh = mesh_file(arguments), import = complete_import(arguments)](const bake::BakeOptions& options) {
    return bake::bake_record(mesh, {options, import}).value_or(bake::BakeRecord());
  };
}

}  // namespace vps::cli
