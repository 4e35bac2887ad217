// SPDX-License-Identifier: Zlib
// The extension module vps._bullet: a stock Bullet world with baked shapes. runtime/python/vps/_world.py is what users
// see.
#include <btBulletDynamicsCommon.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "runtime/bullet/partners/for_each_leaf.h"
#include "runtime/bullet/vps_bullet.h"
#include "runtime/bullet/vps_scene.h"

namespace py = pybind11;
using namespace pybind11::literals;

namespace {

using Vector = std::array<double, 3>;
using Matrix = py::array_t<double, py::array::c_style | py::array::forcecast>;

btVector3 to_bt(const Vector& v) {
  for (const double x : v) {
    if (!std::isfinite(x)) throw py::value_error("a vector is not finite");
  }
  return {btScalar(v[0]), btScalar(v[1]), btScalar(v[2])};
}
Vector to_vector(const btVector3& v) {
  return {double(v.x()), double(v.y()), double(v.z())};
}
btTransform to_bt(const Matrix& matrix) {
  if (matrix.ndim() != 2 || matrix.shape(0) != 4 || matrix.shape(1) != 4) {
    throw py::value_error("pose: an array of shape (4, 4)");
  }
  const double* const m = matrix.data();
  vps::Pose pose;
  for (int r = 0; r < 3; ++r) {
    std::copy_n(m + 4 * r, 3, pose.rotation + 3 * r);
    pose.translation[r] = m[4 * r + 3];
  }
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1 || vps::check_pose(pose) != vps::Status::ok) {
    throw py::value_error("pose: a rotation, a translation of at most 1e12 m and the last row 0, 0, 0, 1");
  }
  const auto at = [&](int i) { return btScalar(pose.rotation[i]); };
  const btMatrix3x3 basis(at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), at(8));
  return btTransform(basis, to_bt(Vector{pose.translation[0], pose.translation[1], pose.translation[2]}));
}
void write(const btTransform& from, double* to) {
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) to[4 * r + c] = double(from.getBasis()[r][c]);
    to[4 * r + 3] = double(from.getOrigin()[r]);
  }
  to[12] = to[13] = to[14] = 0;
  to[15] = 1;
}

// Messages of shapes during a call, which become warnings after it.
thread_local std::vector<std::string> messages;
void warn() {
  const std::vector<std::string> lines = std::move(messages);
  messages.clear();
  for (const std::string& line : lines) {
    if (PyErr_WarnEx(PyExc_RuntimeWarning, line.c_str(), 1) != 0) throw py::error_already_set();
  }
}

/// An asset as a shape: shared by bodies.
struct Baked {
  py::buffer_info bytes;
  std::shared_ptr<vps::bullet::Shape> shape;

  Baked(const py::buffer& source, double scale) : bytes(source.request()) {
    const auto asset = std::make_shared<vps::Asset>();
    const std::span all(static_cast<const std::byte*>(bytes.ptr), static_cast<std::size_t>(bytes.size));
    if (const vps::Status status = vps::Asset::open(all, *asset); status != vps::Status::ok) {
      throw py::value_error(vps::describe(status));
    }
    shape = std::make_shared<vps::bullet::Shape>(asset, vps::bullet::Part::mixed, vps::bullet::Axes::principal);
    const auto factor = btScalar(scale);
    if (scale != 1) shape->setLocalScaling({factor, factor, factor});
    warn();
  }
};

/// Of a body: what all kinds have.
struct BodyOptions {
  btTransform pose;
  double mass = 0;  // 0: it stays where it is, or is moved by the program
  bool kinematic = false;
  double friction = 0.5, restitution = 0;
};

// A contact as numpy sees it.
struct Touch {
  std::int64_t first, second;
  double position[3], normal[3], distance, impulse;
};

