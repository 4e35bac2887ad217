// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The largest mass of a body in Bullet.
#pragma once

namespace vps::cli {

/// From 1.452e7 kg on the solver of Bullet in single precision takes a body's inverse mass for 0 and lets the body fall
/// through others. [kg]
inline constexpr double kMostMass = 1.4e7;

}  // namespace vps::cli
