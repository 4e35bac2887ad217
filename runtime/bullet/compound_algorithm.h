// SPDX-License-Identifier: Zlib
/// @file Compounds that a Shape is part of or meets. Internal.
#pragma once

#include "runtime/bullet/partners/partner.h"

class btCollisionAlgorithm;
struct btCollisionAlgorithmConstructionInfo;

namespace vps::bullet {

/// An algorithm for a pair with a compound: its own for pairs with a Shape, else that of Bullet. Bullet's asks only
/// children whose bounds overlap the other body's before the step, and a Shape's contacts ahead would come too late.
/// @param info  of a btCollisionDispatcher
[[nodiscard]] btCollisionAlgorithm* create_for_compounds(btCollisionAlgorithmConstructionInfo& info,
                                                         const btCollisionObjectWrapper* first,
                                                         const btCollisionObjectWrapper* second, LookAhead ahead);

}  // namespace vps::bullet
