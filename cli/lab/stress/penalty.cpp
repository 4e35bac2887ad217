// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the penalty loop with its theory.
#include "cli/lab/stress/penalty.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "cli/lab/random.h"
#include "cli/lab/stress/world.h"
#include "runtime/bullet/vps_bullet.h"

namespace vps::stress {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

constexpr double kDepth_vx = 0.5;  // depth to which the body is pressed in
constexpr double kUnstable = 100;  // growth that counts as unstable; with more, contact is lost, which limits growth
// Largest growth at the bound of a balance that tips over by itself, whatever the step. [1/step]
constexpr double kTips = 0.01;
constexpr std::size_t kPoses = 24;  // poses that are tried

Eigen::Matrix3d inertia_of(const AssetInfo& info, double mass) {
  const auto& i = info.inertia;  // xx, yy, zz, xy, xz, yz
  Eigen::Matrix3d out;
  out << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
  return out * (mass / info.volume);
}

Pose pose_of(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
  Pose pose;
  for (int i = 0; i < 3; ++i) {
    pose.translation[i] = translation[i];
    for (int j = 0; j < 3; ++j) pose.rotation[3 * i + j] = rotation(i, j);
  }
  return pose;
}

Vec3 to_vec3(const Eigen::Vector3d& v) {
  return {float(v.x()), float(v.y()), float(v.z())};
}

Eigen::Matrix3d turn(const Eigen::Vector3d& angle) {
  const double a = angle.norm();
  return a > 0 ? Eigen::AngleAxisd(a, angle / a).toRotationMatrix() : Eigen::Matrix3d::Identity().eval();
}

}  // namespace

PressedBody::PressedBody(const Subject& subject, Ground ground)
    : asset_(subject.asset), ground_(ground), seed_(subject.seed), mass_(subject.mass) {
  const AssetInfo& info = asset_->info();
  lab::require_ok(asset_->pointshell(shell_));
  centre_ = Eigen::Vector3d(info.centre_of_mass.data());
  inertia_ = inertia_of(info, mass_);
  depth_ = kDepth_vx * subject.voxel;
  if (ground_ == Ground::voxelmap) {
    const double half = subject.size;
    Column ours;
    ours.ours = true;
    const lab::BulletShape slab =
        subject.props->box(ours, {btScalar(half), btScalar(half), btScalar(4 * subject.voxel)}, Props::Role::still);
    slab_ = std::shared_ptr<const Asset>(slab.shape, &static_cast<const bullet::Shape&>(*slab.shape).asset());
    lab::require_ok(slab_->voxelmap(map_));
    slab_top_ = slab_->info().bounds_max[2];
  }
  for (const RestPose& rest : rest_poses(subject.corners, depth_, kPoses)) {
    if (settle(rest, subject.corners)) return;
  }
  refusal_ = "no pose in which a contact of half a voxel holds the body in balance";
}

void PressedBody::query(const Pose& shell_to_field, std::vector<Contact>& contacts) const {
  thread_local Scratch scratch;
  contacts.resize(shell_.points);
  QueryResult result;
  const auto ask = [&](const auto& field) {
    lab::require_ok(traverse(shell_, field, shell_to_field, QueryOptions{}, scratch, contacts, result));
  };
  ground_ == Ground::plane ? ask(HalfSpaceField{}) : ask(map_);
  contacts.resize(result.contacts);
}

