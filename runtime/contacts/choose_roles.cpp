// SPDX-License-Identifier: Zlib
// Chooses which body of a pair plays the pointshell. Paper: Sec. 3.2.
#include "runtime/vps_runtime.h"

namespace vps {

Status choose_roles(const Asset& first, const Asset& second, ShellRole& role) noexcept {
  const bool first_can = first.has_pointshell() && second.has_voxelmap();
  const bool second_can = second.has_pointshell() && first.has_voxelmap();
  const bool prefer_second = second.info().points < first.info().points;
  role = second_can && (prefer_second || !first_can) ? ShellRole::second : ShellRole::first;
  return first_can || second_can ? Status::ok : Status::missing_part;
}

}  // namespace vps
