// SPDX-License-Identifier: GPL-3.0-or-later
// All lengths are in voxels, from the centre of voxel (0,0,0).
#include "bake/stages/fit_planes.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>

#include "bake/stages/surface_parts.h"
#include "formats/cell_plane.h"
#include "formats/octree.h"

namespace vps::bake {
namespace {

using Box = Eigen::AlignedBox3d;

// Surface farther around a cell or block is only known to be that far away.
constexpr double kUnseen = SurfaceParts::kAround * kPlaneCell;
// More than queries round in float.
constexpr double kMargin = 2e-3;
constexpr double kNone = std::numeric_limits<double>::lowest();

// The part of the grid that a plane is for: a cell, or a block of 2x2x2 cells.
struct Part {
  Index3 cell;  // its lowest
  std::uint32_t cells;
  [[nodiscard]] double half() const { return 0.5 * kPlaneCell * cells; }
  [[nodiscard]] Box box() const {
    const Vector low = kPlaneCell * Vector(cell[0], cell[1], cell[2]);
    return {low, low + Vector::Constant(2 * half())};
  }
};

// The samples that decide contacts in a box of cells: those of interpolation cells with a value above `least`.
class Samples {
 public:
  Samples(const PlaneSource& from, double least)
      : tree_(from.values.tree), values_(from.values), voxel_size_(from.grid.voxel_size), least_(least) {}

  // Calls sample(position, V), and inside(box) for cubes beyond the band inside.
  template <class Sample, class Inside>
  void for_each_in(const Box& box, Sample sample, Inside inside) const {
    const auto first = [&](int axis) { return std::max(std::floor(box.min()[axis] / kRootCells), 0.0); };
    const auto last = [&](int axis) {
      const auto end = static_cast<double>(tree_.root_dims[static_cast<std::size_t>(axis)]);
      return std::min(std::ceil(box.max()[axis] / kRootCells), end);
    };
    for (double z = first(2); z < last(2); ++z) {
      for (double y = first(1); y < last(1); ++y) {
        for (double x = first(0); x < last(0); ++x) {
          const auto root = static_cast<std::size_t>((z * tree_.root_dims[1] + y) * tree_.root_dims[0] + x);
          visit(tree_.roots[root], kRootCells * Vector(x, y, z), kRootCells, box, sample, inside);
        }
      }
    }
  }

 private:
  template <class Sample, class Inside>
  void visit(std::uint32_t entry, const Vector& low, double edge, const Box& box, Sample sample, Inside inside) const {
    if (entry == kFarOutside) return;
    const Vector high = low + Vector::Constant(edge);
    // Cubes that only share a face with the box do not count.
    if ((low.array() >= box.max().array()).any() || (high.array() <= box.min().array()).any()) return;
    const Box both = box.intersection(Box(low, high));
    if (entry == kFarInside) return inside(both);
    if (octree::is_brick(entry)) return visit_brick(entry, both, sample);
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      const Vector at = low + edge / 2 * Vector(octant & 1, octant >> 1 & 1, octant >> 2);
      visit(tree_.nodes[8 * std::size_t{octree::node_of(entry)} + octant], at, edge / 2, box, sample, inside);
    }
  }

  template <class Sample>
  void visit_brick(std::uint32_t entry, const Box& box, Sample sample) const {
    constexpr int kCells = kFieldEdge - 1;
    const double h = std::ldexp(1.0, octree::level_of(entry));
    const double step = values_.form.step(octree::level_of(entry)) / voxel_size_;
    const std::int16_t* const v = tree_.scaled.data() + octree::sample_at(entry, 0, 0, 0);
    const Vector low = (box.min() / (kCells * h)).array().floor() * (kCells * h);
    // The cells of interpolation that the box touches.
    int first[3];
    int last[3];
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = static_cast<int>(std::floor((box.min()[axis] - low[axis]) / h));
      last[axis] = std::min(static_cast<int>(std::ceil((box.max()[axis] - low[axis]) / h)), kCells);
    }
    std::array<bool, kFieldSamples> wanted{};
    for (int z = first[2]; z < last[2]; ++z) {
      for (int y = first[1]; y < last[1]; ++y) {
        for (int x = first[0]; x < last[0]; ++x) {
          std::size_t corners[8];
          int most = std::numeric_limits<int>::min();
          for (int corner = 0; corner < 8; ++corner) {
            const auto at = static_cast<std::size_t>(
                ((z + (corner >> 2)) * (kCells + 1) + y + (corner >> 1 & 1)) * (kCells + 1) + x + (corner & 1));
            corners[corner] = at;
            most = std::max(most, int{v[at]});
          }
          if (most * step < least_) continue;
          for (const std::size_t at : corners) wanted[at] = true;
        }
      }
    }
    std::size_t at = 0;
    for (int z = 0; z <= kCells; ++z) {
      for (int y = 0; y <= kCells; ++y) {
        for (int x = 0; x <= kCells; ++x, ++at) {
          if (wanted[at]) sample(Vector(low + h * Vector(x, y, z)), v[at] * step);
        }
      }
    }
  }