// Presses the body in at a resting pose. Returns false when there is no stable balance.
bool PressedBody::settle(const RestPose& rest, const std::vector<btVector3>& corners) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rotation_(i, j) = double(rest.rotation[i][j]);
  }
  rotation_ = Eigen::Quaterniond(rotation_).normalized().toRotationMatrix();
  position_ = {0, 0, slab_top_ - depth_ - lowest(btTransform(rest.rotation), corners)};
  const Pose pose = pose_of(rotation_, position_ - rotation_ * centre_);
  std::vector<Contact> contacts;
  query(pose, contacts);
  area_ = 0;
  std::vector<Vec3> normals;
  for (const Contact& contact : contacts) {
    area_ += double(contact.area);
    normals.push_back(ground_ == Ground::plane ? Vec3{0, 0, 1} : outward_normal(map_, contact.position));
  }
  if (!(area_ > 0)) return false;
  // The gradient for a foundation of 1: all that follows is proportional to it.
  Twist still;
  still.centre = to_vec3(position_);
  WrenchGradient gradient;
  lab::require_ok(penalty_gradient(contacts, normals, {1, 0}, still, gradient));
  Matrix6 inverse_mass = Matrix6::Zero();
  inverse_mass.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() / mass_;
  inverse_mass.bottomRightCorner<3, 3>() = (rotation_ * inertia_ * rotation_.transpose()).inverse();
  const Matrix6 stiffness = -Eigen::Map<const Matrix6>(gradient.pose);
  const Eigen::EigenSolver<Eigen::Matrix<double, 6, 6>> modes(Eigen::Matrix<double, 6, 6>(inverse_mass * stiffness),
                                                              false);
  double fastest = 0;  // square of the largest frequency
  for (const auto& square : modes.eigenvalues()) fastest = std::max(fastest, square.real());
  if (!(fastest > 0)) return false;
  effective_mass_ = area_ / fastest;
  return std::all_of(modes.eigenvalues().begin(), modes.eigenvalues().end(), [&](const std::complex<double>& square) {
    return 2 * std::sqrt(-square / fastest).real() < kTips;
  });
}

PressedBody::LoopResult PressedBody::run(const LoopOptions& options) const {
  const PenaltyLaw law{options.stiffness / area_, options.damping / area_};
  std::vector<Contact> contacts;
  const auto wrench = [&](const Eigen::Matrix3d& r, const Eigen::Vector3d& x, const Eigen::Vector3d& v,
                          const Eigen::Vector3d& w, Wrench& out) {
    query(pose_of(r, x - r * centre_), contacts);
    lab::require_ok(penalty_wrench(contacts, law, {to_vec3(x), to_vec3(v), to_vec3(w)}, out));
  };
  Wrench balance;
  wrench(rotation_, position_, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), balance);

  lab::Random random(seed_);
  const auto draw = [&] {
    return Eigen::Vector3d(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1));
  };
  const double first = options.disturbance * depth_;
  const double arm = std::sqrt(inertia_.trace() / (2 * mass_));
  Eigen::Vector3d x = position_ + first * draw();
  Eigen::Matrix3d r = turn(first / arm * draw()) * rotation_;
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();  // angular
  LoopResult result;
  Trace trace(options.steps);
  const Eigen::Vector3d force0(balance.force);
  const Eigen::Vector3d torque0(balance.torque);
  for (int step = 0; step < options.steps; ++step) {
    const Eigen::Matrix3d moments = r * inertia_ * r.transpose();
    Eigen::Vector3d w = moments.inverse() * momentum;
    Wrench pressed;
    wrench(r, x, v, w, pressed);
    v += options.step / mass_ * (Eigen::Vector3d(pressed.force) - force0);
    momentum += options.step * (Eigen::Vector3d(pressed.torque) - torque0);
    w = moments.inverse() * momentum;
    x += options.step * v;
    r = Eigen::Quaterniond(turn(options.step * w) * r).normalized().toRotationMatrix();
    // Motion along the ground does not count: no contact force acts in these directions.
    const Eigen::AngleAxisd tilt(r * rotation_.transpose());
    const Eigen::Vector3d turned = tilt.angle() * tilt.axis();
    const double off = std::max(std::abs((x - position_).z()), arm * turned.head<2>().norm());
    trace.add(off / first);
    result.growth = std::max(result.growth, off / first);
    if (!(off < kUnstable * first)) {
      result.growth = std::numeric_limits<double>::infinity();
      break;
    }
  }
  result.trace = trace.values;
  return result;
}

