// SPDX-License-Identifier: GPL-3.0-or-later
// From stage results to sections. Integer widths are no larger than the values need.
#include "bake/stages/pack_sections.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>

#include "bake/plan.h"
#include "bake/stages/certify.h"
#include "bake/stages/crease_samples.h"
#include "bake/stages/jump_samples.h"
#include "bake/stages/trim_bricks.h"
#include "formats/quantize.h"

namespace vps::bake {
namespace {

static_assert(std::endian::native == std::endian::little, "sections are written as they lie in memory");

// @param values  a vector
template <class Values>
SectionData section(SectionKind kind, ElementType element, std::vector<std::uint64_t> shape, const Values& values) {
  const std::span<const std::byte> bytes = std::as_bytes(std::span(values));
  SectionData data{kind, element, std::move(shape), {bytes.begin(), bytes.end()}};
  data.hash = hash_bytes(data.bytes);  // here beside other stages
  return data;
}

std::array<std::uint16_t, 3> position_code(const Vector& p, const AssetInfo& info) {
  std::array<std::uint16_t, 3> code;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    code[axis] = encode_coordinate(p[static_cast<Eigen::Index>(axis)], info.position_origin[axis], info.position_step);
  }
  return code;
}

// V at a point of the band by Eq. (4) with sigma = s, for a shell that lies flat on the map.
double layers_penetration(const Surface& surface, const Grid& grid, const BandField& field,
                          const std::vector<std::int8_t>& layers, const Vector& p) {
  std::uint32_t index[3];
  for (int axis = 0; axis < 3; ++axis)
    index[axis] = static_cast<std::uint32_t>((p[axis] - grid.origin[axis]) / grid.voxel_size);
  const std::uint32_t brick = field.set.index[grid.brick_of_voxel(index[0], index[1], index[2])];
  if (brick == kNoBrick) throw std::logic_error("a point of the band has no brick");
  const std::uint32_t voxel = voxel_in_brick(index[0], index[1], index[2]);
  const Vector centre = grid.centre(index[0], index[1], index[2]);
  const Vector inward_normal =
      -exact_gradient(surface, centre, field.triangle(brick, voxel), field.value(brick, voxel) > 0, grid.voxel_size);
  return inward_normal.dot(centre - p) + layers[std::size_t{brick} * kBrickVoxels + voxel] * grid.voxel_size;
}

}  // namespace

Representations represent(const Surface& surface, const Grid& grid, const SurfaceVoxels& voxels, const InsideRuns& runs,
                          const BandField& field, const InsideTest& inside, const BakeOptions& options, double lambda,
                          const StageProgress& progress) {
  Representations out;
  if (options.layers) out.layers = fill_layers(voxels, field.inside, grid, field.set);
  if (!options.scaled && !options.real) return out;
  const double s = grid.voxel_size;
  out.form.real = options.real;
  out.form.band_inner = options.band_inside * s;
  out.form.band_outer = options.band_outside * s;
  if (options.scaled) {
    out.form.lambda = lambda;
    out.form.limit = scaled_limit(options, s, lambda);
  }
  out.tree =
      sample_field(surface, grid, runs, field, inside,
                   {options.field_error * s, options.band_inside * s, options.band_outside * s, options.prove_bound},
                   out.form, progress);
  return out;
}

