// SPDX-License-Identifier: GPL-3.0-or-later
// Planned scenes in Bullet: contacts equal those of a full bake, unused sections are not read, bad manifests are
// refused.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "formats/scene_manifest.h"
#include "runtime/bullet/vps_scene.h"
#include "tests/cli/program.h"
#include "tests/support/bullet_world.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

using Json = nlohmann::json;

// A static voxelmap, a pointshell and mixed bodies over a box, and a body that collides with none: every part occurs.
std::string scene_text() {
  const auto body = [](const char* name, const char* mesh, const char* rest) {
    return std::string("[[body]]\nname = \"") + name + "\"\nmesh = \"" + VPS_SAMPLE_MESHES + "/" + mesh + ".obj\"\n" +
           rest + "\n";
  };
  return "[world]\ngravity = [\"0m/s2\", \"0m/s2\", \"-9.81m/s2\"]\n"
         "[[body]]\nname = \"floor\"\nshape = \"box\"\nsize = [\"1m\", \"1m\", \"2cm\"]\ntype = \"static\"\n"
         "position = [\"0m\", \"0m\", \"-1cm\"]\n" +
         body("ring", "torus", "voxel = \"1mm\"\ntype = \"static\"\nposition = [\"0m\", \"0m\", \"2cm\"]") +
         body("gear", "gear",
              "voxel = \"0.5mm\"\nmass = \"50g\"\nposition = [\"3cm\", \"0m\", \"6cm\"]\n"
              "rotation = [\"20deg\", \"10deg\", \"0deg\"]") +
         body("nut", "nut",
              "voxel = \"0.4mm\"\nmass = \"20g\"\nposition = [\"3.4cm\", \"1mm\", \"9cm\"]\n"
              "rotation = [\"0deg\", \"40deg\", \"0deg\"]\nvelocity = [\"0m/s\", \"0m/s\", \"-2m/s\"]") +
         body("twin", "nut", "voxel = \"0.4mm\"\nmass = \"20g\"\nposition = [\"3.2cm\", \"-2mm\", \"12cm\"]") +
         body("peg", "peg",
              "voxel = \"0.5mm\"\nmass = \"10g\"\nposition = [\"-4cm\", \"0m\", \"6cm\"]\n"
              "rotation = [\"0deg\", \"80deg\", \"0deg\"]") +
         body("shelf", "cube", "voxel = \"5mm\"\ntype = \"static\"\nposition = [\"2m\", \"0m\", \"0m\"]\nmask = 0");
}

void bake_scene(const TemporaryFolder& folder, const std::string& arguments) {
  write_file(folder / "scene.toml", scene_text());
  const Outcome run = vpsbake(folder, "scene scene.toml " + arguments);
  ASSERT_EQ(run.code, 0) << run.err;
}

bool has_asset(const TemporaryFolder& folder, const char* output, const char* mesh) {
  for (const auto& entry : std::filesystem::directory_iterator(folder / output)) {
    if (entry.path().filename().string().starts_with(std::string(mesh) + "-")) return true;
  }
  return false;
}

// All data of every contact point.
std::string contacts_of(World& world) {
  std::string bytes;
  const auto add = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (int m = 0; m < world.dispatcher.getNumManifolds(); ++m) {
    const btPersistentManifold* const manifold = world.dispatcher.getManifoldByIndexInternal(m);
    add(manifold->getBody0()->getUserIndex());
    add(manifold->getBody1()->getUserIndex());
    for (int i = 0; i < manifold->getNumContacts(); ++i) {
      const btManifoldPoint& point = manifold->getContactPoint(i);
      for (int axis = 0; axis < 3; ++axis) {
        add(point.getPositionWorldOnA()[axis]);
        add(point.getPositionWorldOnB()[axis]);
        add(point.m_normalWorldOnB[axis]);
      }
      add(point.getDistance());
      add(point.m_partId0);
      add(point.m_partId1);
    }
  }
  return bytes;
}

