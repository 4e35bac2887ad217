// SPDX-License-Identifier: GPL-3.0-or-later
// `vpsbake view`: its pages in a browser.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/cli/pages.h"

namespace vps::test {
namespace {

// Script: shows each part alone and returns "missing" or the share of the view that it paints in addition to the frame.
// Leaves `last` shown.
std::string show_each(const std::string& last) {
  return "(async () => {"
         "const only = async part => {"
         "  for (const p of kParts) if (!box(p).disabled && box(p).checked !== (p === part)) box(p).click();"
         "  await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));"
         "};"
         "const painted = () => " +
         std::string(kPaintedShare) +
         ";"
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
  EXPECT_NE(run.out.find(".html: "), std::string::npos) << run.out;
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

TEST(View, AMeshThatIsGivenLiesOverTheSurfaceWhichShowsItsErrors) {
  VPS_BROWSER_OR_SKIP();
  const TemporaryFolder folder;
  bake_sample(folder, "gear", "--voxel 1mm");
  view(folder, "--mesh " + sample("gear"));
  const PageVisit shown = visit_small(folder / "a.html", show_each("surface"));
  expect_shown(shown, {"surface", "mesh", "field", "voxels", "points", "spheres"});
  EXPECT_NE(shown.text.find(" from the mesh, "), std::string::npos) << shown.text;
  // Grey without the colours. Errors are less than a voxel, and most of them are far below the largest.
  const PageVisit visit =
      visit_small(folder / "a.html",
                  "(async () => {"
                  "const picture = async () => {"
                  "  await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));"
                  "  return document.querySelector('#view canvas').toDataURL(); };"
                  "const before = await picture(); $('coloured').click(); const after = await picture();"
                  "const errors = unpack(asset.surface.errors, Uint8Array);"
                  "return [before !== after, asset.surface.most, Math.max(...errors.slice(0, 5e4)),"
                  "        errors.filter(e => e < 64).length / errors.length]; })()");
  EXPECT_EQ(visit.value[0], true);
  EXPECT_LT(visit.value[1], 0.001);
  EXPECT_EQ(visit.value[2], 255);
  EXPECT_GT(visit.value[3], 0.9);
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
  EXPECT_TRUE(visit.value[2].get<std::string>().starts_with("Layer −")) << visit.value[2];
  EXPECT_TRUE(visit.value[3].get<std::string>().starts_with("At x = ")) << visit.value[3];
  EXPECT_EQ(visit.value[4], "z is up");
}

TEST(View, WhatAnAssetLacksCannotBeUsedAndSaysSo) {
  VPS_BROWSER_OR_SKIP();
  const TemporaryFolder folder;
  bake_sample(folder, "cube", "--voxel 2mm --parts pointshell");
  view(folder);
  const PageVisit visit =
      visit_small(folder / "a.html",
                  "['surface', 'voxels', 'field'].forEach((part, i) => {"
                  "  box(part).click(); dispatchEvent(new KeyboardEvent('keydown', {key: String(i + 1)})); });"
                  "[...document.querySelectorAll('.missing input, .missing select')].map(e => [e.disabled,"
                  "    e.checked && e.type === 'checkbox' && e === e.closest('fieldset').querySelector('input'),"
                  "    e.offsetParent !== null && !e.closest('fieldset > label')])");
  EXPECT_GE(visit.value.size(), 8U);
  for (const auto& control : visit.value) EXPECT_EQ(control, nlohmann::json({true, false, false}));
  for (const char* const part : {"Surface", "Voxels by layer", "Slice of the field"})
    EXPECT_NE(visit.text.find(std::string(part) + ": not in this asset"), std::string::npos) << visit.text;
  EXPECT_EQ(visit.text.find("Points by tree level: not"), std::string::npos);
}

TEST(View, ButtonsAndScaleLieBesideThePictureAtAnyWidth) {
  VPS_BROWSER_OR_SKIP();
  const TemporaryFolder folder;
  bake_sample(folder, "cube", "--voxel 2mm");
  view(folder);
  for (const int width : {320, 500, 1280}) {
    VisitOptions options;
    options.width = width;
    options.height = 900;
    options.script =
        "(() => { const picture = document.querySelector('#view canvas').getBoundingClientRect();"
        "return [picture.height, ...[...document.querySelectorAll('.buttons button, .below > *')]"
        ".map(e => e.getBoundingClientRect()).map(r => r.bottom <= picture.top || r.top >= picture.bottom)]; })()";
    const PageVisit visit = visit_page(folder / "a.html", options);
    expect_sound(visit, 0.05);
    EXPECT_GT(visit.value[0], 300);
    ASSERT_EQ(visit.value.size(), 8U);
    for (std::size_t i = 1; i < visit.value.size(); ++i) EXPECT_EQ(visit.value[i], true) << width << " " << i;
  }
}

TEST(View, SlicesBeginInTheMiddleOfTheBodyAsThoseOfTheSliceCommand) {
  VPS_BROWSER_OR_SKIP();
  const TemporaryFolder folder;
  bake_sample(folder, "gear", "--voxel 0.7mm --band-outside 5vx");  // the grid is not centred on the mesh
  view(folder);
  const PageVisit visit = visit_small(folder / "a.html",
                                      "box('field').click(), ['x', 'y', 'z'].map((name, i) => {"
                                      "  document.querySelector(`[name=axis][value=\"${i}\"]`).click();"
                                      "  return [+$('at').value, $('at-text').textContent]; })");
  for (const auto& [axis, value] : std::vector<std::pair<std::string, nlohmann::json>>{
           {"x", visit.value[0]}, {"y", visit.value[1]}, {"z", visit.value[2]}}) {
    EXPECT_NEAR(value[0].get<double>(), axis == "z" ? 0.004 : 0, 1e-9);
    const Outcome slice = vpsbake(folder, "slice a.vps.hdf --axis " + axis);
    const std::string place = axis + (axis == "z" ? " = 4 mm" : " = 0 mm");
    EXPECT_NE(slice.out.find(place + ","), std::string::npos) << slice.out;
    EXPECT_EQ(value[1], "At " + place + ", the middle of the body");
  }
}

TEST(View, BothRampsHaveTicksInTheSameUnit) {
  VPS_BROWSER_OR_SKIP();
  const TemporaryFolder folder;
  bake_sample(folder, "cube", "--voxel 0.5mm --fields layers,scaled");
  view(folder);
  const PageVisit visit = visit_small(folder / "a.html",
                                      "['layer', 'field'].map(name => [$(name + '-unit').textContent,"
                                      "  ...[...$(name + '-ramp').querySelectorAll('span')].map(e => e.textContent)])");
  EXPECT_EQ(visit.value[0][0], "Depth in mm, a voxel of 0.5 mm for each layer:");
  EXPECT_EQ(visit.value[1], nlohmann::json({"V in mm:", "−1", "−0.5", "0", "0.5", "1"}));
  const std::vector<std::string> ticks = visit.value[0];
  EXPECT_NE(std::find(ticks.begin(), ticks.end(), "0"), ticks.end());
  EXPECT_GE(ticks.size(), 4U);
}

TEST(View, BodiesOfAnySizeFitThePictureAndCanBeZoomed) {
  VPS_BROWSER_OR_SKIP();
  for (const char* const options : {"--scale 2.3e-4 --voxel 0.1um", "--scale 2.3e5 --voxel 100m"}) {
    const TemporaryFolder folder;
    bake_sample(folder, "gear", options);
    view(folder);
    const PageVisit visit = visit_small(
        folder / "a.html",
        "(async () => {"
        "const canvas = document.querySelector('#view canvas');"
        "const picture = async () => {"
        "  await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));"
        "  const copy = Object.assign(document.createElement('canvas'), {width: canvas.width, height: canvas.height});"
        "  const pen = copy.getContext('2d'); pen.drawImage(canvas, 0, 0);"
        "  const {width, height, data} = pen.getImageData(0, 0, copy.width, copy.height);"
        "  let all = 0, rim = 0;"
        "  for (let i = 0; i < width * height; ++i) {"
        "    if (data[4 * i + 3] === 0) continue;"
        "    ++all; const x = i % width, y = (i - x) / width;"
        "    rim += x === 0 || y === 0 || x === width - 1 || y === height - 1; }"
        "  return [all, rim]; };"
        "const whole = await picture();"
        "canvas.dispatchEvent(new WheelEvent('wheel', {deltaY: 100, bubbles: true, cancelable: true}));"
        "return [...whole, ...await picture()]; })()");
    EXPECT_GT(visit.value[0], 1000) << options;
    EXPECT_EQ(visit.value[1], 0) << options << ": something reaches beyond the picture";
    EXPECT_LT(visit.value[2].get<double>(), 0.97 * visit.value[0].get<double>()) << options;
  }
}

TEST(View, NumbersComeWithTheProgramAndTheCommand) {
  const TemporaryFolder folder;
  bake_sample(folder, "cube", "--voxel 2mm");
  view(folder, "-o 'a page.html'");
  const std::string page = read_file(folder / "a page.html");
  EXPECT_NE(page.find(R"(["With","vpsbake view a.vps.hdf -o 'a page.html'"])"), std::string::npos);
  EXPECT_NE(page.find(R"(["Page made by","vpsbake )"), std::string::npos);
  EXPECT_NE(page.find(R"(["Baked by","vpsbake )"), std::string::npos);
}

TEST(View, OpensThePageInTheBrowserThatTheEnvironmentNames) {
  const TemporaryFolder folder;
  bake_sample(folder, "cube", "--voxel 2mm");
  write_file(folder / "browser", "#!/bin/sh\ntest -s \"$1\" && echo \"$1\" >opened.txt\n");
  std::filesystem::permissions(folder / "browser", std::filesystem::perms::owner_all);
  ::setenv("BROWSER", (folder / "browser").c_str(), 1);
  const Outcome run = vpsbake(folder, "view a.vps.hdf --open -o 'a page.html'");
  ::setenv("BROWSER", "no_such_browser", 1);
  const Outcome none = vpsbake(folder, "view a.vps.hdf --open");
  ::unsetenv("BROWSER");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  for (int i = 0; i < 100 && !std::filesystem::exists(folder / "opened.txt"); ++i) ::usleep(50'000);
  EXPECT_NE(read_file(folder / "opened.txt").find("/a page.html"), std::string::npos);
  EXPECT_EQ(none.code, 0);
  EXPECT_NE(none.err.find("vpsbake: warning: a.html: no_such_browser: "), std::string::npos) << none.err;
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
  // The page may be overwritten, but no other file.
  EXPECT_EQ(vpsbake(folder, "view a.vps.hdf -o page.html").code, 0);
}

TEST(View, WhatCannotBeShownIsRefusedInOneLine) {
  const TemporaryFolder folder;
  bake_sample(folder, "cube", "--voxel 2mm");
  write_file(folder / "junk.vps.hdf", "no asset");
  write_file(folder / "notes.html", "mine");
  write_file(folder / "home.html", "<!doctype html>\n<title>mine</title>");
  expect_refusal(folder, "view absent.vps.hdf", 2, "absent.vps.hdf");
  expect_refusal(folder, "view junk.vps.hdf", 3, "junk.vps.hdf");
  expect_refusal(folder, "view .", 2, "folder");
  expect_refusal(folder, "view", 1, "asset");
  expect_refusal(folder, "view a.vps.hdf -o .", 2, "folder");
  expect_refusal(folder, "view a.vps.hdf -o absent/a.html", 2, "does not exist");
  expect_refusal(folder, "view a.vps.hdf -o notes.html", 2, "not a page");
  expect_refusal(folder, "view a.vps.hdf -o home.html", 2, "not a page of view");
  expect_refusal(folder, "view a.vps.hdf -o a.vps.hdf", 2, "not a page");
  expect_refusal(folder, "view a.vps.hdf --mesh absent.obj", 2, "absent.obj");
  expect_refusal(folder, "view a.vps.hdf --mesh junk.vps.hdf", 3, "junk.vps.hdf");
  expect_refusal(folder, "view a.vps.hdf --unit mm --mesh " + sample("cube"), 3, "check --unit and --scale");
  expect_refusal(folder, "view a.vps.hdf --mesh " + sample("gear"), 3, "was not baked from this mesh");
  for (const char* const option : {"--unit mm", "--scale 2", "--import-memory 1GB", "--import-timeout 5s"})
    expect_refusal(folder, std::string("view a.vps.hdf ") + option, 1, "requires --mesh");
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
