#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Plays the scenes, writes pictures of their trajectories and the table of docs/scenes.md. Needs python3-vtk9."""
import argparse
import pathlib
import subprocess

import numpy
import vtk
from PIL import Image
from vtk.util.numpy_support import vtk_to_numpy

from trajectory import read_trajectory

# Program, variant, times of the pictures [s], direction from which the camera looks; no times: no pictures.
SCENES = [
    ("nut_on_bolt", "sample", (0.0, 0.3, 0.5), (1, -1.6, 0.7)),
    ("nut_on_bolt", "fine", (), None),
    ("nut_on_bolt", "factory", (0.0, 1.0), (1, -1.6, 0.7)),
    ("gears", "sample", (0.0, 0.4, 0.8), (0.2, -0.6, 1)),
    ("gears", "factory", (0.0, 0.8), (0.2, -0.6, 1)),
    ("peg_in_hole", "sample", (0.0, 0.06, 1.0), (1, -1.6, 0.9)),
    ("peg_in_hole", "round", (), None),
    ("peg_in_hole", "rectangular", (), None),
    ("tabletop", "layout", (0.0, 3.0), (0.4, -1, 0.8)),
    ("tabletop", "bin", (0.5, 5.0), (0.4, -1, 0.8)),
    ("bunnies", "tori", (0.3, 2.0), (0.5, -1, 0.6)),
    ("bunnies", "bunnies", (0.4, 4.0), (0.5, -1, 0.5)),
]
COLOURS = [(0.75, 0.77, 0.8), (0.88, 0.62, 0.25), (0.35, 0.6, 0.8), (0.5, 0.72, 0.45), (0.8, 0.45, 0.42)]
SIZE = 400  # pixels
SIDE = (400, 360)  # of the animation


def read_mesh(path):
    """Reads OBJ with vtk, OFF with the code below."""
    if path.endswith(".obj"):
        reader = vtk.vtkOBJReader()
        reader.SetFileName(path)
        reader.Update()
        return reader.GetOutput()
    words = pathlib.Path(path).read_text().split()
    vertices, faces = int(words[1]), int(words[2])
    points, cells, at = vtk.vtkPoints(), vtk.vtkCellArray(), 4
    for _ in range(vertices):
        points.InsertNextPoint(*map(float, words[at:at + 3]))
        at += 3
    for _ in range(faces):
        cells.InsertNextCell(3, [int(w) for w in words[at + 1:at + 4]])
        at += 4
    mesh = vtk.vtkPolyData()
    mesh.SetPoints(points)
    mesh.SetPolys(cells)
    return mesh


def make_actors(bodies):
    """An actor for each visible body."""
    actors, meshes = [], {}
    for number, (kind, numbers, word) in enumerate(bodies):
        if word == "hidden" or (kind == "mesh" and not word):
            actors.append(None)
            continue
        if kind == "box":
            source = vtk.vtkCubeSource()
            source.SetXLength(2 * numbers[0]), source.SetYLength(2 * numbers[1]), source.SetZLength(2 * numbers[2])
            source.Update()
            shape = source.GetOutput()
        else:
            if word not in meshes:
                normals = vtk.vtkPolyDataNormals()
                normals.SetInputData(read_mesh(word))
                normals.SetFeatureAngle(30)
                normals.Update()
                meshes[word] = normals.GetOutput()
            shape = meshes[word]
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputData(shape)
        mapper.ScalarVisibilityOff()
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        colour = (0.93, 0.93, 0.92) if kind == "box" else COLOURS[number % len(COLOURS)]
        actor.GetProperty().SetColor(*colour)
        actor.GetProperty().SetSpecular(0.2)
        actors.append(actor)
    return actors


def set_poses(actors, poses):
    for actor, (x, y, z, qx, qy, qz, qw) in zip(actors, poses):
        if not actor:
            continue
        pose = vtk.vtkTransform()
        pose.Translate(x, y, z)
        matrix = [[0.0] * 3 for _ in range(3)]
        vtk.vtkMath.QuaternionToMatrix3x3([qw, qx, qy, qz], matrix)
        turn = vtk.vtkMatrix4x4()
        for i in range(3):
            for j in range(3):
                turn.SetElement(i, j, matrix[i][j])
        pose.Concatenate(turn)
        actor.SetUserTransform(pose)


def aim(renderer, actors, bodies, view):
    """The camera frames the meshes, not the ground."""
    bounds = vtk.vtkBoundingBox()
    for actor, (kind, _, _) in zip(actors, bodies):
        if actor and kind == "mesh":
            bounds.AddBounds(actor.GetBounds())
    box = [0.0] * 6
    bounds.GetBounds(box)
    camera = renderer.GetActiveCamera()
    camera.SetViewUp(0, 0, 1)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetPosition(*view)
    renderer.ResetCamera(box)


