// SPDX-License-Identifier: GPL-3.0-or-later
// Flat nodes answer for their points on triangle meshes too: beside a search that tests every point.
#include <algorithm>
#include <map>
#include <vector>

#include "runtime/bullet/partners/triangle_contacts.h"
#include "tests/runtime/bullet/mesh_ground.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

constexpr double kPlateVoxel = 0.001;
constexpr double kPlateHalf = 0.008;  // of the thickness. [m]

struct FoundOnMesh {
  std::vector<Contact> contacts;
  std::vector<std::uint32_t> features;
};

// A plate, and the same whose contacts are springs: these have the areas of all points.
struct Plates {
  std::shared_ptr<Asset> asset = baked_at(make_box({0.06, 0.05, kPlateHalf}), kPlateVoxel);
  bullet::Shape few{asset}, all{asset};
  btCollisionObject object;
  float touching = static_cast<float>(0.3 * kPlateVoxel);
  std::uint32_t level = 0;

  Plates() {
    PenaltyLaw law;
    law.stiffness = 1e9;
    all.set_foundation(law);
  }
  FoundOnMesh find(const bullet::Shape& shape, const btCollisionShape& mesh, const btTransform& at,
                   bullet::TriangleMemory& memory, std::span<const detail::ContactPlace> known = {}) const {
    const bullet::Pair pair{bullet::PairBody(&shape, &object, at),
                            bullet::PairBody(&mesh, &object, btTransform::getIdentity())};
    QueryOptions options;
    options.contact_distance = touching;
    options.segment_level = level;
    detail::SheetContacts found;
    EXPECT_EQ(bullet::find_triangle_contacts(pair, options, known, memory, found), Status::ok);
    EXPECT_TRUE(known.empty() || found.are_known);
    return {found.contacts, found.features};
  }
  FoundOnMesh find(const bullet::Shape& shape, const btCollisionShape& mesh, const btTransform& at) const {
    bullet::TriangleMemory none;
    return find(shape, mesh, at, none);
  }
  // What docs/internals/bounds.md states for depths, and for places. [m]
  [[nodiscard]] float bent() const { return 6 * static_cast<float>(kHullTolerance) * few.pointshell().covering_radius; }
  [[nodiscard]] float off() const { return bent() / 2 + 3 * few.pointshell().position_step; }
};

// Sheets that are flat all over, in parts, and nowhere.
struct Sheet {
  const char* name;
  std::unique_ptr<Ground> ground;  // a mesh's address must not change
};
std::vector<Sheet> all_sheets() {
  const auto slope = [](double x, double) { return std::abs(x) < 0.02 ? 0 : -0.1 * (std::abs(x) - 0.02); };
  const auto step = [](double x, double y) { return x > 0.01 && x < 0.02 && y > 0 && y < 0.01 ? 0.0002 : 0.0; };
  const auto hills = [](double x, double y) { return 0.002 * std::sin(40 * x) * std::cos(35 * y); };
  std::vector<Sheet> sheets;
  sheets.push_back({"coarse", std::make_unique<Ground>(Kind::bvh, 0.5, 1)});
  sheets.push_back({"grid", std::make_unique<Ground>(Kind::bvh, 0.5, 60, flat, Winding::mixed)});
  sheets.push_back({"fine", std::make_unique<Ground>(Kind::bvh, 0.2, 100)});
  sheets.push_back({"terrain", std::make_unique<Ground>(Kind::terrain, 0.5, 60)});
  sheets.push_back({"short", std::make_unique<Ground>(Kind::bvh, 0.03, 4)});  // ends under the plate
  sheets.push_back({"roof", std::make_unique<Ground>(Kind::bvh, 0.2, 40, slope)});
  sheets.push_back({"step", std::make_unique<Ground>(Kind::bvh, 0.1, 40, step)});
  sheets.push_back({"hills", std::make_unique<Ground>(Kind::bvh, 0.2, 40, hills)});
  return sheets;
}

btTransform lying(Random& random, double depth, double tilt) {
  const double axis = random.between(0, 6.3);
  btTransform at(btQuaternion({btScalar(std::cos(axis)), btScalar(std::sin(axis)), 0}, btScalar(tilt)) *
                 btQuaternion({0, 0, 1}, btScalar(random.between(0, 6.3))));
  at.setOrigin(
      {btScalar(random.between(-0.01, 0.01)), btScalar(random.between(-0.01, 0.01)), btScalar(kPlateHalf - depth)});
  return at;
}

