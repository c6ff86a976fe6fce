"""Closed loop of many flights at once: set-points, position loop, attitude loop, four rotors, rigid body, air, battery, estimator."""
import numpy as np

from air import Gusts
from vehicle import (AUTHORITY, FEEDBACK_DELAY, G, HOVER, KD, KP, LATENCY, MASS, MAX_THRUST, SIDE, actuator_step, command_of, gains, share_of)

DT = 0.004  # s
LOG = 5  # steps a row of the log
SETTLE = 1000  # steps in the first hover before the log begins
CORD = 0.22  # m, of a slung load
UP = np.array([0.0, 0.0, 1.0])


def rotation(q):
    """(n, 3, 3) of unit quaternions (n, 4), w first."""
    w, x, y, z = q.T
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    return np.stack(rows, -1).reshape(-1, 3, 3)


def cross(a, b):
    """Of rows (n, 3); np.cross takes ten times as long."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], 1)


def turned(q, rate, dt):
    """q after turning at `rate` (body) for dt."""
    w, v = q[:, :1], q[:, 1:]
    half = 0.5 * dt * rate
    step = np.concatenate([w - (v * half).sum(1, keepdims=True), v + w * half + cross(v, half)], 1)
    return step / np.sqrt((step * step).sum(1, keepdims=True))


def attitude_error(R, force, yaw):
    """Body vector (n, 3) that turns R to the attitude whose thrust lies along `force` at this yaw."""
    z = force / np.sqrt((force * force).sum(1, keepdims=True))
    ahead = np.stack([np.cos(yaw), np.sin(yaw), 0 * yaw], 1)
    y = cross(z, ahead)
    y /= np.sqrt((y * y).sum(1, keepdims=True))
    M = np.einsum("nji,njk->nik", R, np.stack([cross(y, z), y, z], 2))
    return 0.5 * np.stack([M[:, 2, 1] - M[:, 1, 2], M[:, 0, 2] - M[:, 2, 0], M[:, 1, 0] - M[:, 0, 1]], 1)


class Draws:
    """Normal (n, 9) and uniform (n, 1) numbers of each step, drawn world by world: a world does not depend on what is simulated beside it."""

    def __init__(self, generators, flights):
        self.generators, self.flights, self.block = generators, flights, []

    def step(self):
        if not self.block:
            normals = np.concatenate([g.standard_normal((500, self.flights, 9)) for g in self.generators], 1)
            uniforms = np.concatenate([g.random((500, self.flights, 1)) for g in self.generators], 1)
            self.block = list(zip(normals[::-1], uniforms[::-1]))
        return self.block.pop()


class Battery:
    """Four cells: open voltage by charge, an inner resistance, and one that recovers in 15 s."""

    def __init__(self, charge):
        self.charge, self.slow = charge, np.zeros_like(charge)

    def step(self, power, dt):
        """Terminal voltage under `power` (1 in hover, shape (n,))."""
        current = 18.0 * power
        self.charge = self.charge - current * dt / 5400.0
        self.slow += dt / 15.0 * (0.022 * current - self.slow)
        return 4 * (3.45 + 0.72 * self.charge) - 0.024 * current - self.slow


class Estimator:
    """Position and velocity that the loop has: errors of first order, and late by the feedback's delay."""

    def __init__(self, n):
        self.p, self.v = np.zeros((n, 3)), np.zeros((n, 3))
        self.late = [None] * (round(FEEDBACK_DELAY / DT) + 1)

    def step(self, p, v, normal):
        """(now, as the loop has it): pairs of position and velocity."""
        self.p += -DT / 8.0 * self.p + 0.004 * np.sqrt(2 * DT / 8.0) * normal[:, :3]
        self.v += -DT / 0.15 * self.v + 0.01 * np.sqrt(2 * DT / 0.15) * normal[:, 3:]
        now = (p + self.p, v + self.v)
        self.late = self.late[1:] + [now]
        return now, self.late[0] or now


