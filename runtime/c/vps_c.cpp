// SPDX-License-Identifier: Zlib
// The C interface: checks arguments, converts, forwards.
#include "runtime/c/vps_c.h"

#include <bit>
#include <cstring>
#include <memory>
#include <new>
#include <type_traits>

namespace {

using namespace vps::c;
using vps::c::to_c;

static_assert(vps_ok == static_cast<int>(vps::Status::ok));
static_assert(vps_missing_part == static_cast<int>(vps::Status::missing_part));
static_assert(vps_bad_argument == static_cast<int>(vps::Status::bad_argument));
static_assert(vps_field_finest == static_cast<int>(vps::Field::none));
static_assert(vps_shell_second == static_cast<int>(vps::ShellRole::second));
static_assert(vps_field_real == static_cast<int>(vps::Field::real));

// Contacts are copied as bytes.
static_assert(std::is_trivially_copyable_v<vps::Contact> && sizeof(VpsContact) == sizeof(vps::Contact));
static_assert(offsetof(VpsContact, inward_normal) == offsetof(vps::Contact, inward_normal));
static_assert(offsetof(VpsContact, penetration) == offsetof(vps::Contact, penetration));
static_assert(offsetof(VpsContact, area) == offsetof(vps::Contact, area));
static_assert(offsetof(VpsContact, point) == offsetof(vps::Contact, point));
static_assert(offsetof(VpsContact, node) == offsetof(vps::Contact, node));

VpsCertificate to_c(const vps::FieldCertificate& from) {
  VpsCertificate out{from.max, from.rms, from.p99, {}, from.bound};
  std::copy_n(from.worst_at.begin(), 3, out.worst_at);
  return out;
}

vps::Contact to_contact(const VpsContact& from) {
  return std::bit_cast<vps::Contact>(from);
}
bool are_valid(const VpsContact* contacts, size_t count) {
  return count == 0 || (contacts != nullptr && std::all_of(contacts, contacts + count, [](const VpsContact& contact) {
                          return is_in_range(contact.position) && is_in_range(contact.inward_normal) &&
                                 is_in_range(contact.penetration) && contact.area >= 0 && is_in_range(contact.area);
                        }));
}
bool are_valid(const VpsContact* contacts, size_t count, const VpsPenaltyLaw* law, const VpsTwist* twist) {
  return law != nullptr && twist != nullptr && is_in_range(twist->centre) && is_in_range(twist->linear) &&
         is_in_range(twist->angular) && are_valid(contacts, count);
}
vps::PenaltyLaw to_law(const VpsPenaltyLaw& law) {
  return {law.stiffness, law.damping};
}
vps::Twist to_twist(const VpsTwist& twist) {
  return {to_vec3(twist.centre), to_vec3(twist.linear), to_vec3(twist.angular)};
}
template <std::size_t n>
bool is_finite(const double (&numbers)[n]) {
  return std::all_of(numbers, numbers + n, [](double x) { return std::isfinite(x); });
}
template <std::size_t n>
void add(const double (&from)[n], double (&to)[n]) {
  for (std::size_t i = 0; i < n; ++i) to[i] += from[i];
}

vps::Weight to_weight(VpsWeight weight) {
  if (weight == vps_per_point) return vps::Weight::per_point;
  return weight == vps_per_patch ? vps::Weight::per_patch : vps::Weight::per_area;
}
// As vps_traverse, with a checked field.
VpsStatus traverse(const VpsPointshell* shell, vps::FieldRef field, const VpsPose* pose, const VpsQueryOptions* options,
                   VpsScratch* scratch, VpsContact* contacts, size_t capacity, VpsQueryResult* result) {
  if (shell == nullptr || pose == nullptr || result == nullptr) return vps_bad_argument;
  if (contacts == nullptr && capacity > 0) return vps_bad_argument;
  const VpsQueryOptions given = options == nullptr ? VpsQueryOptions{} : *options;
  if (given.weight < vps_per_area || given.weight > vps_per_patch) return vps_bad_argument;
  if (!(given.contact_distance <= kFarthest) || !std::isfinite(given.max_microseconds)) return vps_bad_argument;
  if (const VpsStatus status = reserve(scratch, shell, capacity); status != vps_ok) return status;

  vps::QueryOptions query;
  query.contact_distance = given.contact_distance;
  query.weight = to_weight(given.weight);
  query.segment_level = given.segment_level;
  query.level = given.level;
  query.max_tests = given.max_tests;
  query.max_microseconds = given.max_microseconds;
  if (given.cache != nullptr) query.cache = &given.cache->cache;
  if (given.level > 0 || given.max_tests > 0 || given.max_microseconds > 0) {
    const VpsStatus status = or_no_memory([&] { query.node_areas = shell->areas(); });
    if (status != vps_ok) return status;
  }
  const std::size_t most = std::min(capacity, most_contacts(*shell));
  const std::span<vps::Contact> out = scratch->contacts.grow(most).first(most);  // reserved
  vps::QueryResult found;
  const vps::Status status = vps::traverse(shell->view, field, to_pose(*pose), query, scratch->scratch, out, found);
  if (status != vps::Status::ok && status != vps::Status::output_full) return to_c(status);

  const std::size_t written = std::min<std::size_t>(found.contacts, out.size());
  if (written > 0) std::memcpy(contacts, out.data(), written * sizeof(VpsContact));
  result->delta = found.delta;
  result->delta_bound = found.delta_bound;
  std::copy_n(found.force, 3, result->force);
  std::copy_n(found.torque, 3, result->torque);
  result->contacts = found.contacts;
  result->nodes_tested = found.nodes_tested;
  result->points_tested = found.points_tested;
  result->complete = found.complete ? 1 : 0;
  return to_c(status);
}

// Fills the views of an open asset.
void fill_views(VpsAsset& asset, double scale) {
  asset.scale = scale;
  // Parts that are missing leave their view empty.
  for (VpsField field = vps_field_finest; field <= vps_field_real; ++field) {
    (void)asset.asset.voxelmap(asset.maps[field].view, static_cast<vps::Field>(field), scale);
  }
  vps::PointshellView shell;
  if (asset.asset.pointshell(shell, scale) == vps::Status::ok) {
    asset.shell.change_to(shell);
    for (VpsVoxelmap& map : asset.maps) map.shell = &asset.shell.view;
  }
}

// Fills a new handle. open(vps::Asset&) opens its asset.
template <class Open>
VpsStatus open_asset(const Open& open, VpsUse use, VpsAsset** asset) {
  if (asset == nullptr) return vps_bad_argument;
  *asset = nullptr;
  if ((use & ~vps_use_everything) != 0) return vps_bad_argument;
  std::unique_ptr<VpsAsset> opened(new (std::nothrow) VpsAsset);
  if (opened == nullptr) return vps_no_memory;
  if (const vps::Status status = open(opened->asset); status != vps::Status::ok) return to_c(status);
  fill_views(*opened, 1);
  *asset = opened.release();
  return vps_ok;
}

}  // namespace

