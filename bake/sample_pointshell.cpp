// SPDX-License-Identifier: GPL-3.0-or-later
// Pointshell sampling. Paper: Sec. 2.1.2: surface voxel centres projected onto triangles, kept at least alpha s apart.
// Beyond the paper: sharp vertices and edges first, so that no tip is cut; then every gap is found by subdividing the
// triangles and filled, which bounds the covering radius; and each point gets the area it stands for.
#include "bake/sample_pointshell.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/point_grid.h"

namespace vps {
namespace {

// Points whose triangles face away from each other by more than this (cosine) lie on two sides of a wall or wedge: both
// sides have to be sampled, however thin it is.
constexpr double kSameSide = -0.25;
// Dihedral angle above which an edge is sampled as a feature (cosine of 40 degrees).
constexpr double kSharp = 0.766;

struct Piece {
  Vector a, b, c;
};

class Sampler {
 public:
  Sampler(const Surface& surface, double spacing) : surface_(surface), spacing_(spacing), grid_(spacing) {}

  /// Adds the point unless one on the same side is nearer than the spacing.
  void offer(const Vector& p, const Vector& normal) {
    bool free = true;
    grid_.for_each_near(p, 1, [&](std::uint32_t q) {
      free = free && !((positions_[q] - p).squaredNorm() < spacing_ * spacing_ && normal.dot(normals_[q]) > kSameSide);
    });
    if (!free) return;
    grid_.insert(p, static_cast<std::uint32_t>(positions_.size()));
    positions_.push_back(p);
    normals_.push_back(normal);
  }

  void sample_features();
  void sample_triangles(const Grid& grid, const SurfaceVoxels& voxels);
  void fill_gaps();
  [[nodiscard]] std::vector<double> areas() const;

  [[nodiscard]] const std::vector<Vector>& positions() const { return positions_; }
  [[nodiscard]] const std::vector<Vector>& normals() const { return normals_; }
  [[nodiscard]] double covering_radius() const { return covering_; }

 private:
  struct Near {
    std::uint32_t point = kNoTriangle;
    double distance = std::numeric_limits<double>::infinity();  ///< largest distance to a corner of the piece
  };
  /// The point whose farthest corner of the piece is nearest; kNoTriangle when none is within two spacings.
  [[nodiscard]] Near nearest(const Piece& piece, const Vector& normal) const;
  void fill(const Piece& piece, const Vector& normal);

  const Surface& surface_;
  const double spacing_;
  PointGrid grid_;
  std::vector<Vector> positions_;
  std::vector<Vector> normals_;  // outward, of the triangle each point was made on
  double covering_ = 0;
};

double longest_edge(const Piece& p, int& edge) {
  const double lengths[3] = {(p.b - p.a).norm(), (p.c - p.b).norm(), (p.a - p.c).norm()};
  edge = static_cast<int>(std::max_element(lengths, lengths + 3) - lengths);
  return lengths[edge];
}

// Halves a piece at its longest edge.
std::array<Piece, 2> split(const Piece& p, int edge) {
  const Vector corners[3] = {p.a, p.b, p.c};
  const Vector& from = corners[edge];
  const Vector& to = corners[(edge + 1) % 3];
  const Vector& apex = corners[(edge + 2) % 3];
  const Vector middle = (from + to) / 2;
  return {Piece{from, middle, apex}, Piece{middle, to, apex}};
}

// Sharp edges are walked from one end to the other; their ends, and tips where the normals spread, come first.
void Sampler::sample_features() {
  struct Side {
    std::uint64_t key;
    std::uint32_t triangle;
  };
  std::vector<Side> sides;
  for (std::uint32_t t = 0; t < surface_.triangles.size(); ++t) {
    const Triangle& v = surface_.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [lo, hi] = std::minmax(v[k], v[(k + 1) % 3]);
      sides.push_back({std::uint64_t{lo} << 32 | hi, t});
    }
  }
  std::stable_sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.key < b.key; });

  struct SharpEdge {
    std::uint32_t from, to, triangle;
  };
  std::vector<SharpEdge> sharp;
  std::vector<std::uint8_t> sharp_ends(surface_.vertices.size(), 0);
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i;
    bool is_sharp = false;
    for (; end < sides.size() && sides[end].key == sides[i].key; ++end) {
      is_sharp = is_sharp || surface_.normals[sides[end].triangle].dot(surface_.normals[sides[i].triangle]) < kSharp;
    }
    if (is_sharp) {
      const auto from = static_cast<std::uint32_t>(sides[i].key >> 32);
      const auto to = static_cast<std::uint32_t>(sides[i].key);
      sharp.push_back({from, to, sides[i].triangle});
      for (const std::uint32_t v : {from, to})
        sharp_ends[v] = static_cast<std::uint8_t>(std::min(255, sharp_ends[v] + 1));
    }
    i = end;
  }
  // Two sharp edges pass through a vertex; one or three and more end there.
  for (const SharpEdge& e : sharp) {
    for (const std::uint32_t v : {e.from, e.to}) {
      if (sharp_ends[v] != 2) offer(surface_.vertices[v], surface_.normals[e.triangle]);
    }
  }
  for (const SharpEdge& e : sharp) {
    const Vector& from = surface_.vertices[e.from];
    const Vector step = surface_.vertices[e.to] - from;
    const int count = std::max(1, static_cast<int>(std::floor(step.norm() / spacing_)));
    for (int i = 0; i <= count; ++i) offer(from + step * (double(i) / count), surface_.normals[e.triangle]);
  }
}

