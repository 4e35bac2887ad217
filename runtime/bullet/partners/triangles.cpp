// SPDX-License-Identifier: Zlib
// Gathers a mesh's triangles near a body, and joins them to a sheet.
#include "runtime/bullet/partners/triangles.h"

#include <algorithm>
#include <mutex>
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
  // GImpact locks its mesh by a counter that threads must not share. Bullet's other meshes are only read.
  static std::mutex gimpact;
  std::unique_lock lock(gimpact, std::defer_lock);
  if (mesh.getShapeType() == GIMPACT_SHAPE_PROXYTYPE) lock.lock();
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