const char* vps_status_text(VpsStatus status) {
  if (status == vps_no_memory) return vps::describe(vps::Status::no_memory);
  // Numbers that are no VpsStatus must not become another status.
  return vps::describe(static_cast<vps::Status>(status < 0 || status > vps_bad_argument ? 255 : status));
}

VpsStatus vps_asset_open(const char* path, VpsAsset** asset) {
  return vps_asset_open_for(path, vps_use_everything, asset);
}

VpsStatus vps_asset_open_for(const char* path, VpsUse use, VpsAsset** asset) {
  return open_asset([&](vps::Asset& opened) { return vps::Asset::open(path, opened, static_cast<vps::Use>(use)); }, use,
                    asset);
}

VpsStatus vps_asset_open_memory(const void* bytes, size_t count, VpsUse use, VpsAsset** asset) {
  const auto open = [&](vps::Asset& opened) {
    if (bytes == nullptr) return vps::Status::bad_argument;
    return vps::Asset::open({static_cast<const std::byte*>(bytes), count}, opened, static_cast<vps::Use>(use));
  };
  return open_asset(open, use, asset);
}

VpsStatus vps_asset_close(VpsAsset* asset) {
  delete asset;
  return vps_ok;
}

VpsStatus vps_asset_verify(const VpsAsset* asset) {
  return asset == nullptr ? VpsStatus{vps_bad_argument} : to_c(asset->asset.verify());
}

