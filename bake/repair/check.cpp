// SPDX-License-Identifier: GPL-3.0-or-later
// Checks and repairs the mesh. Later stages rely on the result.
#include "bake/repair/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "bake/extent.h"
#include "bake/quantity_text.h"
#include "bake/repair/clean_mesh.h"
#include "bake/repair/close_mesh.h"
#include "bake/repair/far_vertices.h"
#include "bake/repair/judge_filling.h"
#include "bake/repair/open_sheets.h"
#include "bake/repair/orient_mesh.h"
#include "bake/repair/resolve_shells.h"
#include "bake/repair/thicken_sheets.h"
#include "bake/repair/topology.h"
#include "bake/repair/wrap_mesh.h"
#include "bake/stages/mass_properties.h"

namespace vps::bake {
namespace {

// Share of filled surface that gives a warning. Holes of scans take 1 to 2 % of the surface. Missing sides of a body,
// or the mouths of a tunnel, take 15 to 31 %.
constexpr double kLargeFilling = 0.1;

// Doubts up to which a filled mesh is the one sensible solid. Of the volume, scans, a teapot and robot links leave up
// to 0.045 in doubt, a box without a lid 0.11, a bearing without its bottom 0.48 (docs/internals/decisions.md).
constexpr FillingDoubts kAccepted = {0.07, 0.002};
// Folds of scans leave out less.
constexpr double kNotedVolume = 0.001;
// Crossings up to which repairs are tried to advise them. An assembly with 9e5, the most in a corpus, takes 15 s.
constexpr double kMostTried = 2e6;
// Where sheets have more of the area, thickening is advised first.
constexpr double kMostlySheets = 0.25;

// "8.1 %", "100 %".
std::string percent(double share) {
  return share < 0.995 ? fmt::format("{:.2g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

[[noreturn]] void refuse(const std::string& message) {
  throw BakeError("check", message);
}

std::string place(const Vector& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) m", p.x(), p.y(), p.z());
}

// Joining vertices may create duplicates and inconsistent winding. This removes both first.
bool closed_after_tidying(Mesh& mesh) {
  CleanCounts ignored;
  drop_duplicates(mesh, ignored);
  if (count_unbalanced(mesh) > 0) orient_consistently(mesh);
  return count_unbalanced(mesh) == 0;
}

const char* plural(std::size_t n) {
  return n == 1 ? "" : "s";
}

double area_of(const Mesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += mesh.area_normal(t).norm() / 2;
  return sum;
}

// Walls of two voxels are known well.
std::string thickened(double voxel_size) {
  std::string thickness = voxel_size > 0 ? format_length(2 * voxel_size) : "2mm";
  std::erase(thickness, ' ');
  return "--open-surface thicken=" + thickness;
}

void warn_of_large_filling(double voxel_size, RepairOutcome& outcome) {
  if (outcome.filled_share < kLargeFilling) return;
  outcome.notes.push_back(
      fmt::format("{:.0f} % of the surface fills holes: the solid may be a plug of what was open; a sheet keeps its "
                  "shape with {}",
                  100 * outcome.filled_share, thickened(voxel_size)));
}

// Fills holes first. Otherwise the skin would enter through wide holes, and the solid would be hollow.
void wrap(Mesh& mesh, double voxel_size, RepairOutcome& outcome) {
  if (!(voxel_size > 0)) refuse("wrapping needs a voxel size; give --voxel or --resolution");
  const FilledHoles holes = fill_holes(mesh, std::numeric_limits<double>::infinity());
  outcome.filled_share = holes.area / area_of(mesh);
  const double alpha = 4 * voxel_size;
  const double offset = voxel_size / 4;
  mesh = wrap_mesh(mesh, alpha, offset);
  outcome.notes.push_back(
      fmt::format("repair wrap: closed {} hole{}, then a skin {} outside of the mesh that bridges gaps below {}",
                  holes.filled, plural(holes.filled), format_length(offset), format_length(alpha)));
}

// A mesh that the allowed repairs do not close. Others may.
struct NotClosed : BakeError {
  NotClosed(const std::string& reason, std::string remedy_in)
      : BakeError("check", reason), remedy(std::move(remedy_in)) {}
  std::string remedy;  // beside repairs
};

[[noreturn]] void refuse_leak(const FilledHoles& holes, const RepairSettings& settings) {
  std::string reason = fmt::format(
      "the mesh is open: it leaks through {} hole{}, the longest border of {} at {}, up to {} wide", holes.left,
      plural(holes.left), format_length(holes.longest_border), place(holes.place), format_length(holes.widest));
  if (settings.repair != Repair::automatic) throw NotClosed(reason, "close it there");
  if (settings.voxel_size == 0) throw NotClosed(reason, "give --voxel or --resolution to close holes up to a voxel");
  throw NotClosed(fmt::format("{}, more than a voxel of {}", reason, format_length(settings.voxel_size)),
                  "close it there");
}

[[noreturn]] void refuse_sheets(const OpenSheets& sheets) {
  const std::uint32_t left = sheets.crossing + sheets.outside;
  throw NotClosed(
      fmt::format("the mesh is open: beside closed surfaces it has {} open one{} that bound{} no volume, "
                  "one {} at {}",
                  left, plural(left), left == 1 ? "s" : "",
                  sheets.crossing > 0 ? "that crosses or touches a closed one" : "outside of the closed ones",
                  place(sheets.place)),
      left == 1 ? "remove it" : "remove them");
}

[[noreturn]] void refuse_union(std::size_t open) {
  throw NotClosed(fmt::format("uniting the shells that cross left {} open edge{}", open, plural(open)),
                  "unite them in the modeller");
}

// A vertex that an export misplaced makes the mesh so large that the rest of it vanishes in a voxel.
void refuse_far_vertices(const Mesh& mesh, double voxel_size) {
  const FarVertices far = find_far_vertices(mesh, voxel_size);
  if (far.count == 0) return;
  const bool one = far.count == 1;
  refuse(
      fmt::format("{} at {}{} up to {} from all others, which lie within {} of each other and would vanish in one "
                  "voxel; correct {}, or choose smaller voxels",
                  one ? "a vertex" : fmt::format("{} vertices, one", far.count), place(far.place),
                  one ? " lies" : ", lie", format_length(far.distance), format_length(far.core), one ? "it" : "them"));
}

void note_dropped(const OpenSheets& sheets, std::vector<std::string>& notes) {
  if (sheets.dropped == 0) return;
  notes.push_back(fmt::format("{} open surface{} inside a solid: dropped, as {} no volume", sheets.dropped,
                              plural(sheets.dropped), sheets.dropped == 1 ? "it bounds" : "they bound"));
}

// Tolerances that do not depend on the voxel size, then the voxel size: a mesh that closes within one of the first
// closes to the same surface with all larger voxels.
std::vector<double> stitch_tolerances(double longest_side, double voxel_size) {
  std::vector<double> tolerances;
  for (double t = 4e-6 * longest_side; t < voxel_size; t *= 4) tolerances.push_back(t);
  tolerances.push_back(voxel_size);
  return tolerances;
}

// Tries each tolerance without splitting edges first: where vertices match, splits leave slivers.
// @param note  set when something changed
// @return whether the mesh is closed
bool stitch(Mesh& mesh, const std::vector<double>& tolerances, std::string& note) {
  struct Attempt {
    std::size_t (*join)(Mesh&, double);
    Mesh mesh;
    std::size_t changes = 0;
    double within = 0;
  };
  Attempt attempts[] = {{merge_borders, mesh}, {stitch_borders, mesh}};
  bool closed = false;
  const Attempt* best = &attempts[1];
  for (const double tolerance : tolerances) {
    for (Attempt& attempt : attempts) {
      const std::size_t changes = closed ? 0 : attempt.join(attempt.mesh, tolerance);
      if (changes == 0) continue;
      attempt.changes += changes;
      attempt.within = tolerance;
      closed = !attempt.mesh.triangles.empty() && closed_after_tidying(attempt.mesh);
      if (closed) best = &attempt;
    }
  }
  if (best->changes == 0 || best->mesh.triangles.empty()) return false;
  note =
      fmt::format("repair stitch: sewed open edges within {}, {} places", format_length(best->within), best->changes);
  if (closed) note += "; smaller voxels than that may need another repair";
  mesh = best->mesh;
  return closed;
}

bool closes_by_filling(Mesh mesh, double widest) {
  return fill_holes(mesh, widest).left == 0 && count_unbalanced(mesh) == 0;
}

// Applies the repairs from the least invasive to the most, each on top of the ones before, until only sheets inside
// solids are open.
// @param filling  where not null, gets the mesh that `fill` made
void close_mesh(Mesh& mesh, double longest_side, const RepairSettings& settings, RepairOutcome& outcome,
                Filling* filling) {
  if (settings.repair == Repair::wrap) {
    wrap(mesh, settings.voxel_size, outcome);
    outcome.used = Repair::wrap;
    return;
  }
  Mesh work = mesh;
  const auto allowed = [&](Repair r) { return settings.repair >= r; };
  std::string note;  // about the most invasive repair that changed something
  const auto done = [&] {
    if (!note.empty()) outcome.notes.push_back(std::move(note));
    mesh = std::move(work);
  };
  if (allowed(Repair::weld)) {
    constexpr double kRelative = 1e-6;  // a few float steps
    const double tolerance = kRelative * longest_side;
    const std::size_t merged = weld_vertices(work, tolerance);
    if (merged > 0) {
      outcome.used = Repair::weld;
      note = fmt::format("repair weld: merged {} vertices within {}", merged, format_length(tolerance));
    }
    if (closed_after_tidying(work)) return done();
  }
  if (allowed(Repair::stitch) && settings.voxel_size > 0) {
    std::string sewed;
    Mesh sewn = work;
    const bool closed = stitch(sewn, stitch_tolerances(longest_side, settings.voxel_size), sewed);
    // Sewing that collapses triangles draws the border of a hole together. Filling moves no vertex.
    const bool draws_together = closed && sewn.triangles.size() < work.triangles.size();
    if (!(draws_together && allowed(Repair::fill) && closes_by_filling(work, settings.voxel_size))) {
      if (!sewed.empty()) {
        outcome.used = Repair::stitch;
        note = std::move(sewed);
      }
      work = std::move(sewn);
      if (closed) return done();
    }
  }
  // `automatic` only fills holes of at most a voxel's width, which the grid cannot distinguish from a crack.
  const double widest = settings.repair == Repair::fill        ? std::numeric_limits<double>::infinity()
                        : settings.repair == Repair::automatic ? settings.voxel_size
                                                               : 0;
  const std::size_t patches = work.triangles.size();
  const FilledHoles holes = fill_holes(work, widest);
  if (filling != nullptr) *filling = {work, patches};
  if (holes.filled > 0) {
    outcome.used = Repair::fill;
    outcome.filled_share = holes.area / area_of(work);
    note = fmt::format("repair fill: closed {} hole{}, {} of the surface", holes.filled, plural(holes.filled),
                       percent(outcome.filled_share));
    if (const std::size_t flat = drop_flat_sheets(work, patches); flat > 0) {
      note += fmt::format("; dropped {} flat sheet{}", flat, plural(flat));
    }
  }
  // A filled mesh is closed. Tidying could open it again where a patch lies on a lone triangle.
  if (count_unbalanced(work) > 0 && !closed_after_tidying(work)) {
    const OpenSheets sheets = drop_enclosed_sheets(work);
    note_dropped(sheets, outcome.notes);
    if (holes.left > 0 && sheets.crossing + sheets.outside > 0) refuse_sheets(sheets);
    if (holes.left > 0 && sheets.dropped == 0) refuse_leak(holes, settings);
    if (count_unbalanced(work) > 0) {
      throw NotClosed("the mesh has no consistent inside", "make the winding of its triangles consistent");
    }
  }
  done();
}

void drop_flat(Mesh& mesh, std::size_t& collapsed) {
  collapsed += std::erase_if(mesh.triangles, [&](const Triangle& t) {
    const Vector n = (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    return !(n.squaredNorm() > 0);
  });
  drop_unused_vertices(mesh);
}

Surface measure(Mesh&& mesh) {
  Surface surface;
  static_cast<Mesh&>(surface) = std::move(mesh);
  surface.bounds_min = surface.bounds_max = surface.vertices.front();
  for (const Vector& v : surface.vertices) {
    surface.bounds_min = surface.bounds_min.cwiseMin(v);
    surface.bounds_max = surface.bounds_max.cwiseMax(v);
  }
  surface.normals.resize(surface.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Vector n = surface.area_normal(t);
    surface.area += n.norm() / 2;
    // The squared areas of a 10 um mesh do not underflow, but those of slivers may: hence stableNormalized.
    surface.normals[t] = n.stableNormalized();
  }
  return surface;
}

std::string shells(std::uint32_t n) {
  return fmt::format("{} shell{}", n, plural(n));
}

void note_shells(const ShellCounts& counts, std::vector<std::string>& notes) {
  if (counts.inverted > 0 && counts.shells == 1) {
    notes.emplace_back("the mesh was inside out; its winding was reversed");
  } else if (counts.inverted > 0) {
    notes.push_back(fmt::format("{} of {} inside out; winding reversed", shells(counts.inverted), counts.shells));
  }
  if (counts.nested > 0) notes.push_back(fmt::format("{} inside others: cavities", shells(counts.nested)));
  if (counts.united > 0) {
    notes.push_back(fmt::format("{} crossing or touching another or itself ({} pairs of triangles): united",
                                shells(counts.united), counts.intersections));
  }
  if (counts.righted > 0) {
    notes.push_back(
        fmt::format("a part that was inside out, at least {} of the rest, was turned", percent(counts.righted)));
  }
  if (counts.left_out > kNotedVolume) {
    notes.push_back(fmt::format(
        "a part that is inside out, at least {} of what is kept, is left out; turn its triangles in the mesh",
        percent(counts.left_out)));
  }
  if (counts.flat > 0) notes.push_back(fmt::format("{} without volume: dropped", shells(counts.flat)));
}

// Crossings of the cuts in all triangles, at most: each takes 10 to 100 us to find.
double most_crossings(const Mesh& mesh, const std::vector<TrianglePair>& pairs) {
  std::vector<std::uint32_t> cuts(mesh.triangles.size(), 0);
  for (const auto& [a, b] : pairs) {
    ++cuts[a];
    ++cuts[b];
  }
  double sum = 0;
  for (const double n : cuts) sum += n * n;
  return sum;
}

// @param filling  see close_mesh; where not null, a union that takes minutes is not tried
// @throw NotClosed, or BakeError when no repair helps
Surface closed_surface(const TriangleMesh& input, const RepairSettings& settings, RepairOutcome& outcome,
                       Filling* filling = nullptr) {
  std::vector<std::string>& notes = outcome.notes;
  const Extent extent = measure_extent(input);
  const double longest = (extent.bounds_max - extent.bounds_min).maxCoeff();
  CleanCounts cleaned;
  Mesh mesh = join_vertices(input, cleaned);
  if (mesh.triangles.empty()) refuse("the mesh has no triangle with an area; check the export");
  refuse_far_vertices(mesh, settings.voxel_size);
  drop_duplicates(mesh, cleaned);
  if (mesh.triangles.empty()) refuse("the mesh encloses no volume; give it thickness");
  UnsetVector<EdgeUse> edges = sorted_edges(mesh.triangles);
  bool closed = count_unbalanced(edges) == 0;
  const auto renew_edges = [&] {
    edges = sorted_edges(mesh.triangles);
    closed = count_unbalanced(edges) == 0;
  };
  if (!closed) {
    const std::size_t turned = orient_consistently(mesh);
    if (turned > 0) notes.push_back(fmt::format("turned {} triangles wound against their neighbours", turned));
    renew_edges();
  }
  if (settings.sheet_thickness > 0) {
    // Sheets inside a solid add nothing, and the shell around a thickened one would be a cavity.
    note_dropped(drop_enclosed_sheets(mesh), notes);
    const std::size_t sheets = thicken_sheets(mesh, settings.sheet_thickness);
    if (sheets > 0) {
      notes.push_back(fmt::format("{} open surface{} made {} thick", sheets, plural(sheets),
                                  format_length(settings.sheet_thickness)));
    }
    renew_edges();
  }
  const auto begin = [&](const char* step) {
    if (settings.progress) settings.progress(step);
  };
  begin("check: close");
  if (!closed || settings.repair == Repair::wrap) {
    close_mesh(mesh, longest, settings, outcome, filling);
    renew_edges();
  }
  const Pieces pieces = closed_pieces(mesh.triangles, edges);
  edges = {};  // the largest array of the check
  warn_of_large_filling(settings.voxel_size, outcome);
  begin("check: crossing triangles");
  const std::vector<TrianglePair> pairs = self_intersections(mesh);
  if (filling != nullptr && most_crossings(mesh, pairs) > kMostTried) refuse("uniting the shells takes minutes");
  begin("check: unite shells");
  const ShellCounts resolved = resolve_shells(mesh, pairs, pieces);
  note_shells(resolved, notes);
  const std::size_t open = resolved.united + resolved.flat > 0 ? close_slivers(mesh, longest, settings.voxel_size) : 0;
  if (open > 0) refuse_union(open);
  drop_flat(mesh, cleaned.collapsed);
  if (cleaned.collapsed > 0) notes.push_back(fmt::format("dropped {} collapsed triangles", cleaned.collapsed));
  if (cleaned.duplicates > 0) notes.push_back(fmt::format("dropped {} duplicate triangles", cleaned.duplicates));
  if (mesh.triangles.empty()) refuse("the mesh encloses no volume; give it thickness");
  Surface surface = measure(std::move(mesh));
  double volume6 = 0;
  const Vector middle = (surface.bounds_min + surface.bounds_max) / 2;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    volume6 += (surface.corner(t, 0) - middle).dot(surface.area_normal(t));
  }
  // Rounding makes errors of about 1e-16 of these products, and readers refuse an asset without a certain volume.
  constexpr double kLeastShare = 1e-12;
  if (!(volume6 > kLeastShare * longest * std::max(surface.area, longest * longest))) {
    refuse("the mesh encloses no volume, or so little that rounding hides it; give it thickness");
  }
  return surface;
}

// A mesh that a bake would fill, if it were told to.
struct Filled {
  Surface surface;
  RepairOutcome outcome;
  FillingDoubts doubts;
};

// Nothing where `fill` does not close the mesh, or the shells that it closes cannot be united.
std::optional<Filled> fill_all(const TriangleMesh& input, RepairSettings settings) {
  settings.repair = Repair::fill;
  settings.progress = nullptr;
  Filled filled;
  Filling filling;
  try {
    filled.surface = closed_surface(input, settings, filled.outcome, &filling);
  } catch (const BakeError&) {
    return std::nullopt;
  }
  filled.doubts = judge_filling(filling, filled.surface);
  return filled;
}

// The options that close a mesh after all. `fill` and less are tried, as they fail where the shells that they close
// cannot be united. Wraps and thickened sheets are closed by construction.
// @param filled  what `fill` makes of the mesh, where `automatic` tried it
std::string advise_options(const TriangleMesh& input, const RepairSettings& settings,
                           const std::optional<Filled>& filled) {
  std::vector<std::string> options;
  const auto closes = [&](Repair repair) {
    if (settings.repair == Repair::automatic) return filled && repair == Repair::fill;
    RepairSettings more = settings;
    more.repair = repair;
    more.progress = nullptr;
    RepairOutcome ignored;
    Filling not_judged;
    try {
      (void)closed_surface(input, more, ignored, &not_judged);
      return true;
    } catch (const BakeError&) {
      return false;
    }
  };
  for (const Repair repair : {Repair::weld, Repair::stitch, Repair::fill}) {
    const bool is_more = repair > settings.repair || settings.repair == Repair::automatic;
    if (!options.empty() || !is_more || !closes(repair)) continue;
    options.push_back(fmt::format("--repair {}", describe(repair)));
  }
  if (settings.repair != Repair::wrap) options.emplace_back("--repair wrap");
  // The best comes first: filling drops sheets.
  const bool mostly_sheets = filled && filled->doubts.sheets > kMostlySheets;
  if (settings.sheet_thickness == 0) {
    options.insert(mostly_sheets ? options.begin() : options.end(), thickened(settings.voxel_size) + " for a sheet");
  }
  if (options.size() > 1) options.back() = "or " + options.back();
  return fmt::format("{}", fmt::join(options, options.size() > 2 ? ", " : " "));
}

bool is_accepted(const FillingDoubts& doubts) {
  return doubts.volume <= kAccepted.volume && doubts.sheets <= kAccepted.sheets;
}

// The two answers that differ.
std::string describe_doubts(const Filled& filled) {
  if (filled.doubts.sheets > kAccepted.sheets) {
    return fmt::format("; filling the holes would drop {} of the area, thickening would keep it",
                       percent(filled.doubts.sheets));
  }
  return fmt::format("; it is a solid of {:.3g} m^3 if the holes are filled, or hollow with thin walls",
                     mass_properties(filled.surface).volume);
}

}  // namespace

std::function<void(const char* step)> report_steps(const BakeOptions& options) {
  if (!options.progress) return nullptr;
  return [progress = options.progress](const char* step) { progress(step, 0); };
}

Surface check_mesh(const TriangleMesh& input, const RepairSettings& settings, RepairOutcome& outcome) {
  try {
    return closed_surface(input, settings, outcome);
  } catch (const NotClosed& open) {
    if (settings.progress) settings.progress("check: try repairs");
    std::string reason = open.what();
    std::optional<Filled> filled;
    if (settings.repair == Repair::automatic) filled = fill_all(input, settings);
    if (filled && is_accepted(filled->doubts)) {
      outcome = std::move(filled->outcome);
      return std::move(filled->surface);
    }
    if (filled) reason += describe_doubts(*filled);
    const std::string options = advise_options(input, settings, filled);
    refuse(fmt::format("{}; {}{}{}", reason, open.remedy, options.empty() ? "" : ", or use ", options));
  }
}

}  // namespace vps::bake