struct Played {
  std::vector<std::string> contacts;  // of each step
  std::size_t touching = 0;           // steps with a contact between two baked bodies
};

Played play(const std::string& manifest) {
  World world;
  const bullet::Scene scene = bullet::load_scene(manifest, world.world);
  EXPECT_EQ(scene.error(), "");
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) scene.bodies()[i]->setUserIndex(static_cast<int>(i));
  Played played;
  for (int i = 0; i < 300; ++i) {
    world.step(1);
    played.contacts.push_back(contacts_of(world));
    for (int m = 0; m < world.dispatcher.getNumManifolds(); ++m) {
      const btPersistentManifold* const manifold = world.dispatcher.getManifoldByIndexInternal(m);
      const bool baked = manifold->getBody0()->getUserIndex() > 0 && manifold->getBody1()->getUserIndex() > 0;
      if (baked && manifold->getNumContacts() > 0) ++played.touching;
    }
  }
  for (const auto& body : scene.bodies()) {
    const auto* const shape = dynamic_cast<const bullet::Shape*>(body->getCollisionShape());
    EXPECT_TRUE(shape == nullptr || shape->status() == Status::ok) << describe(shape->status());
  }
  return played;
}

// Other fields beside `scaled` change which of its samples beyond the band are stored: docs/scene.md.
void bake_with_scaled_alone(const TemporaryFolder& folder, Json& manifest) {
  for (Json& asset : manifest["assets"]) {
    const std::string file = asset["file"].get<std::string>();
    for (const auto& [mesh, voxel] :
         {std::pair{"torus", "1mm"}, {"gear", "0.5mm"}, {"nut", "0.4mm"}, {"peg", "0.5mm"}}) {
      if (!file.starts_with(std::string(mesh) + "-")) continue;
      const Outcome run =
          vpsbake(folder, std::string(VPS_SAMPLE_MESHES) + "/" + mesh + ".obj --voxel " + voxel + " -o full/" + file);
      ASSERT_EQ(run.code, 0) << run.err;
      Asset baked;
      ASSERT_EQ(Asset::open((folder / "full" / file).c_str(), baked), Status::ok);
      asset["key"] = scene_manifest::asset_key(baked.bytes());
    }
  }
}

TEST(LoadScene, APlannedSceneAndOneWithBothPartsGiveTheSameContactsToTheBit) {
  const TemporaryFolder folder;
  bake_scene(folder, "-o planned");
  bake_scene(folder, "-o full --full");
  const Json manifest = Json::parse(read_file(folder / "planned/scene.vps.json"));
  // Every part is among them.
  EXPECT_EQ(manifest["bodies"][1]["shapes"][0]["part"], "voxelmap");
  EXPECT_EQ(manifest["bodies"][2]["shapes"][0]["part"], "mixed");
  EXPECT_EQ(manifest["bodies"][5]["shapes"][0]["part"], "pointshell");
  EXPECT_EQ(manifest["bodies"][6]["shapes"][0]["primitive"], "box");
  EXPECT_FALSE(has_asset(folder, "planned", "cube"));
  EXPECT_TRUE(has_asset(folder, "full", "cube"));
  // As with whole assets: all sections in use, and every body mixed.
  Json whole = Json::parse(read_file(folder / "full/scene.vps.json"));
  bake_with_scaled_alone(folder, whole);
  write_file(folder / "full/scene.vps.json", whole.dump());
  for (Json& asset : whole["assets"]) asset["use"] = {"scaled", "pointshell"};
  for (Json& body : whole["bodies"]) {
    for (Json& shape : body["shapes"]) {
      if (shape.contains("part")) shape["part"] = "mixed";
    }
  }
  write_file(folder / "full/whole.vps.json", whole.dump());

  const Played planned = play(folder / "planned/scene.vps.json");
  EXPECT_GT(planned.touching, 200U);
  for (const char* const other : {"full/scene.vps.json", "full/whole.vps.json"}) {
    const Played played = play(folder / other);
    for (std::size_t step = 0; step < planned.contacts.size(); ++step) {
      ASSERT_TRUE(planned.contacts[step] == played.contacts[step]) << other << ", step " << step;
    }
  }
}