void certify_fields(const Surface& surface, const Distances& distances, const InsideTest& inside, const Grid& grid,
                    const BandField& field, const Representations& fields, const BakeOptions& options,
                    AssetInfo& info) {
  const double s = grid.voxel_size;
  const double half_diagonal = std::sqrt(0.75) * s;
  const Truth truth{distances, inside, s, options.band_inside * s - half_diagonal,
                    options.band_outside * s - half_diagonal};
  const StoredSamples scaled{fields.tree, fields.form, false};
  const StoredSamples real{fields.tree, fields.form, true};
  std::vector<CertificateSample> samples;
  std::vector<CertificateSample> starts;
  std::vector<CertificateSample> scaled_jumps;
  std::vector<CertificateSample> real_jumps;
  // Side by side, as parts of each keep one thread busy.
  tbb::parallel_invoke(
      [&] {
        samples =
            certificate_samples(distances, inside, grid, field, options.band_inside * s, options.band_outside * s);
      },
      [&] { starts = crease_samples(distances, inside, grid, field, std::min(truth.inner, truth.outer)); },
      [&] {
        if (fields.has_scaled()) scaled_jumps = jump_samples(truth, grid, scaled);
      },
      [&] {
        if (options.real) real_jumps = jump_samples(truth, grid, real);
      });
  info.certificate_samples = samples.size();
  starts.insert(starts.end(), samples.begin(), samples.end());
  const auto certified = [&](const Reconstruction& reconstruct, const std::vector<CertificateSample>& more) {
    FieldCertificate certificate = certify(samples, reconstruct);
    std::vector<CertificateSample> all = starts;
    all.insert(all.end(), more.begin(), more.end());
    find_worst(all, reconstruct, truth, certificate);
    return certificate;
  };
  if (!fields.layers.empty()) {
    info.layers_error =
        certified([&](const Vector& p) { return layers_penetration(surface, grid, field, fields.layers, p); }, {});
    const double end = std::max(options.band_inside, options.band_outside) - std::sqrt(0.75);
    info.layers_error.bound = layers_error_bound(end) * s;
  }
  const auto sampled = [&](const StoredSamples& value, const std::vector<CertificateSample>& jumps, double rounding) {
    FieldCertificate certificate = certified(
        [&](const Vector& p) {
          const FieldCell cell = find_cell(grid, fields.tree, p);
          if (!cell.sampled) throw std::logic_error("a point of the band has no field brick");
          double sum = 0;
          for (std::size_t k = 0; k < 8; ++k) sum += cell.weights[k] * value(cell.level, cell.samples[k]);
          return sum;
        },
        jumps);
    if (options.prove_bound) {
      certificate.bound = std::max(certificate.bound, fields.tree.proven + rounding);
      return certificate;
    }
    // A crease changes the slope along a line by at most 2. Where the line's middle shows an error e, the error at the
    // crease itself is below 2 e.
    // Longer searches from other starts found up to 1.1 times the largest error of this one: docs/internals/bounds.md.
    constexpr double kSearched = 1.15;
    certificate.bound = std::max(kSearched * certificate.max, 2 * fields.tree.worst_error + rounding);
    return certificate;
  };
  if (fields.has_scaled()) info.scaled_error = sampled(scaled, scaled_jumps, fields.form.lambda);
  if (options.real) info.real_error = sampled(real, real_jumps, 0);
}

void describe_voxelmap(const Grid& grid, const SurfaceVoxels& voxels, const InsideRuns& runs,
                       const BakeOptions& options, double lambda, AssetInfo& info) {
  info.dims = grid.dims;
  for (std::size_t axis = 0; axis < 3; ++axis) info.origin[axis] = grid.origin[static_cast<Eigen::Index>(axis)];
  info.precision = options.precision;
  info.lambda = lambda;
  info.band_inner = options.band_inside * grid.voxel_size;
  info.band_outer = options.band_outside * grid.voxel_size;
  info.surface_voxels = voxels.count;
  std::uint64_t inside_surface = 0;
  const std::vector<BrickMask> inside = inside_masks(runs, grid, voxels.set);
  for (std::size_t n = 0; n < inside.size(); ++n) {
    for (std::size_t z = 0; z < kBrickEdge; ++z) {
      inside_surface += static_cast<std::uint64_t>(std::popcount(inside[n][z] & voxels.masks[n][z]));
    }
  }
  info.inner_voxels = runs.count - inside_surface;
}

void pack_voxelmap(const Grid& grid, const BandField& field, const CoarseBounds& coarse, const Representations& fields,
                   std::vector<SectionData>& sections) {
  std::vector<std::uint64_t> blocks;
  for (const std::uint32_t dim : {grid.dims[2], grid.dims[1], grid.dims[0]}) {
    blocks.push_back((dim + kCoarseEdge - 1) / kCoarseEdge);
  }
  sections.push_back(section(SectionKind::coarse_layers, ElementType::i16, blocks, coarse.blocks));
  if (!fields.layers.empty()) {
    std::vector<std::uint32_t> index = field.set.index;
    for (std::size_t brick = 0; brick < index.size(); ++brick) {
      if (index[brick] == kNoBrick && coarse.bricks[brick] > 0) index[brick] = kNoBrickInside;
    }
    sections.push_back(section(SectionKind::brick_index, ElementType::u32,
                               {grid.brick_dims[2], grid.brick_dims[1], grid.brick_dims[0]}, index));
    sections.push_back(section(SectionKind::layers, ElementType::i8,
                               {field.set.bricks.size(), kBrickEdge, kBrickEdge, kBrickEdge}, fields.layers));
  }
  const FieldTree& tree = fields.tree;
  if (tree.bricks == 0) return;
  const TrimmedTree trimmed = trim_bricks(tree, fields.form);
  sections.push_back(section(SectionKind::field_roots, ElementType::u32,
                             {tree.root_dims[2], tree.root_dims[1], tree.root_dims[0]}, trimmed.roots));
  sections.push_back(section(SectionKind::field_nodes, ElementType::u32, {tree.nodes.size() / 8, 8}, trimmed.nodes));
  const std::vector<std::uint64_t> samples = {trimmed.slices, kFieldSlice};
  if (fields.has_scaled()) {
    sections.push_back(
        fields.form.limit <= 127
            ? section(SectionKind::scaled, ElementType::i8, samples, trimmed.stored<std::int8_t>(tree.scaled))
            : section(SectionKind::scaled, ElementType::i16, samples, trimmed.stored<std::int16_t>(tree.scaled)));
  }
  if (fields.form.real) {
    sections.push_back(section(SectionKind::real, ElementType::f64, samples, trimmed.stored<double>(tree.penetration)));
    sections.push_back(section(SectionKind::real_gradient, ElementType::f32, {trimmed.slices, kFieldSlice, 3},
                               trimmed.stored<float>(tree.gradient, 3)));
  }
}