VpsStatus vps_asset_info(const VpsAsset* asset, VpsAssetInfo* info) {
  if (asset == nullptr || info == nullptr) return vps_bad_argument;
  const vps::AssetInfo from = vps::scaled(asset->asset.info(), asset->scale);
  VpsAssetInfo& to = *info;
  std::copy_n(from.bounds_min.begin(), 3, to.bounds_min);
  std::copy_n(from.bounds_max.begin(), 3, to.bounds_max);
  to.triangles = from.triangles;
  to.vertices = from.vertices;
  to.surface_area = from.surface_area;
  to.volume = from.volume;
  std::copy_n(from.centre_of_mass.begin(), 3, to.centre_of_mass);
  std::copy_n(from.inertia.begin(), 6, to.inertia);
  to.voxel_size = from.voxel_size;
  std::copy_n(from.dims.begin(), 3, to.dims);
  std::copy_n(from.origin.begin(), 3, to.origin);
  to.band_inner = from.band_inner;
  to.band_outer = from.band_outer;
  to.points = from.points;
  to.levels = from.levels;
  to.branching = from.branching;
  to.spacing = from.spacing;
  to.covering_radius = from.covering_radius;
  to.feature_covering_radius = from.feature_covering_radius;
  to.normal_error_mean = from.normal_error_mean;
  to.normal_error_max = from.normal_error_max;
  to.layers_error = to_c(from.layers_error);
  to.scaled_error = to_c(from.scaled_error);
  to.real_error = to_c(from.real_error);
  to.far_spacing = from.far_spacing;
  to.far_range = from.far_range;
  to.far_error = to_c(from.far_error);
  to.certificate_samples = from.certificate_samples;
  std::copy(from.generator.begin(), from.generator.end(), to.generator);
  return vps_ok;
}

VpsStatus vps_asset_scale(VpsAsset* asset, double scale) {
  if (asset == nullptr || vps::check_scale(scale) != vps::Status::ok) return vps_bad_argument;
  fill_views(*asset, scale);
  return vps_ok;
}

VpsStatus vps_asset_voxelmap(const VpsAsset* asset, VpsField field, const VpsVoxelmap** map) {
  if (map == nullptr) return vps_bad_argument;
  *map = nullptr;
  if (asset == nullptr || field < vps_field_finest || field > vps_field_real) return vps_bad_argument;
  if (asset->maps[field].view.field == vps::Field::none) return vps_missing_part;
  *map = &asset->maps[field];
  return vps_ok;
}

VpsStatus vps_voxelmap_field(const VpsVoxelmap* map, VpsField* field) {
  if (map == nullptr || field == nullptr) return vps_bad_argument;
  *field = static_cast<VpsField>(map->view.field);
  return vps_ok;
}

VpsStatus vps_asset_pointshell(const VpsAsset* asset, const VpsPointshell** shell) {
  if (shell == nullptr) return vps_bad_argument;
  *shell = nullptr;
  if (asset == nullptr) return vps_bad_argument;
  if (asset->shell.view.points == 0) return vps_missing_part;
  *shell = &asset->shell;
  return vps_ok;
}

VpsStatus vps_choose_roles(const VpsAsset* first, const VpsAsset* second, VpsShellRole* role) {
  if (first == nullptr || second == nullptr || role == nullptr) return vps_bad_argument;
  vps::ShellRole chosen{};
  const vps::Status status = vps::choose_roles(first->asset, second->asset, chosen);
  if (status == vps::Status::ok) *role = static_cast<VpsShellRole>(chosen);
  return to_c(status);
}

