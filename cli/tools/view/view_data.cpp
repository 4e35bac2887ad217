// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/view/view_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "bake/quantity_text.h"
#include "cli/lab/oracle.h"
#include "cli/tools/field_surface.h"
#include "cli/tools/pack_array.h"
#include "cli/tools/provenance.h"
#include "cli/tools/stored_field.h"

namespace vps::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPageCells = 1.5e6;  // of the grids of layers and of V
constexpr std::uint32_t kPagePoints = 150'000;
constexpr std::uint32_t kPageSpheres = 20'000;  // of a level
constexpr std::uint32_t kPageSegments = 1'000;  // nodes of a level that has its points coloured by node
constexpr double kPageStep = 0.5;               // [vx]; the field is sampled finer than voxels near edges
constexpr std::int8_t kNone = -128;

Json missing(const char* reason) {
  return {{"missing", reason}};
}

std::string size_text(const AssetInfo& info) {
  std::string text;
  for (std::size_t k = 0; k < 3; ++k)
    text += (k == 0 ? "" : " x ") + bake::format_length(info.bounds_max[k] - info.bounds_min[k]);
  return text;
}

// A grid of blocks of `merge` voxels along each edge, few enough for a page.
struct PageGrid {
  std::uint32_t merge = 1;
  std::uint32_t dims[3] = {};
  [[nodiscard]] std::size_t cells() const { return std::size_t{dims[0]} * dims[1] * dims[2]; }
};

PageGrid page_grid(const AssetInfo& info) {
  PageGrid grid;
  for (;; ++grid.merge) {
    for (std::size_t k = 0; k < 3; ++k) grid.dims[k] = (info.dims[k] + grid.merge - 1) / grid.merge;
    if (double(grid.dims[0]) * grid.dims[1] * grid.dims[2] <= kPageCells) return grid;
  }
}

Vec3 voxel_centre(const AssetInfo& info, double x, double y, double z) {
  const double s = info.voxel_size;
  return {float(info.origin[0] + s * (x + 0.5)), float(info.origin[1] + s * (y + 0.5)),
          float(info.origin[2] + s * (z + 0.5))};
}

bool has_field(const Asset& asset, Field field) {
  VoxelmapView map;
  return asset.voxelmap(map, field) == Status::ok;
}

// Layers of voxels: the stored ones, or those derived from the distances of voxel centres.
class Layers {
 public:
  Layers(const Asset& asset, bool stored) : info_(asset.info()), stored_(stored) {
    (void)asset.voxelmap(map_, stored ? Field::layers : Field::none);
  }
  /// Whether the brick at a place of the grid of bricks is so far from the surface that none of its voxels has a layer.
  [[nodiscard]] bool is_empty(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    if (stored_) {
      const std::uint32_t* const dims = map_.brick_dims;
      return !is_stored(map_.brick_index[(std::size_t{z} * dims[1] + y) * dims[0] + x]);
    }
    constexpr std::uint32_t kBricks = kCoarseEdge / kBrickEdge;
    const std::uint32_t* const dims = map_.root_dims;
    const int layer = map_.coarse_layers[(std::size_t{z / kBricks} * dims[1] + y / kBricks) * dims[0] + x / kBricks];
    const double reach = std::max(map_.band_inner, map_.band_outer) / map_.voxel_size;
    return std::abs(layer) > reach + 0.9 * kCoarseEdge;
  }
  [[nodiscard]] std::int8_t at(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    const double v = double(stored_penetration(map_, voxel_centre(info_, x, y, z))) / info_.voxel_size;
    const bool far =
        std::isinf(v) ||
        (!stored_ && (v > info_.band_inner / info_.voxel_size || -v > info_.band_outer / info_.voxel_size));
    return far ? kNone : static_cast<std::int8_t>(std::clamp(std::round(v), -127.0, 127.0));
  }
  [[nodiscard]] const VoxelmapView& map() const { return map_; }

 private:
  const AssetInfo& info_;
  bool stored_;
  VoxelmapView map_;
};

