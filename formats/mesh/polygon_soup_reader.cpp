// SPDX-License-Identifier: GPL-3.0-or-later
// The only source that includes CGAL's readers.
#include "formats/mesh/polygon_soup_reader.h"

#include <CGAL/IO/PLY.h>
#include <CGAL/IO/STL.h>
#include <CGAL/Simple_cartesian.h>

#include <locale>
#include <sstream>

#include "formats/mesh/read_obj.h"
#include "formats/mesh/read_off.h"
#include "formats/mesh/tidy.h"
#include "formats/mesh/triangulate.h"

namespace vps {
namespace {

// The PLY reader needs a kernel's point.
using Point = CGAL::Simple_cartesian<double>::Point_3;
using Polygon = std::vector<std::size_t>;

void tidy(std::string& bytes, const std::string& extension) {
  if (extension == "ply") tidy_ply(bytes);
  if (extension == "stl") tidy_stl(bytes);
}

bool read(std::istream& in, const std::string& extension, std::vector<Point>& points, std::vector<Polygon>& polygons) {
  const auto quiet = CGAL::parameters::verbose(false);
  if (extension == "ply") return CGAL::IO::read_PLY(in, points, polygons, quiet);
  return CGAL::IO::read_STL(in, points, polygons, quiet);
}

void add_polygon(const Polygon& polygon, RawMesh& out) {
  if (polygon.size() < 3) {
    ++out.skipped_primitives;
    return;
  }
  for (const std::size_t index : polygon) {
    if (index >= out.vertices.size()) throw ReadError("a face refers to a vertex that is not there");
  }
  const auto number = [&](std::size_t corner) { return static_cast<std::uint32_t>(polygon[corner]); };
  if (polygon.size() == 3) {
    out.triangles.push_back({number(0), number(1), number(2)});
    return;
  }
  std::vector<std::array<double, 3>> corners;
  corners.reserve(polygon.size());
  for (const std::size_t index : polygon) corners.push_back(out.vertices[index]);
  for (const auto& [a, b, c] : triangulate_polygon(corners)) {
    out.triangles.push_back({number(a), number(b), number(c)});
  }
}

RawMesh to_raw_mesh(PolygonSoup&& soup) {
  constexpr std::size_t kMaxVertices = 0xFFFFFFFF;
  if (soup.vertices.size() > kMaxVertices) throw ReadError("more than 2^32 vertices");
  RawMesh raw;
  raw.vertices = std::move(soup.vertices);
  raw.skipped_primitives = soup.skipped_primitives;
  raw.triangles.reserve(soup.polygons.size());
  for (const Polygon& polygon : soup.polygons) add_polygon(polygon, raw);
  return raw;
}

}  // namespace

RawMesh read_polygon_soup(const std::string& path, const std::string& extension) {
  // CGAL's streams use the global locale, in which the decimal point may be a comma. This process is the child, so no
  // other code is affected.
  std::locale::global(std::locale::classic());
  std::string bytes = read_bytes(path);
  if (extension == "obj") return to_raw_mesh(read_obj(bytes));
  if (extension == "off") return to_raw_mesh(read_off(bytes));
  tidy(bytes, extension);
  std::istringstream in(std::move(bytes));
  std::vector<Point> points;
  PolygonSoup soup;
  const bool complete = read(in, extension, points, soup.polygons);
  soup.vertices.reserve(points.size());
  for (const Point& p : points) soup.vertices.push_back({p.x(), p.y(), p.z()});
  RawMesh raw = to_raw_mesh(std::move(soup));
  // Checked last, because a wrong index is the usual reason and has a message of its own.
  if (!complete) throw ReadError("a part of the file cannot be read");
  return raw;
}

}  // namespace vps