void pack_far(const FarField& far, AssetInfo& info, std::vector<SectionData>& sections) {
  for (std::size_t axis = 0; axis < 3; ++axis) info.far_origin[axis] = far.origin[static_cast<Eigen::Index>(axis)];
  info.far_spacing = far.spacing;
  info.far_step_inner = far.step_inner;
  info.far_step_outer = far.step_outer;
  info.far_range = far.range;
  info.far_error = far.error;
  sections.insert(sections.begin() + 1,
                  section(SectionKind::far, ElementType::i8, {far.dims[2], far.dims[1], far.dims[0]}, far.values));
}

void pack_corners(std::vector<Corner> corners, std::vector<SectionData>& sections) {
  if (corners.empty()) return;
  if (corners.size() > kMostMeshCorners) {
    std::stable_sort(corners.begin(), corners.end(),
                     [](const Corner& a, const Corner& b) { return a.sharpness > b.sharpness; });
    corners.resize(kMostMeshCorners);
  }
  std::vector<float> places;
  for (const Corner& corner : corners) {
    for (const double x : corner.place) places.push_back(static_cast<float>(x));
  }
  sections.push_back(section(SectionKind::corners, ElementType::f32, {corners.size(), 3}, places));
}

void pack_planes(const FieldPlanes& planes, std::vector<SectionData>& sections) {
  const auto roots = std::find_if(sections.begin(), sections.end(),
                                  [](const SectionData& s) { return s.kind == SectionKind::field_roots; });
  *roots = section(SectionKind::field_roots, ElementType::u32, roots->shape, planes.roots);
  sections.push_back(section(SectionKind::planes, ElementType::u32, {planes.octants.size() / 8, 8}, planes.octants));
}

void describe_pointshell(const Pointshell& shell, const PointTree& tree, std::uint32_t branching, AssetInfo& info) {
  info.spacing = shell.spacing;
  info.normal_error_mean = shell.normal_error_mean;
  info.normal_error_max = shell.normal_error_max;
  const PositionScale scale = position_scale(info.bounds_min, info.bounds_max);
  info.position_origin = scale.origin;
  info.position_step = scale.step;
  info.area_step =
      std::max(*std::max_element(shell.areas.begin(), shell.areas.end()) / (kLargestAreaCode * kLargestAreaCode),
               double{std::numeric_limits<float>::min()});
  // The radius must hold for decoded positions: these move by up to half a step along each axis, and are then rounded
  // to float.
  double largest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    largest = std::max({largest, std::abs(info.bounds_min[axis]), std::abs(info.bounds_max[axis])});
  }
  const auto stored = [&](double radius) {
    return radius + std::numbers::sqrt3 / 2 * info.position_step + largest * std::numeric_limits<float>::epsilon();
  };
  info.covering_radius = stored(shell.covering_radius);
  if (!shell.on_face.empty()) info.feature_covering_radius = stored(shell.feature_covering_radius);
  info.points = shell.positions.size();
  info.branching = branching;
  info.levels = static_cast<std::uint32_t>(tree.level_offsets.size() - 1);
}

std::vector<Point3f> tree_points(const Pointshell& shell, const PointTree& tree, const AssetInfo& info) {
  std::vector<Point3f> points(tree.order.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    const std::array<std::uint16_t, 3> code = position_code(shell.positions[tree.order[i]], info);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      points[i][axis] = decode_coordinate(code[axis], static_cast<float>(info.position_origin[axis]),
                                          static_cast<float>(info.position_step));
    }
  });
  return points;
}