Json pack_voxels(const Asset& asset) {
  if (!asset.has_voxelmap()) return missing("This asset has no voxelmap.");
  const AssetInfo& info = asset.info();
  const PageGrid grid = page_grid(info);
  const bool stored = has_field(asset, Field::layers);
  const Layers layers(asset, stored);
  std::vector<std::int8_t> out(grid.cells(), kNone);
  const std::uint32_t* const bricks = layers.map().brick_dims;
  for (std::size_t brick = 0; brick < std::size_t{bricks[0]} * bricks[1] * bricks[2]; ++brick) {
    const auto at = [&](std::size_t n) { return static_cast<std::uint32_t>(n); };
    const std::uint32_t place[3] = {at(brick % bricks[0]), at(brick / bricks[0] % bricks[1]),
                                    at(brick / bricks[0] / bricks[1])};
    if (layers.is_empty(place[0], place[1], place[2])) continue;
    const std::size_t low[3] = {place[0] * kBrickEdge, place[1] * kBrickEdge, place[2] * kBrickEdge};
    for (std::uint32_t n = 0; n < kBrickVoxels; ++n) {
      const auto x = static_cast<std::uint32_t>(low[0] + n % kBrickEdge);
      const auto y = static_cast<std::uint32_t>(low[1] + n / kBrickEdge % kBrickEdge);
      const auto z = static_cast<std::uint32_t>(low[2] + n / (kBrickEdge * kBrickEdge));
      const std::int8_t layer = layers.at(x, y, z);
      std::int8_t& block =
          out[(std::size_t{z / grid.merge} * grid.dims[1] + y / grid.merge) * grid.dims[0] + x / grid.merge];
      if (layer != kNone && (block == kNone || std::abs(layer) < std::abs(block))) block = layer;
    }
  }
  std::set<int> present(out.begin(), out.end());
  present.erase(kNone);
  std::string note = stored ? "The layers stored in the asset."
                            : "Derived: the distance of a voxel's centre, in voxels, rounded. "
                              "The asset stores no layers (--fields layers,scaled would).";
  if (grid.merge > 1) {
    note += fmt::format(" Blocks of {0} x {0} x {0} voxels are shown as one, of the layer nearest to the surface.",
                        grid.merge);
  }
  return {{"note", note},
          {"origin", info.origin},
          {"size", grid.merge * info.voxel_size},
          {"dims", {grid.dims[0], grid.dims[1], grid.dims[2]}},
          {"merged", grid.merge > 1},
          {"present", present},
          {"layers", pack_array(out)}};
}

Json pack_field(const Asset& asset) {
  VoxelmapView map;
  if (asset.voxelmap(map) != Status::ok) return missing("This asset has no voxelmap.");
  const AssetInfo& info = asset.info();
  const PageGrid grid = page_grid(info);
  const double reach = std::max(info.band_inner, info.band_outer);
  const double scale = reach / 120;
  std::vector<std::int8_t> out;
  out.reserve(grid.cells());
  const double offset = 0.5 * (grid.merge - 1);
  for (std::uint32_t z = 0; z < grid.dims[2]; ++z) {
    for (std::uint32_t y = 0; y < grid.dims[1]; ++y) {
      for (std::uint32_t x = 0; x < grid.dims[0]; ++x) {
        const Vec3 at = voxel_centre(info, x * grid.merge + offset, y * grid.merge + offset, z * grid.merge + offset);
        const double v = double(stored_penetration(map, at)) / scale;
        out.push_back(static_cast<std::int8_t>(std::clamp(std::round(v), -127.0, 127.0)));
      }
    }
  }
  std::string note = fmt::format("Field \"{}\", kept from {} outside to {} inside.", field_name(map.field),
                                 bake::format_length(info.band_outer), bake::format_length(info.band_inner));
  if (grid.merge > 1) note += fmt::format(" Drawn from every {} voxels.", grid.merge);
  Json places = Json::array();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const SliceRange range = slice_range(info, axis);
    places.push_back({range.low, range.middle, range.high});
  }
  const double step = grid.merge * info.voxel_size;
  const Vec3 origin = voxel_centre(info, offset, offset, offset);
  return {{"note", note},     {"origin", {origin.x, origin.y, origin.z}},
          {"step", step},     {"dims", {grid.dims[0], grid.dims[1], grid.dims[2]}},
          {"scale", scale},   {"reach", reach},
          {"places", places}, {"values", pack_array(out)}};
}

// For each level of few nodes: the first drawn point of every node. The points below a node are contiguous.
Json pack_segments(const PointshellView& shell, const std::vector<std::uint32_t>& drawn_before) {
  std::vector<std::uint32_t> first(shell.nodes);
  for (std::uint32_t node = shell.nodes; node-- > 0;) {
    const std::uint32_t child = children_of(shell, node).begin;
    first[node] = node >= shell.level_offsets[shell.levels - 1] ? child : first[child];
  }
  Json segments = Json::array();
  for (std::uint32_t l = 0; l < shell.levels; ++l) {
    const std::uint32_t count = shell.level_offsets[l + 1] - shell.level_offsets[l];
    if (count > kPageSegments) break;
    std::vector<std::uint32_t> begins;
    for (std::uint32_t node = shell.level_offsets[l]; node < shell.level_offsets[l + 1]; ++node)
      begins.push_back(drawn_before[first[node]]);
    segments.push_back(begins);
  }
  return segments;
}

