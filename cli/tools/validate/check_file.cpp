// SPDX-License-Identifier: GPL-3.0-or-later
// The checks that need no mesh.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <sstream>

#include "bake/quantity_text.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/face_jumps.h"
#include "cli/tools/stored_field.h"
#include "cli/tools/validate/check.h"
#include "formats/hdf5/hdf5_check.h"
#include "formats/mesh/child_process.h"
#include "version.h"

namespace vps::cli {
namespace {

using Result = Check::Result;

// Runs libhdf5 in a child process. It has crashed on forged files, and a forger can write valid hashes.
struct ChildAnswer {
  bool finished = false;
  std::vector<std::string> lines;
};
template <class Work>
ChildAnswer ask_child(const Work& work) {
  constexpr ChildLimits kLimits = {std::size_t{1} << 30, 60};
  const ChildResult result = run_in_child(kLimits, [&](int fd) {
    for (const std::string& line : work()) {
      write_all(fd, line.data(), line.size());
      write_all(fd, "\n", 1);
    }
  });
  ChildAnswer answer{result.end == ChildResult::End::finished, {}};
  std::istringstream text(std::string(reinterpret_cast<const char*>(result.bytes.data()), result.bytes.size()));
  for (std::string line; std::getline(text, line);) answer.lines.push_back(line);
  return answer;
}

bool is_rewritten(const std::filesystem::path& file) {
  return !ask_child([&] {
            return std::vector<std::string>(hdf5_holds_sections(file) ? 1 : 0, "it does");
          }).lines.empty();
}

std::string joined(const std::vector<std::string>& parts, const char* between) {
  return fmt::format("{}", fmt::join(parts, between));
}

template <class Number>
std::size_t not_finite(const Asset& asset, SectionKind kind) {
  const Section* const section = asset.directory().find(kind);
  if (section == nullptr) return 0;
  const auto* const values = reinterpret_cast<const Number*>(asset.bytes().data() + section->offset);
  return static_cast<std::size_t>(
      std::count_if(values, values + section->bytes / sizeof(Number), [](Number x) { return !std::isfinite(x); }));
}

void check_values(const Asset& asset, std::vector<Check>& checks) {
  if (!asset.has_voxelmap() || asset.directory().find(SectionKind::real) == nullptr) return;
  const std::size_t bad =
      not_finite<double>(asset, SectionKind::real) + not_finite<float>(asset, SectionKind::real_gradient);
  checks.push_back({"values",
                    bad == 0 ? Result::ok : Result::failed,
                    bad == 0 ? "all of real and its gradient are finite"
                             : fmt::format("{} of real and its gradient are not finite", bad),
                    {{"not_finite", bad}}});
}

// Where bricks of different levels meet, both sides are within the certificate's bound of the true V.
void check_faces(const Asset& asset, Field field, std::vector<Check>& checks) {
  VoxelmapView map;
  if (asset.voxelmap(map, field) != Status::ok) return;
  const FaceJump jump = largest_face_jump(map, asset.info().voxel_size);
  const double allowed = 2 * double(detail::field_error(map));
  const bool good = jump.largest <= allowed;
  checks.push_back({std::string("faces ") + field_name(field),
                    good ? Result::ok : Result::failed,
                    fmt::format("V jumps by {} at most between field bricks, {} are allowed",
                                bake::format_length(jump.largest), bake::format_length(allowed)),
                    {{"largest", jump.largest}, {"place", jump.place}, {"allowed", allowed}}});
}

// The points below each node, first and one past the last. They are contiguous in tree order.
std::vector<std::pair<std::uint32_t, std::uint32_t>> point_ranges(const PointshellView& shell) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ranges(shell.nodes);
  for (std::uint32_t node = shell.nodes; node-- > 0;) {
    const auto [first, end] = children_of(shell, node);
    const bool leaf = node >= shell.level_offsets[shell.levels - 1];
    ranges[node] = leaf ? std::pair{first, end} : std::pair{ranges[first].first, ranges[end - 1].second};
  }
  return ranges;
}

void check_spheres(const PointshellView& shell, std::vector<Check>& checks) {
  const auto ranges = point_ranges(shell);
  std::size_t outside = 0, tests = 0;
  double worst = 0;  // distance outside of a sphere. [m]
  for (std::uint32_t node = 0; node < shell.nodes; ++node) {
    const Vec3 centre = sphere_centre(shell, node);
    for (std::uint32_t i = ranges[node].first; i < ranges[node].second; ++i, ++tests) {
      const Vec3 p = point_position(shell, i);
      // Some points lie exactly on their sphere: points and radii are on one grid. A root would round, squares do not.
      using Wide = long double;
      const Wide x = Wide(p.x) - Wide(centre.x);
      const Wide y = Wide(p.y) - Wide(centre.y);
      const Wide z = Wide(p.z) - Wide(centre.z);
      const Wide radius = sphere_radius(shell, node);
      const Wide squared = x * x + y * y + z * z;
      if (squared <= radius * radius) continue;
      ++outside;
      worst = std::max(worst, static_cast<double>(std::sqrt(squared) - radius));
    }
  }
  checks.push_back({"spheres",
                    outside == 0 ? Result::ok : Result::failed,
                    outside == 0
                        ? fmt::format("each of {} spheres holds all points below it ({} tests)", shell.nodes, tests)
                        : fmt::format("points lie outside of spheres above them {} times, by {} at most", outside,
                                      bake::format_length(worst)),
                    {{"spheres", shell.nodes}, {"tests", tests}, {"outside", outside}, {"farthest", worst}}});
}

// The corners of a flat node's hull answer for its points (docs/internals/bounds.md, "Flat nodes").
void check_hulls(const AssetInfo& info, const PointshellView& shell, std::vector<Check>& checks) {
  if (shell.hull_offsets == nullptr) return;
  constexpr int kDirections = 24;
  const double allowed =
      2 * kHullTolerance * (info.feature_covering_radius > 0 ? info.feature_covering_radius : info.covering_radius);
  const auto ranges = point_ranges(shell);
  std::size_t nodes = 0, strange = 0;
  double worst = 0;  // distance of a point from a hull. [m]
  for (std::uint32_t node = 0; node < shell.nodes; ++node) {
    const std::span corners(shell.hull_points + shell.hull_offsets[node],
                            shell.hull_points + shell.hull_offsets[node + 1]);
    if (corners.empty()) continue;
    ++nodes;
    for (const std::uint32_t corner : corners) strange += corner < ranges[node].first || corner >= ranges[node].second;
    for (int k = 0; k < kDirections; ++k) {
      // Spread evenly over all directions, by the golden angle.
      const double z = 1 - (2.0 * k + 1) / kDirections, angle = 2.399963229728653 * k, r = std::sqrt(1 - z * z);
      const auto height = [&](std::uint32_t i) {
        const Vec3 p = point_position(shell, i);
        return r * std::cos(angle) * double(p.x) + r * std::sin(angle) * double(p.y) + z * double(p.z);
      };
      double of_corners = -std::numeric_limits<double>::max(), of_points = of_corners;
      for (const std::uint32_t corner : corners) of_corners = std::max(of_corners, height(corner));
      for (std::uint32_t i = ranges[node].first; i < ranges[node].second; ++i)
        of_points = std::max(of_points, height(i));
      worst = std::max(worst, of_points - of_corners);
    }
  }
  const bool good = strange == 0 && worst <= allowed;
  checks.push_back(
      {"hulls",
       good ? Result::ok : Result::failed,
       strange > 0
           ? fmt::format("{} corners lie below other nodes", strange)
           : fmt::format(
                 "{} of {} nodes are flat; their points lie {} beside the corners' hulls at most, {} are allowed",
                 nodes, shell.nodes, bake::format_length(worst), bake::format_length(allowed)),
       {{"nodes", nodes}, {"strange", strange}, {"farthest", worst}, {"allowed", allowed}}});
}

void check_areas(const AssetInfo& info, const PointshellView& shell, std::vector<Check>& checks) {
  double sum = 0;
  for (std::uint32_t i = 0; i < shell.points; ++i) sum += decode_area(shell.area[i], info.area_step);
  const double off = std::abs(sum - info.surface_area);
  const double step = kLargestAreaCode * info.area_step;  // half of the largest
  const bool good = off <= step + 1e-9 * info.surface_area;
  checks.push_back(
      {"areas",
       good ? Result::ok : Result::failed,
       fmt::format("they sum to {:.6g} m^2, off the surface's by {:.2g}; {:.2g} are allowed", sum, off, step),
       {{"sum", sum}, {"surface_area", info.surface_area}, {"step", step}}});
}

}  // namespace

