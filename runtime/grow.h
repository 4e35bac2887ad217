// SPDX-License-Identifier: Zlib
/// @file Growth of working memory in functions that never throw. Internal.
#pragma once

#include <new>
#include <stdexcept>

#include "formats/vps_format.h"

namespace vps::detail {

/// Calls grow(), which allocates. @return no_memory where that fails
template <class Grow>
[[nodiscard]] Status try_to_grow(const Grow& grow) noexcept {
  try {
    grow();
    return Status::ok;
  } catch (const std::bad_alloc&) {
    return Status::no_memory;
  } catch (const std::length_error&) {
    return Status::no_memory;
  }
}

}  // namespace vps::detail