double PressedBody::bounce(double stiffness, double step) const {
  const PenaltyLaw law{stiffness / area_, 0};
  constexpr int kMostSteps = 100000;
  // With this speed the body gets a voxel deep if the area in contact is constant.
  const double speed = 2 * depth_ * std::sqrt(stiffness / mass_);
  Eigen::Vector3d x = position_ + Eigen::Vector3d(0, 0, depth_);
  Eigen::Matrix3d r = rotation_;
  Eigen::Vector3d v(0, 0, -speed);
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
  std::vector<Contact> contacts;
  bool touched = false;
  for (int i = 0; i < kMostSteps; ++i) {
    query(pose_of(r, x - r * centre_), contacts);
    if (touched && contacts.empty()) break;
    touched = touched || !contacts.empty();
    Wrench pressed;
    lab::require_ok(penalty_wrench(contacts, law, {to_vec3(x), to_vec3(v), {}}, pressed));
    v += step / mass_ * Eigen::Vector3d(pressed.force);
    momentum += step * Eigen::Vector3d(pressed.torque);
    const Eigen::Vector3d w = (r * inertia_ * r.transpose()).inverse() * momentum;
    x += step * v;
    r = Eigen::Quaterniond(turn(step * w) * r).normalized().toRotationMatrix();
  }
  const Eigen::Vector3d w = (r * inertia_ * r.transpose()).inverse() * momentum;
  return (0.5 * mass_ * v.squaredNorm() + 0.5 * w.dot(momentum)) / (0.5 * mass_ * speed * speed) - 1;
}

double measured_over_theory(const PressedBody& body, double step, double damping_share) {
  const double theory = 4 * body.effective_mass() / (step * step * (1 + 2 * damping_share));
  const auto stands = [&](double share) {
    PressedBody::LoopOptions options;
    options.step = step;
    options.stiffness = share * theory;
    options.damping = damping_share * options.stiffness * step;
    return std::isfinite(body.run(options).growth);
  };
  double low = 1.0 / 64;
  double high = 64;
  if (!stands(low)) return low;
  while (high / low > 1.001) {
    const double middle = std::sqrt(low * high);
    (stands(middle) ? low : high) = middle;
  }
  return low;
}

namespace {

constexpr double kDampingShare = 0.25;  // c over k dt
const std::vector<double> kRates{1000, 240, 60, 5};

// Runs `measure` where there is something to measure.
template <class Measure>
Trial with_pressed(const Subject& subject, Ground ground, const Measure& measure) {
  const PressedBody body(subject, ground);
  if (!body.refusal().empty()) return skipped(body.refusal());
  Trial trial;
  measure(body, trial);
  return trial;
}

Trial find_bound(const Subject& subject, Ground ground, double rate, double damping_share) {
  return with_pressed(subject, ground, [&](const PressedBody& body, Trial& trial) {
    const double share = measured_over_theory(body, 1 / rate, damping_share);
    const double theory = 4 * body.effective_mass() * rate * rate / (1 + 2 * damping_share);
    trial.least = 0.95;
    trial.remark = fmt::format("{:.4g} N/m of {:.4g} N/m; m_eff {:.4g} kg, {:.3g} m^2 in touch", share * theory, theory,
                               body.effective_mass(), body.area());
    judge(trial, share, 1.05);
  });
}

Trial sweep(const Subject& subject, double rate, double share) {
  return with_pressed(subject, Ground::plane, [&](const PressedBody& body, Trial& trial) {
    PressedBody::LoopOptions options;
    options.step = 1 / rate;
    options.stiffness = share * 4 * body.effective_mass() * rate * rate;
    const PressedBody::LoopResult result = body.run(options);
    trial.trace = result.trace;
    if (share > 1) trial.least = kUnstable;
    judge(trial, std::min(result.growth, kUnstable), kUnstable * (share < 1 ? 0.999 : 1));
    trial.remark =
        fmt::format("{} at {:.4g} N/m", result.growth < kUnstable ? "stable" : "unstable", options.stiffness);
  });
}

}  // namespace

