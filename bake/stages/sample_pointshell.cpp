// SPDX-License-Identifier: GPL-3.0-or-later
// Pointshell sampling. Paper: Sec. 2.1.2: surface voxel centres projected onto triangles, kept at least alpha s apart.
// Beyond the paper: sharp vertices and edges are sampled first, so that no tip is cut. Then every gap is found in the
// Voronoi cells of the points on each patch of the surface and filled, which proves the covering radius. Each point
// gets the area of its cells, and facets where these are folded.
#include "bake/stages/sample_pointshell.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>

#include "bake/repair/topology.h"
#include "bake/stages/find_faces.h"
#include "bake/stages/inward_normal.h"
#include "bake/stages/piece_cells.h"
#include "bake/stages/thin_faces.h"
#include "formats/quantize.h"

namespace vps::bake {
namespace {

// Dihedral angle above which an edge is sampled as a feature (cosine of 40 degrees).
constexpr double kSharp = 0.766;
// Largest distance of the surface from the points, in spacings.
constexpr double kCovering = 1.05;
// A point's cell is folded if the length of its vector area, divided by its area, is below this: normals that deviate
// by 14 degrees (root mean square), or an edge of 28 degrees in the middle.
constexpr double kFlat = 0.97;

using Place = PieceCells::Place;

class Sampler {
 public:
  Sampler(const Surface& surface, double spacing)
      : surface_(surface), spacing_(spacing), blocks_(surface, 2 * spacing) {}

  void sample_features(std::span<const Corner> corners);
  void sample_triangles(const Grid& grid, const SurfaceVoxels& voxels);
  void fill_gaps();
  void measure_areas();
  void find_folds();
  void drop_patches() { blocks_.drop_patches(); }

  [[nodiscard]] std::vector<Sample*> samples();
  [[nodiscard]] double covering_radius() const { return covering_; }

 private:
  /// Adds the point unless one on the same side is nearer than the spacing; then it returns null.
  Sample* offer(Block& home, const Vector& p, const Vector& normal);
  void offer_on_edge(const Vector& p, std::uint32_t triangle) {
    Sample* const made = offer(blocks_.block_of(p), p, surface_.normals[triangle]);
    if (made != nullptr) made->on_edge = true;
  }
  void sample_patch(const Grid& grid, const SurfaceVoxels& voxels, Block& home, const Patch& patch);