bool check_structure(const std::filesystem::path& file, Asset& asset, std::vector<Check>& checks) {
  const Status status = Asset::open(file.c_str(), asset);
  if (status == Status::ok) {
    checks.push_back({"structure",
                      Result::ok,
                      fmt::format("{} sections, every index within its range", asset.directory().section_count),
                      {}});
    return true;
  }
  std::string says = describe(status);
  const bool maybe = status == Status::wrong_size || status == Status::corrupt_header || status == Status::rewritten;
  if (maybe && is_rewritten(file)) {
    says += "; HDF5 can still read it: another HDF5 tool has written it, such as h5repack or h5py; bake it again";
  }
  checks.push_back({"structure", Result::failed, std::move(says), {}});
  return false;
}

void check_file(const std::filesystem::path& file, const Asset& asset, std::vector<Check>& checks) {
  const Directory& directory = asset.directory();
  std::vector<std::string> damaged;
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    const Section& section = directory.sections[i];
    if (hash_bytes(asset.bytes().subspan(section.offset, section.bytes)) != section.hash) {
      damaged.emplace_back(section_name(section.kind));
    }
  }
  const bool metadata = hash_metadata(asset.bytes(), directory) != directory.metadata_hash;
  std::string says = fmt::format("{} sections, and HDF5's own bytes", directory.section_count);
  if (!damaged.empty()) {
    says = "damaged: " + joined(damaged, ", ") + (metadata ? ", and HDF5's own bytes" : "");
  } else if (metadata) {
    says =
        "every section is as it was baked, but HDF5's own bytes are not: another HDF5 tool has edited attributes, "
        "names "
        "or times, or they are damaged; bake it again";
  }
  checks.push_back({"hashes", damaged.empty() && !metadata ? Result::ok : Result::failed, says, {}});

  const ChildAnswer answer = ask_child([&] { return compare_with_hdf5(file, directory); });
  if (!answer.finished) {
    checks.push_back({"hdf5", Result::failed, "libhdf5 crashes or hangs on this file", {}});
  } else {
    checks.push_back({"hdf5",
                      answer.lines.empty() ? Result::ok : Result::failed,
                      answer.lines.empty() ? "datasets and attributes agree with the directory, and there is no more"
                                           : joined(answer.lines, "; "),
                      {}});
  }
}

