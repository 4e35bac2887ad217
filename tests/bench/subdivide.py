# SPDX-License-Identifier: GPL-3.0-or-later
"""Divides every triangle of an OBJ mesh into n^2 equal ones and writes an OFF file: the same solid with many triangles."""


def read_obj(path):
    vertices, triangles = [], []
    with open(path, encoding="utf-8") as file:
        for line in file:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                vertices.append(tuple(map(float, words[1:4])))
            elif words[0] == "f":
                corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
                if len(corners) != 3 or min(corners) < 0:
                    raise SystemExit(f"{path}: only triangles with positive indices")
                triangles.append(corners)
    return vertices, triangles


def subdivide(vertices, triangles, parts):
    numbers = {}
    points = []

    def number(weights):
        """Number of the vertex with these weights at the mesh's vertices; the same for all triangles that share it."""
        key = tuple(sorted((v, w) for v, w in weights if w))
        if key not in numbers:
            numbers[key] = len(points)
            points.append(tuple(sum(w * vertices[v][axis] for v, w in key) / parts for axis in range(3)))
        return numbers[key]

    cut = []
    for a, b, c in triangles:
        rows = [[number(((a, parts - i - j), (b, i), (c, j))) for i in range(parts - j + 1)] for j in range(parts + 1)]
        for low, high in zip(rows, rows[1:]):
            cut += [(low[i], low[i + 1], high[i]) for i in range(len(high))]
            cut += [(low[i + 1], high[i + 1], high[i]) for i in range(len(high) - 1)]
    return points, cut


def write_subdivided(mesh, parts, output):
    points, triangles = subdivide(*read_obj(mesh), parts)
    with open(output, "w", encoding="ascii") as file:
        file.write(f"OFF\n{len(points)} {len(triangles)} 0\n")
        file.writelines(f"{x!r} {y!r} {z!r}\n" for x, y, z in points)
        file.writelines(f"3 {a} {b} {c}\n" for a, b, c in triangles)