class Flights:
    """State of all flights, one step at a time. `c` holds one array (n,) per constant of effects.NEUTRAL, `own` what differs by flight and craft."""

    def __init__(self, c, own, start, yaw, rooms):
        n = len(yaw)
        self.c, self.own, self.rooms = c, own, rooms
        self.size = np.empty((n, 3))
        for room, members in rooms:
            self.size[members] = room.count * 0.1
        self.p, self.v, self.a = start.copy(), np.zeros((n, 3)), np.zeros((n, 3))
        self.q = np.stack([np.cos(yaw / 2), 0 * yaw, 0 * yaw, np.sin(yaw / 2)], 1)
        self.R = rotation(self.q)
        self.rate, self.trim = np.zeros((n, 3)), np.zeros((n, 3))
        self.spin, self.spun = np.full((n, 4), HOVER), np.zeros((n, 4))
        self.step_of, self.gain_of = (m[:, None] for m in actuator_step(c["rotor_frequency"], DT))
        self.gains = gains(c["tilt"], c["tilt_rate"])
        self.load, self.swing = np.zeros((n, 2)), np.zeros((n, 2))
        self.gusts, self.battery, self.estimator = Gusts(c["shots"], DT), Battery(own["charge"]), Estimator(n)
        self.volts, self.t = np.full(n, 15.6), 0.0
        axis = np.stack([c["skew_x"], c["skew_y"], np.ones(n)], 1)
        self.axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)

    def control(self, command, normal):
        """Rotor commands for the set-point `command` (n, 10); keeps what the log needs."""
        self.seen, (p, v) = self.estimator.step(self.p, self.v, normal)
        wanted = command[:, 6:9] + KP * (command[:, :3] - p) + KD * (command[:, 3:6] - v)
        force = np.clip(wanted, -6, 6) + G * UP
        share = np.clip(MASS * (force * self.R[:, :, 2]).sum(1) / MAX_THRUST, 0.05, 0.95)
        error = self.gains[0] * attitude_error(self.R, force, command[:, 9]) - self.rate
        self.trim += self.gains[2] * error * DT
        torque = (self.gains[1] * error + self.trim) / AUTHORITY
        self.collective = command_of(share)
        self.motors = np.clip(command_of(share[:, None] + torque @ SIDE.T / 4), 0, 1)

    def rotors(self):
        """Thrust shares of the four rotors (n, 4) after one step of their actuators."""
        volts = (self.volts / 15.6) ** self.c["sag"]
        target = share_of(self.motors, self.c["curve"][:, None]) * volts[:, None]
        s, g = self.step_of, self.gain_of
        spin = s[..., 0] * self.spin + s[..., 1] * self.spun + g[..., 0] * target
        self.spun = s[..., 2] * self.spin + s[..., 3] * self.spun + g[..., 1] * target
        self.spin = spin
        self.volts = self.battery.step((np.maximum(self.spin, 0) ** 1.5).mean(1) / HOVER**1.5, DT)
        return self.spin * self.own["thrust"]

    def air(self, share, normal, uniform, begun):
        """Acceleration (n, 3) by the air: gusts of the field's variance, and what the effect adds."""
        c, z = self.c, self.p[:, 2]
        if begun % (2 * LOG) == 0:
            places = self.p + np.stack([c["offset_x"], c["offset_y"], 0 * z], 1)
            variance = np.empty_like(places)
            for room, members in self.rooms:
                variance[members] = room.at(places[members])
            more = (1 + c["growth"] * self.t**2 / (self.t**2 + 1600)) * (1 + c["speed_variance"] * (self.v**2).sum(1))
            self.deviation = np.sqrt(variance * (self.own["strength"] * more)[:, None])
        air = self.deviation * self.gusts.step(normal, uniform)
        gap = np.maximum(self.size[:, 2] - z, 0.1)
        near = np.maximum(self.p[:, :2], 0.2), np.maximum(self.size[:, :2] - self.p[:, :2], 0.2)
        air[:, :2] += c["wall"][:, None] * ((0.4 / near[1]) ** 2 - (0.4 / near[0]) ** 2)
        turbulence = 1 + 0.3 * np.sin(2 * np.pi * self.t / 13 + self.own["phase"][:, 0])
        air[:, 0] += c["push_x"] * turbulence
        air[:, 1] += c["push_y"] * turbulence
        lift = share * MAX_THRUST / MASS * (1 / (1 - np.minimum(c["ground_radius"] / (4 * np.maximum(z, 0.15)), 0.8) ** 2) - 1)
        air[:, 2] += lift + c["ceiling"] / (1 + (gap / c["ceiling_range"]) ** 2) ** 1.5 - c["tether"] * G * z
        jet = c["plume"] * np.exp(-0.5 * (((self.p - self.size * [0.4, 0.6, 0.5]) / 0.5) ** 2).sum(1))
        air[:, 0] += jet * np.cos(c["plume_heading"])
        air[:, 1] += jet * np.sin(c["plume_heading"])
        return air + self.other_pushes()

    def other_pushes(self):
        """Acceleration (n, 3) by what no catalogue has, and by another ground."""
        c, beside = self.c, self.p - self.size * 0.5
        yaw = np.arctan2(self.R[:, 1, 0], self.R[:, 0, 0])
        along = c["surge"] * np.sin(2 * np.pi * c["surge_rate"] * self.t) + c["thirds"] * np.cos(3 * yaw) + c["onset"] * (self.t > 30)
        return np.stack([along, c["saddle"] * beside[:, 0] * beside[:, 2], c["cushion"] * np.exp(-((self.p[:, 2] / 0.4) ** 2))], 1)

    def drag(self, share):
        """Of the rotors, by velocity: flapping and induced in their plane, the loss in climb along their axis."""
        c, up = self.c, self.R[:, :, 2]
        along = (self.v * up).sum(1, keepdims=True)
        across = self.v - along * up
        speed = (across * across).sum(1)
        in_plane = c["flapping"] * share / HOVER + c["induced"] / np.sqrt(1 + speed / 0.64)
        return -in_plane[:, None] * across - (c["climb"][:, None] * along / (1 + np.abs(along) / 2)) * up

    def slung(self):
        """Force of the load's cord over the vehicle's mass."""
        mass = self.c["slung"][:, None]
        tension = np.maximum(G + self.a[:, 2:], 2.0)
        self.swing += DT * (-tension / CORD * self.load - self.a[:, :2] - 0.4 * self.swing)
        self.load += DT * self.swing
        lean = np.clip(self.load / CORD, -0.6, 0.6)
        down = np.sqrt(1 - 0.999 * np.minimum((lean * lean).sum(1, keepdims=True), 1))
        return mass * tension * np.concatenate([lean, -down], 1)

    def step(self, command, draws, begun):
        """One step of DT under the set-point that has arrived."""
        normal, uniform = draws
        self.control(command, normal[:, 3:])
        thrusts = self.rotors()
        share = thrusts.mean(1)
        force = (share * MAX_THRUST / (MASS * (1 + self.c["mass"] + self.c["weight"])))[:, None] * np.einsum("nij,nj->ni", self.R, self.axis)
        self.a = force - G * UP + self.air(share, normal[:, :3], uniform, begun) + self.drag(share) + self.slung()
        self.row = dict(p=self.seen[0], v=self.seen[1], q=self.q, specific=np.einsum("nji,nj->ni", self.R, self.a + G * UP), thrust=self.collective,
                        motors=self.motors, spin=self.spin, volts=self.volts)
        torque = thrusts * self.own["torque"]
        turn = np.stack([thrusts @ SIDE[:, 0], thrusts @ SIDE[:, 1], torque @ SIDE[:, 2]], 1) * AUTHORITY
        turn[:, :2] -= (4 * HOVER * self.c["weight"])[:, None] * SIDE[self.c["weighted"].astype(int), :2] * AUTHORITY[:2]
        self.v = self.v + DT * self.a
        self.p = self.p + DT * self.v
        self.rate = self.rate + DT * turn
        self.q = turned(self.q, self.rate, DT)
        self.R = rotation(self.q)
        self.t = max(0.0, (begun - SETTLE) * DT)


