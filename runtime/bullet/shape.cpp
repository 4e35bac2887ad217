// SPDX-License-Identifier: Zlib
// The collision shape: bounds, inertia and surfels from the asset. Paper: Sec. 3.2.
#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>
#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>
#include <utility>

#include "runtime/bullet/convert.h"
#include "runtime/bullet/lint.h"
#include "runtime/bullet/messages.h"
#include "runtime/bullet/principal_axes.h"
#include "runtime/vps_queries.h"

namespace vps::bullet {
namespace {

btVector3 vector3(const std::array<double, 3>& v) {
  return {static_cast<btScalar>(v[0]), static_cast<btScalar>(v[1]), static_cast<btScalar>(v[2])};
}

std::uint64_t next_serial() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

// @return never 0
std::uint64_t hash_of_pose(const btTransform& transform) {
  btScalar matrix[16];
  transform.getOpenGLMatrix(matrix);  // without the padding of Bullet's vectors
  return hash_bytes(std::as_bytes(std::span(matrix))) | 1;
}

// Walks the point-sphere tree and passes the surfels that meet a box to a callback.
class Surfels {
 public:
  Surfels(const Shape& shape, const btVector3& low, const btVector3& high, btTriangleCallback& callback)
      : shape_(shape), shell_(shape.pointshell()), low_(low), high_(high), callback_(callback) {}

  // The recursion is no deeper than the tree has levels.
  void visit(std::uint32_t node) {
    if (!near(in_shape(sphere_centre(shell_, node)), sphere_radius(shell_, node) + reach())) return;
    const auto [first, end] = children_of(shell_, node);
    const bool leaf = node >= shell_.level_offsets[shell_.levels - 1];
    for (std::uint32_t child = first; child < end; ++child) leaf ? emit(child) : visit(child);
  }

