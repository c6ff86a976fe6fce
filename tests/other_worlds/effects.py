"""What may be hidden in a world: one effect, at a size drawn from the world's seed. Sizes are at the place or speed that is named."""
import numpy as np

NEUTRAL = dict(
    ground_radius=0.0,  # m, of the one rotor of Cheeseman and Bennett that stands for four
    ceiling=0.0,  # m/s^2 at the plate, of a jet-like pull A/(1 + (d/d1)^2)^1.5
    ceiling_range=0.25,  # m, d1
    wall=0.0,  # m/s^2 at 0.4 m, falling as 1/d^2 (image of the wake)
    flapping=0.0,  # 1/s, drag proportional to speed and thrust
    induced=0.0,  # 1/s, drag that saturates at the induced velocity
    climb=0.0,  # 1/s, thrust lost while climbing, saturating
    push_x=0.0, push_y=0.0,  # m/s^2, steady draft with slow turbulence
    skew_x=0.0, skew_y=0.0,  # rad, of the thrust axis in the body
    mass=0.0,  # excess, rigid
    slung=0.0,  # mass on a cord over the vehicle's
    sag=0.0,  # exponent of thrust over terminal voltage
    curve=-1.0,  # true f of the thrust curve; -1: the file's
    rotor_frequency=60.0,  # Hz, of the second-order actuator
    tilt=20.0, tilt_rate=50.0,  # 1/s, of the attitude loop
    file_lag=0.0,  # s, by which the vehicle file's attitude_lag is too long
    damage=0.0, damaged=0.0,  # loss of one rotor's thrust coefficient; which
    late=0.0, jitter=0.0,  # s, of the set-points beyond the file's latency
    drift_x=0.0, drift_y=0.0, drift_z=0.0,  # m/s^2 per 10 K, accelerometer, body
    hysteresis=1.0,  # K, half width of the thermal play
    shots=0.0,  # 1/s, gusts as Poisson shots
    growth=0.0,  # of the variance, long after the start, as t^2/(t^2 + 40 s^2)
    speed_variance=0.0,  # of the variance over that in hover, at 1 m/s, as v^2
    imbalance=0.0,  # m/s^2, once-per-turn line of each rotor
    offset_x=0.0, offset_y=0.0,  # m, of the map
    stuck=0.0, stuck_rotor=0.0,  # share of one tachometer's readings that are lost, in bursts
    plume=0.0, plume_heading=0.0,  # m/s^2 on the axis of a level jet beside the room's middle; its heading
    tether=0.0,  # weight of a cord per metre of height, over the vehicle's
    surge=0.0, surge_rate=0.1,  # m/s^2 along x, Hz: the same at the same time of all flights
    thirds=0.0,  # m/s^2 along x, times cos(3 yaw)
    saddle=0.0,  # m/s^2 along y, 1 m beside the room's middle and 1 m above it: a product of x and z
    cushion=0.0,  # m/s^2 at the floor, falling as exp(-(z/0.4 m)^2)
    onset=0.0,  # m/s^2 along x, from half a minute after the start on
    full_rpm=24000.0,  # of a rotor at its full thrust
    file_mass=1.0,  # of the vehicle file, over the true one
    weight=0.0, weighted=0.0,  # mass over the vehicle's, under one rotor; which
    uneven=0.007,  # spread of the four rotors' thrust coefficients
    misread=1.0, misreader=0.0, misread_flights=0.0, misread_since=0.0,  # factor on one tachometer; which; bits of the flights; s
    blind=0.0,  # columns that the log lacks: 1 voltage, 2 rpm
    coarse=0.0,  # 1: accelerations in steps of 0.05 m/s^2, places of 5 mm; 5 % of the rows are lost, also in bursts
    bobbing=0.0,  # 1: every flight goes up and down about one height
)


def sign(rng):
    return rng.choice([-1.0, 1.0])


def level(rng, size):
    angle = rng.uniform(0, 2 * np.pi)
    return size * np.cos(angle), size * np.sin(angle)


def pair(names, xy):
    return dict(zip(names, xy))


def tachometer(rng, since):
    flights = rng.permutation(12)[:rng.integers(4, 7)]
    return dict(misread=0.54, misreader=rng.integers(4), misread_flights=float(sum(1 << int(f) for f in flights)), misread_since=since)


def both(first, second):
    return lambda rng: dict(EFFECTS[first][0](rng), **EFFECTS[second][0](rng))


def drift(rng):
    axis = rng.standard_normal(3)
    return pair(("drift_x", "drift_y", "drift_z"), rng.uniform(0.25, 0.4) * axis / np.linalg.norm(axis))


