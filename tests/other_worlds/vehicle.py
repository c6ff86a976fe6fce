"""The vehicle: constants, thrust curve, attitude loop, vehicle file. Rotors go round: front left, rear left, rear right, front right."""
import numpy as np

G = 9.81
MASS = 1.1  # kg
MAX_THRUST = 22.0  # N
CURVE = 0.3  # f of T = max_thrust (f u^2 + (1 - f) u)
KP = np.array([7.0, 7.0, 9.0])  # 1/s^2
KD = np.array([4.5, 4.5, 5.5])  # 1/s
LATENCY = 0.028  # s: set-points arrive 12 ms before a row of the log. At 20 ms every row caught the rotors behind a fresh step of the command
FEEDBACK_DELAY = 0.008  # s
YAW = 5.0, 10.0, 6.0  # 1/s, rate asked for per rad of error; 1/s, acceleration per rate error; 1/s^2, its integral
TRIM = 12.0  # 1/s^2, integral of the tilt's rate error
HOVER = MASS * G / MAX_THRUST  # share of the full thrust
SIDE = np.array([[1, -1, 1], [1, 1, -1], [-1, 1, 1], [-1, -1, -1]])  # signs of roll, pitch, yaw torque of each rotor's thrust
AUTHORITY = np.array([77.0, 77.0, 7.3])  # rad/s^2 of a unit share of one rotor
DAMPING = 0.8  # of the actuator


def command_of(share):
    """Command u whose modelled thrust is `share` of the largest."""
    b = 1 - CURVE
    return (np.sqrt(b * b + 4 * CURVE * np.maximum(share, 0)) - b) / (2 * CURVE)


def share_of(u, f):
    """Thrust share of command u on a curve f that agrees with the file's in hover."""
    f = np.where(f < 0, CURVE, f)
    hover = command_of(HOVER)
    return HOVER * (f * u * u + (1 - f) * u) / (f * hover * hover + (1 - f) * hover)


def actuator_step(frequency, dt):
    """Exact step of a second-order actuator, state (value, rate): 2x2 transition and the input's (2,), for each flight (n,)."""
    w = 2 * np.pi * np.asarray(frequency)
    s, d = DAMPING * w, w * np.sqrt(1 - DAMPING**2)
    e, c, sn = np.exp(-s * dt), np.cos(d * dt), np.sin(d * dt)
    a = e * (c + s / d * sn)
    b = e * sn / d
    return np.stack([a, b, -w * w * b, e * (c - s / d * sn)], -1), np.stack([1 - a, w * w * b], -1)


def gains(tilt, rate):
    """(flights, 3) each: rate per attitude error, acceleration per rate error, its integral, about the body's axes."""
    columns = lambda level, yaw: np.stack([level, level, np.full_like(level, yaw)], 1)
    return columns(tilt, YAW[0]), columns(rate, YAW[1]), columns(np.full_like(tilt, TRIM), YAW[2])


def attitude_lag(frequency, tilt, damping):
    """Mean lateness of the tilt after a step of its set-point, s, with this actuator and these gains: what the vehicle file asks for."""
    dt, angle, rate, trim, value, speed, late = 0.0005, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    step, gain = actuator_step(frequency, dt)
    for _ in range(10000):
        error = tilt * (1 - angle) - rate
        trim += TRIM * error * dt
        wanted = damping * error + trim
        value, speed = step[0] * value + step[1] * speed + gain[0] * wanted, step[2] * value + step[3] * speed + gain[1] * wanted
        rate += value * dt
        angle += rate * dt
        late += (1 - angle) * dt
    if abs(1 - angle) > 0.01:
        raise ValueError("the attitude loop does not answer")
    return late


def vehicle_toml(c):
    """The vehicle file, docs/interfaces.md."""
    return f"""name = "other-6in"
[body]
radius = 0.19
diagonal_radius = 0.22
rotor_radius = 0.076
mass = {MASS * c["file_mass"]:.4f}
[controller]
kp = {{ horizontal = {KP[0]}, vertical = {KP[2]} }}
kd = {{ horizontal = {KD[0]}, vertical = {KD[2]} }}
latency = {LATENCY}
feedback_delay = {FEEDBACK_DELAY}
attitude_lag = {attitude_lag(c["rotor_frequency"], c["tilt"], c["tilt_rate"]) + c["file_lag"]:.4f}
[estimation]
position = 0.03
[propulsion]
max_thrust = {MAX_THRUST}
thr_mdl_fac = {CURVE}
[limits]
v_max = 1.6
a_max = 3.0
[initial_error]
position = 0.03
velocity = 0.06
"""