VpsStatus vps_pointshell_segment_level(const VpsPointshell* shell, uint32_t segments, uint32_t* level) {
  if (shell == nullptr || level == nullptr) return vps_bad_argument;
  *level = vps::segment_level_for(shell->view, segments);
  return vps_ok;
}

VpsStatus vps_pointshell_point(const VpsPointshell* shell, uint32_t index, VpsPoint* point) {
  if (shell == nullptr || point == nullptr || index >= shell->view.points) return vps_bad_argument;
  copy(vps::point_position(shell->view, index), point->position);
  copy(vps::point_inward_normal(shell->view, index), point->inward_normal);
  point->area = vps::point_area(shell->view, index);
  return vps_ok;
}

VpsStatus vps_check_pose(const VpsPose* pose) {
  return pose == nullptr ? VpsStatus{vps_bad_argument} : to_c(vps::check_pose(to_pose(*pose)));
}

VpsStatus vps_relative_pose(const VpsPose* first, const VpsPose* second, VpsPose* out) {
  if (first == nullptr || second == nullptr || out == nullptr) return vps_bad_argument;
  for (const VpsPose* const given : {first, second}) {
    const auto is_finite = [](double x) { return std::isfinite(x); };
    if (!std::all_of(given->rotation, given->rotation + 9, is_finite) ||
        !std::all_of(given->translation, given->translation + 3, is_finite)) {
      return vps_bad_argument;
    }
  }
  const vps::Pose pose = vps::relative_pose(to_pose(*first), to_pose(*second));
  std::copy_n(pose.rotation, 9, out->rotation);
  std::copy_n(pose.translation, 3, out->translation);
  return vps_ok;
}

VpsStatus vps_penetration(VpsFieldRef field, const float point[3], const float inward_normal[3], float* penetration) {
  const bool needs_normal = field.kind == vps_kind_map;
  if (!is_in_range(point) || (needs_normal && !is_in_range(inward_normal)) || penetration == nullptr) {
    return vps_bad_argument;
  }
  return with_field(field, [&](vps::FieldRef ref) {
    *penetration = vps::penetration(ref, to_vec3(point), needs_normal ? to_vec3(inward_normal) : vps::Vec3());
    return VpsStatus{vps_ok};
  });
}

VpsStatus vps_penetration_bound(const VpsVoxelmap* map, const float point[3], float* bound) {
  if (map == nullptr || !is_in_range(point) || bound == nullptr) return vps_bad_argument;
  *bound = vps::penetration_bound(map->view, to_vec3(point));
  return vps_ok;
}

VpsStatus vps_outward_normal(VpsFieldRef field, const float point[3], float normal[3]) {
  if (!is_in_range(point) || normal == nullptr) return vps_bad_argument;
  return with_field(field, [&](vps::FieldRef ref) {
    copy(vps::outward_normal(ref, to_vec3(point)), normal);
    return VpsStatus{vps_ok};
  });
}

VpsStatus vps_scratch_create(VpsScratch** scratch) {
  if (scratch == nullptr) return vps_bad_argument;
  *scratch = new (std::nothrow) VpsScratch;
  return *scratch == nullptr ? vps_no_memory : vps_ok;
}

VpsStatus vps_scratch_destroy(VpsScratch* scratch) {
  delete scratch;
  return vps_ok;
}

VpsStatus vps_scratch_reserve(VpsScratch* scratch, const VpsPointshell* shell, size_t capacity) {
  if (const VpsStatus status = reserve(scratch, shell, capacity); status != vps_ok) return status;
  return or_no_memory([&] { (void)shell->areas(); });
}

VpsStatus vps_contact_cache_create(VpsContactCache** cache) {
  if (cache == nullptr) return vps_bad_argument;
  *cache = new (std::nothrow) VpsContactCache;
  return *cache == nullptr ? vps_no_memory : vps_ok;
}

VpsStatus vps_contact_cache_destroy(VpsContactCache* cache) {
  delete cache;
  return vps_ok;
}