  const FieldTree& tree_;
  const Representations& values_;
  const double voxel_size_;
  const double least_;
};

// A sample relative to the cell's centre.
struct Value {
  Vector at;
  double v;
};

// The nearest code of a gradient that is no longer than 1.
void set_slope(const Vector& gradient, CellPlane& plane) {
  const Vector unit = gradient / std::max(gradient.norm(), 1.0);
  int squared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    plane.slope[axis] = static_cast<int>(std::lrint(kSlopeSteps * unit[axis]));
    squared += plane.slope[axis] * plane.slope[axis];
  }
  while (squared > kSlopeSteps * kSlopeSteps) {
    int* const largest =
        std::max_element(plane.slope, plane.slope + 3, [](int a, int b) { return std::abs(a) < std::abs(b); });
    squared -= 2 * std::abs(*largest) - 1;
    *largest -= *largest > 0 ? 1 : -1;
  }
}
Vector gradient_of(const CellPlane& plane) {
  return Vector(plane.slope[0], plane.slope[1], plane.slope[2]) / kSlopeSteps;
}

// The gradient of the plane with the least square error.
Vector fitted_gradient(const std::vector<Value>& values) {
  Vector mean = Vector::Zero();
  double mean_v = 0;
  for (const Value& value : values) {
    mean += value.at;
    mean_v += value.v;
  }
  const auto count = static_cast<double>(values.size());
  mean /= count;
  mean_v /= count;
  Eigen::Matrix3d squares = 1e-6 * count * Eigen::Matrix3d::Identity();
  Vector products = Vector::Zero();
  for (const Value& value : values) {
    const Vector at = value.at - mean;
    squares += at * at.transpose();
    products += (value.v - mean_v) * at;
  }
  return squares.ldlt().solve(products);
}

class Fitter {
 public:
  explicit Fitter(const PlaneSource& from)
      : from_(from),
        parts_(from.surface, from.grid),
        // Queries with a larger contact distance look at every point themselves.
        samples_(from, -(from.band_outer / from.grid.voxel_size - std::sqrt(0.75))),
        end_inner_(from.band_inner / from.grid.voxel_size - std::sqrt(0.75)) {}

  // The last blocks reach beyond the grid.
  [[nodiscard]] bool is_in_grid(const Part& part) const {
    const Index3& dims = from_.grid.brick_dims;
    return part.cell[0] < dims[0] && part.cell[1] < dims[1] && part.cell[2] < dims[2];
  }

