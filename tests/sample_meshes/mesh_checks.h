// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "formats/triangle_mesh.h"

namespace vps::test {

[[nodiscard]] bool intersects_itself(const TriangleMesh& mesh);

}  // namespace vps::test