  const Surface& surface_;
  const double spacing_;
  SurfaceBlocks blocks_;
  double covering_ = 0;
};

Sample* Sampler::offer(Block& home, const Vector& p, const Vector& normal) {
  bool free = true;
  blocks_.for_each_near(home, p, p, spacing_, [&](const Sample& s) {
    free = (s.position - p).squaredNorm() >= spacing_ * spacing_ || normal.dot(s.normal) <= kSameSide;
    return free;
  });
  return free ? blocks_.insert(home, p, normal) : nullptr;
}

// Samples sharp edges from one end to the other. Vertices come first where one sharp edge ends, or three and more meet.
void Sampler::sample_features(std::span<const Corner> corners) {
  struct SharpEdge {
    std::uint32_t from, to, triangle;
  };
  std::vector<SharpEdge> sharp;
  std::vector<std::uint8_t> sharp_ends(surface_.vertices.size(), 0);
  for_each_edge(sorted_edges(surface_.triangles), [&](std::span<const EdgeUse> edge) {
    const Vector& normal = surface_.normals[edge.front().triangle];
    if (std::none_of(edge.begin(), edge.end(),
                     [&](const EdgeUse& use) { return surface_.normals[use.triangle].dot(normal) < kSharp; })) {
      return;
    }
    sharp.push_back({edge.front().low(), edge.front().high(), edge.front().triangle});
    for (const std::uint32_t v : {edge.front().low(), edge.front().high()})
      sharp_ends[v] = static_cast<std::uint8_t>(std::min(255, sharp_ends[v] + 1));
  });
  // Two sharp edges at a vertex pass through it. One, or three and more, end there.
  for (const SharpEdge& e : sharp) {
    for (const std::uint32_t v : {e.from, e.to}) {
      if (sharp_ends[v] != 2) offer_on_edge(surface_.vertices[v], e.triangle);
    }
  }
  // Tips of cones with many sides have no sharp edge.
  for (const Corner& corner : corners) offer_on_edge(corner.place, corner.triangle);
  for (const SharpEdge& e : sharp) {
    const Vector& from = surface_.vertices[e.from];
    const Vector step = surface_.vertices[e.to] - from;
    const int count = std::max(1, static_cast<int>(std::floor(step.norm() / spacing_)));
    for (int i = 0; i <= count; ++i) offer_on_edge(from + step * (double(i) / count), e.triangle);
  }
}

// The paper's rule: centres of the surface voxels in the patch's box, projected onto the patch.
void Sampler::sample_patch(const Grid& grid, const SurfaceVoxels& voxels, Block& home, const Patch& patch) {
  const auto& [a, b, c] = patch.piece;
  const Vector& n = surface_.normals[patch.triangle];
  const Vector inward[3] = {n.cross(b - a), n.cross(c - b), n.cross(a - c)};
  const Vector low = a.cwiseMin(b).cwiseMin(c);
  const Vector high = a.cwiseMax(b).cwiseMax(c);
  VoxelRange range[3];
  for (int axis = 0; axis < 3; ++axis) range[axis] = voxel_range(grid, axis, low[axis], high[axis], 0);
  for (std::uint32_t k = range[2].first; k <= range[2].last; ++k) {
    for (std::uint32_t j = range[1].first; j <= range[1].last; ++j) {
      for (std::uint32_t i = range[0].first; i <= range[0].last; ++i) {
        const Vector centre = grid.centre(i, j, k);
        const double height = n.dot(centre - a);
        // The triangle does not touch a voxel whose centre is farther from its plane.
        if (std::abs(height) > 0.87 * grid.voxel_size) continue;
        const Vector p = centre - height * n;
        if (inward[0].dot(p - a) < 0 || inward[1].dot(p - b) < 0 || inward[2].dot(p - c) < 0) continue;
        if (voxels.test(grid, i, j, k)) offer(home, p, n);
      }
    }
  }
}

void Sampler::sample_triangles(const Grid& grid, const SurfaceVoxels& voxels) {
  blocks_.for_each_block([&](Block& block) {
    blocks_.for_each_patch(block, [&](const Patch& patch) { sample_patch(grid, voxels, block, patch); });
  });
}

// Largest squared distance of a place on the piece from its nearest sample, and that place. When it is not above the
// limit, it may be only an upper bound without the place, and where it is surely not above `known` either, 0.
double farthest_corner(PieceCells& cells, double limit, double known, Place& place) {
  if (cells.candidates().empty()) return std::numeric_limits<double>::infinity();
  if (cells.candidates().front().farthest <= limit) return cells.candidates().front().farthest;
  if (cells.surely_covered(std::min(limit, known))) return 0;
  double far = 0;
  for (const PieceCells::Candidate& c : cells.candidates()) {
    for (const Place& p : cells.cell(c)) {
      const double squared = cells.squared_distance(c, p);
      if (squared <= far) continue;
      far = squared;
      place = p;
    }
  }
  return far;
}

void raise(std::atomic<double>& most, double value) {
  double old = most.load(std::memory_order_relaxed);
  while (value > old && !most.compare_exchange_weak(old, value, std::memory_order_relaxed)) {
  }
}

// Adds a point at the corner of a cell that is farthest from its sample, as long as that distance is above the limit.
void Sampler::fill_gaps() {
  const double limit = kCovering * kCovering * spacing_ * spacing_;
  // The largest so far, squared. Pieces that are surely nearer to the samples do not change it.
  std::atomic<double> covering = 0;
  blocks_.for_each_block([&](Block& block) {
    PieceCells cells(blocks_, 1.01 * kCovering * spacing_);
    blocks_.for_each_patch(block, [&](const Patch& patch) {
      const Vector& normal = surface_.normals[patch.triangle];
      cells.start(block, patch.piece, normal);
      for (bool made = true; made;) {
        made = false;
        Place place = {1.0 / 3, 1.0 / 3};
        const double far = farthest_corner(cells, limit, covering.load(std::memory_order_relaxed), place);
        if (far > limit) {
          if (Sample* sample = offer(block, cells.at(place), normal)) {
            cells.add(*sample);
            made = true;
            continue;
          }
        }
        raise(covering, far);
      }
    });
  });
  covering_ = std::sqrt(covering.load(std::memory_order_relaxed));
  // The corner of a cell between two samples almost equally far along an edge is only accurate to a root of the
  // precision.
  covering_ *= 1 + 1e-6;
}

// Gives every sample the area of its cell in every patch.
void Sampler::measure_areas() {
  blocks_.for_each_block([&](Block& block) {
    PieceCells cells(blocks_, 1.01 * covering_);
    std::vector<double> shares;
    blocks_.for_each_patch(block, [&](const Patch& patch) {
      const Piece& p = patch.piece;
      cells.start(block, p, surface_.normals[patch.triangle]);
      shares.clear();
      for (const PieceCells::Candidate& c : cells.candidates()) {
        const std::span<const Place> cell = cells.cell(c);
        double share = 0;
        for (std::size_t i = 2; i < cell.size(); ++i) {
          share += (cell[i - 1][0] - cell[0][0]) * (cell[i][1] - cell[0][1]) -
                   (cell[i - 1][1] - cell[0][1]) * (cell[i][0] - cell[0][0]);
        }
        shares.push_back(std::max(0.0, share));
      }
      // They sum to one but for rounding.
      const double scale =
          (p[1] - p[0]).cross(p[2] - p[0]).norm() / 2 / std::accumulate(shares.begin(), shares.end(), 0.0);
      for (std::size_t i = 0; i < shares.size(); ++i) {
        Sample& sample = *cells.candidates()[i].sample;
        sample.area += shares[i] * scale;
        sample.vector_area += shares[i] * scale * surface_.normals[patch.triangle];
      }
    });
  });
}

Eigen::AlignedBox3d box_of(const Piece& piece) {
  Eigen::AlignedBox3d box;
  for (const Vector& corner : piece) box.extend(corner);
  return box;
}

// Collects the cells that are folded.
void Sampler::find_folds() {
  const auto mark = [](Block& block) {
    for (Sample& s : block.samples) {
      if (s.vector_area.norm() < kFlat * s.area) s.cell = std::make_unique<std::vector<CellPart>>();
      block.has_folds = block.has_folds || s.cell != nullptr;
    }
  };
  blocks_.for_each_block(mark);
  blocks_.for_each_block([&](Block& block) {
    std::vector<Vector> folded;
    for (const Block* const b : block.around) {
      if (b == nullptr || !b->has_folds) continue;
      for (const Sample& s : b->samples) {
        if (s.cell != nullptr) folded.push_back(s.position);
      }
    }
    if (folded.empty()) return;
    const double reach = 1.01 * covering_;
    PieceCells cells(blocks_, reach);
    blocks_.for_each_patch(block, [&](const Patch& patch) {
      const Eigen::AlignedBox3d box = box_of(patch.piece);
      const auto is_near = [&](const Vector& p) { return box.squaredExteriorDistance(p) < reach * reach; };
      if (std::none_of(folded.begin(), folded.end(), is_near)) return;
      const Vector& normal = surface_.normals[patch.triangle];
      cells.start(block, patch.piece, normal);
      for (const PieceCells::Candidate& c : cells.candidates()) {
        if (c.sample->cell == nullptr) continue;
        CellPart part{normal, {}};
        for (const Place& p : cells.cell(c)) part.corners.push_back(cells.at(p) - c.sample->position);
        if (part.corners.size() > 2) c.sample->cell->push_back(std::move(part));
      }
    });
  });
}

std::vector<Sample*> Sampler::samples() {
  std::vector<std::size_t> first(1, 0);
  for (const Block& block : blocks_.blocks()) first.push_back(first.back() + block.samples.size());
  std::vector<Sample*> all(first.back());
  tbb::parallel_for(std::size_t{0}, blocks_.blocks().size(), [&](std::size_t n) {
    std::size_t at = first[n];
    for (Sample& sample : blocks_.blocks()[n].samples) all[at++] = &sample;
  });
  return all;
}

std::vector<PointFacet> facets_of(const std::vector<Sample*>& samples) {
  std::vector<std::uint32_t> folded;
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    if (samples[i]->cell != nullptr) folded.push_back(i);
  }
  std::vector<std::vector<Facet>> fitted(folded.size());
  tbb::parallel_for(std::size_t{0}, folded.size(),
                    [&](std::size_t n) { fitted[n] = fit_facets(*samples[folded[n]]->cell); });
  std::vector<PointFacet> facets;
  for (std::size_t n = 0; n < folded.size(); ++n) {
    for (const Facet& facet : fitted[n]) facets.push_back({folded[n], facet});
  }
  return facets;
}

// Rounds a normal as the asset stores it, so that the measured error holds for the asset.
Vector as_stored(const Vector& normal) {
  const auto [x, y, z] = decode_normal<double>(encode_normal({normal.x(), normal.y(), normal.z()}));
  return {x, y, z};
}

}  // namespace