// Number of pages from `first` up to `last` that are in this process's page table.
std::size_t resident_pages(const std::byte* first, const std::byte* last) {
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const int fd = ::open("/proc/self/pagemap", O_RDONLY | O_CLOEXEC);
  std::size_t count = 0;
  for (auto at = (reinterpret_cast<std::uintptr_t>(first) + page - 1) / page;
       at < reinterpret_cast<std::uintptr_t>(last) / page; ++at) {
    std::uint64_t entry = 0;
    if (::pread(fd, &entry, sizeof entry, static_cast<off_t>(at * sizeof entry)) != sizeof entry) break;
    count += entry >> 63;
  }
  ::close(fd);
  return count;
}

// Resident pages of a section, without its first and last 64 KiB: around a touched page the system maps up to 16
// pages by default, also of a neighbouring section.
std::size_t touched(const Asset& asset, SectionKind kind, std::size_t* all = nullptr) {
  constexpr std::ptrdiff_t kAround = 65536;
  const Section* const section = asset.directory().find(kind);
  EXPECT_NE(section, nullptr);
  const std::byte* const first = asset.bytes().data() + section->offset;
  const std::byte* const last = first + section->bytes;
  if (all != nullptr) *all = resident_pages(first, last);
  return last - first > 2 * kAround ? resident_pages(first + kAround, last - kAround) : 0;
}

// From now on, reading the section's pages crashes the program.
void forbid(const Asset& asset, SectionKind kind) {
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const Section* const section = asset.directory().find(kind);
  ASSERT_NE(section, nullptr);
  const auto at = reinterpret_cast<std::uintptr_t>(asset.bytes().data()) + section->offset;
  const std::uintptr_t first = (at + page - 1) / page * page;
  const std::uintptr_t last = (at + section->bytes) / page * page;
  if (first < last) {
    ASSERT_EQ(::mprotect(reinterpret_cast<void*>(first), last - first, PROT_NONE), 0);
  }
}

TEST(LoadScene, SectionsThatAreNotUsedAreNeverTouched) {
  const TemporaryFolder folder;
  write_file(folder / "scene.toml",
             std::string("[[body]]\nname = \"bolt\"\ntype = \"static\"\nvoxel = \"0.15mm\"\nmesh = \"") +
                 VPS_SAMPLE_MESHES + "/bolt.obj\"\n[[body]]\nname = \"nut\"\nmass = \"20g\"\nvoxel = \"0.17mm\"\n" +
                 "position = [\"0m\", \"0m\", \"3cm\"]\nmesh = \"" + VPS_SAMPLE_MESHES + "/nut.obj\"\n");
  ASSERT_EQ(vpsbake(folder, "scene scene.toml -o full --full").code, 0);
  World world;
  const bullet::Scene scene = bullet::load_scene(folder / "full/scene.vps.json", world.world);
  ASSERT_EQ(scene.error(), "");
  const auto asset = [&](const char* name) -> const Asset& {
    return static_cast<const bullet::Shape*>(scene.find(name)->getCollisionShape())->asset();
  };
  std::size_t contacts = 0;
  for (int i = 0; i < 240; ++i) {
    world.step(1);
    contacts += world.points().size();
  }
  ASSERT_GT(contacts, 100U);
  constexpr SectionKind kShell[] = {SectionKind::point_positions, SectionKind::point_inward_normals,
                                    SectionKind::spheres};
  constexpr SectionKind kFields[] = {SectionKind::layers, SectionKind::real, SectionKind::real_gradient};
  std::size_t large = 0;
  for (const char* name : {"bolt", "nut"}) {
    for (const SectionKind kind : kFields) {
      EXPECT_EQ(touched(asset(name), kind), 0U) << name;
      large += asset(name).directory().find(kind)->bytes;
    }
  }
  EXPECT_GT(large, 50'000'000U);  // the unused sections are large
  std::size_t pages = 0;
  for (const SectionKind kind : kShell) {
    EXPECT_EQ(touched(asset("bolt"), kind), 0U);
    (void)touched(asset("nut"), kind, &pages);
    EXPECT_GT(pages, 0U);
  }
  // Its distances place the contacts of its pointshell.
  EXPECT_GT(touched(asset("nut"), SectionKind::scaled), 0U);
  EXPECT_GT(touched(asset("bolt"), SectionKind::scaled), 0U);
  (void)touched(asset("bolt"), SectionKind::field_nodes, &pages);
  EXPECT_GT(pages, 0U);

  // The same, enforced by memory protection.
  for (const char* name : {"bolt", "nut"}) {
    for (const SectionKind kind : kFields) forbid(asset(name), kind);
  }
  for (const SectionKind kind : kShell) forbid(asset("bolt"), kind);
  world.step(60);

  // With all sections of the same file in use, the counts are not 0.
  Asset whole;
  const Json manifest = Json::parse(read_file(folder / "full/scene.vps.json"));
  const std::string bolt = manifest["assets"][0]["file"];
  ASSERT_EQ(Asset::open((folder / ("full/" + bolt)).c_str(), whole), Status::ok);
  ASSERT_EQ(whole.verify(), Status::ok);
  for (const SectionKind kind : kFields) EXPECT_GT(touched(whole, kind), 0U);
}

