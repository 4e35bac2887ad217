// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/wrench.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <queue>
#include <vector>

#include "cli/lab/oracle.h"
#include "cli/lab/patches.h"

namespace vps::lab {
namespace {

using Eigen::Vector3d;

Vector3d vector(const Point& p) {
  return {p[0], p[1], p[2]};
}

double longest_side(const std::array<Vector3d, 3>& corners) {
  return std::max(
      {(corners[1] - corners[0]).norm(), (corners[2] - corners[1]).norm(), (corners[0] - corners[2]).norm()});
}

// A flat piece of the surface with V at its corners and at the middles of its sides (01, 12, 20), second's frame.
struct Piece {
  std::array<Vector3d, 3> corners, middles;
  std::array<double, 3> at_corners{}, at_middles{};
  Vector3d inward = Vector3d::Zero();  // unit
  double area = 0;
  double longest = 0;   // side
  double pressure = 0;  // integral of V where positive, by the values at the middles: exact for a quadratic V
  double error = 0;     // estimated error of `pressure`
};

class Integral {
 public:
  Integral(const Oracle& second, const WrenchOptions& options, double widest)
      : second_(second), options_(options), widest_(widest) {}

  void add(const std::array<Vector3d, 3>& corners) {
    Piece piece;
    piece.corners = corners;
    const Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if (!(normal.norm() > 0)) return;
    piece.inward = -normal.normalized();
    piece.area = normal.norm() / 2;
    for (std::size_t i = 0; i < 3; ++i) piece.at_corners[i] = penetration(corners[i]);
    push(piece);
  }

  ExactWrench run(const Vector3d& centre) {
    while (!worst_.empty() && error_ > options_.tolerance * pressure_ && pieces_.size() < options_.most_pieces) {
      const Piece piece = pieces_[worst_.top().second];
      pieces_[worst_.top().second].area = 0;
      worst_.pop();
      pressure_ -= piece.pressure;
      error_ -= piece.error;
      cut(piece);
    }
    return sum(centre);
  }

 private:
  double penetration(const Vector3d& p) const { return second_.penetration({p.x(), p.y(), p.z()}); }

  void cut(const Piece& piece) {
    const auto child = [&](const std::array<Vector3d, 3>& corners, const std::array<double, 3>& values) {
      Piece out;
      out.corners = corners;
      out.at_corners = values;
      out.inward = piece.inward;
      out.area = piece.area / 4;
      push(out);
    };
    const auto& c = piece.corners;
    const auto& m = piece.middles;
    const auto& vc = piece.at_corners;
    const auto& vm = piece.at_middles;
    child({c[0], m[0], m[2]}, {vc[0], vm[0], vm[2]});
    child({c[1], m[1], m[0]}, {vc[1], vm[1], vm[0]});
    child({c[2], m[2], m[1]}, {vc[2], vm[2], vm[1]});
    child({m[0], m[1], m[2]}, {vm[0], vm[1], vm[2]});
  }

  // Takes a reference: a copy would read the middles before they are set.
  void push(Piece& piece) {
    piece.longest = longest_side(piece.corners);
    // No point of the triangle is farther than this from its nearest corner, and V changes by no more than the
    // distance.
    const double most = *std::max_element(piece.at_corners.begin(), piece.at_corners.end());
    if (most + piece.longest / std::sqrt(3.0) <= 0) return;
    for (std::size_t i = 0; i < 3; ++i) {
      piece.middles[i] = (piece.corners[i] + piece.corners[(i + 1) % 3]) / 2;
      piece.at_middles[i] = penetration(piece.middles[i]);
    }
    estimate(piece);
    if (!(piece.error > 0) && piece.pressure == 0) return;
    pressure_ += piece.pressure;
    error_ += piece.error;
    if (piece.error > 0) worst_.emplace(piece.error, pieces_.size());
    pieces_.push_back(piece);
  }

