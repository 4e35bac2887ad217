// SPDX-License-Identifier: Zlib
// Chooses the contacts of a manifold before addContactPoint, which costs about 30 ns a point and keeps four. Paper:
// Sec. 3.2.
#include "runtime/bullet/choose_four.h"

#include <algorithm>
#include <limits>

#include "runtime/fields/penetration.h"

namespace vps::bullet {
namespace {

using namespace detail;

// Factor by which a new contact must be better than one of the last step.
constexpr float kHysteresis = 1.2F;

class Candidates {
 public:
  Candidates(std::span<const Contact> contacts, std::span<const std::uint32_t> features,
             std::span<const std::uint32_t> previous, float alike)
      : contacts_(contacts), features_(features), previous_(previous), alike_(alike) {}

  /// The deepest. Of contacts that are equally deep, one of the step before.
  std::uint32_t deepest() const {
    std::uint32_t at = 0;
    float most = -std::numeric_limits<float>::max();
    for (std::uint32_t i = 0; i < contacts_.size(); ++i) {
      const float penetration = contacts_[i].penetration + (was_chosen(i) ? alike_ : 0);
      if (penetration <= most) continue;
      most = penetration;
      at = i;
    }
    return at;
  }

  /// Sets `at` to the first contact with the largest score above 0; false if there is none.
  template <class Score>
  bool best(Score score, std::uint32_t& at) const {
    float value = 0;
    for (std::uint32_t i = 0; i < contacts_.size(); ++i) {
      float s = score(contacts_[i].position) * weight(contacts_[i].penetration);
      if (s > 0 && was_chosen(i)) s *= kHysteresis;
      if (s > value) {
        value = s;
        at = i;
      }
    }
    return value > 0;
  }

 private:
  bool was_chosen(std::size_t i) const {
    return std::find(previous_.begin(), previous_.end(), feature_of(contacts_, features_, i)) != previous_.end();
  }
  // A point that does not touch yet carries no load, however far out it lies. A body that rests on such points never
  // stops rocking.
  float weight(float penetration) const {
    return penetration >= 0 ? 1 : alike_ * alike_ / (alike_ * alike_ + penetration * penetration);
  }
  const std::span<const Contact> contacts_;
  const std::span<const std::uint32_t> features_;
  const std::span<const std::uint32_t> previous_;
  const float alike_;
};

}  // namespace

std::size_t choose_four(std::span<const Contact> contacts, std::span<const std::uint32_t> features,
                        std::span<const std::uint32_t> previous, float alike, std::array<std::uint32_t, 4>& chosen) {
  if (contacts.empty()) return 0;
  const Candidates candidates(contacts, features, previous, alike);
  chosen[0] = candidates.deepest();
  const Vec3 a = contacts[chosen[0]].position;
  if (!candidates.best([&](Vec3 p) { return dot(p - a, p - a); }, chosen[1])) return 1;
  const Vec3 b = contacts[chosen[1]].position;
  // Twice the area of the triangle abp.
  if (!candidates.best([&](Vec3 p) { return length(cross(b - a, p - a)); }, chosen[2])) return 2;
  const Vec3 c = contacts[chosen[2]].position;
  const Vec3 normal = cross(b - a, c - a);
  // Area that a fourth corner adds beyond one of the triangle's edges, times a constant.
  const auto beyond = [&](Vec3 p) {
    return std::max(
        {dot(cross(b - a, a - p), normal), dot(cross(c - b, b - p), normal), dot(cross(a - c, c - p), normal)});
  };
  return candidates.best(beyond, chosen[3]) ? 4 : 3;
}

}  // namespace vps::bullet