Json pack_points(const PointshellView& shell) {
  // The first level at which a point is the parent point of a node; `levels` for points that never are.
  std::vector<std::uint8_t> level(shell.points, static_cast<std::uint8_t>(shell.levels));
  for (std::uint32_t l = shell.levels; l-- > 0;) {
    for (std::uint32_t node = shell.level_offsets[l]; node < shell.level_offsets[l + 1]; ++node)
      level[shell.parent_point[node]] = static_cast<std::uint8_t>(l);
  }
  std::vector<std::uint64_t> counts(shell.levels + 1);
  for (const std::uint8_t l : level) ++counts[l];
  const std::uint32_t stride = shell.points / kPagePoints + 1;
  std::vector<std::uint16_t> codes;
  std::vector<std::uint8_t> levels;
  std::vector<std::uint32_t> drawn_before(shell.points);
  for (std::uint32_t i = 0; i < shell.points; ++i) {
    drawn_before[i] = static_cast<std::uint32_t>(levels.size());
    if (level[i] == shell.levels && i % stride != 0) continue;
    for (const auto* const row : shell.position) codes.push_back(row[i]);
    levels.push_back(level[i]);
  }
  std::string note = fmt::format(
      "A level's points stand for its nodes; each level sees the whole body, more finely than "
      "the one before.");
  if (stride > 1) note += fmt::format(" Of those below the last level one in {} is drawn.", stride);
  return {{"note", note},
          {"origin", std::vector<float>(shell.position_origin, shell.position_origin + 3)},
          {"step", shell.position_step},
          {"counts", counts},
          {"segments", pack_segments(shell, drawn_before)},
          {"positions", pack_array(codes)},
          {"levels", pack_array(levels)}};
}

Json pack_spheres(const PointshellView& shell) {
  std::vector<float> values;
  std::vector<std::uint32_t> counts;
  for (std::uint32_t l = 0; l < shell.levels; ++l) {
    const std::uint32_t count = shell.level_offsets[l + 1] - shell.level_offsets[l];
    if (count > kPageSpheres) break;
    counts.push_back(count);
    for (std::uint32_t node = shell.level_offsets[l]; node < shell.level_offsets[l + 1]; ++node) {
      const Vec3 centre = sphere_centre(shell, node);
      values.insert(values.end(), {centre.x, centre.y, centre.z, sphere_radius(shell, node)});
    }
  }
  std::string note = fmt::format("The tree has {} levels", shell.levels);
  if (counts.size() < shell.levels) note += fmt::format("; those of more than {} spheres are left out", kPageSpheres);
  return {{"note", note + "."}, {"counts", counts}, {"values", pack_array(values)}};
}

// The distance of each vertex of a surface from a mesh: `errors`, as parts of `most`.
void add_errors(const FieldSurface& surface, const TriangleMesh& mesh, Json& out) {
  const lab::SoupOracle oracle(mesh);
  std::vector<double> distances;
  double most = 0, squares = 0;
  for (const auto& p : surface.mesh.vertices) {
    distances.push_back(oracle.distance(p));
    most = std::max(most, distances.back());
    squares += distances.back() * distances.back();
  }
  std::vector<std::uint8_t> codes;
  for (const double d : distances)
    codes.push_back(static_cast<std::uint8_t>(most > 0 ? std::lround(255 * d / most) : 0));
  out["errors"] = pack_array(codes);
  out["most"] = most;
  out["note"] = out["note"].get<std::string>() +
                fmt::format(" Its vertices lie up to {} from the mesh, {} RMS.", bake::format_length(most),
                            bake::format_length(std::sqrt(squares / double(distances.size()))));
}

Json pack_given_mesh(const TriangleMesh& mesh) {
  double cell = 0;
  const TriangleMesh coarse = coarsened(mesh, kPageTriangles, cell);
  Json out = pack_mesh(coarse);
  out["note"] = cell == 0 ? fmt::format("The mesh that was given: {} triangles.", mesh.triangles.size())
                          : fmt::format(
                                "The mesh that was given, {} of its {} triangles: vertices less than about {} "
                                "apart are drawn as one.",
                                coarse.triangles.size(), mesh.triangles.size(), bake::format_length(cell));
  return out;
}