  void estimate(Piece& piece) const {
    const auto positive = [](const std::array<double, 3>& values) {
      return std::max(values[0], 0.0) + std::max(values[1], 0.0) + std::max(values[2], 0.0);
    };
    const auto [low_corner, high_corner] = std::minmax_element(piece.at_corners.begin(), piece.at_corners.end());
    const auto [low_middle, high_middle] = std::minmax_element(piece.at_middles.begin(), piece.at_middles.end());
    const double least = std::min(*low_corner, *low_middle);
    const double most = std::max(*high_corner, *high_middle);
    // The same bound for the four triangles between the six sampled points.
    const double unseen = piece.longest / 2 / std::sqrt(3.0);
    piece.pressure = piece.area * positive(piece.at_middles) / 3;
    if (most + unseen <= 0) return;
    // The quadratures by corners and by middles agree where V is linear. Where V changes its sign both are wrong.
    piece.error = std::abs(piece.area * positive(piece.at_corners) / 3 - piece.pressure);
    if (least < 0) piece.error = std::max(piece.error, piece.area * std::max(most, 0.0) / 4);
    // Here six samples are too few for an estimate, so this is a bound.
    if (most <= 0 || piece.longest > widest_) piece.error = std::max(piece.error, piece.area * (most + unseen));
  }

  ExactWrench sum(const Vector3d& centre) const {
    ExactWrench out;
    Vector3d force = Vector3d::Zero();
    Vector3d torque = Vector3d::Zero();
    double error = 0;
    for (const Piece& piece : pieces_) {
      if (piece.area == 0) continue;  // cut
      error += piece.error;
      for (std::size_t i = 0; i < 3; ++i) {
        const double v = piece.at_middles[i];
        if (v < 0) continue;
        const double share = piece.area / 3;
        force += share * v * piece.inward;
        torque += (piece.middles[i] - centre).cross(share * v * piece.inward);
        out.pressure += share * v;
        out.area += share;
      }
    }
    for (int i = 0; i < 3; ++i) {
      out.force[std::size_t(i)] = force[i];
      out.torque[std::size_t(i)] = torque[i];
    }
    out.error = out.pressure > 0 ? error / out.pressure : 0;
    return out;
  }

  const Oracle& second_;
  const WrenchOptions& options_;
  const double widest_;  // [m]
  std::vector<Piece> pieces_;
  std::priority_queue<std::pair<double, std::size_t>> worst_;
  double pressure_ = 0;
  double error_ = 0;
};

}  // namespace

struct WrenchOracle::Impl {
  PatchTree first;
  Oracle second;
  WrenchOptions options;
  Impl(const TriangleMesh& first_in, const TriangleMesh& second_in, const WrenchOptions& options_in)
      : first(first_in), second(second_in), options(options_in) {}

  void collect(std::size_t at, const Pose& pose, Integral& integral) const {
    const PatchTree::Ball& ball = first.ball(at);
    if (second.penetration(moved(pose, ball.centre)) + ball.radius < 0) return;
    if (ball.children[0] != 0) {
      for (const std::size_t child : ball.children) collect(child, pose, integral);
      return;
    }
    const auto& [a, b, c] = first.patch(ball).corners;
    integral.add({vector(moved(pose, a)), vector(moved(pose, b)), vector(moved(pose, c))});
  }
};

WrenchOracle::WrenchOracle(const TriangleMesh& body, const TriangleMesh& second, WrenchOptions options)
    : impl_(std::make_unique<Impl>(body, second, options)) {}
WrenchOracle::~WrenchOracle() = default;

ExactWrench WrenchOracle::at(const Pose& first_in_second) const {
  Integral integral(impl_->second, impl_->options, impl_->options.widest * impl_->first.ball(0).radius);
  impl_->collect(0, first_in_second, integral);
  const double* const t = first_in_second.translation;
  return integral.run({t[0], t[1], t[2]});
}

}  // namespace vps::lab