  [[nodiscard]] CellPlane fit(const Part& part) const {
    if (!is_in_grid(part)) return {{}, kNoBound, false};
    const Box box = part.box();
    const Vector centre = box.center();
    std::vector<Value> values;
    std::vector<Box> inside;
    samples_.for_each_in(
        box,
        [&](const Vector& p, double v) {
          values.push_back({p - centre, v});
        },
        [&](const Box& cube) { inside.push_back(cube); });
    if (inside.size() == 1 && inside[0].volume() == box.volume()) return {{}, kNoBound, false};
    const int layer = most_layer(part);
    SurfaceAround around;
    if (may_see_surface(layer)) {
      parts_.for_each_around(part.cell, part.cells, [&](const SurfacePart& surface) { around.push_back(&surface); });
    }
    const Vector* const nearest = nearest_corner(around, centre);
    if (nearest == nullptr && values.empty()) return far_plane(layer);
    // Deep inside.
    if (nearest == nullptr && !inside.empty()) return {{}, kNoBound, false};

    CellPlane best;
    double least = std::numeric_limits<double>::max();
    const auto try_gradient = [&](const Vector& gradient) {
      CellPlane plane;
      set_slope(gradient, plane);
      const double height = height_of(plane, part, {values, inside, around}, least);
      if (height >= least) return;
      least = height;
      best = plane;
    };
    if (!values.empty()) try_gradient(fitted_gradient(values));
    // Deep inside values are clamped, and the plane through all would be too flat.
    std::vector<Value> sloping;
    std::copy_if(values.begin(), values.end(), std::back_inserter(sloping),
                 [&](const Value& value) { return value.v < end_inner_; });
    if (!sloping.empty() && sloping.size() < values.size()) try_gradient(fitted_gradient(sloping));
    if (nearest != nullptr) {
      const Vector to_nearest = *nearest - centre;
      try_gradient(to_nearest.normalized());
      constexpr double kLoose_vx = 0.25;
      constexpr double kNear_vx = 12;
      if (least > std::max(kLoose_vx - to_nearest.norm(), -kNear_vx)) {
        try_gradient(nearest_in_hull(around, centre, to_nearest).normalized());
      }
    }
    try_gradient(Vector::Zero());
    set_height(least, best);
    widen(box, values, best);
    return best;
  }

 private:
  // The largest height that the codes of cells and of blocks have.
  static constexpr int kNoBound = kLargestBlockHeight;
  // From the centre of a brick to the farthest point of its cell, which begins half a voxel behind the brick.
  static constexpr double kFarthest = (0.5 * kPlaneCell + 0.5) * std::numbers::sqrt3;

  static void set_height(double height, CellPlane& plane) {
    const double above = height + kMargin;
    const double root = std::sqrt(std::abs(above) * kHeightSquares);
    const double code = above < 0 ? -std::floor(root) : std::ceil(root);
    plane.height = static_cast<int>(std::clamp(code, double{-kLargestBlockHeight}, double{kLargestBlockHeight}));
  }

  using SurfaceAround = std::vector<const SurfacePart*>;

  // The first of the nearest ones.
  [[nodiscard]] static const Vector* nearest_corner(const SurfaceAround& around, const Vector& centre) {
    if (around.empty()) return nullptr;
    // The part with the nearest box excludes most others.
    const auto nearest_box = std::min_element(around.begin(), around.end(), [&](const auto* a, const auto* b) {
      return a->box.squaredExteriorDistance(centre) < b->box.squaredExteriorDistance(centre);
    });
    double closest = std::numeric_limits<double>::max();
    for (const Vector& q : (*nearest_box)->corners) closest = std::min(closest, (q - centre).squaredNorm());
    closest = std::nextafter(closest, std::numeric_limits<double>::max());
    const Vector* nearest = nullptr;
    for (const SurfacePart* const part : around) {
      if (part->box.squaredExteriorDistance(centre) >= closest) continue;
      for (const Vector& q : part->corners) {
        const double squared = (q - centre).squaredNorm();
        if (squared >= closest) continue;
        closest = squared;
        nearest = &q;
      }
    }
    return nearest;
  }

  // Near the point of the corners' hull that is nearest to the centre, by Gilbert's algorithm: a plane across the way
  // there is the lowest above the whole hull. The nearest corner of a face that slopes lies up to half a cell aside.
  // @param point  where to start, from the centre
  [[nodiscard]] static Vector nearest_in_hull(const SurfaceAround& around, const Vector& centre, Vector point) {
    constexpr int kSteps = 3;  // more are no better
    for (int step = 0; step < kSteps; ++step) {
      double least = 0.99 * point.squaredNorm();
      const Vector* support = nullptr;
      for (const SurfacePart* const part : around) {
        const Vector half = 0.5 * part->box.sizes();
        if (point.dot(part->box.center() - centre) - point.cwiseAbs().dot(half) >= least) continue;
        for (const Vector& q : part->corners) {
          const double along = point.dot(q - centre);
          if (along >= least) continue;
          least = along;
          support = &q;
        }
      }
      if (support == nullptr) break;
      const Vector way = *support - centre - point;
      point += std::clamp(-point.dot(way) / way.squaredNorm(), 0.0, 1.0) * way;
    }
    return point;
  }