void check_contents(const Asset& asset, std::vector<Check>& checks) {
  check_values(asset, checks);
  for (const Field field : {Field::scaled, Field::real}) check_faces(asset, field, checks);
  PointshellView shell;
  if (asset.pointshell(shell) != Status::ok) return;
  check_spheres(shell, checks);
  check_hulls(asset.info(), shell, checks);
  check_areas(asset.info(), shell, checks);
}

void check_origin(const Asset& asset, std::vector<Check>& checks) {
  const Directory& directory = asset.directory();
  const auto warn = [&](const char* name, std::string says) {
    checks.push_back({name, Result::warning, std::move(says), {}});
  };
  if (directory.minor != kFormatMinor) {
    warn("format", fmt::format("it is {}.{}, this program writes {}.{}", directory.major, directory.minor, kFormatMajor,
                               kFormatMinor));
  }
  if (const std::string ours = "vpsbake " VPSBAKE_VERSION; ours != directory.info.generator.data()) {
    warn("generator", "another version baked it than this, " + ours);
  }
  if (directory.find(SectionKind::record) == nullptr) {
    warn("record", "it does not say which settings and mesh it was baked from");
  }
  for (std::uint32_t i = 0; i < directory.section_count; ++i) {
    if (std::strcmp(section_name(directory.sections[i].kind), "unknown") != 0) continue;
    warn("sections", fmt::format("kind {} is unknown to this program, which leaves it out",
                                 static_cast<std::uint32_t>(directory.sections[i].kind)));
  }
}

}  // namespace vps::cli
