// SPDX-License-Identifier: GPL-3.0-or-later
// Writes what an asset's bytes depend on as text, and hashes it. Of a mesh it takes the bytes and the extension, never
// times or names: a touched or renamed mesh is the same mesh.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "bake/store/cache.h"
#include "cache_program.h"
#include "formats/mesh/gltf.h"

namespace vps::bake {
namespace {

namespace fs = std::filesystem;

std::string digits(XXH128_hash_t hash) {
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

std::string hash_of(std::span<const std::byte> bytes) {
  return digits(XXH3_128bits(bytes.data(), bytes.size()));
}

// As %a of printf, in any locale: there the decimal point may be a comma.
std::string exact_text(double value) {
  char text[32];
  char* const end = std::to_chars(text, text + sizeof text, std::abs(value), std::chars_format::hex).ptr;
  return (std::signbit(value) ? "-0x" : "0x") + std::string(text, end);
}

// Hash of a regular file; empty when it cannot be read. Appends the file's bytes to `text` unless that is null. Appends
// the file's identity and change time from before the reading to `stamps`.
std::string hash_file(const fs::path& path, std::string& stamps, std::string* text) {
  // O_NONBLOCK: opening a FIFO by mistake must not hang.
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return {};
  struct stat facts {};
  bool good = ::fstat(fd, &facts) == 0 && S_ISREG(facts.st_mode);
  // The change time (ctime), because the modification time can be set back.
  stamps += fmt::format("{} {} {} {}\n", facts.st_dev, facts.st_ino, facts.st_ctim.tv_sec, facts.st_ctim.tv_nsec);
  XXH3_state_t state;
  XXH3_128bits_reset(&state);
  std::vector<char> buffer(good ? std::clamp<std::size_t>(static_cast<std::size_t>(facts.st_size), 1, 1 << 16) : 0);
  while (good) {
    const ssize_t got = ::read(fd, buffer.data(), buffer.size());
    if (got == 0) break;
    good = got > 0 || errno == EINTR;
    if (got < 0) continue;
    XXH3_128bits_update(&state, buffer.data(), static_cast<std::size_t>(got));
    if (text != nullptr) text->append(buffer.data(), static_cast<std::size_t>(got));
  }
  ::close(fd);
  return good ? digits(XXH3_128bits_digest(&state)) : std::string();
}

// Names of the files that hold a glTF file's buffers, as written in it. Nothing when its JSON cannot be parsed.
std::optional<std::vector<std::string>> gltf_buffers(std::string_view file) {
  using Text = nlohmann::json;
  using Event = Text::parse_event_t;
  std::vector<std::string> names;
  std::string top_key, key;
  // Keeps only the names, because a file may hold all of its geometry as text.
  const auto visit = [&](int depth, Event event, const Text& value) {
    if (event == Event::key) (depth == 1 ? top_key : key) = value.get<std::string>();
    if (event == Event::value && top_key == "buffers" && key == "uri" && value.is_string()) {
      const auto& name = value.get_ref<const std::string&>();
      if (!name.starts_with("data:")) names.push_back(name);
    }
    return event == Event::object_start || event == Event::array_start;
  };
  const std::string_view text = gltf_json(file);
  if (Text::parse(text.begin(), text.end(), visit, false).is_discarded()) return std::nullopt;
  return names;
}

// Paths of a glTF file's buffers, as the importer finds them. A slash in front of a name has no meaning.
std::vector<fs::path> beside(const fs::path& mesh, const std::vector<std::string>& names) {
  const std::string folder = mesh.has_parent_path() ? mesh.parent_path().string() + '/' : "";
  std::vector<fs::path> files;
  for (const std::string& name : names) files.emplace_back(referred_file(folder, name));
  return files;
}

// The files of a mesh and their hashes, the mesh first. A hash is empty when the file cannot be read.
struct HashedFiles {
  std::vector<fs::path> paths;
  std::vector<std::string> hashes;
  std::string stamps;      // as of MeshState
  bool understood = true;  // false: what the mesh refers to is not known
};

bool is_gltf(const std::string& format) {
  return format == "gltf" || format == "glb";
}

HashedFiles hash_files(const fs::path& mesh, const std::string& format) {
  const bool gltf = is_gltf(format);
  std::string text;
  HashedFiles out;
  out.paths.push_back(mesh);
  out.hashes.push_back(hash_file(mesh, out.stamps, gltf ? &text : nullptr));
  if (!gltf) return out;
  const auto names = gltf_buffers(text);
  out.understood = names.has_value();
  for (const fs::path& buffer : beside(mesh, names.value_or(std::vector<std::string>()))) {
    out.paths.push_back(buffer);
    out.hashes.push_back(hash_file(buffer, out.stamps, nullptr));
  }
  return out;
}

}  // namespace

std::string describe_settings(const BakeSettings& settings) {
  // Names every field, so that a new one does not compile until it is handled here.
  const auto& [options, import, max_error] = settings;
  const auto& [unit, import_memory, import_timeout, import_format] = import;
  const auto& [voxel_size, resolution, layers, scaled, real, voxelmap, pointshell, precision, branching, band_inside,
               band_outside, field_error, prove_bound, alpha, thin_faces, repair, sheet_thickness, memory_limit,
               planned, progress] = options;
  static_cast<void>(import_memory), static_cast<void>(import_timeout), static_cast<void>(import_format);
  static_cast<void>(memory_limit), static_cast<void>(planned), static_cast<void>(progress);

  std::string text = fmt::format("program {}\nformat {}.{}\n", VPSBAKE_CACHE_PROGRAM, kFormatMajor, kFormatMinor);
  const auto number = [&](const char* name, double value) { text += fmt::format("{} {}\n", name, exact_text(value)); };
  const auto integer = [&](const char* name, auto value) { text += fmt::format("{} {:d}\n", name, value); };
  number("unit", unit);
  number("max_error", max_error);
  number("voxel_size", voxel_size);
  integer("resolution", resolution);
  integer("layers", layers);
  integer("scaled", scaled);
  integer("real", real);
  integer("voxelmap", voxelmap);
  integer("pointshell", pointshell);
  integer("precision", precision);
  integer("branching", branching);
  number("band_inside", band_inside);
  number("band_outside", band_outside);
  number("field_error", field_error);
  integer("prove_bound", prove_bound);
  number("alpha", alpha);
  number("thin_faces", thin_faces);
  text += fmt::format("repair {}\n", describe(repair));
  number("sheet_thickness", sheet_thickness);
  return text;
}

std::vector<fs::path> mesh_files(const fs::path& mesh, const ImportOptions& import) {
  const std::string format = mesh_format(mesh, import);
  return is_gltf(format) ? hash_files(mesh, format).paths
                         : std::vector{mesh};  // other formats name no files with geometry
}

MeshState mesh_state(const fs::path& mesh, const BakeSettings& settings) {
  const std::string format = mesh_format(mesh, settings.import);
  HashedFiles files = hash_files(mesh, format);
  MeshState state{std::nullopt, std::move(files.stamps)};
  BakeRecord record{describe_settings(settings)};
  if (files.hashes[0].empty()) return state;
  record.text += fmt::format("mesh .{} {}\n", format, files.hashes[0]);
  for (std::size_t i = 1; i < files.hashes.size(); ++i) {
    std::error_code ignored;
    const bool unreadable = files.hashes[i].empty();
    if (unreadable && fs::exists(files.paths[i], ignored)) return state;
    // A missing buffer is not used, or the import fails.
    record.text += fmt::format("buffer {}\n", unreadable ? "absent" : files.hashes[i]);
  }
  if (files.understood) state.record = std::move(record);
  return state;
}

std::optional<BakeRecord> bake_record(const fs::path& mesh, const BakeSettings& settings) {
  return mesh_state(mesh, settings).record;
}

BakeRecord bake_record(const TriangleMesh& mesh, const BakeSettings& settings) {
  return {describe_settings(settings) + fmt::format("vertices {}\ntriangles {}\n",
                                                    hash_of(std::as_bytes(std::span(mesh.vertices))),
                                                    hash_of(std::as_bytes(std::span(mesh.triangles))))};
}

std::optional<double> exact_number(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  if (!text.starts_with("0x")) return std::nullopt;
  text.remove_prefix(2);
  double value = 0;
  if (std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::hex).ec != std::errc())
    return std::nullopt;
  return negative ? -value : value;
}

CacheKey cache_key(const BakeRecord& record) {
  return {hash_of(std::as_bytes(std::span(record.text)))};
}

void add_record(const BakeRecord& record, BakedAsset& baked) {
  const auto bytes = std::as_bytes(std::span(record.text));
  baked.sections.push_back(
      {SectionKind::record, ElementType::i8, {bytes.size()}, std::vector<std::byte>(bytes.begin(), bytes.end())});
}

BakeRecord record_of(const Asset& asset) {
  const Section* const section = asset.directory().find(SectionKind::record);
  if (section == nullptr) return {};
  return {std::string(reinterpret_cast<const char*>(asset.bytes().data() + section->offset), section->bytes)};
}

}  // namespace vps::bake