TEST(LoadScene, ABodyTurnsAboutItsPrincipalAxes) {
  const TemporaryFolder folder;
  // A plate, turned by 0.4 rad about z in its mesh.
  std::string obj;
  for (int i = 0; i < 8; ++i) {
    const double x = (i & 1) != 0 ? 0.06 : -0.06;
    const double y = (i & 2) != 0 ? 0.03 : -0.03;
    obj += "v " + std::to_string(x * std::cos(0.4) - y * std::sin(0.4)) + ' ' +
           std::to_string(x * std::sin(0.4) + y * std::cos(0.4)) + ((i & 4) != 0 ? " 0.03\n" : " 0.01\n");
  }
  obj += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  write_file(folder / "plate.obj", obj);
  write_file(folder / "scene.toml",
             "[[body]]\nname = \"floor\"\nshape = \"plane\"\ntype = \"static\"\n[[body]]\nname = \"plate\"\n"
             "mass = \"3kg\"\nvoxel = \"2mm\"\nmesh = \"plate.obj\"\nrotation = [\"0deg\", \"90deg\", \"0deg\"]\n"
             "position = [\"0m\", \"0m\", \"1m\"]\n");
  const Outcome run = vpsbake(folder, "scene scene.toml -o out");
  ASSERT_EQ(run.code, 0) << run.err;
  World world;
  const bullet::Scene scene = bullet::load_scene(folder / "out/scene.vps.json", world.world);
  ASSERT_EQ(scene.error(), "");
  const btRigidBody& plate = *scene.find("plate");
  const auto* const shape = dynamic_cast<const bullet::Shape*>(plate.getCollisionShape());
  ASSERT_NE(shape, nullptr);
  EXPECT_EQ(shape->lost_inertia(), 0);
  EXPECT_NEAR(double(plate.getLocalInertia().z()), 3 * (0.12 * 0.12 + 0.06 * 0.06) / 12, 1e-6);
  EXPECT_NEAR(double(plate.getLocalInertia().x()), 3 * (0.06 * 0.06 + 0.02 * 0.02) / 12, 1e-6);
  const btTransform mesh = scene.origin(plate);
  EXPECT_LT((mesh.getOrigin() - btVector3(0, 0, 1)).length(), 1e-6);
  EXPECT_LT((mesh.getBasis() * btVector3(1, 0, 0) - btVector3(0, 0, -1)).length(), 1e-6);
  EXPECT_LT((plate.getWorldTransform().getOrigin() - btVector3(btScalar(0.02), 0, 1)).length(), 1e-6);
}

