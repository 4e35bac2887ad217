// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/open_asset.h"

#include <filesystem>

#include "cli/terminal/complain.h"
#include "cli/tools/standard_streams.h"
#include "formats/mesh/mesh_import.h"

namespace vps::cli {

int open_asset(const std::string& path, Asset& asset, std::string* reason) {
  const auto refuse = [&](ExitCode code, const char* why) {
    if (reason != nullptr) *reason = why;
    return fail(code, path, why);
  };
  std::filesystem::path file;
  try {
    file = file_to_read(path);
    check_is_file(file, kAssetFile);
  } catch (const ImportError& error) {
    return refuse(error.kind == ImportError::Kind::io ? kIo : kBadInput, error.what());
  }
  Status status = Asset::open(file.c_str(), asset);
  if (status == Status::cannot_open || status == Status::cannot_map) return refuse(kIo, describe(status));
  if (status == Status::ok) status = asset.verify();
  if (status != Status::ok) return refuse(kBadInput, describe(status));
  return kOk;
}

int fail_field(const std::string& asset, const std::string& name) {
  return fail(kBadInput, asset, "it has no field " + name + "; bake it with --fields " + name + ", or choose another");
}

}  // namespace vps::cli