  // The coarse layer of the part's bricks that is highest.
  [[nodiscard]] int most_layer(const Part& part) const {
    int most = std::numeric_limits<int>::min();
    for (std::uint32_t n = 0; n < part.cells * part.cells * part.cells; ++n) {
      const Index3 at = {part.cell[0] + n % part.cells, part.cell[1] + n / part.cells % part.cells,
                         part.cell[2] + n / part.cells / part.cells};
      const Index3& dims = from_.grid.brick_dims;
      if (at[0] >= dims[0] || at[1] >= dims[1] || at[2] >= dims[2]) continue;
      most = std::max(most, int{from_.coarse_layers[from_.grid.brick_at(at[0], at[1], at[2])]});
    }
    return most;
  }

  // Whether there may be surface up to `kUnseen` away. From the coarse layers: docs/internals/bounds.md.
  [[nodiscard]] static bool may_see_surface(int layer) {
    constexpr double kSeen = kUnseen * std::numbers::sqrt3 + kFarthest;
    return std::abs(layer) <= kSeen;
  }

  // From the coarse layers: docs/internals/bounds.md. |c| - |P - C| <= |V(P)| for any P.
  [[nodiscard]] static CellPlane far_plane(int layer) {
    if (layer > 0) return {{}, kNoBound, false};
    CellPlane plane;
    set_height(std::min(layer + kFarthest, -kUnseen), plane);
    return plane;
  }

  // What a plane has to bound in a part.
  struct Bounded {
    const std::vector<Value>& values;
    const std::vector<Box>& inside;
    const SurfaceAround& around;
  };

  // The least height at the centre with which a plane is a bound; or some height from `enough` on.
  [[nodiscard]] static double height_of(const CellPlane& plane, const Part& part, const Bounded& bounded,
                                        double enough) {
    const Vector centre = part.box().center();
    const Vector g = gradient_of(plane);
    // The surface that is not seen.
    double height = -kUnseen + part.half() * g.lpNorm<1>();
    for (const Value& value : bounded.values) height = std::max(height, value.v - g.dot(value.at));
    // Beyond the band inside, no sphere and no point may be rejected.
    for (const Box& cube : bounded.inside) {
      const Vector from_centre = cube.center() - centre;
      height = std::max(height, -g.dot(from_centre) + 0.5 * g.cwiseAbs().dot(cube.sizes()));
    }
    for (const SurfacePart* const seen : bounded.around) {
      if (height >= enough) break;
      const SurfacePart& surface = *seen;
      const Vector to_part = surface.box.center() - centre;
      const Vector half = 0.5 * surface.box.sizes();
      const double distance = to_part.norm();
      const Vector u = distance > 0 ? Vector(-to_part / distance) : Vector::Zero();
      const double turned = distance > 0 ? part.half() * (u + g).lpNorm<1>() : std::numeric_limits<double>::max();
      const auto bound_of_box = [&](const Vector& along) { return along.dot(to_part) + along.cwiseAbs().dot(half); };
      if (std::min(bound_of_box(-g), bound_of_box(u) + turned) <= height) continue;
      double by_gradient = kNone;
      double by_distance = kNone;
      for (const Vector& q : surface.corners) {
        by_gradient = std::max(by_gradient, -g.dot(q - centre));
        by_distance = std::max(by_distance, u.dot(q - centre));
      }
      height = std::max(height, std::min(by_gradient, by_distance + turned));
    }
    return height;
  }

  // Lets the plane bound the field around its cell as well, where that costs next to nothing.
  void widen(const Box& box, const std::vector<Value>& values, CellPlane& plane) const {
    constexpr double kAround_vx = 1;
    // A sphere of that radius that reaches beyond the band inside must lie inside itself.
    const double e = from_.error / from_.grid.voxel_size;
    if (values.empty() || from_.band_inner / from_.grid.voxel_size < std::sqrt(0.75) + kAround_vx + e) return;
    const Vector g = gradient_of(plane);
    constexpr double kCost_vx = 0.125;
    const double height = double{plane_height(plane.height)};
    const double most = height + kCost_vx - kMargin;
    // Saves time: a field that curves in the cell curves more around it.
    constexpr double kCurved = 0.5;
    double sum = 0;
    for (const Value& value : values) sum += value.v - g.dot(value.at);
    if (height - sum / static_cast<double>(values.size()) > kCurved) return;
    const Box wide(box.min() - Vector::Constant(kAround_vx), box.max() + Vector::Constant(kAround_vx));
    double needed = kNone;
    samples_.for_each_in(
        wide, [&](const Vector& p, double v) { needed = std::max(needed, v - g.dot(p - box.center())); },
        [](const Box&) {});
    if (needed > most) return;
    set_height(std::max(needed, height - kMargin), plane);
    plane.wide = true;
  }

