// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/meeting.h"

#include <fmt/format.h>

#include <algorithm>

namespace vps::cli {

Meeting::Meeting(const Scene& scene) : bodies_(scene.bodies.size()), partners_(scene.bodies.size(), 0) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const SceneBody& body = scene.bodies[i];
    bodies_[i] = {body.group, body.mask, body.motion, {}};
  }
  for (const auto& [a, b] : scene.joined) {
    bodies_[a].joined.push_back(b);
    bodies_[b].joined.push_back(a);
  }
  for (Body& body : bodies_) std::sort(body.joined.begin(), body.joined.end());
  for (std::size_t a = 0; a < bodies_.size(); ++a) {
    for (std::size_t b = a + 1; b < bodies_.size(); ++b) {
      if (can_meet(a, b)) {
        ++partners_[a];
        ++partners_[b];
        ++pairs_;
      } else if (masks_allow(a, b) && (bodies_[a].motion != Motion::fixed || bodies_[b].motion != Motion::fixed)) {
        if (apart_.size() == kMostApart) {
          throw SceneError(scene.bodies[a].place,
                           fmt::format("more than {} pairs of bodies would have to be kept apart one by one; set masks",
                                       kMostApart));
        }
        apart_.emplace_back(a, b);  // Bullet never collides two static bodies
      }
    }
  }
}

bool Meeting::are_joined(std::size_t a, std::size_t b) const {
  const std::vector<std::size_t>& joined = bodies_[a].joined;
  return !joined.empty() && std::binary_search(joined.begin(), joined.end(), b);
}

}  // namespace vps::cli
