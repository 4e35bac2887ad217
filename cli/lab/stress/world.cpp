// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/stress/world.h"

#include <BulletDynamics/ConstraintSolver/btNNCGConstraintSolver.h>
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btLemkeSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace vps::stress {
namespace {

bool is_finite(const btVector3& v) {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

bool is_finite(const btTransform& t) {
  return is_finite(t.getOrigin()) && is_finite(t.getBasis()[0]) && is_finite(t.getBasis()[1]) &&
         is_finite(t.getBasis()[2]);
}

const char* bad_number(const btRigidBody& body) {
  if (!is_finite(body.getWorldTransform())) return "pose";
  if (!is_finite(body.getLinearVelocity())) return "velocity";
  if (!is_finite(body.getAngularVelocity())) return "angular velocity";
  return nullptr;
}

// Owns the method that Bullet's solver only points to.
template <class Method>
struct MlcpSolver final : private Method, public btMLCPSolver {
  MlcpSolver() : btMLCPSolver(this) {}
};

std::unique_ptr<btConstraintSolver> make_solver(Solver solver) {
  switch (solver) {
    case Solver::sequential:
      break;
    case Solver::nncg:
      return std::make_unique<btNNCGConstraintSolver>();
    case Solver::dantzig:
      return std::make_unique<MlcpSolver<btDantzigSolver>>();
    case Solver::lemke:
      return std::make_unique<MlcpSolver<btLemkeSolver>>();
  }
  return std::make_unique<btSequentialImpulseConstraintSolver>();
}

}  // namespace

Arena::Arena(const Subject& subject, const ArenaOptions& options)
    : options_(options), solver_(make_solver(subject.solver)) {
  world_.setGravity({0, 0, -btScalar(options.gravity)});
  world_.getSolverInfo().m_splitImpulsePenetrationThreshold =
      -2 * btScalar(options.voxel > 0 ? options.voxel : subject.voxel);
  world_.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  world_.getSolverInfo().m_numIterations = options.iterations;
  // A problem for each island.
  if (solver_->getSolverType() == BT_MLCP_SOLVER) world_.getSolverInfo().m_minimumSolverBatchSize = 1;
  if (options.detection == Detection::continuous) world_.addAction(&continuous_);
}

Arena::~Arena() {
  for (const auto& body : bodies_) world_.removeRigidBody(body.get());
}

btRigidBody& Arena::add(const lab::BulletShape& shape, double mass, const btTransform& at, const btVector3& inertia) {
  btVector3 moments = inertia;
  if (mass > 0 && moments.isZero()) shape.shape->calculateLocalInertia(btScalar(mass), moments);
  shapes_.push_back(shape);
  bodies_.push_back(std::make_unique<btRigidBody>(btScalar(mass), nullptr, shape.shape.get(), moments));
  btRigidBody& body = *bodies_.back();
  body.setWorldTransform(at);
  body.setInterpolationWorldTransform(at);
  body.setActivationState(DISABLE_DEACTIVATION);
  world_.addRigidBody(&body);
  return body;
}

btRigidBody& Arena::add_plane() {
  return add({{}, std::make_shared<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0))}, 0,
             btTransform::getIdentity());
}

void Arena::watch() {
  for (std::size_t i = 0; i < bodies_.size() && failure_.empty(); ++i) {
    if (const char* const what = bad_number(*bodies_[i])) {
      failure_ = fmt::format("NaN: the {} of body {} is not a number after step {}", what, i, steps_);
    }
  }
}

bool Arena::step(double dt) {
  if (!failure_.empty()) return false;
  watch();  // initial values may be NaN too
  if (!failure_.empty()) return false;
  ++steps_;
  world_.stepSimulation(btScalar(dt), 0);
  watch();
  return failure_.empty();
}

double Arena::kinetic_energy() const {
  double sum = 0;
  for (const auto& body : bodies_) sum += stress::kinetic_energy(*body);
  return sum;
}

double Arena::energy() const {
  double sum = kinetic_energy();
  for (const auto& body : bodies_) {
    if (body->getInvMass() == 0) continue;
    sum += options_.gravity * double(body->getWorldTransform().getOrigin().z()) / double(body->getInvMass());
  }
  return sum;
}

double lowest(const btTransform& at, const std::vector<btVector3>& corners) {
  double low = std::numeric_limits<double>::infinity();
  for (const btVector3& corner : corners) low = std::min(low, double((at * corner).z()));
  return low;
}

btTransform standing(const std::vector<btVector3>& corners, double height) {
  btTransform at = btTransform::getIdentity();
  at.getOrigin().setZ(btScalar(height - lowest(at, corners)));
  return at;
}

double kinetic_energy(const btRigidBody& body) {
  if (body.getInvMass() == 0) return 0;
  const btVector3 spin = body.getWorldTransform().getBasis().transpose() * body.getAngularVelocity();
  return 0.5 * double(body.getLinearVelocity().length2()) / double(body.getInvMass()) +
         0.5 * double((body.getLocalInertia() * spin).dot(spin));
}

Trial broken(const Arena& arena) {
  Trial trial;
  trial.verdict = Verdict::broken;
  trial.remark = arena.failure();
  return trial;
}

}  // namespace vps::stress
