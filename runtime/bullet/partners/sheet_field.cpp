// SPDX-License-Identifier: Zlib
#include "runtime/bullet/partners/sheet_field.h"

#include <algorithm>
#include <functional>

namespace vps::bullet {

using namespace detail;

SheetField::SheetField(std::span<const Triangle> triangles, const Contact& contact, float reach)
    : side_(contact.inward_normal) {
  std::copy_if(triangles.begin(), triangles.end(), std::back_inserter(near_),
               [&](const Triangle& t) { return t.is_within(contact.position, reach); });
}

void SheetField::penetrations(const Places& places, Values& out) const noexcept {
  for (std::uint32_t i = 0; i < places.count; ++i) {
    NearestPlace found;
    const Triangle* const triangle = nearest_triangle(near_, std::identity(), places[i], found);
    const float distance = std::sqrt(found.squared);
    const bool is_behind = triangle != nullptr && triangle->height(places[i]) * dot(triangle->normal, side_) < 0;
    out[i] = is_behind ? distance : -distance;
  }
}

}  // namespace vps::bullet
