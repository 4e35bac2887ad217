// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/repair/open_sheets.h"

#include "bake/repair/resolve_shells.h"
#include "bake/repair/topology.h"
#include "bake/repair/winding.h"

namespace vps::bake {
namespace {

// Facts about one piece of the mesh.
struct Piece {
  bool open = false;
  bool crosses = false;
  std::uint32_t first = 0;    // its first triangle
  std::uint32_t meeting = 0;  // a triangle that meets the solid, if it crosses
};

}  // namespace

OpenSheets drop_enclosed_sheets(Mesh& mesh) {
  OpenSheets result;
  const UnsetVector<EdgeUse> uses = sorted_edges(mesh.triangles);
  const Pieces pieces = closed_pieces(mesh.triangles, uses);
  const std::vector<std::uint8_t> open = open_pieces(pieces, uses);
  std::vector<Piece> all(pieces.count);
  Mesh solid;
  solid.vertices = mesh.vertices;
  for (auto t = static_cast<std::uint32_t>(mesh.triangles.size()); t-- > 0;) {
    Piece& piece = all[pieces.of_triangle[t]];
    piece.open = open[pieces.of_triangle[t]] != 0;
    piece.first = t;
    if (!piece.open) solid.triangles.push_back(mesh.triangles[t]);
  }
  if (solid.triangles.empty() || solid.triangles.size() == mesh.triangles.size()) return result;
  drop_unused_vertices(solid);
  resolve_shells(solid, self_intersections(solid), closed_pieces(solid.triangles));
  if (solid.triangles.empty()) return result;

  // Solid and sheets get separate vertices, so that every touch is an intersection.
  Mesh both = solid;
  std::vector<std::uint32_t> origin(both.triangles.size());
  const auto base = static_cast<std::uint32_t>(both.vertices.size());
  both.vertices.insert(both.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!all[pieces.of_triangle[t]].open) continue;
    const auto& [a, b, c] = mesh.triangles[t];
    both.triangles.push_back({a + base, b + base, c + base});
    origin.push_back(t);
  }
  for (const auto& [a, b] : self_intersections(both)) {
    if (a >= solid.triangles.size() || b < solid.triangles.size()) continue;
    Piece& piece = all[pieces.of_triangle[origin[b]]];
    piece.crosses = true;
    piece.meeting = origin[b];
  }

  const Grid grid = column_grid(both);
  const InsideTest inside(solid, grid);
  std::vector<std::uint8_t> drop(pieces.count, 0);
  for (std::uint32_t p = 0; p < pieces.count; ++p) {
    const Piece& piece = all[p];
    if (!piece.open) continue;
    // A piece that does not cross lies wholly on one side, so one of its points decides.
    if (!piece.crosses && inside.inside(mesh.corner(piece.first, 0))) {
      drop[p] = 1;
      ++result.dropped;
      continue;
    }
    const std::uint32_t t = piece.crosses ? piece.meeting : piece.first;
    if (piece.crosses ? result.crossing == 0 : result.crossing + result.outside == 0) {
      result.place = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3;
    }
    ++(piece.crosses ? result.crossing : result.outside);
  }
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (drop[pieces.of_triangle[t]] == 0) mesh.triangles[kept++] = mesh.triangles[t];
  }
  mesh.triangles.resize(kept);
  drop_unused_vertices(mesh);
  return result;
}

}  // namespace vps::bake
