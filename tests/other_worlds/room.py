"""A box room: its voxels as an OctoMap file, and the disturbance variance of docs/model.md section 2 in it.

The interior is [0, lx] x [0, ly] x [0, lz], one layer of occupied voxels around it, unknown beyond. A box is convex: every element is visible.
"""
import os
import struct

import numpy as np

EDGE = 0.1  # m, of a voxel
MODEL = {
    "base": (0.005, 0.007),  # horizontal, vertical, (m/s^2)^2
    "ground": dict(theta_max=1.0, l_max=1.8, l_footprint_max=4.0, h=0.012, z=0.022, k1h=0.04, k1z=0.10, k2=2.6),
    "corner": dict(phi_max=1.1, l_max=1.4, n=0.018, t=0.011, z=0.017),
    "wall": dict(theta_min=0.95, l_max=1.4, n=0.22, t=0.09, z=0.11, k2=2.2),
}
DIAGONAL = 0.22  # m, r0 of the ground term


def model_toml():
    """The model file of the flights, docs/interfaces.md."""
    g, c, w = MODEL["ground"], MODEL["corner"], MODEL["wall"]
    return f"""[base]
horizontal = {MODEL['base'][0]}
vertical = {MODEL['base'][1]}
[ground]
theta_max = {g['theta_max']}
l_max = {g['l_max']}
l_footprint_max = {g['l_footprint_max']}
lambda = {{ horizontal = {g['h']}, vertical = {g['z']} }}
k1 = {{ horizontal = {g['k1h']}, vertical = {g['k1z']} }}
k2 = {g['k2']}
[corner]
phi_max = {c['phi_max']}
l_max = {c['l_max']}
lambda = {{ normal = {c['n']}, tangential = {c['t']}, vertical = {c['z']} }}
[wall]
theta_min = {w['theta_min']}
l_max = {w['l_max']}
k1 = {{ normal = {w['n']}, tangential = {w['t']}, vertical = {w['z']} }}
k2 = {w['k2']}
[bound]
kappa = 3.0
tau_w = 0.15
"""


def ground(p, size):
    """Diagonal of the ground term (2-3) at points p (n, 3): (n, 3)."""
    g = MODEL["ground"]
    cx, cy = np.meshgrid((np.arange(round(size[0] / EDGE)) + 0.5) * EDGE, (np.arange(round(size[1] / EDGE)) + 0.5) * EDGE, indexing="ij")
    flat2 = (cx.ravel()[None] - p[:, :1]) ** 2 + (cy.ravel()[None] - p[:, 1:2]) ** 2
    l2 = np.maximum(flat2 + p[:, 2:] ** 2, EDGE**2 / 4)
    theta = np.arctan2(np.sqrt(flat2), p[:, 2:])
    seen = (theta <= g["theta_max"] + 1e-9) & (l2 <= g["l_max"] ** 2 + 1e-9)
    seen |= (flat2 <= DIAGONAL**2 + 1e-9) & (l2 <= g["l_footprint_max"] ** 2 + 1e-9)
    by_distance = EDGE**2 * np.where(seen, 1 / l2, 0).sum(1)
    by_gauss = EDGE**2 * np.where(seen, np.exp(-g["k2"] * l2), 0).sum(1)
    h = g["h"] * by_distance + g["k1h"] * by_gauss
    return np.stack([h, h, g["z"] * by_distance + g["k1z"] * by_gauss], 1)


def wall(across, along, z, length, height):
    """(normal, tangential, vertical) of the corner and wall terms (2-4, 2-5) of one wall at `across` m of it, (n, 3)."""
    c, w = MODEL["corner"], MODEL["wall"]
    s, k = np.meshgrid((np.arange(round(length / EDGE)) + 0.5) * EDGE, (np.arange(round(height / EDGE)) + 0.5) * EDGE, indexing="ij")
    if (near := across <= w["l_max"]).sum() < len(across):  # only these feel it
        total = np.zeros((len(across), 3))
        if near.any():
            total[near] = wall(across[near], along[near], z[near], length, height)
        return total
    flat2 = across[:, None] ** 2 + (s.ravel()[None] - along[:, None]) ** 2
    up = k.ravel()[None] - z[:, None]
    l2 = np.maximum(flat2 + up**2, EDGE**2 / 4)
    near = l2 <= w["l_max"] ** 2 + 1e-9
    theta = np.arctan2(np.sqrt(flat2), -up)
    direct = near & (theta >= w["theta_min"] - 1e-9) & (theta <= np.pi / 2 + 1e-9)
    direct = EDGE**2 * np.where(direct, np.exp(-w["k2"] * l2), 0).sum(1)
    phi = np.arctan2(np.sqrt(flat2), z[:, None])
    foot = near & (phi < c["phi_max"]) & (flat2 + z[:, None] ** 2 <= c["l_max"] ** 2 + 1e-9)
    foot = np.where(foot, (c["phi_max"] - phi) / np.maximum(flat2 + z[:, None] ** 6, (EDGE / 2) ** 6), 0).sum(1) * EDGE**2
    return np.stack([w[a] * direct + c[a] * foot for a in "ntz"], 1)


