# SPDX-License-Identifier: Zlib
"""Prints how deep an asset's pointshell lies in its own field, and its mass as steel.

usage: depth.py ASSET
"""
import sys

import vps

with vps.open(sys.argv[1]) as asset:
    points = asset.points.position
    distance = asset.distance(points)
    print(f"{len(points)} points within {1e3 * abs(distance).max():.2g} mm of the surface, "
          f"{asset.mass_properties(7850).mass:.3g} kg")
    sys.exit(0 if abs(distance).max() <= asset.certificate.bound + asset.voxel_size / 50 else 1)