// The paper's rule: centres of the surface voxels in the triangle's box, projected onto the triangle.
void Sampler::sample_triangles(const Grid& grid, const SurfaceVoxels& voxels) {
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    const Vector& a = surface_.corner(t, 0);
    const Vector& b = surface_.corner(t, 1);
    const Vector& c = surface_.corner(t, 2);
    const Vector& n = surface_.normals[t];
    const Vector low = a.cwiseMin(b).cwiseMin(c);
    const Vector high = a.cwiseMax(b).cwiseMax(c);
    VoxelRange range[3];
    for (int axis = 0; axis < 3; ++axis) range[axis] = voxel_range(grid, axis, low[axis], high[axis], 0);
    for (std::uint32_t k = range[2].first; k <= range[2].last; ++k) {
      for (std::uint32_t j = range[1].first; j <= range[1].last; ++j) {
        for (std::uint32_t i = range[0].first; i <= range[0].last; ++i) {
          const Vector centre = grid.centre(i, j, k);
          const double height = n.dot(centre - a);
          // A voxel whose centre is farther off the plane is not this triangle's.
          if (std::abs(height) > 0.87 * grid.voxel_size || !voxels.test(grid, i, j, k)) continue;
          const Vector p = centre - height * n;
          if ((b - a).cross(p - a).dot(n) < 0 || (c - b).cross(p - b).dot(n) < 0 || (a - c).cross(p - c).dot(n) < 0) {
            continue;
          }
          offer(p, n);
        }
      }
    }
  }
}

Sampler::Near Sampler::nearest(const Piece& piece, const Vector& normal) const {
  Near best;
  const Vector centre = (piece.a + piece.b + piece.c) / 3;
  // One cell is a spacing: only a point found farther away may be beaten by one from the next ring.
  for (int reach = 1; reach <= 2 && best.distance > spacing_; ++reach) {
    double squared = best.distance * best.distance;
    grid_.for_each_near(centre, reach, [&](std::uint32_t q) {
      if (normal.dot(normals_[q]) <= kSameSide) return;
      const Vector& p = positions_[q];
      const double far =
          std::max({(p - piece.a).squaredNorm(), (p - piece.b).squaredNorm(), (p - piece.c).squaredNorm()});
      if (far < squared) {
        squared = far;
        best.point = q;
      }
    });
    best.distance = std::sqrt(squared);
  }
  return best;
}

// A triangle lies within r of a point if its corners do. Pieces too large to tell are halved; a small one that is still
// uncovered gets a point at its centroid, which is free unless a neighbour is nearer than the spacing.
void Sampler::fill(const Piece& piece, const Vector& normal) {
  int edge = 0;
  const double longest = longest_edge(piece, edge);
  Near near;
  if (longest <= 2 * spacing_) near = nearest(piece, normal);
  if (near.distance > spacing_) {
    if (longest > spacing_ / 6) {
      for (const Piece& half : split(piece, edge)) fill(half, normal);
      return;
    }
    offer((piece.a + piece.b + piece.c) / 3, normal);
    near = nearest(piece, normal);
  }
  covering_ = std::max(covering_, near.distance);
}

