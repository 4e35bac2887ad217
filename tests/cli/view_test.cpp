// SPDX-License-Identifier: GPL-3.0-or-later
// `vpsbake view`: its pages in a browser.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/cli/pages.h"

namespace vps::test {
namespace {

// Shows each part alone: "missing", or the share of the view that it paints beyond the frame. Leaves `last` shown.
std::string show_each(const std::string& last) {
  return "(async () => {"
         "const only = async part => {"
         "  for (const p of kParts) if (!box(p).disabled && box(p).checked !== (p === part)) box(p).click();"
         "  await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));"
         "};"
         "const painted = () => {"
         "  const copy = Object.assign(document.createElement('canvas'), {width: 200, height: 200});"
         "  copy.getContext('2d').drawImage(document.querySelector('#view canvas'), 0, 0, 200, 200);"
         "  const data = copy.getContext('2d').getImageData(0, 0, 200, 200).data;"
         "  let n = 0; for (let i = 3; i < data.length; i += 4) n += data[i] > 0; return n / 40000;"
         "};"
         "await only('');"
         "const frame = painted(), found = {};"
         "for (const p of kParts) {"
         "  await only(p);"
         "  found[p] = box(p).disabled ? 'missing' : painted() - frame;"
         "}"
         "await only('" +
         last +
         "');"
         "return found;"
         "})()";
}

void expect_shown(const PageVisit& visit, const std::vector<std::string>& parts) {
  for (const auto& [name, share] : visit.value.items()) {
    if (std::find(parts.begin(), parts.end(), name) == parts.end()) {
      EXPECT_EQ(share, "missing") << name;
    } else {
      EXPECT_GT(share, 0.01) << name;
    }
  }
}

void bake_sample(const TemporaryFolder& folder, const std::string& mesh, const std::string& options) {
  const Outcome run = vpsbake(folder, sample(mesh.c_str()) + " -o a.vps.hdf " + options);
  ASSERT_EQ(run.code, 0) << run.err;
}

void view(const TemporaryFolder& folder, const std::string& options = "") {
  const Outcome run = vpsbake(folder, "view a.vps.hdf " + options);
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_NE(run.out.find("a.html"), std::string::npos) << run.out;
}

TEST(View, APageOfAllFieldsShowsEveryPart) {
  VPS_BROWSER_OR_SKIP();
  const TemporaryFolder folder;
  bake_sample(folder, "gear", "--voxel 0.5mm --fields layers,scaled,real");
  view(folder);
  const PageVisit visit = visit_everywhere(folder / "a.html", show_each("voxels"));
  expect_shown(visit, {"surface", "voxels", "field", "points", "spheres"});
  EXPECT_NE(visit.text.find("43.7 mm × 43.7 mm × 8 mm"), std::string::npos) << visit.text;
}

TEST(View, LayersStoredAreShownAndOthersAreDerived) {
  VPS_BROWSER_OR_SKIP();
  for (const bool stored : {true, false}) {
    const TemporaryFolder folder;
    bake_sample(folder, "cube", std::string("--voxel 2mm --fields ") + (stored ? "layers,scaled" : "scaled"));
    view(folder);
    const PageVisit visit = visit_small(folder / "a.html", "box('voxels').click()");
    EXPECT_EQ(visit.text.find("Derived") == std::string::npos, stored) << visit.text;
    EXPECT_NE(visit.text.find("Layer 0 (the surface)"), std::string::npos) << visit.text;
  }
}

TEST(View, APageOfAVoxelmapAloneSaysThatItHasNoPoints) {
  VPS_BROWSER_OR_SKIP();
  const TemporaryFolder folder;
  bake_sample(folder, "torus", "--voxel 1mm --parts voxelmap");
  view(folder);
  const PageVisit visit = visit_small(folder / "a.html", show_each("field"));
  expect_shown(visit, {"surface", "voxels", "field"});
  EXPECT_NE(visit.text.find("This asset has no pointshell."), std::string::npos) << visit.text;
}

TEST(View, APageOfAPointshellAloneSaysThatItHasNoVoxelmap) {
  VPS_BROWSER_OR_SKIP();
  const TemporaryFolder folder;
  bake_sample(folder, "torus", "--voxel 1mm --parts pointshell");
  view(folder);
  const PageVisit visit = visit_small(folder / "a.html", show_each("points"));
  expect_shown(visit, {"points", "spheres"});
  EXPECT_NE(visit.text.find("This asset has no voxelmap."), std::string::npos) << visit.text;
  EXPECT_NE(visit.text.find("give the mesh with --mesh"), std::string::npos) << visit.text;

  view(folder, "--mesh " + sample("torus"));
  const PageVisit with_mesh = visit_small(folder / "a.html", show_each("surface"));
  expect_shown(with_mesh, {"surface", "points", "spheres"});
  EXPECT_NE(with_mesh.text.find("The mesh that was given"), std::string::npos) << with_mesh.text;
}

TEST(View, SlidersListsAndKeysChangeWhatIsShown) {
  VPS_BROWSER_OR_SKIP();
  const TemporaryFolder folder;
  bake_sample(folder, "gear", "--voxel 0.5mm --fields layers,scaled");
  view(folder);
  const PageVisit visit = visit_small(
      folder / "a.html",
      "(async () => {"
      "const set = (id, value) => { $(id).value = value; $(id).dispatchEvent(new Event('input')); };"
      "const press = key => dispatchEvent(new KeyboardEvent('keydown', {key}));"
      "const picture = async () => {"
      "  await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));"
      "  return document.querySelector('#view canvas').toDataURL(); };"
      "const pictures = [await picture()];"
      "const all = async () => pictures.push(await picture());"
      "press('1'); await all();"                                // nothing
      "press('2'); await all(); set('layer', 0); await all();"  // the outermost layer
      "press('2'); press('3'); await all(); set('at', 0.9); await all();"
      "document.querySelector('[name=axis][value=\"0\"]').click(); await all();"
      "press('3'); press('4'); await all(); set('colouring', 1); await all();"
      "press('4'); press('5'); await all(); set('lower', 0); await all();"
      "press('x'); await all(); press('u'); await all();"
      "return [new Set(pictures).size, pictures.length, $('layer-text').textContent, $('at-text').textContent,"
      "        $('up').textContent]; })()");
  EXPECT_EQ(visit.value[0], visit.value[1]) << "some change is not seen";
  EXPECT_TRUE(visit.value[2].get<std::string>().starts_with("Layer -")) << visit.value[2];
  EXPECT_TRUE(visit.value[3].get<std::string>().starts_with("At x = ")) << visit.value[3];
  EXPECT_EQ(visit.value[4], "z is up");
}

TEST(View, ThePageHoldsTheSurfaceWithoutTheBrowser) {
  const TemporaryFolder folder;
  bake_sample(folder, "icosphere", "--voxel 2mm");
  ASSERT_EQ(vpsbake(folder, "view a.vps.hdf -o page.html").code, 0);
  const std::string page = read_file(folder / "page.html");
  EXPECT_TRUE(page.starts_with("<!doctype html>"));
  EXPECT_NE(page.find("Content-Security-Policy"), std::string::npos);
  for (const char* const mark : {"<!-- data -->", "<!-- libraries -->", "<!-- style -->"})
    EXPECT_EQ(page.find(mark), std::string::npos) << mark;
  // Again over the same page, but over nothing else.
  EXPECT_EQ(vpsbake(folder, "view a.vps.hdf -o page.html").code, 0);
}

TEST(View, WhatCannotBeShownIsRefusedInOneLine) {
  const TemporaryFolder folder;
  bake_sample(folder, "cube", "--voxel 2mm");
  write_file(folder / "junk.vps.hdf", "no asset");
  write_file(folder / "notes.html", "mine");
  expect_refusal(folder, "view absent.vps.hdf", 2, "absent.vps.hdf");
  expect_refusal(folder, "view junk.vps.hdf", 3, "junk.vps.hdf");
  expect_refusal(folder, "view .", 2, "folder");
  expect_refusal(folder, "view", 1, "asset");
  expect_refusal(folder, "view a.vps.hdf -o .", 2, "folder");
  expect_refusal(folder, "view a.vps.hdf -o absent/a.html", 2, "does not exist");
  expect_refusal(folder, "view a.vps.hdf -o notes.html", 2, "not a page");
  expect_refusal(folder, "view a.vps.hdf -o a.vps.hdf", 2, "not a page");
  expect_refusal(folder, "view a.vps.hdf --mesh absent.obj", 2, "absent.obj");
  expect_refusal(folder, "view a.vps.hdf --mesh junk.vps.hdf", 3, "junk.vps.hdf");
  expect_refusal(folder, "view a.vps.hdf --unit mm --mesh " + sample("cube"), 3, "check --unit and --scale");
  expect_refusal(folder, "view a.vps.hdf --mesh " + sample("gear"), 3, "was not baked from this mesh");
  EXPECT_EQ(read_file(folder / "notes.html"), "mine");
}

TEST(ViewOfAThinBody, SaysWhyItHasNoSurface) {
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("thin_plate") + " --voxel 10mm --parts voxelmap -o a.vps.hdf").code, 0);
  ASSERT_EQ(vpsbake(folder, "view a.vps.hdf -o a.html").code, 0);
  EXPECT_NE(read_file(folder / "a.html").find("thinner than its voxels"), std::string::npos);
}

}  // namespace
}  // namespace vps::test
