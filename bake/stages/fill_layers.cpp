// SPDX-License-Identifier: GPL-3.0-or-later
// Scanline fill and layers. Paper: Sec. 2.1.1 (modified scanline fill of [KS86]).
#include "bake/stages/fill_layers.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <tuple>

#include "bake/repair/winding.h"
#include "bake/vps_bake.h"

namespace vps::bake {
namespace {

// The winding number changes by `step` at voxel `at` of a line.
struct Event {
  std::uint32_t line;
  std::uint32_t at;
  std::int32_t step;
};

// First voxel of the line whose centre is past the crossing. A centre on the surface counts as inside (V = 0 is
// contact).
std::uint32_t first_voxel_past(const Surface& surface, const Grid& grid, std::size_t t, std::uint32_t j,
                               std::uint32_t k, int crossing) {
  const Vector on_line = grid.centre(0, j, k);
  const double x = crossing_x(on_line.y(), on_line.z(), surface, t);
  const double position = (x - grid.origin.x()) / grid.voxel_size - 0.5;
  const double nearest = std::clamp(std::round(position), 0.0, grid.dims[0] - 1.0);
  auto i = static_cast<std::uint32_t>(nearest);
  // The plane of a sliver, or of a triangle nearly along the line, is uncertain in double.
  const Vector ab = surface.corner(t, 1) - surface.corner(t, 0);
  const Vector ac = surface.corner(t, 2) - surface.corner(t, 0);
  const double plane_error = std::numeric_limits<double>::epsilon() * std::sqrt(ab.squaredNorm() * ac.squaredNorm());
  const double x_error = 8 * plane_error * (ab.cwiseAbs().sum() + ac.cwiseAbs().sum());
  constexpr double kTie = 1e-6;  // far above rounding; within it the predicate decides
  const bool certain = x_error < kTie * grid.voxel_size * std::abs(surface.area_normal(t).x());
  if (certain && std::abs(position - nearest) > kTie) return position < nearest ? i : i + 1;
  const auto is_past = [&](std::uint32_t at) {
    const Vector centre = grid.centre(at, j, k);
    if (crossing_is_beyond(centre, surface, t)) return false;
    return crossing > 0 || !point_on_plane(centre, surface, t);
  };
  while (i > 0 && is_past(i - 1)) --i;
  while (i < grid.dims[0] && !is_past(i)) ++i;
  return i;
}

std::vector<Event> find_crossings(const Surface& surface, const Grid& grid) {
  std::vector<Event> events;
  std::mutex adding;
  const double slack = rounding_slack(grid);
  const auto find = [&](std::size_t t, std::vector<Event>& found) {
    const Vector low = surface.corner(t, 0).cwiseMin(surface.corner(t, 1)).cwiseMin(surface.corner(t, 2));
    const Vector high = surface.corner(t, 0).cwiseMax(surface.corner(t, 1)).cwiseMax(surface.corner(t, 2));
    const VoxelRange js = voxel_range(grid, 1, low.y(), high.y(), slack);
    const VoxelRange ks = voxel_range(grid, 2, low.z(), high.z(), slack);
    for (std::uint32_t k = ks.first; k <= ks.last; ++k) {
      for (std::uint32_t j = js.first; j <= js.last; ++j) {
        const Vector centre = grid.centre(0, j, k);
        const int crossing = line_crossing(centre.y(), centre.z(), surface, t);
        if (crossing == 0) continue;
        found.push_back({k * grid.dims[1] + j, first_voxel_past(surface, grid, t, j, k, crossing), crossing});
      }
    }
  };
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, surface.triangles.size()),
                    [&](const tbb::blocked_range<std::size_t>& triangles) {
                      std::vector<Event> found;
                      for (std::size_t t = triangles.begin(); t < triangles.end(); ++t) find(t, found);
                      const std::scoped_lock lock(adding);
                      events.insert(events.end(), found.begin(), found.end());
                    });
  tbb::parallel_sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
    return std::tie(a.line, a.at, a.step) < std::tie(b.line, b.at, b.step);
  });
  return events;
}

[[noreturn]] void report_leak(const Grid& grid, std::uint32_t line) {
  const Vector at = grid.centre(0, line % grid.dims[1], line / grid.dims[1]);
  throw BakeError("fill_layers",
                  fmt::format("the surface leaks: the line y = {:.6g} m, z = {:.6g} m enters the solid and "
                              "does not leave it; close the mesh there",
                              at.y(), at.z()));
}

// Surface bits of the 5x5x5 bricks around one brick as rows of 40 bits along x.
constexpr int kReach = 2;
constexpr int kWindow = (2 * kReach + 1) * static_cast<int>(kBrickEdge);
using Row = std::uint64_t;
using Window = std::vector<Row>;

void load_window(const SurfaceVoxels& surface, const Grid& grid, const Index3& brick, Window& rows) {
  std::fill(rows.begin(), rows.end(), 0);
  for (int dz = -kReach; dz <= kReach; ++dz) {
    for (int dy = -kReach; dy <= kReach; ++dy) {
      for (int dx = -kReach; dx <= kReach; ++dx) {
        const std::int64_t b[3] = {std::int64_t{brick[0]} + dx, std::int64_t{brick[1]} + dy,
                                   std::int64_t{brick[2]} + dz};
        if (b[0] < 0 || b[1] < 0 || b[2] < 0 || b[0] >= grid.brick_dims[0] || b[1] >= grid.brick_dims[1] ||
            b[2] >= grid.brick_dims[2]) {
          continue;
        }
        const std::uint32_t at = surface.set.index[grid.brick_at(
            static_cast<std::uint32_t>(b[0]), static_cast<std::uint32_t>(b[1]), static_cast<std::uint32_t>(b[2]))];
        if (at == kNoBrick) continue;
        for (int z = 0; z < 8; ++z) {
          for (int y = 0; y < 8; ++y) {
            const Row bits = (surface.masks[at][static_cast<std::size_t>(z)] >> (8 * y)) & 0xFF;
            rows[static_cast<std::size_t>(((dz + kReach) * 8 + z) * kWindow + (dy + kReach) * 8 + y)] |=
                bits << ((dx + kReach) * 8);
          }
        }
      }
    }
  }
}