Pointshell sample_pointshell(const Surface& surface, std::span<const Corner> corners, const Grid& grid,
                             const SurfaceVoxels& voxels, const InsideRuns& runs, const BandField& field,
                             double spacing, double thin, const StageProgress& progress) {
  // The shares of the steps, measured.
  const auto report = [&](double done) {
    if (progress) progress(done);
  };
  Sampler sampler(surface, spacing);
  sampler.sample_features(corners);
  report(0.05);
  sampler.sample_triangles(grid, voxels);
  report(0.15);
  sampler.fill_gaps();
  report(0.45);
  sampler.measure_areas();
  report(0.75);
  sampler.find_folds();
  sampler.drop_patches();
  report(0.87);
  std::vector<Sample*> samples = sampler.samples();
  Pointshell shell;
  shell.spacing = spacing;
  shell.covering_radius = sampler.covering_radius();
  shell.feature_covering_radius = shell.covering_radius;
  if (thin > 1) {
    shell.covering_radius += thin_faces(samples, spacing, {thin, kFaceSag * grid.voxel_size});
    for (const Sample* const sample : samples) shell.on_face.push_back(is_on_face(*sample) ? 1 : 0);
  }
  shell.positions.resize(samples.size());
  shell.inward_normals.resize(samples.size());
  shell.areas.resize(samples.size());
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
    const Sample& sample = *samples[i];
    shell.positions[i] = sample.position;
    shell.inward_normals[i] = inward_normal(grid, runs, field, sample);
    shell.areas[i] = sample.area;
  });
  shell.faces = find_faces(samples, shell.positions, shell.inward_normals, 2 * std::max(thin, 1.0) * spacing,
                           0.5 * kHullTolerance * shell.feature_covering_radius);
  shell.facets = facets_of(samples);
  std::vector<double> errors(samples.size());  // -1 on an edge
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
    const Vector& n = samples[i]->normal;
    const Vector inward = shell.inward_normals[i] = as_stored(shell.inward_normals[i]);
    errors[i] = samples[i]->on_edge ? -1 : std::atan2(inward.cross(n).norm(), -inward.dot(n));
  });
  std::size_t on_faces = 0;
  for (const double error : errors) {
    if (error < 0) continue;
    shell.normal_error_mean += error;
    shell.normal_error_max = std::max(shell.normal_error_max, error);
    ++on_faces;
  }
  if (on_faces > 0) shell.normal_error_mean /= static_cast<double>(on_faces);
  return shell;
}

}  // namespace vps::bake