void add_penalty_cases(std::vector<Case>& cases) {
  const Axis rates{"rate", "Hz", kRates, {1000, 60}};
  const std::string theory =
      "Symplectic Euler is stable for k dt^2 < 4 m_eff, with m_eff by the masses, moments and levers in the contact's "
      "gradient. 5 % is for what is not linear: points that come into touch and leave it.";
  cases.push_back({
      .name = "penalty_bound_plane",
      .family = "penalty loop",
      .question = "Is the penalty loop stable up to the stiffness that theory allows?",
      .setup = "Pressed onto a plane by half a voxel, without damping.",
      .measured = "largest stable k dt^2 over what theory allows",
      .quantity = "measured over theory",
      .limit = "0.95 to 1.05",
      .limit_from = theory,
      .axes = {rates},
      .alone = "penalty loop",
      .run = [](const Subject& subject, const Column&,
                std::span<const double> at) { return find_bound(subject, Ground::plane, at[0], 0); },
  });
  cases.push_back({
      .name = "penalty_bound_voxelmap",
      .family = "penalty loop",
      .question = "Is the penalty loop as stable on a baked slab?",
      .setup = "Pressed onto the slab by half a voxel, without damping; the slab's field is interpolated.",
      .measured = "largest stable k dt^2 over what theory allows",
      .quantity = "measured over theory",
      .limit = "0.95 to 1.05",
      .limit_from = theory,
      .axes = {rates},
      .alone = "penalty loop",
      .run = [](const Subject& subject, const Column&,
                std::span<const double> at) { return find_bound(subject, Ground::voxelmap, at[0], 0); },
  });
  cases.push_back({
      .name = "penalty_bound_damped",
      .family = "penalty loop",
      .question = "Is the penalty loop as stable with a damper?",
      .setup = "Pressed onto a plane by half a voxel, with a damper of a quarter of k dt.",
      .measured = "largest stable k dt^2 over what theory allows",
      .quantity = "measured over theory",
      .limit = "0.95 to 1.05",
      .limit_from =
          "As for penalty_bound_plane; an explicit damper c takes 2 c dt of the bound: k dt^2 + 2 c dt < 4 m_eff.",
      .axes = {rates},
      .alone = "penalty loop",
      .run = [](const Subject& subject, const Column&,
                std::span<const double> at) { return find_bound(subject, Ground::plane, at[0], kDampingShare); },
  });
  cases.push_back({
      .name = "penalty_sweep",
      .family = "penalty loop",
      .question = "Is the penalty loop stable below that stiffness and unstable above it?",
      .setup = "Pressed onto a plane by half a voxel, with 0.1 to 10 times the stiffness that theory allows.",
      .measured = "growth of a disturbance within 300 steps, 100 at most",
      .quantity = "growth of the disturbance",
      .limit = "below 100 where k dt^2 < 4 m_eff, 100 where more",
      .limit_from = theory + " 5 % either side are left out.",
      .axes = {rates,
               {"stiffness", "of the bound", {0.1, 0.25, 0.5, 0.8, 0.95, 1.05, 1.25, 2, 4, 10}, {0.5, 0.95, 1.05, 2}}},
      .trace = "disturbance over its start",
      .alone = "penalty loop",
      .run = [](const Subject& subject, const Column&,
                std::span<const double> at) { return sweep(subject, at[0], at[1]); },
  });
  cases.push_back({
      .name = "penalty_bounce",
      .family = "penalty loop",
      .question = "Does a bounce keep its energy in the penalty loop?",
      .setup = "An undamped bounce onto a face.",
      .measured = "energy after over energy before, less 1, whichever its sign",
      .quantity = "change of energy",
      .unit = "%",
      .limit = "k dt^2 / (2 m_eff), and 1 %",
      .limit_from = "Contact begins and ends within a step: each changes the energy that symplectic Euler conserves by "
                    "up to k dt^2 "
                    "/ (4 "
                    "m_eff) of it. 1 % is for forces that are not quite a gradient, as shell and field have normals of "
                    "their own.",
      .axes = {{"stiffness", "of the bound", {0.01, 0.04, 0.16}, {0.04}}},
      .alone = "penalty loop",
      .run =
          [](const Subject& subject, const Column&, std::span<const double> at) {
            return with_pressed(subject, Ground::plane, [&](const PressedBody& body, Trial& trial) {
              constexpr double kStep = 1e-3;
              const double change = body.bounce(at[0] * 4 * body.effective_mass() / (kStep * kStep), kStep);
              trial.remark = fmt::format("{:+.3g} %", 100 * change);
              judge(trial, 100 * std::abs(change), 200 * at[0] + 1);
            });
          },
  });
}

}  // namespace vps::stress