 private:
  btScalar reach() const { return 2 * btScalar(shell_.covering_radius); }
  btVector3 in_shape(Vec3 p) const { return shape_.asset_frame().getBasis() * (to_bt(p) - shape_.centre_of_mass()); }
  bool near(const btVector3& p, btScalar distance) const {
    const btVector3 margin(distance, distance, distance);
    return TestPointAgainstAabb2(low_ - margin, high_ + margin, p);
  }
  void emit(std::uint32_t point) {
    const btVector3 p = in_shape(point_position(shell_, point));
    if (!near(p, reach())) return;
    const btVector3 outward = shape_.asset_frame().getBasis() * -to_bt(point_inward_normal(shell_, point));
    btVector3 u;
    btVector3 v;
    btPlaneSpace1(outward, u, v);
    // An equilateral triangle has corners at twice the radius of its inscribed circle.
    btVector3 corners[3];
    for (int k = 0; k < 3; ++k) {
      const btScalar angle = btScalar(k) * SIMD_2_PI / 3;
      corners[k] = p + reach() * (btCos(angle) * u + btSin(angle) * v);
    }
    if ((corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(outward) < 0) btSwap(corners[1], corners[2]);
    callback_.processTriangle(corners, 0, static_cast<int>(point));
  }

  const Shape& shape_;
  const PointshellView& shell_;
  const btVector3 low_, high_;
  btTriangleCallback& callback_;
};

// Bullet requests the triangles near a ray from concave shapes. The field gives the hit directly.
// @return false where the field cannot answer, as without distances
bool hit_by_field(const Shape& shape, btTriangleRaycastCallback& ray) {
  const VoxelmapView& map = shape.voxelmap();
  if (map.field != Field::scaled && map.field != Field::real) return false;
  const btVector3& centre_of_mass = shape.centre_of_mass();
  const auto in_asset = [&](const btVector3& v, int axis) {
    const btVector3 row = shape.asset_frame().getBasis().getColumn(axis);
    return double(row.x()) * double(v.x()) + double(row.y()) * double(v.y()) + double(row.z()) * double(v.z());
  };
  double start[3];
  double direction[3];
  double length = 0;
  for (int axis = 0; axis < 3; ++axis) {
    start[axis] = in_asset(ray.m_from, axis);
    direction[axis] = in_asset(ray.m_to, axis) - start[axis];
    length = std::hypot(length, direction[axis]);
  }
  if (!(length > 0)) return true;
  // Starts near the body: floats are precise enough for the body's size, not for its distance.
  double ahead = 0;
  double radius = 0;
  for (int axis = 0; axis < 3; ++axis) {
    direction[axis] /= length;
    const double low = double{map.bounds_min[axis]} - double(centre_of_mass[axis]);
    const double high = double{map.bounds_max[axis]} - double(centre_of_mass[axis]);
    ahead += direction[axis] * ((low + high) / 2 - start[axis]);
    radius = std::hypot(radius, (high - low) / 2);
  }
  const double skipped = std::clamp(ahead - radius - double{map.voxel_size}, 0.0, length);
  const auto at = [&](int axis) {
    return static_cast<float>(start[axis] + skipped * direction[axis] + double(centre_of_mass[axis]));
  };
  const Ray local{
      {at(0), at(1), at(2)},
      {static_cast<float>(direction[0]), static_cast<float>(direction[1]), static_cast<float>(direction[2])},
      static_cast<float>(length - skipped)};
  RayHit hit;
  if (cast_ray(map, local, {}, hit) != Status::ok) return false;
  const auto fraction = static_cast<btScalar>((skipped + double{hit.distance}) / length);
  if (hit.hit && fraction < ray.m_hitFraction) {
    ray.m_hitFraction = ray.reportHit(shape.asset_frame().getBasis() * to_bt(hit.outward_normal), fraction, 0, 0);
  }
  return true;
}

}  // namespace

Shape::Shape(std::shared_ptr<const Asset> asset, Part part, Axes axes)
    : serial_(next_serial()),
      asset_(asset != nullptr ? std::move(asset) : std::make_shared<const Asset>()),
      part_(part),
      axes_(axes),
      label_(asset_key(*asset_)) {
  m_shapeType = kProxyType;
  m_collisionMargin = 0;
  set_scale(1);
  if (asset_->is_open()) return;
  send_message(*this, "its asset is not open, so it has no contacts: check the status of Asset::open");
  sent_ = ~std::uint32_t{0};  // other messages would mislead
}

void Shape::set_scale(btScalar scale) {
  scaling_.setValue(scale, scale, scale);
  info_ = scaled(asset_->info(), double(scale));
  centre_of_mass_ = vector3(info_.centre_of_mass);
  asset_frame_ = translation(-centre_of_mass_);
  moments_ = {info_.inertia[0], info_.inertia[1], info_.inertia[2]};
  if (axes_ == Axes::principal) {
    const PrincipalAxes found = find_principal_axes(info_.inertia);
    moments_ = found.moments;
    asset_frame_ = btTransform(found.rotation.transpose()) * asset_frame_;
  }
  const btVector3 low = vector3(info_.bounds_min);
  const btVector3 high = vector3(info_.bounds_max);
  box_centre_ = asset_frame_ * ((low + high) / 2);
  box_half_ = (high - low) / 2;
  // A missing part leaves its view empty. Pairs that need it report missing_part.
  if (asset_->voxelmap(distances_, Field::none, double(scale)) != Status::ok || distances_.field == Field::layers) {
    distances_ = {};
  }
  if (part_ != Part::pointshell) (void)asset_->voxelmap(map_, Field::none, double(scale));
  if (part_ != Part::voxelmap) (void)asset_->pointshell(shell_, double(scale));
  find_patches();
}

// Only springs need them.
void Shape::find_patches() {
  patches_.clear();
  if (foundation_.stiffness > 0) (void)find_flat_patches(shell_, patches_);
}

std::uint32_t Shape::segment_level() const {
  return segment_level_for(shell_, wished_segments_);
}

Status Shape::set_foundation(const PenaltyLaw& law) {
  const auto sound = [](double x) { return x >= 0 && std::isfinite(x); };
  if (!sound(law.stiffness) || !sound(law.damping)) return Status::bad_argument;
  foundation_ = law;
  find_patches();
  return Status::ok;
}

void Shape::report(Status status) const {
  status_.store(status, std::memory_order_relaxed);
  switch (status) {
    case Status::ok:
      return;
    case Status::missing_part:
      return send_once(
          Notice::missing_part,
          "meets a shape that it cannot: one of the two must give a pointshell, the other a voxelmap or be a "
          "convex shape, plane or mesh of Bullet's, not a GImpact compound; bake the missing part, or use "
          "Part::mixed");
    case Status::bad_pose:
      return send_once(
          Notice::bad_pose,
          "a body's transform is not finite, not a rotation or farther than 1e12 m; its contacts are left out");
    default:
      return send_once(Notice::other, std::string("a pair is left out: ") + describe(status));
  }
}

void Shape::send_once(Notice notice, const std::string& text) const {
  const std::uint32_t bit = 1U << static_cast<std::uint32_t>(notice);
  if ((sent_.fetch_or(bit, std::memory_order_relaxed) & bit) == 0) send_message(*this, text);
}

void Shape::report_not_registered() const {
  send_once(
      Notice::not_registered,
      "meets a dispatcher without its algorithm: call vps::bullet::register_algorithm(*dispatcher) before the first "
      "step");
}

// Where only Shapes meet, an unregistered dispatcher calls getAabb and nothing else: once when a body is added, and
// again in the first step, before the body has moved. Several threads may call this at once: one atomic is enough.
void Shape::look_for_first_step(const btTransform& transform) const {
  const std::uint64_t seen = hash_of_pose(transform);
  std::uint64_t first = 0;
  if (!first_seen_.compare_exchange_strong(first, seen, std::memory_order_relaxed) && first == seen) {
    report_not_registered();
  }
}

void Shape::getAabb(const btTransform& transform, btVector3& low, btVector3& high) const {
  if (!is_any_dispatcher_registered()) look_for_first_step(transform);
  // The box of the asset's axes, turned: tighter than a box of the shape's axes.
  const btMatrix3x3& basis = transform.getBasis();
  const btMatrix3x3 turned = axes_ == Axes::of_asset ? basis : basis * asset_frame_.getBasis();
  const btScalar margin = getMargin();
  const btVector3 reach = turned.absolute() * (box_half_ + btVector3(margin, margin, margin));
  const btVector3 centre = transform(box_centre_);
  low = centre - reach;
  high = centre + reach;
}

void Shape::getBoundingSphere(btVector3& centre, btScalar& radius) const {
  centre = box_centre_;
  radius = box_half_.length() + getMargin();
}

// In double: moments at unit density and densities alone may be beyond floats.
std::array<double, 3> Shape::moments_of(double mass) const {
  // Of a rod this much thinner than long, the integral has no digit of its least moment, not even its sign. Bullet
  // takes 0 for a body that does not turn, and cannot invert what floats hold only in part.
  constexpr double kLeastShare = 1e-9;
  constexpr double kLeast = 16 * double{std::numeric_limits<float>::min()};
  const double largest = std::max({moments_[0], moments_[1], moments_[2]});
  std::array<double, 3> moments{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double moment = mass * (std::max(moments_[axis], kLeastShare * largest) / info_.volume);
    moments[axis] = moment < kLeast ? 0 : moment;
  }
  return moments;
}

void Shape::calculateLocalInertia(btScalar mass, btVector3& inertia) const {
  if (!asset_->is_open()) return inertia.setZero();
  const double density = static_cast<double>(mass) / info_.volume;
  inertia = vector3(moments_of(static_cast<double>(mass)));
  // Aerogel has 1 kg/m^3, osmium 22,600. A density far outside this range means mixed units of mass and size.
  if (mass > 0 && (density < 0.05 || density > 1e6)) {
    double size = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) size = std::max(size, info_.bounds_max[axis] - info_.bounds_min[axis]);
    char text[256];
    std::snprintf(text, sizeof text,
                  "is %.4g m long and weighs %.4g kg, %.2g kg/m^3; assets are in metres and kilograms: bake the mesh "
                  "with its unit (vpsbake --unit mm) or check the mass",
                  size, static_cast<double>(mass), density);
    send_once(Notice::units, text);
  }
}

double Shape::lost_inertia() const {
  if (axes_ == Axes::principal) return 0;
  const std::array<double, 6>& i = info_.inertia;
  return std::max({std::abs(i[3]), std::abs(i[4]), std::abs(i[5])}) / std::max({i[0], i[1], i[2]});
}

void Shape::setLocalScaling(const btVector3& scaling) {
  const bool was_refused = std::exchange(refuses_scaling_, true);
  if (scaling.x() != scaling.y() || scaling.x() != scaling.z() || check_scale(double(scaling.x())) != Status::ok) {
    status_.store(Status::bad_argument, std::memory_order_relaxed);
    return send_once(Notice::scaling,
                     "is scaled by one factor from 0.001 to 1000 along all axes; another scaling was not applied");
  }
  refuses_scaling_ = false;
  if (was_refused && status() == Status::bad_argument) status_.store(Status::ok, std::memory_order_relaxed);
  if (scaling.x() != scaling_.x()) set_scale(scaling.x());
}

void Shape::processAllTriangles(btTriangleCallback* callback, const btVector3& low, const btVector3& high) const {
  // Bullet's own algorithm gets a Shape only if this one is not registered.
  if (dynamic_cast<btConvexTriangleCallback*>(callback) != nullptr) report_not_registered();
  if (auto* const ray = dynamic_cast<btTriangleRaycastCallback*>(callback)) {
    if (hit_by_field(*this, *ray)) return;
  }
  if (shell_.points > 0) Surfels(*this, low, high, *callback).visit(0);
}

}  // namespace vps::bullet