// @param order  the points' old numbers, in tree order
void pack_facets(const Pointshell& shell, const std::vector<std::uint32_t>& order, const AssetInfo& info,
                 std::vector<SectionData>& sections) {
  if (shell.facets.empty()) return;
  std::vector<std::uint32_t> begin(order.size() + 1, 0);
  for (const PointFacet& facet : shell.facets) ++begin[facet.point + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> points;
  std::vector<std::int8_t> corners;
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    for (std::uint32_t at = begin[order[i]]; at < begin[order[i] + 1]; ++at) {
      points.push_back(i);
      for (const Vector& corner : shell.facets[at].corners) {
        for (const double x : corner) {
          const double code = std::nearbyint(x * double{kFacetSteps} / info.covering_radius);
          corners.push_back(static_cast<std::int8_t>(std::clamp(code, -127.0, 127.0)));
        }
      }
    }
  }
  sections.push_back(section(SectionKind::facet_points, ElementType::u32, {points.size()}, points));
  sections.push_back(section(SectionKind::facet_corners, ElementType::i8, {points.size(), 4, 3}, corners));
}

void pack_pointshell(const Pointshell& shell, const PointTree& tree, const std::vector<BoundingSphere>& spheres,
                     const AssetInfo& info, std::vector<SectionData>& sections) {
  const std::size_t count = tree.order.size();
  std::vector<std::uint16_t> positions(3 * count);
  std::vector<NormalCode> normals(count);
  std::vector<std::uint8_t> areas(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const std::uint32_t old = tree.order[i];
    const std::array<std::uint16_t, 3> code = position_code(shell.positions[old], info);
    for (std::size_t axis = 0; axis < 3; ++axis) positions[axis * count + i] = code[axis];
    const Vector& n = shell.inward_normals[old];
    normals[i] = pack(encode_normal({n.x(), n.y(), n.z()}));
  });
  double carry = 0;
  for (std::size_t i = 0; i < count; ++i) areas[i] = encode_area(shell.areas[tree.order[i]], info.area_step, carry);
  const std::size_t nodes = spheres.size();
  const std::uint32_t leaves = *(tree.level_offsets.end() - 2);
  std::vector<std::uint16_t> rows(4 * nodes);
  // Points are numbered after the nodes.
  std::vector<std::uint32_t> children(nodes + 1, static_cast<std::uint32_t>(nodes + count));
  for (std::size_t n = 0; n < nodes; ++n) {
    for (std::size_t axis = 0; axis < 3; ++axis) rows[axis * nodes + n] = spheres[n].centre[axis];
    rows[3 * nodes + n] = spheres[n].radius;
    children[n] = tree.first[n] + (n < leaves ? 0 : static_cast<std::uint32_t>(nodes));
  }
  sections.push_back(section(SectionKind::point_positions, ElementType::u16, {3, count}, positions));
  sections.push_back(section(SectionKind::point_inward_normals, ElementType::u8, {count, 3}, normals));
  sections.push_back(section(SectionKind::point_areas, ElementType::u8, {count}, areas));
  pack_facets(shell, tree.order, info, sections);
  if (!shell.on_face.empty()) {
    std::vector<std::uint32_t> faces((count + 31) / 32, 0);
    for (std::size_t i = 0; i < count; ++i) {
      if (shell.on_face[tree.order[i]] != 0) faces[i / 32] |= std::uint32_t{1} << i % 32;
    }
    sections.push_back(section(SectionKind::face_points, ElementType::u32, {faces.size()}, faces));
  }
  sections.push_back(section(SectionKind::spheres, ElementType::u16, {4, nodes}, rows));
  sections.push_back(section(SectionKind::children, ElementType::u32, {nodes + 1}, children));
  sections.push_back(section(SectionKind::parent_points, ElementType::u32, {nodes}, tree.parent_point));
  sections.push_back(
      section(SectionKind::level_offsets, ElementType::u32, {tree.level_offsets.size()}, tree.level_offsets));
}

void pack_hulls(const NodeHulls& hulls, std::vector<SectionData>& sections) {
  if (hulls.points.empty()) return;
  sections.push_back(section(SectionKind::hull_offsets, ElementType::u32, {hulls.offsets.size()}, hulls.offsets));
  sections.push_back(section(SectionKind::hull_points, ElementType::u32, {hulls.points.size()}, hulls.points));
}

}  // namespace vps::bake