def make_window(width, height):
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(4)
    window.SetSize(width, height)
    return window


def add_renderer(window, actors, left=0.0, right=1.0):
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    renderer.SetViewport(left, 0, right, 1)
    for actor in actors:
        if actor:
            renderer.AddActor(actor)
    window.AddRenderer(renderer)
    return renderer


def grab(window):
    window.Render()
    picture = vtk.vtkWindowToImageFilter()
    picture.SetInput(window)
    picture.ReadFrontBufferOff()
    return picture


def render(bodies, frames, times, view, stem):
    actors = make_actors(bodies)
    window = make_window(SIZE, SIZE)
    renderer = add_renderer(window, actors)
    for index, time in enumerate(times):
        _, poses = min(frames, key=lambda frame: abs(frame[0] - time))
        set_poses(actors, poses)
        if index == 0:
            aim(renderer, actors, bodies, view)
        renderer.ResetCameraClippingRange()
        writer = vtk.vtkPNGWriter()
        writer.SetFileName(f"{stem}_{index + 1}.png")
        picture = grab(window)
        writer.SetInputConnection(picture.GetOutputPort())
        writer.SetCompressionLevel(9)
        writer.Write()


def write_animation(path, pictures, delays):
    """An animated PNG, with one palette for all pictures: small enough for a README. delays: [ms]"""
    pictures = [p // 16 * 17 for p in pictures]  # four bits a channel: shades that vary a little stay equal between pictures
    palette = Image.fromarray(numpy.concatenate(pictures)).quantize(256, dither=Image.Dither.NONE)
    frames = [Image.fromarray(p).quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=delays, loop=0, optimize=True)


def animate(sides, view, path):
    """Trajectories with their titles, side by side with the camera of the first, as an animation."""
    window = make_window(2 * SIDE[0], SIDE[1])
    shown = []
    for number, (title, (bodies, frames)) in enumerate(sides):
        actors = make_actors(bodies)
        renderer = add_renderer(window, actors, number / 2, (number + 1) / 2)
        text = vtk.vtkTextActor()
        text.SetInput(title)
        text.GetTextProperty().SetFontSize(17)
        text.GetTextProperty().SetColor(0.1, 0.1, 0.1)
        text.SetPosition(12, SIDE[1] - 30)
        renderer.AddActor2D(text)
        set_poses(actors, frames[0][1])
        if number == 0:
            aim(renderer, actors, bodies, view)
            renderer.GetActiveCamera().Zoom(1.1)
        else:
            renderer.SetActiveCamera(shown[0][0].GetActiveCamera())
        shown.append((renderer, actors, frames))
    pictures = []
    for index in range(len(shown[0][2])):
        for renderer, actors, frames in shown:
            set_poses(actors, frames[index][1])
            renderer.ResetCameraClippingRange()
        picture = grab(window)
        picture.Update()
        image = picture.GetOutput()
        width, height, _ = image.GetDimensions()
        pictures.append(vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)[::-1, :, :3].copy())
    write_animation(path, pictures, [900] + [60] * (len(pictures) - 2) + [1500])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--programs", type=pathlib.Path, required=True, help="folder of the scenes' programs")
    parser.add_argument("--work", type=pathlib.Path, required=True, help="folder for trajectories")
    parser.add_argument("--pictures", type=pathlib.Path, required=True)
    parser.add_argument("--only", help="one program")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    options.pictures.mkdir(parents=True, exist_ok=True)
    rows, failed = [], False
    for program, variant, times, view in SCENES:
        if options.only and program != options.only:
            continue
        trajectory = options.work / f"{program}_{variant}.txt"
        run = subprocess.run([options.programs / program, variant, "--trajectory", trajectory],
                             capture_output=True, text=True, check=False)
        print(run.stdout + run.stderr, flush=True)
        if run.returncode == 77:
            continue
        failed = failed or run.returncode != 0
        verdict = "holds" if run.returncode == 0 else "FAILS"
        rows += [line[4:] + f" {verdict} |" for line in run.stdout.splitlines() if line.startswith("row ")]
        if times:
            render(*read_trajectory(trajectory), times, view, options.pictures / f"{program}_{variant}")
        if (program, variant) == ("nut_on_bolt", "sample"):
            hulls = options.work / "nut_on_bolt_hulls.txt"
            # Fails its own conditions: that is what the picture shows.
            subprocess.run([options.programs / program, variant, "--hulls", "--trajectory", hulls],
                           stdout=subprocess.DEVNULL, check=False)
            animate([("Baked with vpsbake", read_trajectory(trajectory)),
                     ("16 convex pieces each: shot off", read_trajectory(hulls))], view, options.pictures / "nut_on_bolt.png")
    print("\n".join(rows))
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
