// SPDX-License-Identifier: Zlib
// Looks for settings of a world that harm its Shapes.
#include "runtime/bullet/lint.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <limits>

#include "runtime/bullet/body_motion.h"
#include "runtime/bullet/pair.h"
#include "runtime/bullet/partners/for_each_leaf.h"

namespace vps::bullet {
namespace {

#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
std::string
format(const char* pattern, ...) {
  char text[320];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

bool can_meet(const btCollisionObject& a, const btCollisionObject& b) {
  if (&a == &b || (a.isStaticOrKinematicObject() && b.isStaticOrKinematicObject())) return false;
  const btBroadphaseProxy* const first = a.getBroadphaseHandle();
  const btBroadphaseProxy* const second = b.getBroadphaseHandle();
  if (first == nullptr || second == nullptr) return true;
  return (first->m_collisionFilterGroup & second->m_collisionFilterMask) != 0 &&
         (second->m_collisionFilterGroup & first->m_collisionFilterMask) != 0;
}

class Lint {
 public:
  Lint(btDiscreteDynamicsWorld& world, double step) : world_(world), step_(step) {}

  std::vector<Advice> run() {
    for (int i = 0; i < world_.getNumCollisionObjects(); ++i) {
      for_each_leaf(*world_.getCollisionObjectArray()[i], [&](const Leaf& leaf) {
        const Shape* const shape = as_vps(leaf.shape);
        if (shape == nullptr) return void(others_ = true);
        if (any_ == nullptr) any_ = shape;
        if (!shape->asset().is_open()) return;
        finest_ = std::min(finest_, shape->info().voxel_size);
        shells_ = shells_ || shape->pointshell().points > 0;
        springs_ = springs_ || shape->foundation().stiffness > 0;
        maps_ = maps_ || shape->voxelmap().field != Field::none;
      });
    }
    if (any_ == nullptr) return {};
    if (std::isfinite(finest_)) look_at_world();  // else no asset is open
    for (int i = 0; i < world_.getNumCollisionObjects(); ++i) {
      const btCollisionObject& object = *world_.getCollisionObjectArray()[i];
      for_each_leaf(object, [&](const Leaf& leaf) { look_at_shape(object, *leaf.shape); });
      if (inverse_mass(object) > 0 && !object.isStaticOrKinematicObject()) look_at_body(object);
    }
    return std::move(advice_);
  }

 private:
  // Reports each setting once.
  void add(const btCollisionObject* object, const char* setting, std::string text) {
    const auto is_reported = [&](const Advice& old) { return old.setting == setting; };
    if (std::none_of(advice_.begin(), advice_.end(), is_reported))
      advice_.push_back({object, setting, std::move(text)});
  }

  void look_at_world() {
    const btContactSolverInfo& solver = world_.getSolverInfo();
    if (!is_registered(*world_.getDispatcher(), *any_)) {
      add(nullptr, "register_algorithm",
          "the dispatcher does not know baked shapes: they pass through each other; call "
          "vps::bullet::register_algorithm(*dispatcher) before the first step, after GImpact's registration");
    }
    const double threshold = double(solver.m_splitImpulsePenetrationThreshold);
    if (springs_) {
      if (solver.m_splitImpulse != 0) {
        add(nullptr, "m_splitImpulse",
            "split impulses correct positions only, so the springs of set_foundation carry no weight: set "
            "m_splitImpulse = 0");
      }
    } else if (solver.m_splitImpulse == 0 || threshold < -4 * finest_) {
      add(nullptr, "m_splitImpulsePenetrationThreshold",
          format(
              "penetrations below %.3g mm (without m_splitImpulse: all) are resolved by velocity, so bodies hop; set "
              "m_splitImpulse = 1 and m_splitImpulsePenetrationThreshold = %.2g",
              -1000 * threshold, -2 * finest_));
    } else if (threshold > -0.5 * finest_) {
      add(nullptr, "m_splitImpulsePenetrationThreshold",
          format("split impulses are not warm started, so stacks fall where they begin at %.2g mm of penetration; set "
                 "m_splitImpulsePenetrationThreshold = %.2g",
                 -1000 * threshold, -2 * finest_));
    }
    if ((solver.m_solverMode & SOLVER_USE_WARMSTARTING) == 0) {
      add(nullptr, "m_solverMode", "impulses are not carried over from step to step: set SOLVER_USE_WARMSTARTING");
    } else if ((solver.m_solverMode & SOLVER_USE_2_FRICTION_DIRECTIONS) == 0) {
      add(nullptr, "m_solverMode",
          "with one friction direction resting bodies creep, by 0.2 mm/s at 240 Hz and by centimetres at 60 Hz: set "
          "SOLVER_USE_2_FRICTION_DIRECTIONS too");
    }
    gravity_ = double(world_.getGravity().length());
    if (gravity_ > 100) {
      add(nullptr, "setGravity",
          format("%.4g m/s^2 is the gravity of a world in %s; assets are in metres: build the world in metres, or bake "
                 "with vpsbake --scale %s",
                 gravity_, gravity_ > 2000 ? "millimetres" : "centimetres", gravity_ > 2000 ? "1000" : "100"));
    }
    const double fall = gravity_ * step_ * step_;
    if (fall > finest_) {
      add(nullptr, "stepSimulation",
          format("in a step of %.3g s a resting body falls %.2g mm (%.2g voxels) into its ground; use steps of %.2g s "
                 "(fixedTimeStep), or add a vps::bullet::ContinuousMotion",
                 step_, 1000 * fall, fall / finest_, std::sqrt(finest_ / gravity_)));
    }
  }

  // Whether an object can meet one of Bullet's own shapes.
  [[nodiscard]] bool meets_others(const btCollisionObject& object) const {
    bool found = false;
    for (int i = 0; i < world_.getNumCollisionObjects() && others_ && !found; ++i) {
      const btCollisionObject& other = *world_.getCollisionObjectArray()[i];
      if (!can_meet(object, other)) continue;
      for_each_leaf(other, [&](const Leaf& leaf) { found = found || as_vps(leaf.shape) == nullptr; });
    }
    return found;
  }

  void look_at_shape(const btCollisionObject& object, const btCollisionShape& shape) {
    const double margin = double(shape.getMargin());
    if (const Shape* const vps = as_vps(&shape)) {
      if (!vps->asset().is_open()) {
        return add(&object, "Asset::open",
                   "its asset is not open, so it has no contacts: check the status of Asset::open");
      }
      if (vps->segment_level() > 0 && vps->foundation().stiffness > 0) {
        add(&object, "set_segments",
            "with segments its contacts are rigid: leave them out for the springs of set_foundation");
      }
      if (vps->refuses_scaling()) {
        add(&object, "setLocalScaling",
            "a baked shape is scaled by one positive factor, from 0.001 to 1000; this scaling was not applied");
      }
      const bool has_shell = vps->pointshell().points > 0;
      const bool has_map = vps->voxelmap().field != Field::none;
      if (!has_shell && (meets_others(object) || !shells_)) {
        add(&object, "Part::voxelmap",
            "without a pointshell it has no contacts with Bullet's own shapes or with other voxelmaps; bake one, or "
            "use Part::mixed");
      }
      if (!has_map && !maps_ && !others_) {
        add(&object, "Part::pointshell", "no shape in the world has a voxelmap, so it has no contacts");
      }
      return;
    }
    // Boxes and other primitives include their margin in their size.
    const int type = shape.getShapeType();
    if (type == SOFTBODY_SHAPE_PROXYTYPE) {
      return add(&object, "btSoftBody",
                 "soft bodies are slow on baked shapes, and fall through: let them meet simple shapes instead, by "
                 "collision filters");
    }
    const bool grows =
        btBroadphaseProxy::isPolyhedral(type) ? type != BOX_SHAPE_PROXYTYPE : type == CONE_SHAPE_PROXYTYPE;
    if (grows && margin > finest_) {
      add(&object, "setMargin",
          format("Bullet thickens %s by its margin of %.3g mm, %.2g voxels: bodies seem to float; call "
                 "setMargin(%.2g) before the body is added",
                 shape.getName(), 1000 * margin, margin / finest_, 0.2 * finest_));
    }
  }

  void look_at_body(const btCollisionObject& body) {
    const btVector3& at = body.getWorldTransform().getOrigin();
    const double far = double(btMax(btMax(btFabs(at.x()), btFabs(at.y())), btFabs(at.z())));
    if (far * double(std::numeric_limits<btScalar>::epsilon()) > 0.1 * finest_) {
      add(&body, "setWorldTransform",
          format(
              "%.3g m from the origin, positions are rounded to %.2g mm: move the world's origin closer, or use Bullet "
              "in double precision",
              far, 1000 * far * double(std::numeric_limits<btScalar>::epsilon())));
    }
    look_at_mass(body);
    for_each_leaf(body, [&](const Leaf& leaf) { look_at_foundation(body, as_vps(leaf.shape)); });
    if (const Shape* const shape = as_vps(body.getCollisionShape())) look_at_inertia(body, *shape);
    btVector3 low;
    btVector3 high;
    body.getCollisionShape()->getAabb(btTransform::getIdentity(), low, high);
    const double size = double((high - low).length());
    if (!(size > 0)) return;
    const double travel = double(velocity_of(body).linear.length()) * step_;
    if (travel > 0.25 * size) {
      add(&body, "ContinuousMotion",
          format("it moves %.3g mm in a step and its size is %.3g mm: it may pass through walls; add a "
                 "vps::bullet::ContinuousMotion to the world",
                 1000 * travel, 1000 * size));
    }
    if (const btRigidBody* const rigid = btRigidBody::upcast(&body)) look_at_sleep(*rigid, size);
  }

  // The solver takes an inverse mass for 0 by btVector3::fuzzyZero, and leaves contacts of two such bodies out.
  void look_at_mass(const btCollisionObject& body) {
    constexpr double kMost = 1.7320508 / double{SIMD_EPSILON};  // the root of 3 [kg]
    if (btRigidBody::upcast(&body) == nullptr || double(inverse_mass(body)) * kMost > 1) return;
    add(&body, "setMassProps",
        format("bodies of %.3g kg and more fall through static ones, for Bullet's solver takes them for static: make "
               "it lighter, or use Bullet in double precision",
               kMost));
  }

  void look_at_sleep(const btRigidBody& body, double size) {
    // Speed of a body of this size that falls over. [m/s]
    const double lively = std::sqrt(gravity_ * size);
    if (double(body.getLinearSleepingThreshold()) > 0.6 * lively && body.getActivationState() != DISABLE_DEACTIVATION &&
        gravity_ > 0) {
      add(&body, "setSleepingThresholds",
          format("it falls asleep below %.2g m/s, while it still rolls or tips: for a body of %.3g mm call "
                 "setSleepingThresholds(%.2g, %.2g)",
                 double(body.getLinearSleepingThreshold()), 1000 * size, 0.05 * lively, 0.05 * lively / (0.5 * size)));
    }
  }

  void look_at_inertia(const btCollisionObject& body, const Shape& shape) {
    constexpr double kMatters = 0.02;
    const double lost = shape.lost_inertia();
    if (!(lost > kMatters) || local_inertia(body).isZero()) return;
    add(&body, "Axes::of_asset",
        format("its products of inertia are up to %.2g of its largest moment, and Bullet leaves them out: make the "
               "Shape with Axes::principal, and convert its poses with mesh_pose and body_pose",
               lost));
  }

  void look_at_foundation(const btCollisionObject& body, const Shape* shape) {
    if (shape == nullptr || !(shape->foundation().stiffness > 0) || shape->pointshell().points == 0) return;
    double area = 0;
    for (std::uint32_t i = 0; i < shape->pointshell().points; ++i) {
      area += double(point_area(shape->pointshell(), i));
    }
    // For a body that lies on a quarter of its surface.
    const double swing = std::sqrt(shape->foundation().stiffness * area / 4 * double(inverse_mass(body))) * step_;
    if (swing < 1) return;
    add(&body, "set_foundation",
        format(
            "a stiffness of %.2g N/m^3 oscillates faster than a step of %.3g s resolves: contacts are rigid in effect; "
            "use steps of %.2g s or a stiffness of %.2g N/m^3",
            shape->foundation().stiffness, step_, 0.5 * step_ / swing,
            shape->foundation().stiffness / (4 * swing * swing)));
  }

  btDiscreteDynamicsWorld& world_;
  const double step_;
  const Shape* any_ = nullptr;
  double finest_ = std::numeric_limits<double>::infinity();  // smallest voxel size. [m]
  double gravity_ = 0;
  bool others_ = false;  // the world has shapes of Bullet's own
  bool shells_ = false, maps_ = false, springs_ = false;
  std::vector<Advice> advice_;
};

}  // namespace

std::vector<Advice> lint(btDiscreteDynamicsWorld& world, btScalar step) {
  return Lint(world, double(step)).run();
}

}  // namespace vps::bullet
