# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes animated PNGs (https://www.w3.org/TR/png-3/) of at most 256 colours: small enough for a README."""
import struct
import zlib

import numpy


def _chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _packed(indices):
    """Rows of palette indices as a zlib stream, each without a filter."""
    rows = numpy.zeros((indices.shape[0], indices.shape[1] + 1), numpy.uint8)
    rows[:, 1:] = indices
    return zlib.compress(rows.tobytes(), 9)


def _palette(frames):
    """The frames with four bits a channel, as numbers of a palette's colours; colour 0 is transparent."""
    codes = [(f >> 4).astype(numpy.uint16) @ numpy.array([256, 16, 1], numpy.uint16) for f in frames]
    found, counts = numpy.unique(numpy.concatenate([c.ravel() for c in codes]), return_counts=True)
    kept = numpy.sort(found[numpy.argsort(-counts, kind="stable")[:255]])
    colours = numpy.stack([kept >> 8, kept >> 4 & 15, kept & 15], axis=1).astype(int)
    index = numpy.zeros(4096, numpy.uint8)
    for code in found:
        distance = ((colours - [code >> 8, code >> 4 & 15, code & 15]) ** 2).sum(axis=1)
        index[code] = distance.argmin() + 1
    return numpy.concatenate([[[0, 0, 0]], colours * 17]).astype(numpy.uint8), [index[c] for c in codes]


def write_apng(path, frames, delays):
    """Frames as arrays (height, width, 3) of bytes, each shown for its delay [ms], for ever."""
    colours, indices = _palette(frames)
    height, width = indices[0].shape
    out = b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0))
    out += _chunk(b"acTL", struct.pack(">II", len(frames), 0))
    out += _chunk(b"PLTE", colours.tobytes()) + _chunk(b"tRNS", b"\x00")
    number = 0
    for i, (now, delay) in enumerate(zip(indices, delays)):
        left, top, part = 0, 0, now
        if i > 0:  # only the rectangle that changes, and in it only the pixels that do
            changed = now != indices[i - 1]
            rows, columns = numpy.nonzero(changed.any(axis=1))[0], numpy.nonzero(changed.any(axis=0))[0]
            top, bottom = (rows[0], rows[-1] + 1) if len(rows) else (0, 1)
            left, right = (columns[0], columns[-1] + 1) if len(columns) else (0, 1)
            part = numpy.where(changed, now, 0)[top:bottom, left:right]
        control = struct.pack(">IIIIIHHBB", number, part.shape[1], part.shape[0], left, top, delay, 1000, 0, int(i > 0))
        out += _chunk(b"fcTL", control)
        data = _packed(part)
        out += _chunk(b"IDAT", data) if i == 0 else _chunk(b"fdAT", struct.pack(">I", number + 1) + data)
        number += 1 if i == 0 else 2
    out += _chunk(b"IEND", b"")
    path.write_bytes(out)
