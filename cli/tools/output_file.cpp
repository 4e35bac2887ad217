// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/output_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <system_error>

#include "cli/tools/standard_streams.h"
#include "formats/hdf5/hdf5_writer.h"
#include "formats/mesh/mesh_import.h"
#include "formats/vps_format.h"

namespace vps::cli {

namespace fs = std::filesystem;

namespace {

// Whether a name is that of an open file of this process, such as /dev/stdout.
bool is_open_file(const fs::path& name) {
  const fs::path folder = name.parent_path();
  return name == "/dev/stdout" || name == "/dev/stderr" || folder == "/dev/fd" || folder == "/proc/self/fd";
}

}  // namespace

std::string output_refusal(const fs::path& name, std::string_view beginning, const char* kind) {
  if (is_standard_stream(name))
    return ::isatty(STDOUT_FILENO) == 0 ? "" : "standard output is a terminal; redirect it, or give the name of a file";
  if (is_open_file(name))
    return "an output appears whole, as a new file, which cannot be done here; write - for standard output, or the "
           "name of a file";
  std::error_code ignored;
  const fs::path output = link_target(name);
  if (fs::is_symlink(output, ignored)) return "its symbolic links form a loop; choose another output";
  const fs::path folder = output.has_parent_path() ? output.parent_path() : ".";
  if (fs::is_directory(output, ignored)) return "this is a folder; give the name of a file";
  if (!fs::is_directory(folder, ignored)) return "the folder does not exist; create it or choose another output";
  if (::access(folder.c_str(), W_OK) != 0) return "the folder may not be written; choose another output";
  if (!fs::exists(output, ignored)) return "";
  if (!fs::is_regular_file(output, ignored)) return "this is not a regular file; choose another output";
  // Protects the input, and the buffers and materials that it refers to.
  std::ifstream file(output, std::ios::binary);
  std::string start(beginning.size(), '\0');
  if (file.read(start.data(), std::streamsize(start.size())) && start == beginning) return "";
  return fmt::format("the file exists and is not {}; remove it or choose another output", kind);
}

std::string cache_refusal(const fs::path& folder) {
  if (folder.empty()) return "";
  std::error_code error;
  fs::create_directories(folder, error);
  return error ? error.message() + "; choose another folder for --cache" : "";
}

std::string asset_refusal(const fs::path& output) {
  if (has_mesh_extension(output)) return "its name is that of a mesh; choose one that ends in .vps.hdf";
  return output_refusal(output, {reinterpret_cast<const char*>(kMagic.data()), kMagic.size()}, "an asset");
}

bool is_same_place(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  return fs::weakly_canonical(fs::absolute(a, ignored), ignored) ==
         fs::weakly_canonical(fs::absolute(b, ignored), ignored);
}

fs::path beside(const fs::path& asset, const char* ending) {
  if (is_standard_stream(asset)) return asset;
  return asset.parent_path() / (asset_name(asset) + ending);
}

std::string asset_name(const fs::path& asset) {
  std::string name = asset.filename().string();
  constexpr std::string_view kEnding = ".vps.hdf";
  if (name.size() > kEnding.size() && name.ends_with(kEnding)) name.resize(name.size() - kEnding.size());
  return name;
}

}  // namespace vps::cli
