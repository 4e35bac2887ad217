// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled once per instruction set by Highway, chosen at run time. Every operation is rounded by itself, so that all
// give the same bits as one sample after the other.
#include "bake/stages/near_samples.h"

#include <algorithm>
#include <bit>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/stages/near_samples.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#ifndef VPS_NEAR_SAMPLES_COMMON
#define VPS_NEAR_SAMPLES_COMMON
namespace vps::bake::detail {
inline constexpr double kNowhere = std::numeric_limits<double>::infinity();
inline constexpr std::size_t kChunk = 8;

// Samples that follow each other, and the place of the first one's results. Results fill whole chunks.
struct Slab {
  std::size_t begin, end, to;
};

struct NearSearch {
  std::span<const Slab> slabs;
  const double* lanes[7];  // position, normal, cell along x
  double corner[3][3];
  double normal[3];
  double same_side;
  double first_x, last_x;  // cells
  double* squared[3];      // distances from the corners, infinite for samples that do not count
  double* farthest;
};
}  // namespace vps::bake::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<double, kChunk> double_lanes;
using DoubleLanes = hn::Vec<decltype(double_lanes)>;

HWY_INLINE DoubleLanes all(double value) {
  return hn::Set(double_lanes, value);
}
HWY_INLINE DoubleLanes sum_of_products(const DoubleLanes (&a)[3], const DoubleLanes (&b)[3]) {
  return hn::Add(hn::Add(hn::Mul(a[0], b[0]), hn::Mul(a[1], b[1])), hn::Mul(a[2], b[2]));
}

// Measures a slab's samples.
// @return the least squared distance from the farthest corner
double measure(const NearSearch& search, const Slab& slab) {
  const DoubleLanes of_piece[3] = {all(search.normal[0]), all(search.normal[1]), all(search.normal[2])};
  DoubleLanes least = all(kNowhere);
  std::size_t to = slab.to;
  for (std::size_t n = slab.begin; n < slab.end; n += hn::Lanes(double_lanes), to += hn::Lanes(double_lanes)) {
    const auto load = [&](std::size_t lane) HWY_ATTR { return hn::LoadU(double_lanes, search.lanes[lane] + n); };
    const DoubleLanes position[3] = {load(0), load(1), load(2)};
    const DoubleLanes normal[3] = {load(3), load(4), load(5)};
    const DoubleLanes x = load(6);
    const auto counts =
        hn::And(hn::And(hn::Ge(x, all(search.first_x)), hn::Le(x, all(search.last_x))),
                hn::And(hn::Gt(sum_of_products(of_piece, normal), all(search.same_side)),
                        hn::Lt(hn::Iota(double_lanes, static_cast<double>(n)), all(static_cast<double>(slab.end)))));
    DoubleLanes farthest = hn::Zero(double_lanes);
    for (std::size_t k = 0; k < 3; ++k) {
      const DoubleLanes to_sample[3] = {hn::Sub(position[0], all(search.corner[k][0])),
                                        hn::Sub(position[1], all(search.corner[k][1])),
                                        hn::Sub(position[2], all(search.corner[k][2]))};
      const DoubleLanes squared = hn::IfThenElse(counts, sum_of_products(to_sample, to_sample), all(kNowhere));
      hn::StoreU(squared, double_lanes, search.squared[k] + to);
      farthest = hn::Max(farthest, squared);
    }
    hn::StoreU(farthest, double_lanes, search.farthest + to);
    least = hn::Min(least, farthest);
  }
  return hn::GetLane(hn::MinOfLanes(double_lanes, least));
}

// @param places  receives those of the results that are chosen, in order
// @return how many
std::size_t find_samples(const NearSearch& search, std::uint32_t* places) {
  double least = kNowhere;
  for (const Slab& slab : search.slabs) least = std::min(least, measure(search, slab));
  if (!(least < kNowhere)) return 0;
  const auto ends = [](const Slab& slab) { return slab.to + slab.end - slab.begin; };
  DoubleLanes of_best[3];
  for (const Slab& slab : search.slabs) {
    const double* const found = std::find(search.farthest + slab.to, search.farthest + ends(slab), least);
    if (found == search.farthest + ends(slab)) continue;
    for (std::size_t k = 0; k < 3; ++k) of_best[k] = all(search.squared[k][found - search.farthest]);
    break;
  }
  double best = kNowhere;
  std::size_t count = 0;
  for (const Slab& slab : search.slabs) {
    for (std::size_t n = slab.to; n < ends(slab); n += hn::Lanes(double_lanes)) {
      const auto nearer = [&](std::size_t k)
                              HWY_ATTR { return hn::Lt(hn::LoadU(double_lanes, search.squared[k] + n), of_best[k]); };
      std::array<std::uint8_t, 8> bits{};
      hn::StoreMaskBits(double_lanes, hn::Or(hn::Or(nearer(0), nearer(1)), nearer(2)), bits.data());
      unsigned chosen = bits[0];
      const DoubleLanes farthest = hn::LoadU(double_lanes, search.farthest + n);
      for (;;) {
        const auto better = hn::Lt(farthest, all(best));
        if (hn::AllFalse(double_lanes, better)) break;
        const auto at = static_cast<std::size_t>(hn::FindFirstTrue(double_lanes, better));
        best = search.farthest[n + at];
        chosen |= 1U << at;
      }
      for (; chosen != 0; chosen &= chosen - 1) {
        places[count++] = static_cast<std::uint32_t>(n + static_cast<std::size_t>(std::countr_zero(chosen)));
      }
    }
  }
  return count;
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(find_samples);
}  // namespace detail

