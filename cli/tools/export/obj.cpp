// SPDX-License-Identifier: GPL-3.0-or-later
// The surface that the field describes; the mesh itself is not in an asset.
#include <fmt/format.h>

#include "cli/tools/export/export.h"
#include "cli/tools/field_surface.h"
#include "cli/tools/stored_field.h"

namespace vps::cli {

std::string to_obj(const VoxelmapView& map, double step) {
  const FieldSurface surface = make_field_surface(map, step);
  if (surface.mesh.triangles.empty())
    throw ExportError("no cell of this size has a part of the surface in it; choose a smaller --step");
  std::string text = fmt::format(
      "# vpsbake: V = 0 of the field {}, metres, asset frame, cells of {:.9g} m\n"
      "# off V = 0 by {:.3g} m at most, and the field itself by {:.3g} m\n",
      field_name(map.field), step, surface.residual, map.error);
  for (const auto& [x, y, z] : surface.mesh.vertices) text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", x, y, z);
  for (const auto& [a, b, c] : surface.mesh.triangles) text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return text;
}

}  // namespace vps::cli
