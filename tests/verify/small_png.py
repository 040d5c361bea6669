#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""A picture with few colours: small_png.py PICTURE.png [COLOURS].

Rewrites an 8-bit true-colour PNG with a palette of at most COLOURS (64) colours, so that pictures of
documents stay small. Colours are grouped on a grid that grows coarser until they are few enough; a
group gets its mean. Opaque pictures only, as nmm plot draws them.
"""

import os
import struct
import sys
import zlib

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def chunks(data):
    at = len(SIGNATURE)
    while at < len(data):
        (size,) = struct.unpack(">I", data[at:at + 4])
        yield data[at + 4:at + 8], data[at + 8:at + 8 + size]
        at += 12 + size


def paeth(a, b, c):
    to_a, to_b, to_c = abs(b - c), abs(a - c), abs(a + b - 2 * c)
    if to_a <= to_b and to_a <= to_c:
        return a
    return b if to_b <= to_c else c


def unfilter(raw, row, depth):
    """The bytes of each row; `depth` bytes for each pixel."""
    before, lines = bytearray(row), []
    for start in range(0, len(raw), row + 1):
        kind, line = raw[start], bytearray(raw[start + 1:start + 1 + row])
        for i in range(row):
            left = line[i - depth] if i >= depth else 0
            corner = before[i - depth] if i >= depth else 0
            guess = (0, left, before[i], (left + before[i]) // 2, paeth(left, before[i], corner))[kind]
            line[i] = (line[i] + guess) & 255
        lines.append(line)
        before = line
    return lines


def pixels_of(path):
    """Rows of (r, g, b)."""
    with open(path, "rb") as file:
        data = file.read()
    width, height, bits, kind, _, _, interlace = struct.unpack(">IIBBBBB", dict(chunks(data))[b"IHDR"])
    if not data.startswith(SIGNATURE) or bits != 8 or kind not in (2, 6) or interlace:
        sys.exit(f"small_png.py: {path} is no 8-bit true-colour PNG")
    depth = 3 if kind == 2 else 4
    raw = zlib.decompress(b"".join(body for name, body in chunks(data) if name == b"IDAT"))
    lines = unfilter(raw, width * depth, depth)
    assert len(lines) == height
    return [[tuple(line[i:i + 3]) for i in range(0, len(line), depth)] for line in lines]


def palette_of(rows, most):
    """Width of the grid, and the place of each of its groups in a list of mean colours."""
    count = {}
    for line in rows:
        for pixel in line:
            count[pixel] = count.get(pixel, 0) + 1
    step, groups = 1, {}
    while not groups or len(groups) > most:
        step, groups = step + 1, {}
        for pixel, n in count.items():
            sums = groups.setdefault(tuple(v // step for v in pixel), [0, 0, 0, 0])
            for k in range(3):
                sums[k] += n * pixel[k]
            sums[3] += n
    place = {key: k for k, key in enumerate(groups)}
    return step, place, bytes(round(v / s[3]) for s in groups.values() for v in s[:3])


def chunk(name, body):
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))


def shrink(path, most=64, size=None):
    """With `size`: halves the colours until the file is smaller than that."""
    rows = pixels_of(path)
    write(path, rows, most)
    while size is not None and os.path.getsize(path) >= size and most > 8:
        most //= 2
        write(path, rows, most)


def write(path, rows, most):
    step, place, palette = palette_of(rows, most)
    raw = b"".join(b"\0" + bytes(place[tuple(v // step for v in pixel)] for pixel in line) for line in rows)
    with open(path, "wb") as file:
        file.write(SIGNATURE + chunk(b"IHDR", struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 3, 0, 0, 0))
                   + chunk(b"PLTE", palette) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    shrink(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 64)