def arrivals(generator, c, rows, steps):
    """Index (flights, steps) of the newest set-point that has arrived: each is late by the latency, and never overtakes."""
    index = np.empty((len(c["late"]), steps), dtype=np.int32)
    now = (np.arange(steps) - SETTLE) * DT
    for f, (late, jitter) in enumerate(zip(c["late"], c["jitter"])):
        arrival = np.arange(rows) * DT * LOG + LATENCY + late + jitter * generator.standard_normal(rows).clip(-2, 2)
        index[f] = np.clip(np.searchsorted(np.maximum.accumulate(arrival), now + 1e-9, side="right") - 1, 0, rows - 1)
    return index


def fly(c, own, plans, rooms, generators):
    """Records of all flights at 50 Hz: dictionary of (rows, flights, ...).

    `plans` (flights, rows, 10): set-points p, v, a, yaw. `rooms`: pairs of a Field and the flights in it.
    """
    rows = plans.shape[1]
    steps = SETTLE + (rows - 1) * LOG + 1
    count = len(plans) // len(generators)
    late = [{k: c[k][i * count:(i + 1) * count] for k in ("late", "jitter")} for i in range(len(generators))]
    index = np.concatenate([arrivals(g, own_late, rows, steps) for g, own_late in zip(generators, late)])
    flights = Flights(c, own, plans[:, 0, :3], plans[:, 0, 9], rooms)
    draws, every, record = Draws(generators, count), np.arange(len(plans)), []
    for k in range(steps):
        flights.step(plans[every, index[:, k]], draws.step(), k)
        if k >= SETTLE and (k - SETTLE) % LOG == 0:
            record.append({name: value.astype(np.float32) for name, value in flights.row.items()})
    return {name: np.stack([row[name] for row in record]) for name in record[0]}