  const PlaneSource& from_;
  const SurfaceParts parts_;
  const Samples samples_;
  const double end_inner_;  // values from there on may be clamped
};

// @param cell  the lowest of a block
Part octant_of(const Index3& cell, std::uint32_t octant) {
  return {{cell[0] + (octant & 1), cell[1] + (octant >> 1 & 1), cell[2] + (octant >> 2)}, 1};
}

using OctantPlanes = std::array<CellPlane, 8>;
OctantPlanes fit_octants(const Fitter& fitter, const Index3& cell) {
  OctantPlanes planes;
  for (std::uint32_t octant = 0; octant < 8; ++octant) planes[octant] = fitter.fit(octant_of(cell, octant));
  return planes;
}

// The octants' planes of a block without samples outside, if that of the block is loose. It is where the surface bends
// around it, which matters near the surface.
std::optional<OctantPlanes> needed_octants(const Fitter& fitter, const Index3& cell, const CellPlane& block) {
  constexpr double kLoose = 2;  // [vx]
  constexpr double kNear = 12;  // [vx]
  double heights[8];
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    constexpr float kPart = 0.5F * kPlaneCell;
    const auto place = [](std::uint32_t upper) { return upper != 0 ? kPart : -kPart; };
    heights[octant] = double{height_at(block, {place(octant & 1), place(octant & 2), place(octant & 4)})};
  }
  if (*std::max_element(heights, heights + 8) <= -kNear) return {};
  const OctantPlanes planes = fit_octants(fitter, cell);
  double gap = 0;
  double nearest = kNone;
  int count = 0;
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    if (!fitter.is_in_grid(octant_of(cell, octant))) continue;
    const double height = double{plane_height(planes[octant].height)};
    nearest = std::max(nearest, height);
    gap += heights[octant] - height;
    ++count;
  }
  if (gap > kLoose * count && nearest > -kNear) return planes;
  return {};
}

// Codes of the octants of a row of blocks along x.
struct OctantRow {
  std::vector<std::uint32_t> of_nodes, others;
};

void append_codes(const OctantPlanes& planes, std::vector<std::uint32_t>& codes) {
  for (const CellPlane& plane : planes) codes.push_back(encode(plane));
}

}  // namespace

FieldPlanes fit_planes(const PlaneSource& from) {
  const Fitter fitter(from);
  const Index3& dims = from.values.tree.root_dims;
  FieldPlanes out;
  out.roots = from.values.tree.roots;
  std::vector<OctantRow> rows(std::size_t{dims[1]} * dims[2]);
  tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t n) {
    OctantRow& row = rows[n];
    for (std::uint32_t x = 0; x < dims[0]; ++x) {
      std::uint32_t& root = out.roots[n * dims[0] + x];
      const Index3 cell = {2 * x, static_cast<std::uint32_t>(2 * (n % dims[1])),
                           static_cast<std::uint32_t>(2 * (n / dims[1]))};
      if (octree::is_node(root)) {
        append_codes(fit_octants(fitter, cell), row.of_nodes);
        continue;
      }
      const CellPlane plane = fitter.fit({cell, 2});
      const bool is_inside = root == kFarInside;
      const auto octants = is_inside ? std::nullopt : needed_octants(fitter, cell, plane);
      root = octants ? kOctantsFlag : encode_block(plane, is_inside);
      if (octants) append_codes(*octants, row.others);
    }
  });
  // Nodes have the numbers from 0.
  for (const OctantRow& row : rows) out.octants.insert(out.octants.end(), row.of_nodes.begin(), row.of_nodes.end());
  auto count = static_cast<std::uint32_t>(out.octants.size() / 8);
  for (const OctantRow& row : rows) out.octants.insert(out.octants.end(), row.others.begin(), row.others.end());
  for (std::uint32_t& root : out.roots) {
    if (root == kOctantsFlag) root |= count++;
  }
  return out;
}

}  // namespace vps::bake
