// SPDX-License-Identifier: Zlib
// Gathers a mesh's triangles near a body, and finds the place of a triangle that is nearest to a point.
#include "runtime/bullet/partners/triangles.h"

#include <algorithm>
#include <tuple>

namespace vps::bullet {
namespace {

struct Collect final : btTriangleCallback {
  explicit Collect(std::vector<MeshTriangle>& to) : all(to) {}
  void processTriangle(btVector3* corners, int part, int index) override {
    MeshTriangle triangle{{}, part, index};
    for (int k = 0; k < 3; ++k) std::copy_n(&corners[k][0], 3, triangle.corners[k]);
    all.push_back(triangle);
  }
  std::vector<MeshTriangle>& all;
};

}  // namespace

bool Triangle::set(const double (&p)[3][3]) noexcept {
  using detail::operator+;
  using detail::operator-;
  using detail::operator*;
  const auto minus = [](const double(&a)[3], const double(&b)[3], double(&out)[3]) {
    for (int i = 0; i < 3; ++i) out[i] = a[i] - b[i];
  };
  const auto cross = [](const double(&a)[3], const double(&b)[3], double(&out)[3]) {
    for (int i = 0; i < 3; ++i) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
  };
  const auto dot = [](const double(&a)[3], const double(&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  // Scales to unit length; false for a length within the rounding of floats at `scale`.
  const auto normalise = [&](double(&a)[3], double scale) {
    const double size = std::sqrt(dot(a, a));
    if (!(size > 1e-6 * scale)) return false;
    for (double& x : a) x /= size;
    return true;
  };
  const auto to_float = [](const double(&a)[3]) {
    return Vec3{static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
  };
  for (const auto& corner : p) {
    for (const double x : corner) {
      if (!(std::abs(x) <= 1e15)) return false;  // squares must fit into floats
    }
  }
  double edges[3][3];
  for (int i = 0; i < 3; ++i) minus(p[(i + 1) % 3], p[i], edges[i]);
  double n[3];
  cross(edges[0], edges[1], n);
  if (!normalise(n, std::max({dot(edges[0], edges[0]), dot(edges[1], edges[1]), dot(edges[2], edges[2])})))
    return false;
  normal = to_float(n);
  offset = static_cast<float>(dot(n, p[0]));
  for (int i = 0; i < 3; ++i) {
    double inwards[3];
    cross(n, edges[i], inwards);
    if (!normalise(inwards, 0)) return false;
    corners[i] = to_float(p[i]);
    side[i] = to_float(inwards);
    side_offset[i] = static_cast<float>(dot(inwards, p[i]));
  }
  centre = (1.0F / 3) * (corners[0] + corners[1] + corners[2]);
  for (const Vec3& corner : corners) radius = std::max(radius, detail::length(corner - centre));
  radius *= 1 + 1e-6F;
  return true;
}

NearestPlace Triangle::nearest(Vec3 p) const noexcept {
  using namespace detail;
  const float h = height(p);
  if (beyond(p) <= 0) return {p - h * normal, h * h, true};
  NearestPlace best;
  for (int i = 0; i < 3; ++i) {
    const Vec3 edge = corners[(i + 1) % 3] - corners[i];
    const float along = std::clamp(dot(p - corners[i], edge) / dot(edge, edge), 0.0F, 1.0F);
    const Vec3 at = corners[i] + along * edge;
    const Vec3 apart = p - at;
    const float squared = dot(apart, apart);
    if (squared < best.squared) best = {at, squared, false};
  }
  return best;
}

std::uint16_t within_reach(const Triangle& triangle, const Spheres& spheres) noexcept {
  using namespace detail;
  std::uint32_t within[Spheres::kMost];
  // Without branches, so that compilers make vectors of it.
  for (std::uint32_t k = 0; k < Spheres::kMost; ++k) {
    const Vec3 at{spheres.x[k], spheres.y[k], spheres.z[k]};
    const Vec3 away = at - triangle.centre;
    const float reach = spheres.reach[k];
    const float farthest = reach + triangle.radius;
    within[k] =
        (dot(away, away) <= farthest * farthest ? 1U : 0U) & (triangle.least_squared(at) <= reach * reach ? 1U : 0U);
  }
  std::uint32_t mask = 0;
  for (std::uint32_t k = 0; k < Spheres::kMost; ++k) mask |= within[k] << k;
  return static_cast<std::uint16_t>(mask);
}

void turn_box(const Box& box, const Pose& to_frame, btVector3& low, btVector3& high) {
  for (int i = 0; i < 3; ++i) {
    double middle = 0;
    double half = 0;
    for (int j = 0; j < 3; ++j) {
      const double r = to_frame.rotation[3 * j + i];
      middle += r * ((box.low[j] + box.high[j]) / 2 - to_frame.translation[j]);
      half += std::abs(r) * (box.high[j] - box.low[j]) / 2;
    }
    low[i] = static_cast<btScalar>(middle - half);
    high[i] = static_cast<btScalar>(middle + half);
  }
}

std::uint64_t gather(const btConcaveShape& mesh, const btVector3& low, const btVector3& high, Sheets& sheets) {
  sheets.mesh.clear();
  Collect collect(sheets.mesh);
  mesh.processAllTriangles(&collect, low, high);
  return hash_bytes(std::as_bytes(std::span(sheets.mesh)));
}

void place(const Pose& to_frame, const Box& box, Sheets& sheets) {
  sheets.triangles.clear();
  sheets.are_joined = false;
  for (const MeshTriangle& from : sheets.mesh) {
    double p[3][3];
    bool meets = true;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        p[k][i] = to_frame.translation[i];
        for (int j = 0; j < 3; ++j) p[k][i] += to_frame.rotation[3 * i + j] * static_cast<double>(from.corners[k][j]);
      }
      meets = meets && std::min({p[0][i], p[1][i], p[2][i]}) <= box.high[i] &&
              std::max({p[0][i], p[1][i], p[2][i]}) >= box.low[i];
    }
    Triangle triangle;
    if (!meets || !triangle.set(p)) continue;
    // Terrain passes its columns as parts.
    triangle.id = (static_cast<std::uint32_t>(from.part) * 0x9E3779B1U) ^ static_cast<std::uint32_t>(from.index);
    sheets.triangles.push_back(triangle);
  }
}

void join(Sheets& sheets) {
  constexpr float kSmooth = 0.966F;  // 15 degrees
  const auto order = [](const Vec3& p) { return std::tie(p.x, p.y, p.z); };
  const auto key = [&](const Sheets::Edge& e) { return std::tuple_cat(order(e.ends[0]), order(e.ends[1])); };
  std::vector<Sheets::Edge>& edges = sheets.edges;
  edges.clear();
  for (std::uint32_t i = 0; i < sheets.triangles.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Triangle& t = sheets.triangles[i];
      Sheets::Edge edge{{t.corners[k], t.corners[(k + 1) % 3]}, i, k};
      if (order(edge.ends[1]) < order(edge.ends[0])) std::swap(edge.ends[0], edge.ends[1]);
      edges.push_back(edge);
    }
  }
  std::sort(edges.begin(), edges.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
  for (auto at = edges.begin(); at != edges.end();) {
    const auto end = std::find_if(at, edges.end(), [&](const Sheets::Edge& e) { return key(e) != key(*at); });
    if (end - at == 2) {
      Triangle& a = sheets.triangles[at[0].triangle];
      Triangle& b = sheets.triangles[at[1].triangle];
      const bool is_smooth = detail::dot(a.side[at[0].side], b.side[at[1].side]) < -kSmooth;
      a.goes_on[at[0].side] = b.goes_on[at[1].side] = is_smooth;
    }
    at = end;
  }
  sheets.are_joined = true;
}

}  // namespace vps::bullet
