// SPDX-License-Identifier: GPL-3.0-or-later
// The only source that includes CGAL's readers.
#include "formats/mesh/polygon_soup_reader.h"

#include <CGAL/IO/PLY.h>
#include <CGAL/IO/STL.h>
#include <CGAL/Simple_cartesian.h>

#include <locale>
#include <sstream>

#include "formats/mesh/read_without_library.h"
#include "formats/mesh/tidy.h"

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

}  // namespace

RawMesh read_polygon_soup(const std::string& path, const std::string& extension) {
  std::string bytes = read_bytes(path);
  if (std::optional<PolygonSoup> soup = read_without_library(bytes, extension)) return to_raw_mesh(std::move(*soup));
  // CGAL's streams use the global locale, in which the decimal point may be a comma. This process is the child, so no
  // other code is affected.
  std::locale::global(std::locale::classic());
  tidy(bytes, extension);
  std::istringstream in(std::move(bytes));
  std::vector<Point> points;
  std::vector<Polygon> polygons;
  const bool complete = read(in, extension, points, polygons);
  PolygonSoup soup;
  soup.vertices.reserve(points.size());
  for (const Point& p : points) soup.vertices.push_back({p.x(), p.y(), p.z()});
  for (const Polygon& polygon : polygons) {
    soup.corners.insert(soup.corners.end(), polygon.begin(), polygon.end());
    soup.end_polygon();
  }
  RawMesh raw = to_raw_mesh(std::move(soup));
  // Checked last, because a wrong index is the usual reason and has a message of its own.
  if (!complete) throw ReadError("a part of the file cannot be read");
  return raw;
}

}  // namespace vps