double tilt_of(int n) {
  constexpr double kTilts[] = {0, 1e-5, 1e-4, 1e-3, 1e-2, 0.1};
  return kTilts[n % 6];
}

float support_of(const std::vector<Contact>& contacts, Vec3 along) {
  float most = -1e9F;
  for (const Contact& c : contacts) most = std::max(most, detail::dot(c.position, along));
  return most;
}

TEST(FlatTriangles, CornersHaveTheDepthAndTheExtentOfAllPointsInContact) {
  const Plates plates;
  ASSERT_NE(plates.few.pointshell().hull_offsets, nullptr);
  Random random;
  std::map<std::string, std::pair<std::size_t, std::size_t>> counts;  // few, all
  std::size_t strangers = 0;
  for (Sheet& sheet : all_sheets()) {
    for (int n = 0; n < 60; ++n) {
      const btTransform at = lying(random, random.between(-0.0004, 0.002), tilt_of(n));
      const FoundOnMesh few = plates.find(plates.few, **sheet.ground, at);
      const FoundOnMesh all = plates.find(plates.all, **sheet.ground, at);
      counts[sheet.name].first += few.contacts.size();
      counts[sheet.name].second += all.contacts.size();
      ASSERT_EQ(few.contacts.empty(), all.contacts.empty()) << sheet.name << n;
      if (all.contacts.empty()) continue;
      std::map<std::uint32_t, Contact> by_feature;
      float deepest = -1;
      for (std::size_t i = 0; i < all.contacts.size(); ++i) {
        by_feature[all.features[i]] = all.contacts[i];
        deepest = std::max(deepest, all.contacts[i].penetration);
      }
      float deepest_of_few = -1;
      for (std::size_t i = 0; i < few.contacts.size(); ++i) {
        const Contact& c = few.contacts[i];
        // Of a point right over an edge of two triangles, rounding may find neither.
        strangers += by_feature.contains(few.features[i]) ? 0 : 1;
        if (!by_feature.contains(few.features[i])) continue;
        const Contact& same = by_feature[few.features[i]];
        ASSERT_NEAR(c.penetration, same.penetration, plates.bent() / 6) << sheet.name << n;
        ASSERT_EQ(c.node, same.node);
        ASSERT_GT(detail::dot(c.inward_normal, same.inward_normal), 0.999F) << sheet.name << n;
        deepest_of_few = std::max(deepest_of_few, c.penetration);
      }
      ASSERT_GE(deepest_of_few, deepest - plates.bent()) << sheet.name << n;
      // Ends and corners of the sheet are all found.
      for (const std::uint32_t feature : all.features) {
        if (feature < plates.few.pointshell().points) continue;
        ASSERT_NE(std::find(few.features.begin(), few.features.end(), feature), few.features.end()) << sheet.name << n;
      }
      for (int k = 0; k < 30; ++k) {
        const Vec3 along = {static_cast<float>(std::cos(k * 0.21)), static_cast<float>(std::sin(k * 0.21)), 0};
        ASSERT_GE(support_of(few.contacts, along), support_of(all.contacts, along) - plates.off()) << sheet.name << n;
      }
    }
  }
  EXPECT_LT(strangers, 10U);
  for (const char* const name : {"coarse", "grid", "fine", "terrain"}) {
    EXPECT_LT(10 * counts[name].first, 9 * counts[name].second) << name;
  }
  for (const auto& [name, count] : counts) EXPECT_GT(count.first, 500U) << name;
}