class World {
 public:
  World(const Vector& gravity, double step) : step_(step) {
    // Bullet leaves out steps of less than 1.2e-7 s.
    if (!(step >= 1e-6 && step <= 10)) throw py::value_error("step: 1e-6 to 10 s");
    vps::bullet::register_algorithm(dispatcher_);
    world_.setGravity(to_bt(gravity));
    world_.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  ~World() {
    for (const auto& joint : joints_) world_.removeConstraint(joint.get());
    scenes_.clear();
    for (const auto& body : own_bodies_) world_.removeRigidBody(body.get());
  }

  std::size_t add_baked(py::object baked, const BodyOptions& options) {
    const auto& shape = baked.cast<const Baked&>().shape;
    const std::size_t index = add(shape, options, shape->asset_frame());
    kept_.push_back(std::move(baked));
    // As docs/bullet.md advises: split impulses from a penetration of two voxels.
    split_from(double(shape->info().voxel_size));
    return index;
  }
  std::size_t add_box(const Vector& half_extents, const BodyOptions& options) {
    check_sizes({half_extents[0], half_extents[1], half_extents[2]});
    return add(std::make_shared<btBoxShape>(to_bt(half_extents)), options, btTransform::getIdentity());
  }
  std::size_t add_sphere(double radius, const BodyOptions& options) {
    check_sizes({radius});
    return add(std::make_shared<btSphereShape>(btScalar(radius)), options, btTransform::getIdentity());
  }
  std::size_t add_plane(const Vector& normal, double offset, const BodyOptions& options) {
    const btVector3 up = direction("normal", normal);
    const double distance = offset / std::hypot(normal[0], normal[1], normal[2]);
    if (!(std::abs(distance) <= kLargest)) throw py::value_error("offset: at most 1e9 m from the origin");
    return add(std::make_shared<btStaticPlaneShape>(up, btScalar(distance)), options, btTransform::getIdentity());
  }

  // @return the index of the first of its bodies
  std::size_t load_scene(const std::string& manifest) {
    const std::size_t first = bodies_.size();
    auto scene = std::make_unique<vps::bullet::Scene>(vps::bullet::load_scene(manifest, world_));
    if (!scene->error().empty()) throw py::value_error(scene->error());
    warn();  // first: where warnings are errors, the scene takes itself out of the world
    for (const auto& body : scene->bodies()) {
      vps::bullet::for_each_leaf(*body, [&](const vps::bullet::Leaf& leaf) {
        const auto* const shape = dynamic_cast<const vps::bullet::Shape*>(leaf.shape);
        if (shape != nullptr) split_from(double(shape->info().voxel_size));
      });
      enter(*body, body->getWorldTransform().inverse() * scene->origin(*body));
    }
    scenes_.push_back(std::move(scene));
    return first;
  }

  // Other threads may run meanwhile, and step other worlds.
  void step(int count) {
    using Clock = std::chrono::steady_clock;
    constexpr std::chrono::milliseconds kTurn(20);  // Ctrl-C waits so long
    while (count > 0) {
      {
        const Stepping stepping(is_stepping_);
        const py::gil_scoped_release release;
        const Clock::time_point begin = Clock::now();
        do {
          world_.stepSimulation(step_of_bullet(), 0);
          ++steps_;
        } while (--count > 0 && messages.empty() && Clock::now() - begin < kTurn);
      }
      warn();
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
  }
  void check_alone() const {
    if (is_stepping_) throw std::runtime_error("another thread is stepping this world");
  }
  [[nodiscard]] double time() const { return step_ * static_cast<double>(steps_); }

  [[nodiscard]] py::array_t<double> poses() const {
    py::array_t<double> out({static_cast<py::ssize_t>(bodies_.size()), py::ssize_t{4}, py::ssize_t{4}});
    for (std::size_t i = 0; i < bodies_.size(); ++i) write(pose_of(i), out.mutable_data() + 16 * i);
    return out;
  }
  void set_pose(std::size_t i, const Matrix& pose) {
    btRigidBody& body = at(i);
    const btTransform to = to_bt(pose) * frames_[i].inverse();
    body.getMotionState()->setWorldTransform(to);
    if (body.isKinematicObject()) return;  // it moves there in the next step
    body.setWorldTransform(to);
    body.setInterpolationWorldTransform(to);
    body.updateInertiaTensor();
    world_.updateSingleAabb(&body);
  }
  [[nodiscard]] py::tuple velocity(std::size_t i) const {
    return py::make_tuple(to_vector(at(i).getLinearVelocity()), to_vector(at(i).getAngularVelocity()));
  }
  void set_velocity(std::size_t i, const Vector& linear, const Vector& angular) {
    if (mass(i) == 0) throw py::value_error("velocity: no force moves this body; move it by its pose, as kinematic");
    at(i).setLinearVelocity(to_bt(linear));
    at(i).setAngularVelocity(to_bt(angular));
  }
  void push(std::size_t i, const Vector& force, const Vector& torque) {
    if (mass(i) == 0) throw py::value_error("push: no force moves this body");
    at(i).applyCentralForce(to_bt(force));
    at(i).applyTorque(to_bt(torque));
  }
  [[nodiscard]] double mass(std::size_t i) const {
    const double inverse = double(at(i).getInvMass());
    return inverse == 0 ? 0 : 1 / inverse;
  }

  std::size_t add_hinge(std::size_t first, std::ptrdiff_t second, const Vector& point, const Vector& axis) {
    auto [a, b] = pair(first, second);
    const btVector3 p = to_bt(point), z = direction("axis", axis);
    const btTransform to_a = a->getWorldTransform().inverse(), to_b = b->getWorldTransform().inverse();
    auto joint =
        std::make_unique<btHingeConstraint>(*a, *b, to_a * p, to_b * p, to_a.getBasis() * z, to_b.getBasis() * z);
    return keep(std::move(joint));
  }
  std::size_t add_slider(std::size_t first, std::ptrdiff_t second, const Vector& axis) {
    auto [a, b] = pair(first, second);
    const btVector3 x = direction("axis", axis);
    btVector3 y, z;
    btPlaneSpace1(x, y, z);
    const btTransform frame(btMatrix3x3(x.x(), y.x(), z.x(), x.y(), y.y(), z.y(), x.z(), y.z(), z.z()),
                            a->getWorldTransform().getOrigin());
    auto joint = std::make_unique<btSliderConstraint>(*b, *a, b->getWorldTransform().inverse() * frame,
                                                      a->getWorldTransform().inverse() * frame, true);
    joint->setLowerLinLimit(1);  // lower above upper: free
    joint->setUpperLinLimit(-1);
    joint->setLowerAngLimit(0);
    joint->setUpperAngLimit(0);
    return keep(std::move(joint));
  }
  void set_motor(std::size_t joint, double speed, double effort) {
    if (!std::isfinite(speed) || !(effort >= 0))
      throw py::value_error("motor: a finite speed, an effort of at least 0");
    btTypedConstraint& constraint = *joints_.at(joint);
    for (btRigidBody* body : {&constraint.getRigidBodyA(), &constraint.getRigidBodyB()}) body->activate();
    if (auto* const hinge = dynamic_cast<btHingeConstraint*>(&constraint)) {
      hinge->enableAngularMotor(effort > 0, btScalar(speed), btScalar(effort * step_));
    } else if (auto* const slider = dynamic_cast<btSliderConstraint*>(&constraint)) {
      slider->setPoweredLinMotor(effort > 0);
      slider->setTargetLinMotorVelocity(btScalar(speed));
      slider->setMaxLinMotorForce(btScalar(effort));
    }
  }
  // Since the joint was made. [rad] or [m]
  [[nodiscard]] double position(std::size_t joint) {
    btTypedConstraint& constraint = *joints_.at(joint);
    if (auto* const hinge = dynamic_cast<btHingeConstraint*>(&constraint)) return double(hinge->getHingeAngle());
    auto& slider = dynamic_cast<btSliderConstraint&>(constraint);
    slider.calculateTransforms(constraint.getRigidBodyA().getWorldTransform(),
                               constraint.getRigidBodyB().getWorldTransform());
    slider.testLinLimits();
    return double(slider.getLinearPos());
  }

  [[nodiscard]] py::array_t<Touch> contacts() const {
    std::vector<Touch> found;
    for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
      const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
      for (int i = 0; i < manifold.getNumContacts(); ++i) {
        const btManifoldPoint& point = manifold.getContactPoint(i);
        Touch touch{};
        touch.first = manifold.getBody0()->getUserIndex();
        touch.second = manifold.getBody1()->getUserIndex();
        for (int axis = 0; axis < 3; ++axis) {
          touch.position[axis] = double(point.getPositionWorldOnB()[axis]);
          touch.normal[axis] = -double(point.m_normalWorldOnB[axis]);
        }
        touch.distance = double(point.getDistance());
        touch.impulse = double(point.getAppliedImpulse());
        found.push_back(touch);
      }
    }
    py::array_t<Touch> out(static_cast<py::ssize_t>(found.size()));
    if (!found.empty()) std::memcpy(out.mutable_data(), found.data(), found.size() * sizeof(Touch));
    return out;
  }

  [[nodiscard]] std::vector<std::string> lint() {
    std::vector<std::string> lines;
    for (const vps::bullet::Advice& advice : vps::bullet::lint(world_, step_of_bullet())) {
      lines.push_back(advice.setting + ": " + advice.text);
    }
    return lines;
  }

 private:
  static constexpr double kLargest = 1e9;  // as in a scene's manifest: far beyond any simulation
  static void check_sizes(std::initializer_list<double> sizes) {
    for (const double size : sizes) {
      if (!(size >= 1 / kLargest && size <= kLargest)) throw py::value_error("a size is 1e-9 to 1e9 m");
    }
  }
  // Normalized in double: squares of lengths beyond 1e19 are infinite in float.
  static btVector3 direction(const char* name, const Vector& axis) {
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    if (!(length > 0) || !std::isfinite(length)) throw py::value_error(std::string(name) + ": finite, and not zero");
    return {btScalar(axis[0] / length), btScalar(axis[1] / length), btScalar(axis[2] / length)};
  }
  // Set under Python's lock, and read under it.
  class Stepping {
   public:
    explicit Stepping(bool& flag) : flag_(flag) { flag_ = true; }
    ~Stepping() { flag_ = false; }
    Stepping(const Stepping&) = delete;
    Stepping& operator=(const Stepping&) = delete;

   private:
    bool& flag_;
  };
  [[nodiscard]] btScalar step_of_bullet() const { return btScalar(step_); }
  void split_from(double voxel) {
    btScalar& threshold = world_.getSolverInfo().m_splitImpulsePenetrationThreshold;
    if (!has_baked_ || -2 * voxel > double(threshold)) threshold = btScalar(-2 * voxel);
    has_baked_ = true;
  }

  // @param frame  takes the frame that users see to the body's own
  std::size_t add(std::shared_ptr<btCollisionShape> shape, const BodyOptions& options, const btTransform& frame) {
    if (!(options.mass >= 0) || !std::isfinite(options.mass)) throw py::value_error("mass: finite, at least 0 kg");
    for (const double law : {options.friction, options.restitution})
      if (!(law >= 0 && law <= kLargest)) throw py::value_error("friction, restitution: 0 to 1e9");
    btVector3 inertia(0, 0, 0);
    if (options.mass > 0) shape->calculateLocalInertia(btScalar(options.mass), inertia);
    warn();  // where warnings are errors, nothing was added
    states_.push_back(std::make_unique<btDefaultMotionState>(options.pose * frame.inverse()));
    btRigidBody::btRigidBodyConstructionInfo info(btScalar(options.mass), states_.back().get(), shape.get(), inertia);
    info.m_friction = btScalar(options.friction);
    info.m_restitution = btScalar(options.restitution);
    own_bodies_.push_back(std::make_unique<btRigidBody>(info));
    btRigidBody& body = *own_bodies_.back();
    if (options.kinematic) body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    world_.addRigidBody(&body);
    shapes_.push_back(std::move(shape));
    return enter(body, frame);
  }
  std::size_t enter(btRigidBody& body, const btTransform& frame) {
    if (body.getMotionState() == nullptr) {
      states_.push_back(std::make_unique<btDefaultMotionState>(body.getWorldTransform()));
      body.setMotionState(states_.back().get());
    }
    body.setActivationState(DISABLE_DEACTIVATION);
    body.setUserIndex(static_cast<int>(bodies_.size()));
    bodies_.push_back(&body);
    frames_.push_back(frame);
    return bodies_.size() - 1;
  }
  [[nodiscard]] btRigidBody& at(std::size_t i) const { return *bodies_.at(i); }
  [[nodiscard]] btTransform pose_of(std::size_t i) const { return bodies_[i]->getWorldTransform() * frames_[i]; }
  std::pair<btRigidBody*, btRigidBody*> pair(std::size_t first, std::ptrdiff_t second) {
    if (static_cast<std::ptrdiff_t>(first) == second) throw py::value_error("a joint is between two bodies");
    return {&at(first), second < 0 ? &btTypedConstraint::getFixedBody() : &at(static_cast<std::size_t>(second))};
  }
  std::size_t keep(std::unique_ptr<btTypedConstraint> joint) {
    world_.addConstraint(joint.get(), true);
    joints_.push_back(std::move(joint));
    return joints_.size() - 1;
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  double step_;
  std::uint64_t steps_ = 0;
  bool is_stepping_ = false;
  bool has_baked_ = false;
  std::vector<py::object> kept_;  // Baked
  std::vector<std::shared_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btMotionState>> states_;
  std::vector<std::unique_ptr<btRigidBody>> own_bodies_;
  std::vector<std::unique_ptr<vps::bullet::Scene>> scenes_;
  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
  std::vector<btRigidBody*> bodies_;  // all, by their index
  std::vector<btTransform> frames_;   // each takes the frame that users see to the body's own
};

// Methods that are refused while another thread steps the world.
template <class Result, class... Arguments>
auto alone(Result (World::*method)(Arguments...)) {
  return [method](World& world, Arguments... arguments) -> Result {
    world.check_alone();
    return (world.*method)(std::forward<Arguments>(arguments)...);
  };
}
template <class Result, class... Arguments>
auto alone(Result (World::*method)(Arguments...) const) {
  return [method](const World& world, Arguments... arguments) -> Result {
    world.check_alone();
    return (world.*method)(std::forward<Arguments>(arguments)...);
  };
}

}  // namespace

PYBIND11_MODULE(_bullet, m) {
  PYBIND11_NUMPY_DTYPE(Touch, first, second, position, normal, distance, impulse);
  vps::bullet::set_message_handler([](const char* line) { messages.emplace_back(line); });
  py::class_<Baked>(m, "Baked")
      .def(py::init<const py::buffer&, double>())
      .def_property_readonly("volume", [](const Baked& baked) { return baked.shape->info().volume; });
  py::class_<BodyOptions>(m, "BodyOptions")
      .def(py::init([](const Matrix& pose, double mass, bool kinematic, double friction, double restitution) {
        return BodyOptions{to_bt(pose), mass, kinematic, friction, restitution};
      }));
  py::class_<World>(m, "World")
      .def(py::init<const Vector&, double>())
      .def("add_baked", alone(&World::add_baked))
      .def("add_box", alone(&World::add_box))
      .def("add_sphere", alone(&World::add_sphere))
      .def("add_plane", alone(&World::add_plane))
      .def("load_scene", alone(&World::load_scene))
      .def("step", alone(&World::step))
      .def("poses", alone(&World::poses))
      .def("set_pose", alone(&World::set_pose))
      .def("velocity", alone(&World::velocity))
      .def("set_velocity", alone(&World::set_velocity))
      .def("push", alone(&World::push))
      .def("mass", alone(&World::mass))
      .def("add_hinge", alone(&World::add_hinge))
      .def("add_slider", alone(&World::add_slider))
      .def("set_motor", alone(&World::set_motor))
      .def("position", alone(&World::position))
      .def("contacts", alone(&World::contacts))
      .def("lint", alone(&World::lint))
      .def_property_readonly("time", alone(&World::time));
}
