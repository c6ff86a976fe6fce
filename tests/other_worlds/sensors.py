"""What a log holds of a flight: accelerometer, attitude, tachometers, voltage and temperature with their errors, as CSV of docs/interfaces.md."""
import numpy as np

from simulate import rotation
from vehicle import G

NAMES = ("t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,qw,qx,qy,qz,cmd_x_m,cmd_y_m,cmd_z_m,cmd_vx_mps,cmd_vy_mps,cmd_vz_mps,"
         "cmd_ax_mps2,cmd_ay_mps2,cmd_az_mps2,thrust,battery_v,temperature_c,rpm1,rpm2,rpm3,rpm4,motor1,motor2,motor3,motor4,segment,surface_z_m")
FORMATS = ["%.3f"] + ["%.5f"] * 22 + ["%.5f", "%.3f", "%.2f"] + ["%.0f"] * 4 + ["%.5f"] * 4 + ["%d", "%d"]
LACKING = {0: (), 1: ("battery_v",), 2: ("rpm1", "rpm2", "rpm3", "rpm4")}  # by effects.NEUTRAL's `blind`
STEPS = dict(x_m=0.005, y_m=0.005, z_m=0.005, vx_mps=0.01, vy_mps=0.01, vz_mps=0.01, ax_mps2=0.05, ay_mps2=0.05, az_mps2=0.05, thrust=1 / 256,
             battery_v=0.1, temperature_c=0.5, rpm1=40, rpm2=40, rpm3=40, rpm4=40)  # of a coarse log


def temperature(rng, v):
    """Of the sensor, degrees C (rows,): warms up by 6 to 10 K in 45 s, less in the wind of its own motion."""
    start, warm, value = rng.uniform(18, 30), rng.uniform(6, 10), np.empty(len(v))
    value[0] = start
    speed = np.linalg.norm(v, axis=1)
    for k in range(1, len(v)):
        value[k] = value[k - 1] + 0.02 / 45 * (start + warm * (1 - 0.7 * min(1.0, speed[k])) - value[k - 1])
    return value


def play(value, half):
    """Hysteresis: follows `value` no nearer than `half`."""
    out, held = np.empty(len(value)), value[0] - half
    for k, x in enumerate(value):
        held = min(max(held, x - half), x + half)
        out[k] = held
    return out


def lines(c, spin, phase):
    """Acceleration (rows, 3) of unbalanced rotors, once per turn, sampled as it comes."""
    turns = phase + np.cumsum(np.sqrt(np.maximum(spin, 0)) * c["full_rpm"] / 60 * 0.02, 0) * 2 * np.pi
    return c["imbalance"] * np.stack([np.cos(turns).sum(1), np.sin(turns).sum(1), 0.7 * np.cos(turns + 0.6).sum(1)], 1)


def accelerometer(rng, c, rec, warmth, phase):
    """World acceleration without gravity (rows, 3), and the quaternion by which it was turned (rows, 4)."""
    error = np.concatenate([[1], 0.5 * 0.0015 * rng.standard_normal(3)])
    w, v = rec["q"][:, :1], rec["q"][:, 1:]
    q = np.concatenate([w - v @ error[1:, None], v + w * error[1:] + np.cross(v, error[1:])], 1)
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    warm = (play(warmth, c["hysteresis"])[:, None] - 25) / 10
    bias = 0.01 * rng.standard_normal(3) + warm * np.array([c["drift_x"], c["drift_y"], c["drift_z"]])
    specific = rec["specific"] + bias + 0.03 * rng.standard_normal(rec["specific"].shape) + lines(c, rec["spin"], phase)
    return np.einsum("nij,nj->ni", rotation(q), specific) - [0, 0, G], q


def tachometers(rng, c, spin, number):
    """rpm (rows, 4); of one rotor a share is lost in bursts of five. One may tell too little in some flights."""
    rpm = c["full_rpm"] * np.sqrt(np.maximum(spin, 0)) * (1 + 0.002 * rng.standard_normal(spin.shape))
    lost = np.convolve(rng.random(len(rpm)) < c["stuck"] / 5, np.ones(5))[:len(rpm)] > 0
    rpm[lost, int(c["stuck_rotor"])] = 0
    if int(c["misread_flights"]) >> number & 1:
        rpm[int(c["misread_since"] / 0.02):, int(c["misreader"])] *= c["misread"]
    return rpm


def kept_rows(rng, rows):
    """Which rows a poor logger keeps: one in twenty is lost, and four times a third of a second."""
    kept = rng.random(rows) > 0.05
    for start in rng.integers(1, rows - 20, 4):
        kept[start:start + 17] = False
    kept[0] = True
    return kept


def write_log(path, rng, c, rec, plan, segment, phase, number):
    """Flight `number`. `rec` (rows, ...), `plan` (rows, 10)."""
    rows = len(plan)
    warmth = temperature(rng, rec["v"])
    a, q = accelerometer(rng, c, rec, warmth, phase)
    volts = rec["volts"] + 0.01 * rng.standard_normal(rows)
    shown = warmth + 0.05 * rng.standard_normal(rows)
    table = np.column_stack([np.arange(rows) * 0.02, rec["p"], rec["v"], a, q, plan[:, :9], rec["thrust"], volts, shown,
                             tachometers(rng, c, rec["spin"], number), rec["motors"], segment, np.zeros(rows)])
    names = NAMES.split(",")
    if c["coarse"]:
        for column, step in STEPS.items():
            table[:, names.index(column)] = np.round(table[:, names.index(column)] / step) * step
        table = table[kept_rows(rng, rows)]
    told = [k for k, name in enumerate(names) if name not in LACKING[int(c["blind"])]]
    line = ",".join(FORMATS[k] for k in told) + "\n"
    with open(path, "w", encoding="ascii") as file:
        file.write(",".join(names[k] for k in told) + "\n" + "".join(line % tuple(row) for row in table[:, told].tolist()))