void NearSamples::collect(const SurfaceBlocks& blocks, const Block& home, double reach) {
  blocks_ = &blocks;
  reach_ = reach;
  Eigen::AlignedBox3d box;
  blocks.for_each_patch(home, [&](const Patch& patch) {
    for (const Vector& corner : patch.piece) box.extend(corner);
  });
  from_ = blocks.cell_of(box.min() - Vector::Constant(reach));
  const Position to = blocks.cell_of(box.max() + Vector::Constant(reach));
  for (std::size_t axis = 0; axis < 3; ++axis) dims_[axis] = to[axis] - from_[axis] + 1;
  // Loading the samples takes longest: those of all cells at the same time.
  const auto fetch = [](const Sample* sample) {
    hwy::Prefetch(sample);
    hwy::Prefetch(&sample->next);
  };
  samples_.clear();
  SurfaceBlocks::for_each_cell(home, from_, to, [&](Sample* head) {
    if (head == nullptr) return;
    fetch(head);
    samples_.push_back(head);
  });
  for (std::size_t count = samples_.size(); count > 0;) {
    std::size_t kept = 0;
    for (std::size_t n = 0; n < count; ++n) {
      Sample* const next = samples_[n]->next;
      if (next == nullptr) continue;
      fetch(next);
      samples_[kept++] = next;
    }
    count = kept;
  }
  samples_.clear();
  first_.assign(1, 0);
  SurfaceBlocks::for_each_cell(home, from_, to, [&](Sample* head) {
    for (Sample* s = head; s != nullptr; s = s->next) samples_.push_back(s);
    first_.push_back(static_cast<std::uint32_t>(samples_.size()));
  });
  for (std::vector<double>& lane : lanes_) lane.resize(samples_.size() + detail::kChunk);
  for (std::size_t n = 0; n < samples_.size(); ++n) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      lanes_[axis][n] = samples_[n]->position[static_cast<Eigen::Index>(axis)];
      lanes_[3 + axis][n] = samples_[n]->normal[static_cast<Eigen::Index>(axis)];
    }
  }
  for (std::size_t cell = 0; cell + 1 < first_.size(); ++cell) {
    const int x = from_[0] + static_cast<int>(cell) % dims_[0];
    std::fill(lanes_[6].begin() + first_[cell], lanes_[6].begin() + first_[cell + 1], x);
  }
}

void NearSamples::insert(Sample& sample) {
  const Position cell = blocks_->cell_of(sample.position);
  const std::size_t number = number_of(cell);
  const std::ptrdiff_t at = first_[number];
  samples_.insert(samples_.begin() + at, &sample);
  const auto insert = [&](std::size_t lane, double value) { lanes_[lane].insert(lanes_[lane].begin() + at, value); };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    insert(axis, sample.position[static_cast<Eigen::Index>(axis)]);
    insert(3 + axis, sample.normal[static_cast<Eigen::Index>(axis)]);
  }
  insert(6, cell[0]);
  for (std::size_t n = number + 1; n < first_.size(); ++n) ++first_[n];
}

void NearSamples::find(const Piece& piece, const Vector& normal, double same_side, std::vector<Found>& found) {
  using namespace detail;
  const Vector low = piece[0].cwiseMin(piece[1]).cwiseMin(piece[2]);
  const Vector high = piece[0].cwiseMax(piece[1]).cwiseMax(piece[2]);
  const Position from = blocks_->cell_of(low - Vector::Constant(reach_));
  const Position to = blocks_->cell_of(high + Vector::Constant(reach_));
  std::array<Slab, 12> slabs;
  std::size_t slab_count = 0;
  std::size_t count = 0;
  for (int z = from[2]; z <= to[2]; ++z) {
    const std::size_t begin = first_[number_of({from[0], from[1], z})];
    const std::size_t end = first_[number_of({to[0], to[1], z}) + 1];
    if (begin == end) continue;
    slabs[slab_count++] = {begin, end, count};
    count += (end - begin + kChunk - 1) / kChunk * kChunk;
  }
  if (places_.size() < count) {
    for (std::vector<double>& distances : squared_) distances.resize(2 * count);
    farthest_.resize(2 * count);
    places_.resize(2 * count);
  }
  NearSearch search{
      {slabs.data(), slab_count}, {}, {}, {}, same_side, double(from[0]), double(to[0]), {}, farthest_.data()};
  for (std::size_t n = 0; n < 7; ++n) search.lanes[n] = lanes_[n].data();
  for (std::size_t k = 0; k < 3; ++k) {
    search.squared[k] = squared_[k].data();
    search.normal[k] = normal[static_cast<Eigen::Index>(k)];
    for (std::size_t axis = 0; axis < 3; ++axis) search.corner[k][axis] = piece[k][static_cast<Eigen::Index>(axis)];
  }
  found.clear();
  const std::size_t chosen = HWY_DYNAMIC_DISPATCH(find_samples)(search, places_.data());
  const Slab* slab = slabs.data();
  for (const std::uint32_t at : std::span(places_).first(chosen)) {
    while (at - slab->to >= slab->end - slab->begin) ++slab;
    found.push_back(
        {samples_[slab->begin + at - slab->to], {squared_[0][at], squared_[1][at], squared_[2][at]}, farthest_[at]});
  }
}

}  // namespace vps::bake
#endif