void Sampler::fill_gaps() {
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    fill({surface_.corner(t, 0), surface_.corner(t, 1), surface_.corner(t, 2)}, surface_.normals[t]);
  }
}

// Every piece of surface goes to the point nearest to its centroid: a Voronoi partition at the pieces' resolution.
std::vector<double> Sampler::areas() const {
  std::vector<double> areas(positions_.size(), 0);
  std::vector<Piece> stack;
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    stack.push_back({surface_.corner(t, 0), surface_.corner(t, 1), surface_.corner(t, 2)});
    while (!stack.empty()) {
      const Piece piece = stack.back();
      stack.pop_back();
      int edge = 0;
      if (longest_edge(piece, edge) > 0.75 * spacing_) {
        for (const Piece& half : split(piece, edge)) stack.push_back(half);
        continue;
      }
      const Vector centre = (piece.a + piece.b + piece.c) / 3;
      const Near near = nearest({centre, centre, centre}, surface_.normals[t]);
      if (near.point != kNoTriangle) areas[near.point] += (piece.b - piece.a).cross(piece.c - piece.a).norm() / 2;
    }
  }
  return areas;
}

// V at any point near the surface, trilinear between voxel centres.
double interpolate(const Grid& grid, const InsideRuns& runs, const BandField& field, const Vector& p) {
  const Vector g = (p - grid.origin) / grid.voxel_size - Vector::Constant(0.5);
  std::uint32_t base[3];
  double w[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::clamp(std::floor(g[axis]), 0.0, grid.dims[static_cast<std::size_t>(axis)] - 2.0);
    base[axis] = static_cast<std::uint32_t>(cell);
    w[axis] = g[axis] - cell;
  }
  double sum = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const std::uint32_t dx = corner & 1;
    const std::uint32_t dy = corner >> 1 & 1;
    const std::uint32_t dz = corner >> 2;
    const double weight = (dx != 0 ? w[0] : 1 - w[0]) * (dy != 0 ? w[1] : 1 - w[1]) * (dz != 0 ? w[2] : 1 - w[2]);
    sum += weight * field.value(grid, runs, base[0] + dx, base[1] + dy, base[2] + dz);
  }
  return sum;
}

// The gradient of V points inward; central differences over one voxel. Where it vanishes (the middle of a thin wall) or
// contradicts the triangle, the triangle's own normal is better.
Vector inward_normal(const Grid& grid, const InsideRuns& runs, const BandField& field, const Vector& p,
                     const Vector& outward) {
  const double h = grid.voxel_size / 2;
  Vector gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector step = h * Vector::Unit(axis);
    gradient[axis] = interpolate(grid, runs, field, p + step) - interpolate(grid, runs, field, p - step);
  }
  const double length = gradient.norm();
  constexpr double kTrust = 0.4;  // of the unit slope
  if (!(length > kTrust * 2 * h) || gradient.dot(outward) > -0.2 * length) return -outward;
  return gradient / length;
}

}  // namespace

Pointshell sample_pointshell(const Surface& surface, const Grid& grid, const SurfaceVoxels& voxels,
                             const InsideRuns& runs, const BandField& field, double spacing) {
  Sampler sampler(surface, spacing);
  sampler.sample_features();
  sampler.sample_triangles(grid, voxels);
  sampler.fill_gaps();
  Pointshell shell;
  shell.spacing = spacing;
  shell.covering_radius = sampler.covering_radius();
  shell.positions = sampler.positions();
  shell.areas = sampler.areas();
  shell.inward_normals.reserve(shell.positions.size());
  for (std::size_t i = 0; i < shell.positions.size(); ++i) {
    shell.inward_normals.push_back(inward_normal(grid, runs, field, shell.positions[i], sampler.normals()[i]));
  }
  return shell;
}

}  // namespace vps