TEST(FlatTriangles, MemoryChangesNothingWhileAFaceSlidesTipsAndLeaves) {
  Plates plates;
  Random random;
  std::size_t remembered = 0;
  for (const std::uint32_t level : {0U, 2U}) {
    plates.level = level;
    for (Sheet& sheet : all_sheets()) {
      for (int run = 0; run < 3; ++run) {
        bullet::TriangleMemory memory;
        btTransform at = lying(random, 0.0002, tilt_of(run));
        const double speed = std::pow(10, random.between(-7, -4.5));  // [m a step]
        for (int step = 0; step < 20; ++step) {
          const auto way = [&] { return btScalar(random.between(-speed, speed)); };
          at.setOrigin(at.getOrigin() + btVector3(btScalar(speed) + way(), way(), way()));
          at.setRotation(btQuaternion({0, 1, 0}, btScalar(20) * way()) * at.getRotation());
          const Pose reference = memory.reference;
          const FoundOnMesh with = plates.find(plates.few, **sheet.ground, at, memory);
          remembered += std::equal(reference.translation, reference.translation + 3, memory.reference.translation);
          const FoundOnMesh without = plates.find(plates.few, **sheet.ground, at);
          ASSERT_EQ(with.features, without.features) << sheet.name << run << " " << step;
          for (std::size_t i = 0; i < with.contacts.size(); ++i) {
            ASSERT_EQ(with.contacts[i].penetration, without.contacts[i].penetration) << sheet.name << run;
          }
        }
      }
    }
  }
  EXPECT_GT(remembered, 500U);
}

TEST(FlatTriangles, ASegmentsContactIsAsDeepAsItsDeepestPoint) {
  Plates plates;
  const PointshellView& shell = plates.few.pointshell();
  constexpr std::uint32_t kLevel = 3;
  ASSERT_GT(shell.levels, kLevel);
  // The segment of a leaf.
  std::vector<std::uint32_t> segment(shell.nodes);
  for (std::uint32_t node = 0; node < shell.level_offsets[shell.levels - 1]; ++node) {
    const auto [begin, end] = children_of(shell, node);
    for (std::uint32_t child = begin; child < end; ++child) {
      segment[child] = child < shell.level_offsets[kLevel] ? child : segment[node];
    }
  }
  Random random;
  std::size_t found = 0;
  for (Sheet& sheet : all_sheets()) {
    for (int n = 0; n < 30; ++n) {
      const btTransform at = lying(random, random.between(-0.0004, 0.002), tilt_of(n));
      plates.level = 0;
      const FoundOnMesh all = plates.find(plates.all, **sheet.ground, at);
      std::map<std::uint32_t, float> deepest;
      for (const Contact& c : all.contacts) {
        const auto [entry, is_new] = deepest.try_emplace(segment[c.node], c.penetration);
        entry->second = std::max(entry->second, c.penetration);
      }
      plates.level = kLevel;
      const FoundOnMesh few = plates.find(plates.few, **sheet.ground, at);
      ASSERT_EQ(few.contacts.size(), deepest.size()) << sheet.name << n;
      for (const Contact& c : few.contacts) {
        ASSERT_NEAR(c.penetration, deepest.at(c.node), plates.bent()) << sheet.name << n;
      }
      found += few.contacts.size();
    }
  }
  EXPECT_GT(found, 1000U);
}

TEST(FlatTriangles, KnownContactsAreFoundAlone) {
  const Plates plates;
  Random random;
  for (Sheet& sheet : all_sheets()) {
    for (int n = 0; n < 5; ++n) {
      const btTransform at = lying(random, 0.0002, tilt_of(n));
      bullet::TriangleMemory memory;
      const FoundOnMesh all = plates.find(plates.few, **sheet.ground, at, memory);
      std::vector<detail::ContactPlace> known;
      for (std::size_t i = 0; i < all.contacts.size() && known.size() < 4; i += 1 + all.contacts.size() / 4) {
        known.push_back({all.contacts[i].node, all.features[i]});
      }
      // A deep pair is searched whole.
      const auto is_deep = [&](const Contact& c) {
        return 2 * c.penetration > plates.few.pointshell().covering_radius;
      };
      if (known.empty() || std::any_of(all.contacts.begin(), all.contacts.end(), is_deep)) continue;
      std::sort(known.begin(), known.end());
      memory.room = 1e-4;
      const FoundOnMesh again = plates.find(plates.few, **sheet.ground, at, memory, known);
      ASSERT_EQ(again.contacts.size(), known.size()) << sheet.name << n;
      for (std::size_t i = 0; i < known.size(); ++i) {
        ASSERT_EQ(again.features[i], known[i].feature) << sheet.name << n;
        const auto same = std::find(all.features.begin(), all.features.end(), known[i].feature);
        const Contact& before = all.contacts[static_cast<std::size_t>(same - all.features.begin())];
        ASSERT_NEAR(again.contacts[i].penetration, before.penetration, plates.bent() / 6) << sheet.name << n;
      }
    }
  }
}

}  // namespace
}  // namespace vps::test
