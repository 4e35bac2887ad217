// SPDX-License-Identifier: GPL-3.0-or-later
// Region growing from points in turn. The plane is that of the first point's triangle, so that a face cannot drift over
// a curved surface.
#include "bake/stages/find_faces.h"

#include <cmath>

#include "bake/point_grid.h"

namespace vps::bake {
namespace {

constexpr std::size_t kFewestOfFace = 64;
constexpr std::size_t kFewestPerRimPoint = 4;  // a strip of 8 points across has 2 of 8 at its rim

class FaceSearch {
 public:
  FaceSearch(const std::vector<Sample*>& samples, const std::vector<Vector>& positions,
             const std::vector<Vector>& inward_normals, double reach, double flat)
      : samples_(samples),
        positions_(positions),
        normals_(inward_normals),
        reach_(reach),
        flat_(flat),
        grid_(reach),
        face_(samples.size(), kNew) {
    for (std::uint32_t i = 0; i < samples.size(); ++i) grid_.insert(positions[i], i);
  }

  std::vector<std::uint32_t> run() {
    for (std::uint32_t seed = 0; seed < samples_.size(); ++seed) {
      if (face_[seed] == kNew) grow(seed);
    }
    return std::move(face_);
  }

 private:
  static constexpr std::uint32_t kNone = 0;
  static constexpr std::uint32_t kNew = 0xFFFFFFFFu;

  void grow(std::uint32_t seed) {
    const Vector& at = positions_[seed];
    const Vector& normal = samples_[seed]->normal;
    const auto is_inside = [&](std::uint32_t i) {
      return (normals_[i] + normal).norm() <= kFlatNormal && std::abs(normal.dot(positions_[i] - at)) <= flat_;
    };
    face_[seed] = kNone;
    if (!is_inside(seed)) return;
    const std::uint32_t number = faces_ + 1;
    face_[seed] = number;
    region_.assign(1, seed);
    std::size_t rim = 0;
    for (std::size_t i = 0; i < region_.size(); ++i) {
      const Vector& p = positions_[region_[i]];
      bool is_at_rim = false;
      grid_.for_each_near(p, 1, [&](std::uint32_t q) {
        if (face_[q] == number || (positions_[q] - p).squaredNorm() > reach_ * reach_) return;
        if (face_[q] != kNew || !is_inside(q)) {
          is_at_rim = true;
          return;
        }
        face_[q] = number;
        region_.push_back(q);
      });
      if (is_at_rim) ++rim;
    }
    if (region_.size() >= std::max(kFewestOfFace, kFewestPerRimPoint * rim)) {
      faces_ = number;
    } else {
      for (const std::uint32_t i : region_) face_[i] = kNone;
    }
  }

  const std::vector<Sample*>& samples_;
  const std::vector<Vector>& positions_;
  const std::vector<Vector>& normals_;
  const double reach_, flat_;
  PointGrid grid_;
  std::vector<std::uint32_t> face_;
  std::vector<std::uint32_t> region_;
  std::uint32_t faces_ = 0;
};

}  // namespace

std::vector<std::uint32_t> find_faces(const std::vector<Sample*>& samples, const std::vector<Vector>& positions,
                                      const std::vector<Vector>& inward_normals, double reach, double flat) {
  return FaceSearch(samples, positions, inward_normals, reach, flat).run();
}

}  // namespace vps::bake