// Plans a nut on a floor into `out`. @return its manifest
Json bake_nut(const TemporaryFolder& folder) {
  write_file(
      folder / "scene.toml",
      std::string("[[body]]\nname = \"floor\"\nshape = \"plane\"\ntype = \"static\"\n[[body]]\nname = \"nut\"\n") +
          "mass = \"20g\"\nvoxel = \"1mm\"\nkeep = [\"voxelmap\"]\nmesh = \"" + VPS_SAMPLE_MESHES + "/nut.obj\"\n");
  EXPECT_EQ(vpsbake(folder, "scene scene.toml -o out").code, 0);
  return Json::parse(read_file(folder / "out/scene.vps.json"));
}

TEST(LoadScene, AnotherAssetUnderTheNameOfThePlannedOneIsRefused) {
  const TemporaryFolder folder;
  const std::string nut = bake_nut(folder)["assets"][0]["file"];
  const std::string manifest = folder / "out/scene.vps.json";
  ASSERT_EQ(vpsbake(folder, std::string(VPS_SAMPLE_MESHES) + "/nut.obj --voxel 2mm -o out/" + nut).code, 0);
  World world;
  const bullet::Scene scene = bullet::load_scene(manifest, world.world);
  EXPECT_EQ(scene.error(), manifest + ": " + nut + " is not the asset that the scene was planned with; plan it again");
  EXPECT_EQ(world.world.getNumCollisionObjects(), 0);
}

TEST(LoadScene, AFileOfSeveralEntriesIsMappedOnceForAllTheirUses) {
  const TemporaryFolder folder;
  Json manifest = bake_nut(folder);
  Json second = manifest["assets"][0];
  second["file"] = "./" + second["file"].get<std::string>();
  second["use"] = {"scaled"};
  manifest["assets"][0]["use"] = {"pointshell"};
  manifest["assets"].push_back(second);
  for (const char* const part : {"pointshell", "voxelmap"}) {
    Json body = manifest["bodies"][1];
    body["name"] = part;
    body["shapes"][0]["part"] = part;
    body["shapes"][0]["asset"] = part == std::string("voxelmap") ? 1 : 0;
    manifest["bodies"].push_back(body);
  }
  write_file(folder / "out/s.json", manifest.dump());
  World world;
  const bullet::Scene scene = bullet::load_scene(folder / "out/s.json", world.world);
  ASSERT_EQ(scene.error(), "");
  const auto shape_of = [&](const char* name) {
    return static_cast<const bullet::Shape*>(scene.find(name)->getCollisionShape());
  };
  EXPECT_EQ(&shape_of("pointshell")->asset(), &shape_of("voxelmap")->asset());
  EXPECT_NE(shape_of("pointshell"), shape_of("voxelmap"));
}

TEST(LoadScene, DamagedPayloadsAreFoundWhenHashesAreAskedFor) {
  const TemporaryFolder folder;
  const Json manifest = bake_nut(folder);
  const std::string name = manifest["assets"][0]["file"];
  const std::string path = folder / "out/scene.vps.json";
  const bullet::LoadOptions checked{.verify = true};
  {
    World world;
    EXPECT_EQ(bullet::load_scene(path, world.world, checked).error(), "");
  }
  Asset nut;
  ASSERT_EQ(Asset::open((folder / ("out/" + name)).c_str(), nut), Status::ok);
  const auto at = static_cast<std::streamoff>(nut.directory().find(SectionKind::point_areas)->offset);
  std::fstream file(folder / ("out/" + name), std::ios::in | std::ios::out | std::ios::binary);
  const char changed = static_cast<char>(nut.bytes()[static_cast<std::size_t>(at)] ^ std::byte{1});
  file.seekp(at).put(changed);
  file.close();
  World world;
  EXPECT_EQ(bullet::load_scene(path, world.world, checked).error(),
            path + ": " + name + ": " + describe(Status::corrupt_payload));
  EXPECT_EQ(world.world.getNumCollisionObjects(), 0);
  EXPECT_EQ(bullet::load_scene(path, world.world).error(), "");
}

}  // namespace
}  // namespace vps::test