// One step of 26-neighbour dilation, axis by axis.
void dilate(Window& rows, Window& scratch) {
  for (Row& row : rows) row |= row << 1 | row >> 1;
  const auto pass = [](const Window& from, Window& to, int stride, int length) {
    for (int i = 0; i < kWindow * kWindow; ++i) {
      const int at = (i / stride) % length;
      Row row = from[static_cast<std::size_t>(i)];
      if (at > 0) row |= from[static_cast<std::size_t>(i - stride)];
      if (at + 1 < length) row |= from[static_cast<std::size_t>(i + stride)];
      to[static_cast<std::size_t>(i)] = row;
    }
  };
  pass(rows, scratch, 1, kWindow);
  pass(scratch, rows, kWindow, kWindow);
}

void brick_layers(Window& rows, Window& scratch, const BrickMask& inside, std::int8_t* layers) {
  std::array<bool, kBrickVoxels> done{};
  std::uint32_t left = kBrickVoxels;
  for (int n = 0; left > 0; ++n) {
    if (n > kReach * static_cast<int>(kBrickEdge)) {
      throw BakeError("fill_layers", "a brick lies farther from the surface than its band; report this as a defect");
    }
    if (n > 0) dilate(rows, scratch);
    for (std::uint32_t voxel = 0; voxel < kBrickVoxels; ++voxel) {
      const std::uint32_t x = voxel % 8 + 8 * kReach;
      const std::uint32_t y = voxel / 8 % 8 + 8 * kReach;
      const std::uint32_t z = voxel / 64 + 8 * kReach;
      if (done[voxel] || ((rows[z * kWindow + y] >> x) & 1) == 0) continue;
      done[voxel] = true;
      --left;
      layers[voxel] = static_cast<std::int8_t>(test_bit(inside, voxel) ? n : -n);
    }
  }
}

}  // namespace

bool InsideRuns::test(const Grid& grid, std::uint32_t i, std::uint32_t j, std::uint32_t k) const {
  const std::size_t line = std::size_t{k} * grid.dims[1] + j;
  const auto first = bounds.begin() + line_start[line];
  const auto last = bounds.begin() + line_start[line + 1];
  return (std::upper_bound(first, last, i) - first) % 2 == 1;
}

InsideRuns fill_inside(const Surface& surface, const Grid& grid) {
  const std::vector<Event> events = find_crossings(surface, grid);
  InsideRuns runs;
  const std::size_t lines = std::size_t{grid.dims[1]} * grid.dims[2];
  runs.line_start.reserve(lines + 1);
  std::size_t e = 0;
  for (std::uint32_t line = 0; line < lines; ++line) {
    runs.line_start.push_back(static_cast<std::uint32_t>(runs.bounds.size()));
    int winding = 0;
    while (e < events.size() && events[e].line == line) {
      const std::uint32_t at = events[e].at;
      const bool was_inside = winding > 0;
      for (; e < events.size() && events[e].line == line && events[e].at == at; ++e) winding += events[e].step;
      if (was_inside == (winding > 0)) continue;
      if (was_inside) runs.count += at - runs.bounds.back();
      runs.bounds.push_back(at);
    }
    if (winding != 0) report_leak(grid, line);
  }
  runs.line_start.push_back(static_cast<std::uint32_t>(runs.bounds.size()));
  return runs;
}

std::vector<BrickMask> inside_masks(const InsideRuns& runs, const Grid& grid, const BrickSet& set) {
  std::vector<BrickMask> masks(set.bricks.size(), BrickMask{});
  tbb::parallel_for(std::size_t{0}, set.bricks.size(), [&](std::size_t n) {
    const Index3& b = set.bricks[n];
    const std::uint32_t x0 = b[0] * kBrickEdge;
    for (std::uint32_t row = 0; row < kBrickEdge * kBrickEdge; ++row) {
      const std::uint32_t j = b[1] * kBrickEdge + row % kBrickEdge;
      const std::uint32_t k = b[2] * kBrickEdge + row / kBrickEdge;
      const std::size_t line = std::size_t{k} * grid.dims[1] + j;
      for (std::uint32_t r = runs.line_start[line]; r < runs.line_start[line + 1]; r += 2) {
        const std::uint32_t first = std::max(runs.bounds[r], x0);
        const std::uint32_t end = std::min(runs.bounds[r + 1], x0 + kBrickEdge);
        for (std::uint32_t i = first; i < end; ++i) set_bit(masks[n], row * kBrickEdge + (i - x0));
      }
    }
  });
  return masks;
}

std::vector<std::int8_t> fill_layers(const SurfaceVoxels& surface, const std::vector<BrickMask>& inside,
                                     const Grid& grid, const BrickSet& set) {
  std::vector<std::int8_t> layers(set.bricks.size() * kBrickVoxels);
  tbb::parallel_for(std::size_t{0}, set.bricks.size(), [&](std::size_t n) {
    Window rows(kWindow * kWindow);
    Window scratch(kWindow * kWindow);
    load_window(surface, grid, set.bricks[n], rows);
    brick_layers(rows, scratch, inside[n], layers.data() + n * kBrickVoxels);
  });
  return layers;
}

}  // namespace vps::bake
