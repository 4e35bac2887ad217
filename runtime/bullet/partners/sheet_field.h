// SPDX-License-Identifier: Zlib
/// @file A sheet of triangles near a contact, as a field. Internal.
#pragma once

#include <span>
#include <vector>

#include "runtime/bullet/partners/triangles.h"
#include "runtime/fields/placed_field.h"

namespace vps::bullet {

/// A sheet of triangles near a contact, as a body with its surface there.
class SheetField final : public detail::FieldAtPlaces {
 public:
  /// @param triangles  TriangleMemory::near
  /// @param contact    on the side of the sheet to which its direction points
  /// @param reach      triangles farther off are left out. [m]
  SheetField(std::span<const Triangle> triangles, const Contact& contact, float reach);
  void penetrations(const detail::Places& places, detail::Values& out) const noexcept override;

 private:
  std::vector<Triangle> near_;
  const Vec3 side_;
};

}  // namespace vps::bullet