Json facts(const Asset& asset) {
  const AssetInfo& info = asset.info();
  Json out = Json::array();
  const auto add = [&](const char* name, const std::string& value) { out.push_back({name, value}); };
  add("Size", size_text(info));
  add("Mesh", fmt::format("{} triangles, {} vertices", info.triangles, info.vertices));
  add("Voxel size", bake::format_length(info.voxel_size));
  if (asset.has_voxelmap()) {
    add("Voxelmap", fmt::format("{} x {} x {} voxels, {} on the surface, {} inside", info.dims[0], info.dims[1],
                                info.dims[2], info.surface_voxels, info.inner_voxels));
    std::string fields;
    for (const Field field : {Field::layers, Field::scaled, Field::real}) {
      if (has_field(asset, field)) fields += (fields.empty() ? "" : ", ") + std::string(field_name(field));
    }
    add("Fields", fields);
    add("Narrow band", fmt::format("{} outside, {} inside", bake::format_length(info.band_outer),
                                   bake::format_length(info.band_inner)));
    const std::pair<const char*, const FieldCertificate*> errors[] = {{"Error of layers", &info.layers_error},
                                                                      {"Error of scaled", &info.scaled_error},
                                                                      {"Error of real", &info.real_error}};
    for (const auto& [name, error] : errors) {
      if (error->max == 0 && error->rms == 0) continue;
      add(name, fmt::format("{} max, {} RMS, measured at {} points", bake::format_length(error->max),
                            bake::format_length(error->rms), info.certificate_samples));
    }
  }
  if (asset.has_pointshell()) {
    add("Pointshell", fmt::format("{} points, every surface point within {} of one", info.points,
                                  bake::format_length(info.covering_radius)));
    add("Tree", fmt::format("{} levels, K = {}", info.levels, info.branching));
  }
  add("Volume", fmt::format("{:.6g} m³", info.volume));
  add("File", bake::format_bytes(double(asset.directory().file_bytes)));
  add("Baked by", info.generator.data());
  for (Json& fact : origin_facts()) out.push_back(std::move(fact));
  return out;
}

std::string about(const Asset& asset) {
  const AssetInfo& info = asset.info();
  std::string text = fmt::format("A solid of {}, baked for collisions ", size_text(info));
  if (asset.has_voxelmap()) text += fmt::format("into a voxelmap of {} voxels", bake::format_length(info.voxel_size));
  if (asset.has_pointshell()) {
    text += fmt::format("{} a pointshell of {} points", asset.has_voxelmap() ? " and" : "into", info.points);
  }
  return text + ".";
}

}  // namespace

Json origin_facts() {
  const Json origin = provenance(0);
  return Json::array({Json::array({"Page made by", "vpsbake " + origin["versions"]["vpsbake"].get<std::string>()}),
                      Json::array({"With", origin["command"]})});
}

Json pack_field_surface(const Asset& asset, std::size_t triangles, const TriangleMesh* mesh) {
  VoxelmapView map;
  if (asset.voxelmap(map) != Status::ok) return missing("No voxelmap to make it from: give the mesh with --mesh.");
  const FieldSurface surface = make_field_surface(map, step_for(asset.info(), double(triangles), kPageStep));
  if (surface.mesh.triangles.empty())
    return missing(
        "The field is nowhere 0: the body is thinner than its voxels. Bake it finer, or give the mesh with --mesh.");
  Json out = pack_mesh(surface.mesh);
  out["note"] = fmt::format(
      "Preview surface, rebuilt from the distance field \"{}\" in cells of {}. At the middles of its triangles and at "
      "its vertices the field is within {} of 0.",
      field_name(map.field), bake::format_length(surface.step), bake::format_length(surface.residual));
  if (mesh != nullptr) add_errors(surface, *mesh, out);
  return out;
}

Json view_data(const Asset& asset, const std::string& name, const TriangleMesh* mesh) {
  PointshellView shell;
  const bool has_shell = asset.pointshell(shell) == Status::ok;
  const bool surface_is_mesh = mesh != nullptr && !asset.has_voxelmap();
  constexpr const char* kNoShell = "This asset has no pointshell.";
  return {{"name", name},
          {"about", about(asset)},
          {"facts", facts(asset)},
          {"bounds_min", asset.info().bounds_min},
          {"bounds_max", asset.info().bounds_max},
          {"voxel_size", asset.info().voxel_size},
          {"surface", surface_is_mesh ? pack_given_mesh(*mesh) : pack_field_surface(asset, kPageTriangles, mesh)},
          {"mesh", mesh == nullptr   ? missing("Give it with --mesh to lay it over the surface.")
                   : surface_is_mesh ? missing("It is shown as the surface.")
                                     : pack_given_mesh(*mesh)},
          {"voxels", pack_voxels(asset)},
          {"field", pack_field(asset)},
          {"points", has_shell ? pack_points(shell) : missing(kNoShell)},
          {"spheres", has_shell ? pack_spheres(shell) : missing(kNoShell)}};
}

}  // namespace vps::cli