VpsStatus vps_traverse(const VpsPointshell* shell, VpsFieldRef field, const VpsPose* shell_to_field,
                       const VpsQueryOptions* options, VpsScratch* scratch, VpsContact* contacts, size_t capacity,
                       VpsQueryResult* result) {
  return with_field(field, [&](vps::FieldRef ref) {
    return traverse(shell, ref, shell_to_field, options, scratch, contacts, capacity, result);
  });
}

VpsStatus vps_penalty_wrench(const VpsContact* contacts, size_t count, const VpsPenaltyLaw* law, const VpsTwist* twist,
                             VpsWrench* wrench) {
  if (!are_valid(contacts, count, law, twist) || wrench == nullptr) return vps_bad_argument;
  vps::Wrench one;
  const vps::Status status = vps::penalty_wrench({}, to_law(*law), to_twist(*twist), one);
  if (status != vps::Status::ok) return to_c(status);
  VpsWrench sum = {};
  for (size_t i = 0; i < count; ++i) {
    const vps::Contact contact = to_contact(contacts[i]);
    (void)vps::penalty_wrench({&contact, 1}, to_law(*law), to_twist(*twist), one);
    add(one.force, sum.force);
    add(one.torque, sum.torque);
  }
  if (!is_finite(sum.force) || !is_finite(sum.torque)) return vps_bad_argument;
  *wrench = sum;
  return vps_ok;
}

VpsStatus vps_penalty_gradient(const VpsContact* contacts, const float* outward_normals, size_t count,
                               const VpsPenaltyLaw* law, const VpsTwist* twist, VpsWrenchGradient* gradient) {
  if (!are_valid(contacts, count, law, twist) || gradient == nullptr) return vps_bad_argument;
  for (size_t i = 0; outward_normals != nullptr && i < count; ++i) {
    if (!is_in_range(outward_normals + 3 * i)) return vps_bad_argument;
  }
  vps::WrenchGradient one;
  const vps::Status status = vps::penalty_gradient({}, {}, to_law(*law), to_twist(*twist), one);
  if (status != vps::Status::ok) return to_c(status);
  VpsWrenchGradient sum = {};
  for (size_t i = 0; i < count; ++i) {
    const vps::Contact contact = to_contact(contacts[i]);
    const vps::Vec3 normal = outward_normals == nullptr ? contact.inward_normal : to_vec3(outward_normals + 3 * i);
    (void)vps::penalty_gradient({&contact, 1}, {&normal, 1}, to_law(*law), to_twist(*twist), one);
    add(one.pose, sum.pose);
    add(one.twist, sum.twist);
  }
  if (!is_finite(sum.pose) || !is_finite(sum.twist)) return vps_bad_argument;
  *gradient = sum;
  return vps_ok;
}

VpsStatus vps_reduce_contacts(const VpsContact* contacts, size_t count, const float centre[3], VpsScratch* scratch,
                              VpsContact* kept, size_t capacity, VpsReduction* reduction) {
  if (!are_valid(contacts, count) || !is_in_range(centre) || scratch == nullptr || kept == nullptr || capacity == 0 ||
      count > UINT32_MAX || reduction == nullptr) {
    return vps_bad_argument;
  }
  vps::Reduction found;
  const size_t most = std::min(capacity, count);
  std::span<vps::Contact> all;
  std::span<vps::Contact> room;
  const VpsStatus grown = or_no_memory([&] {
    all = scratch->contacts.grow(count).first(count);
    room = scratch->kept.grow(most).first(most);
    if (scratch->reduction.distances.size() < count) scratch->reduction.distances.resize(count);
    if (scratch->reduction.nearest.size() < count) scratch->reduction.nearest.resize(count);
  });
  if (grown != vps_ok) return grown;
  if (count > 0) {
    std::transform(contacts, contacts + count, all.begin(), to_contact);
    (void)vps::reduce_contacts(all, to_vec3(centre), room, scratch->reduction, found);
    std::memcpy(kept, room.data(), found.kept * sizeof(VpsContact));
  }
  *reduction = {found.kept, found.force_residual, found.torque_residual};
  return vps_ok;
}