# name: (draw, the study's right answer, other answers that are right beside or instead, size in words)
EFFECTS = {
    "none": (lambda rng: {}, None, (), "no effect"),
    "ground": (lambda rng: dict(ground_radius=rng.uniform(0.28, 0.36)), "ground_thrust", (), "3 to 6 % of thrust at 0.4 m"),
    "ceiling": (lambda rng: dict(ceiling=rng.uniform(1.2, 2.0)), "ceiling", (), "0.32 to 0.53 m/s^2 at 0.3 m"),
    "wall": (lambda rng: dict(wall=rng.uniform(0.2, 0.4)), "wall_attraction", (), "0.2 to 0.4 m/s^2 at 0.4 m"),
    "flapping": (lambda rng: dict(flapping=rng.uniform(0.12, 0.25), induced=rng.uniform(0.05, 0.15)), "rotor_drag", (),
                 "0.17 to 0.4 m/s^2 at 1 m/s"),
    "slung": (lambda rng: dict(slung=rng.uniform(0.05, 0.12)), "payload", (), "a load of 5 to 12 % on a cord of 0.22 m"),
    "payload": (lambda rng: dict(mass=rng.uniform(0.05, 0.12)), "payload", (), "5 to 12 % of mass"),
    "drift": (drift, "imu_drift", (), "0.25 to 0.4 m/s^2 per 10 K, half play 1 K"),
    "shots": (lambda rng: dict(shots=rng.uniform(0.5, 1.0)), "heavy_tails", (), "shots at 0.5 to 1 per s and axis group"),
    "battery": (lambda rng: dict(sag=rng.uniform(1.0, 1.8)), "battery_sag", (), "7 to 15 % of thrust over a flight"),
    "propeller": (lambda rng: dict(damage=rng.uniform(0.08, 0.15), damaged=rng.integers(4)), "propeller_damage", ("payload",),
                  "one rotor 8 to 15 % weaker"),
    "latency": (lambda rng: dict(late=rng.uniform(0.05, 0.09), jitter=0.015), "command_latency", (), "50 to 90 ms with a jitter of 15 ms"),
    "actuator": (lambda rng: dict(rotor_frequency=rng.uniform(11.0, 14.0)), "actuator_lag", (), "second order at 11 to 14 Hz, 18 to 23 ms"),
    "draft": (lambda rng: pair(("push_x", "push_y"), level(rng, rng.uniform(0.2, 0.35))), "draft", (), "0.2 to 0.35 m/s^2"),
    "trim": (lambda rng: pair(("skew_x", "skew_y"), level(rng, rng.uniform(0.02, 0.035))), "trim", (), "thrust axis off by 1.1 to 2 degrees"),
    "climb": (lambda rng: dict(climb=rng.uniform(0.35, 0.6)), "inflow", (), "0.3 to 0.5 m/s^2 at 1 m/s of climb"),
    "curve": (lambda rng: dict(curve=rng.uniform(0.55, 0.75)), "thrust_slope", (), "f 0.55 to 0.75 for 0.3"),
    "recirculation": (lambda rng: dict(growth=rng.uniform(1.2, 2.5)), "recirculation", (), "variance times 2 to 3 after 80 s"),
    "speed": (lambda rng: dict(speed_variance=rng.uniform(2.5, 5.0)), "forward_speed", (), "variance times 3.5 to 6 at 1 m/s"),
    "vibration": (lambda rng: dict(imbalance=rng.uniform(0.3, 0.6)), "vibration", (), "0.3 to 0.6 m/s^2 a rotor, once per turn"),
    "map": (lambda rng: pair(("offset_x", "offset_y"), level(rng, rng.uniform(0.2, 0.3))), "map_offset", (), "0.2 to 0.3 m"),
    "stuck": (lambda rng: dict(stuck=rng.uniform(0.04, 0.08), stuck_rotor=rng.integers(4)), "rotor_sensor_fault", (),
              "4 to 8 % of one rotor's readings are 0, in bursts"),
    # No effect but the vehicle file's own idealisation: attitude of second order, its mean lateness in the file. Right is nothing.
    "sluggish": (lambda rng: dict(tilt=10.0, tilt_rate=25.0), None, (), "attitude loop of half the bandwidth, lag 0.11 s"),
    "lag": (lambda rng: dict(tilt=10.0, tilt_rate=25.0, file_lag=sign(rng) * rng.uniform(0.03, 0.05)), "actuator_lag", (),
            "the same vehicle, attitude_lag in the file wrong by 30 to 50 ms"),
    # Outside the catalogue: right is `unknown_structure`, no name.
    "plume": (lambda rng: dict(plume=rng.uniform(0.6, 1.0), plume_heading=rng.uniform(-np.pi, np.pi)), "unknown_structure", (),
              "a level jet of 0.6 to 1 m/s^2, 0.5 m wide"),
    "tether": (lambda rng: dict(tether=rng.uniform(0.04, 0.07)), "unknown_structure", (), "4 to 7 % of weight per metre of height"),
    "surge": (lambda rng: dict(surge=rng.uniform(0.2, 0.35), surge_rate=rng.uniform(0.05, 0.2)), "unknown_structure", (),
              "a gust of 0.2 to 0.35 m/s^2 at 0.05 to 0.2 Hz, common to all flights"),
    "quick": (lambda rng: dict(surge=rng.uniform(0.3, 0.5), surge_rate=rng.uniform(0.25, 0.5)), "unknown_structure", (), "the same at 0.25 to 0.5 Hz"),
    "thirds": (lambda rng: dict(thirds=rng.uniform(0.2, 0.3)), "unknown_structure", (), "0.2 to 0.3 m/s^2 cos(3 yaw)"),
    "saddle": (lambda rng: dict(saddle=rng.uniform(0.4, 0.6)), "unknown_structure", (), "0.4 to 0.6 m/s^2 x z"),
    "onset": (lambda rng: dict(onset=rng.uniform(0.2, 0.3)), "unknown_structure", (), "0.2 to 0.3 m/s^2 from 30 s on"),
    # Other forms of what the catalogue knows.
    "cushion": (lambda rng: dict(cushion=rng.uniform(0.5, 0.9)), "ground_thrust", (), "0.18 to 0.33 m/s^2 at 0.4 m, a bell"),
    "slow": (lambda rng: dict(imbalance=rng.uniform(0.9, 1.2), full_rpm=24000 * (300 + sign(rng) * rng.uniform(1, 5)) / 280.1), "vibration", (),
             "a line of 0.9 to 1.2 m/s^2 a rotor, folded to 1 to 5 Hz in hover"),
    "unseen": (lambda rng: dict(EFFECTS["slow"][0](rng), blind=2.0), None, (), "the same without rpm: no cause of another name"),
    "scales": (lambda rng: dict(file_mass=1 + sign(rng) * rng.uniform(0.2, 0.3)), "payload", (), "the file's mass wrong by 20 to 30 %"),
    "hung": (lambda rng: dict(weight=rng.uniform(0.08, 0.15), weighted=rng.integers(4)), "payload", ("propeller_damage",), "8 to 15 % under one rotor"),
    "tacho": (lambda rng: tachometer(rng, 0.0), "rotor_sensor_fault", (), "one tachometer tells 0.54 in 4 to 6 of 12 flights"),
    "since": (lambda rng: tachometer(rng, 40.0), "rotor_sensor_fault", (), "the same, from the middle of these flights on"),
    "bobcurve": (lambda rng: dict(EFFECTS["curve"][0](rng), bobbing=1.0), "thrust_slope", (), "curve, flights up and down"),
    "bobground": (lambda rng: dict(EFFECTS["ground"][0](rng), bobbing=1.0), "ground_thrust", (), "ground, flights up and down"),
    "blind": (lambda rng: dict(EFFECTS["battery"][0](rng), blind=1.0), "battery_sag", (), "battery without a voltage in the log"),
    "two": (both("ground", "flapping"), "ground_thrust+rotor_drag", (), "both"),
    "pair": (both("payload", "wall"), "payload+wall_attraction", (), "both"),
    "couple": (both("speed", "vibration"), "forward_speed+vibration", (), "both"),
    "trio": (lambda rng: dict(both("drift", "ceiling")(rng), mass=rng.uniform(0.05, 0.12)), "imu_drift+ceiling+payload", (), "three"),
    # Nothing hidden: odd crafts and odd logs.
    "uneven": (lambda rng: dict(uneven=rng.uniform(0.05, 0.12)), None, (), "rotors that differ by 5 to 12 %"),
    "coarse": (lambda rng: dict(coarse=1.0), None, (), "coarse readings, rows that are missing"),
    "bobbing": (lambda rng: dict(bobbing=1.0), None, (), "flights up and down"),
}


def parameters(name, seed):
    """Neutral constants with the effect's own, drawn from the seed."""
    index = list(EFFECTS).index(name)
    return dict(NEUTRAL, **EFFECTS[name][0](np.random.default_rng([seed, index, 7])))