def variance(p, size):
    """Diagonal of Sigma at points p (n, 3) of a room of `size`, (m/s^2)^2; walls along the axes, so nothing couples."""
    total = np.array([MODEL["base"][0], MODEL["base"][0], MODEL["base"][1]]) + ground(p, size)
    for side in (0, 1):
        for far in (False, True):
            across = size[side] - p[:, side] if far else p[:, side]
            n, t, z = wall(across, p[:, 1 - side], p[:, 2], size[1 - side], size[2]).T
            total += np.stack([n, t, z] if side == 0 else [t, n, z], 1)
    return total


class Field:
    """Sigma's diagonal, stored at voxel centres, read between them by trilinear shares."""

    def __init__(self, size):
        self.count = np.round(np.array(size) / EDGE).astype(int)
        half = (self.count[:2] + 1) // 2
        axes = [(np.arange(n) + 0.5) * EDGE for n in (half[0], half[1], self.count[2])]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        values = np.concatenate([variance(part, size) for part in np.array_split(points, max(1, len(points) // 200))])
        quarter = values.reshape(half[0], half[1], self.count[2], 3)
        x = np.minimum(np.arange(self.count[0]), self.count[0] - 1 - np.arange(self.count[0]))
        y = np.minimum(np.arange(self.count[1]), self.count[1] - 1 - np.arange(self.count[1]))
        self.values = quarter[x][:, y]

    def at(self, p):
        """(n, 3) at p (n, 3)."""
        q = np.clip(p / EDGE - 0.5, 0, self.count - 1.001)
        low = q.astype(int)
        share = q - low
        total = np.zeros_like(p)
        for corner in range(8):
            bit = np.array([corner & 1, corner >> 1 & 1, corner >> 2])
            weight = np.prod(np.where(bit, share, 1 - share), 1)
            i, j, k = (low + bit).T
            total += weight[:, None] * self.values[i, j, k]
        return total


def write_octomap(path, size):
    """The room as a binary OctoMap file (.bt): free inside, one occupied layer around."""
    n = np.round(np.array(size) / EDGE).astype(int)
    i, j, k = (a.ravel() for a in np.meshgrid(*[np.arange(-1, m + 1) for m in n], indexing="ij"))
    inside = (i >= 0) & (i < n[0]) & (j >= 0) & (j < n[1]) & (k >= 0) & (k < n[2])
    level = {key: 1 if free else 2 for key, free in zip(zip((i + 32768).tolist(), (j + 32768).tolist(), (k + 32768).tolist()), inside.tolist())}
    levels = []
    for _ in range(16):
        parents = {}
        for (x, y, z), kind in level.items():
            parents.setdefault((x >> 1, y >> 1, z >> 1), [0] * 8)[(x & 1) | (y & 1) << 1 | (z & 1) << 2] = kind
        levels.append(parents)
        level = dict.fromkeys(parents, 3)
    out = bytearray()

    def write(depth, key):
        children = levels[depth][key]
        out.extend(struct.pack("<H", sum(kind << 2 * c for c, kind in enumerate(children))))
        for c, kind in enumerate(children):
            if kind == 3:
                write(depth - 1, (key[0] << 1 | c & 1, key[1] << 1 | c >> 1 & 1, key[2] << 1 | c >> 2))

    write(15, (0, 0, 0))
    count = 1 + sum(sum(1 for kind in children if kind) for parents in levels for children in parents.values())
    with open(path, "wb") as file:
        file.write(f"# Octomap OcTree binary file\nid OcTree\nsize {count}\nres {EDGE}\ndata\n".encode() + bytes(out))


def stored_field(size, folder):
    """Field of a room, kept in `folder` between runs."""
    path = os.path.join(folder, "field_%g_%g_%g.npy" % tuple(size))
    if os.path.exists(path):
        field = Field.__new__(Field)
        field.count = np.round(np.array(size) / EDGE).astype(int)
        field.values = np.load(path)
        return field
    field = Field(size)
    np.save(path, field.values)
    return field
