#!/usr/bin/env python3
# SPDX-License-Identifier: Zlib
"""Reads a baked asset with h5py: its scalars, its points, and the penetration at a place.

    python3 read_asset.py bunny.vps.hdf            # scalars and points
    python3 read_asset.py bunny.vps.hdf 0.01 0 0   # and V at a place, asset frame, metres

Needs h5py and numpy (Debian: python3-h5py, for /usr/bin/python3). docs/internals/format.md defines every number.
"""

import sys

import h5py
import numpy as np


def read_points(f):
    """Positions [m], unit normals into the body and areas [m^2] of the pointshell: P x 3, P x 3, P."""
    facts, shell = f.attrs, f["pointshell"]
    # Positions are 16-bit steps from an origin; rows are x, y, z.
    positions = facts["position_origin"] + facts["position_step"] * shell["positions"][:].T
    # Octahedral code: u and v are x and y on an octahedron, whose lower half is folded out into the corners of the square.
    # Three bytes hold 12 bits of each.
    low, middle, high = shell["inward_normals"][:].astype(int).T
    u = (low + 256 * (middle % 16)) / 2047.0 - 1
    v = (middle // 16 + 16 * high) / 2047.0 - 1
    z = 1 - abs(u) - abs(v)
    t = np.maximum(-z, 0)
    normals = np.stack([u - np.where(u >= 0, t, -t), v - np.where(v >= 0, t, -t), z], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return positions, normals, facts["area_step"] * shell["areas"][:].astype(float) ** 2


def penetration(f, point, field="scaled"):
    """V at a point of the asset frame [m]: positive inside. None where no sample is stored.

    `field` is "scaled" or "real", whichever was baked.
    """
    own = own_penetration(f, point, field)
    if own is None:
        return None
    # At the band's end, where samples may be clamped, V changes over to the far grid.
    band = f.attrs["band_inner" if own >= 0 else "band_outer"]
    end = max(band - np.sqrt(0.75) * f.attrs["voxel_size"], 0)
    far = far_penetration(f, point)
    if abs(own) < end or far is None:
        return own
    weight = min((abs(own) - end) / (band - end), 1)
    return own + weight * ((max(own, far) if own >= 0 else min(own, far)) - own)


def own_penetration(f, point, field):
    """What `field` alone says of V at a point [m]. None where no sample is stored."""
    facts, voxelmap = f.attrs, f["voxelmap"]
    # In voxels, from the centre of voxel (0,0,0). Samples cover 0 <= g < dims - 1.
    g = (np.asarray(point) - facts["origin"]) / facts["voxel_size"] - 0.5
    if (g < 0).any() or (g >= facts["dims"] - 1.0).any():
        return None
    i = g.astype(int)
    # Descend the octree, from blocks of 16 voxels. Arrays are indexed z, y, x.
    entry = int(voxelmap["field_roots"][tuple(i[::-1] // 16)])
    if entry < 0x80000000:  # no samples: the entry is a bound of V
        return None
    edge = 8
    while 0x80000000 <= entry < 0xFFFFFFFE:
        octant = int((i // edge % 2) @ [1, 2, 4])
        entry = int(voxelmap["field_nodes"][entry - 0x80000000, octant])
        edge //= 2
    if entry >= 0xFFFFFFFE:  # ...FF: outside, ...FE: inside, beyond the band
        return None
    # A brick of 4x4x4 cells whose edge is 2^level voxels, with samples at their corners: slices of 5x5 along an axis.
    level = (entry >> 29) - 2
    axis = 2 - (entry >> 27 & 3)
    at_lower_end, left_out = entry >> 26 & 1, entry >> 24 & 3
    at = g / 2.0**level % 4
    at[[axis, 2]] = at[[2, axis]]
    # Slices that are left out at one end equal the nearest that is stored.
    at[2] = min(max(at[2] - at_lower_end * left_out, 0), 4 - left_out)
    x, y, z = low = np.minimum(at.astype(int), [3, 3, 3 - left_out])
    first = (entry & 0xFFFFFF) + z
    v = voxelmap[field][first : first + 2].reshape(2, 5, 5)[:, y : y + 2, x : x + 2].astype(float)
    for t in (at - low)[::-1]:  # trilinear: along z, then y, then x
        v = v[0] + t * (v[1] - v[0])
    if field == "real":
        return float(v)
    # In steps of lambda, or of 2 lambda in the coarsest bricks.
    return float(v * facts["lambda"] * (2 if level == 1 else 1))


def far_penetration(f, point):
    """V at a point by the far grid [m]: coarse, for places beyond the band. None beyond the grid and without one."""
    facts = f.attrs
    if "far" not in f["voxelmap"]:
        return None
    at = (np.asarray(point) - facts["far_origin"]) / facts["far_spacing"]
    values = f["voxelmap/far"]
    if (at < 0).any() or (at >= np.array(values.shape[::-1]) - 1.0).any():
        return None
    x, y, z = at.astype(int)
    v = values[z : z + 2, y : y + 2, x : x + 2].astype(float)
    v *= np.where(v > 0, facts["far_step_inner"], facts["far_step_outer"])
    for t in at[::-1] % 1:
        v = v[0] + t * (v[1] - v[0])
    return float(v)


def main():
    if len(sys.argv) not in (2, 5):
        sys.exit(__doc__)
    with h5py.File(sys.argv[1]) as f:
        for name, value in sorted(f.attrs.items()):
            print(f"{name:28} {value.decode() if isinstance(value, bytes) else value}")
        if "pointshell" in f:
            positions, normals, areas = read_points(f)
            print(f"{len(positions)} points of {areas.sum():.6g} m^2 in all; the first, in metres:")
            print(f"  at {positions[0]}, inward normal {normals[0]}, area {areas[0]:.3g} m^2")
        if len(sys.argv) == 5:
            point = [float(x) for x in sys.argv[2:5]]
            for field in ("scaled", "real"):
                if "voxelmap" in f and field in f["voxelmap"]:
                    v = penetration(f, point, field)
                    print(f"V of {field} at {point}: " + ("none stored there" if v is None else f"{v:.9g} m"))
            if "voxelmap" in f:
                v = far_penetration(f, point)
                print(f"V of the far grid at {point}: " + ("none there" if v is None else f"{v:.4g} m"))


if __name__ == "__main__":
    main()
