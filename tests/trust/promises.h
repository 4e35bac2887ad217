// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The promises of assets and queries, and for each the search of its worst case. docs/internals/bounds.md has
/// their proofs.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "cli/lab/climb.h"
#include "runtime/vps_runtime.h"
#include "tests/support/oracle.h"

namespace vps::test {

/// A baked body with its mesh.
struct Subject {
  TriangleMesh mesh;  ///< closed, as baked
  Asset asset;
  std::map<Field, VoxelmapView> maps;
  PointshellView shell;
  Oracle oracle;
  SoupOracle surface;

  /// @param closed  from bake::closed_mesh
  /// @throw BakeError, MeasureError
  Subject(TriangleMesh closed, const bake::BakeOptions& options);

 private:
  std::vector<std::byte> bytes_;
};

/// What a search found.
struct Found {
  double worst = lab::kNotCovered;    ///< kNotCovered: the promise says nothing about this body
  double started = lab::kNotCovered;  ///< by random places alone
  long measured = 0;                  ///< places
};

/// How a promise is measured. It holds where the value is at most 1 of a ratio, or 0 of an excess.
enum class Measure : std::uint8_t {
  ratio,   ///< of what was found to what is promised. [-]
  excess,  ///< of what was found over what is promised. [Units: vx]
};
inline double most_of(Measure measure) {
  return measure == Measure::ratio ? 1 : 0;
}

struct Promise {
  std::string name;
  std::string says;
  Measure measure = Measure::excess;
  /// Rests on the certificate of the field, which is measured and not proven.
  bool certified = false;
  /// Relative number of starts: places of a point are cheap, poses are not.
  double effort = 1;
  std::function<Found(const Subject&, const lab::ClimbOptions&)> attack;
};

/// All of them, in the order of docs/internals/bounds.md. Promises about pairs take a body and a copy of itself.
[[nodiscard]] const std::vector<Promise>& promises();

}  // namespace vps::test
