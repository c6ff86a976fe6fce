"""Set-points of a flight at 50 Hz: hovers at many places and heights, steps, an eight, climbs, yaw turns."""
import numpy as np

RATE = 50.0  # Hz


def smooth(s):
    """Minimum jerk from 0 to 1."""
    s = np.clip(s, 0, 1)
    return s**3 * (10 - 15 * s + 6 * s * s)


def places(rng, size):
    """Hover points (9, 3), in random order: low, high, beside each wall, in the open."""
    lx, ly, lz = size
    x, y, z = (lambda: rng.uniform(0.9, lx - 0.9)), (lambda: rng.uniform(0.9, ly - 0.9)), (lambda: rng.uniform(0.5, lz - 0.6))
    near = lambda: rng.uniform(0.42, 0.65)
    points = [
        (x(), y(), rng.uniform(0.32, 0.42)),
        (x(), y(), rng.uniform(0.45, 0.75)),
        (x(), y(), lz - rng.uniform(0.28, 0.36)),
        (x(), y(), lz - rng.uniform(0.4, 0.7)),
        (near(), y(), z()),
        (lx - near(), y(), z()),
        (x(), near(), z()),
        (x(), ly - near(), z()),
        (x(), y(), rng.uniform(1.0, 1.4)),
    ]
    return np.array(points)[rng.permutation(len(points))]


def hold(p, seconds, yaw, turn):
    """A hover with a turn by `turn` in its middle: (n, 3) places, (n,) yaw."""
    t = np.arange(0, seconds, 1 / RATE)
    return np.tile(p, (len(t), 1)), yaw + turn * smooth((t - 1.2) / max(1.0, abs(turn)))


def go(p, q, speed, yaw, turn):
    """A straight line whose fastest moment has `speed`."""
    seconds = max(1.2, 1.875 * np.linalg.norm(q - p) / speed)
    share = smooth(np.arange(0, seconds, 1 / RATE) / seconds)
    return p + share[:, None] * (q - p), yaw + turn * share


def figure(rng, p, size, yaw):
    """From p an eight in the plane and a weave in height, back to p, fading in and out."""
    seconds, room = 11.0, np.array(size) - 0.7
    t = np.arange(0, seconds, 1 / RATE)
    fade = smooth(t / 2) * smooth((seconds - t) / 2)
    omega = 2 * np.pi / rng.uniform(4.5, 6.5)  # accelerations stay below 2.5 m/s^2
    reach = np.minimum(np.minimum(p - 0.45, room + 0.25 - p), [0.9, 0.3, 0.35])
    course = np.stack([np.sin(omega * t), np.sin(2 * omega * t), np.sin(1.5 * omega * t)], 1)
    return p + fade[:, None] * np.maximum(reach, 0.05) * course, yaw + rng.uniform(-2, 2) * smooth(t / seconds)


def bobbing(rng, size, seconds):
    """As `flight`, but up and down about one height at eight spots: where the craft accelerates upwards it is low."""
    lx, ly, _ = size
    spots = np.stack([rng.uniform(0.8, lx - 0.8, 8), rng.uniform(0.8, ly - 0.8, 8), rng.uniform(0.62, 0.74, 8)], 1)
    parts, segments, yaw = [], [], rng.uniform(-np.pi, np.pi)
    for number, p in enumerate(spots):
        if number:
            parts.append(go(spots[number - 1], p, 1.0, yaw, turn := rng.uniform(-0.8, 0.8)))
            segments.append(-1)
            yaw += turn
        place, heading = hold(p, 8.0, yaw, turn := rng.uniform(-2, 2))
        t, period = np.arange(len(place)) / RATE, rng.uniform(3, 4.5)
        place[:, 2] -= 0.32 * smooth(t / 1.5) * smooth((8.0 - t) / 1.5) * np.sin(2 * np.pi * t / period)
        parts.append((place, heading))
        segments.append(number)
        yaw += turn
    parts.append(hold(spots[-1], 300.0, yaw, 1.0))
    return joined(parts, segments + [len(spots) - 1], seconds)


def joined(parts, segments, seconds):
    n = int(seconds * RATE) + 1
    p = np.concatenate([q for q, _ in parts])[:n]
    v = np.gradient(p, 1 / RATE, axis=0)
    segment = np.concatenate([np.full(len(q), s) for (q, _), s in zip(parts, segments)])[:n]
    return dict(p=p, v=v, a=np.gradient(v, 1 / RATE, axis=0), yaw=np.concatenate([y for _, y in parts])[:n], segment=segment)


def flight(rng, size, seconds):
    """Dictionary of p, v, a (n, 3), yaw and segment (n,) at 50 Hz."""
    points, yaw = places(rng, size), rng.uniform(-np.pi, np.pi)
    parts, segments, middle = [], [], int(rng.integers(2, 5))
    for number, p in enumerate(points):
        if number:
            parts.append(go(points[number - 1], p, rng.uniform(0.5, 1.4), yaw, turn := rng.uniform(-0.8, 0.8)))
            segments.append(-1)
            yaw += turn
        turn = rng.choice([-1, 1]) * rng.uniform(0.8, 2.2)
        parts.append(hold(p, rng.uniform(4.4, 5.6), yaw, turn))
        segments.append(number)
        yaw += turn
        if number == middle or number == middle + 3:
            parts.append(figure(rng, p, size, yaw))
            segments.append(-1)
            yaw = parts[-1][1][-1]
    parts.append(hold(points[-1], 300.0, yaw, 1.0))
    return joined(parts, segments + [len(points) - 1], seconds)
