"""The cat's coat: a tabby's colours as a function of the place on its skin."""

from __future__ import annotations

import math

import numpy as np

from builder.cat import FRAME, body, ears, haunch, head, tail, to_head
from builder.cat_face import DARK, GROUND, PALE, WARM, WHITE, ear_fur, head_fur
from builder.noise import over, smooth, solid
from builder.sculpt import length, mirrored


def coat(p, n):
    """Linear colours at points (m, 3) of the skin with their normals."""
    fur = hair(p, n)
    wave = 0.6 * solid(p, 401, 0.11) + 0.3 * solid(p, 402, 0.045)
    trunk, skull = body(p), head(p)
    shares = (
        (_body, np.ones(len(p))),
        (_tail, smooth(-0.012, 0.012, trunk - tail(p)[0])),
        (head_fur, smooth(-0.03, 0.03, trunk - skull)),
        (ear_fur, smooth(-0.008, 0.008, skull - ears(mirrored(to_head(p)))) * smooth(0.8, 0.85, p[:, 2])),
    )
    color = np.zeros_like(p)
    for paint, share in shares:
        mine = share > 0.0
        color[mine] = over(color[mine], paint(p[mine], n[mine], wave[mine], fur[mine]), share[mine])
    return np.clip(color * np.clip(1.0 + 0.19 * fur, 0.5, 1.6)[:, None], 0.015, 0.9)


def hair(p, n):
    """Short strokes along the lie of the fur, about -2..2: noise averaged along it."""
    flow = _lie(p)
    flow = flow - n * (flow * n).sum(axis=1, keepdims=True)
    flow = flow / np.maximum(length(flow), 1e-3)[:, None]
    total = np.zeros(len(p))
    for step in np.linspace(-1.0, 1.0, 7):
        total += solid(p + flow * (0.016 * step), 403, 0.0075)
    return 0.9 * total / math.sqrt(7.0)


def _lie(p):
    """Which way the hairs point: back over the head, down the body."""
    q = to_head(p)
    on_head = smooth(0.06, -0.02, head(p))[:, None]
    backwards = 1.2 * q[:, :1] * FRAME[0] + FRAME[1] + 2.0 * q[:, 2:] * FRAME[2]
    down = np.array((0.0, 0.35, -1.0)) + p[:, :1] * np.array((1.5, 0.0, 0.0))
    return down * (1.0 - on_head) + backwards * on_head


def _stripes(phase, wave, fur, share):
    """1 in the dark stripes of a pattern that repeats every 1 of `phase`; `share` of it is dark.

    Hairs that grow across an edge fray it; between two stripes there is a ghost of a third.
    """
    turn = 2.0 * math.pi * (phase + 0.32 * wave)
    level = np.cos(math.pi * np.clip(share, 0.0, 1.0))
    edge = np.cos(turn) + 0.22 * fur
    ghost = smooth(0.72, 1.0, -np.cos(turn) + 0.2 * fur)
    return np.maximum(smooth(level - 0.20, level + 0.24, edge), 0.26 * ghost)


def _body(p, n, wave, fur):
    x, y, z = p.T
    m = np.abs(x)
    color = over(np.broadcast_to(GROUND, p.shape), WARM, smooth(-0.5, 0.6, wave))
    color = over(color, PALE, 0.6 * smooth(0.30, -0.12, y) * smooth(0.62, 0.2, z))
    patchy = 0.12 * wave + 0.14 * solid(p, 404, 0.06)
    # Down the flanks: stripes across the line from the nape to the rump, a little bent forwards.
    back = 0.55 * y - 0.83 * z
    flank = _stripes((back - 0.35 * m) * 12.0, wave, fur, 0.42 - 0.8 * smooth(0.04, 0.3, -y) + patchy)
    # On the thighs: arcs around the knee.
    arc = length((mirrored(p) - np.array((0.20, -0.12, 0.06))) * np.array((0.7, 1.0, 1.0)))
    thigh = _stripes(arc * 13.0 + 0.25, wave, fur, 0.38 + patchy)
    on_thigh = smooth(0.035, -0.005, haunch(p) + 0.01 * wave)
    dark = flank + (thigh - flank) * on_thigh
    # Along the spine: one line.
    spine = smooth(0.030, 0.010, m + 0.006 * wave + 0.004 * fur)
    spine = spine * smooth(0.1, 0.45, n[:, 1] + 0.6 * n[:, 2]) * smooth(-0.05, 0.0, y)
    dark = np.maximum(dark, spine)
    # Bracelets on the front legs.
    leg = smooth(-0.10, -0.14, y) * smooth(0.40, 0.32, z)
    bars = _stripes(z * 15.0 + 0.8 * m, wave, fur, 0.32) * smooth(0.11, 0.15, z)
    dark = dark * (1.0 - leg) + leg * bars * smooth(-0.75, -0.2, np.abs(n[:, 0]) - 0.6)
    color = over(color, DARK, (0.84 + 0.1 * wave) * dark)
    # Bib, belly and socks.
    bib = np.sqrt((x / 0.108) ** 2 + ((z - 0.44) / 0.25) ** 2) + 0.05 * wave + 0.035 * fur
    white = smooth(1.06, 0.88, bib) * smooth(0.15, 0.45, -n[:, 1])
    belly = smooth(0.10, 0.03, m) * smooth(0.33, 0.25, z) * smooth(0.0, -0.06, y)
    socks = smooth(0.118, 0.095, z + 0.006 * wave + 0.004 * fur) * smooth(-0.13, -0.155, y + 0.25 * z)
    white = np.maximum(np.maximum(white, 0.8 * belly), socks)
    return over(color, WHITE, white) * _toes(p)[:, None]


def _toes(p):
    """Dark lines between the toes of front and hind paws."""
    m = np.abs(p[:, 0])
    dark = np.zeros(len(p))
    for middle, front in ((0.072, -0.262), (0.212, -0.198)):
        for side in (-0.020, 0.0, 0.020):
            line = smooth(0.0055, 0.0025, np.abs(m - middle - side))
            dark = np.maximum(
                dark, line * smooth(front + 0.022, front + 0.008, p[:, 1]) * smooth(0.072, 0.060, p[:, 2])
            )
    return 1.0 - 0.6 * dark


def _tail(p, n, wave, fur):
    place = tail(p)[1]
    color = over(np.broadcast_to(GROUND, p.shape), WARM, smooth(-0.5, 0.6, wave))
    rings = _stripes(place * 9.0 + 0.2, wave * 0.5, fur, 0.42)
    tip = smooth(0.87, 0.91, place + 0.01 * fur)
    return over(color, DARK, 0.9 * np.maximum(rings, tip))
