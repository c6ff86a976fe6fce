#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How often the 90 % intervals of `backwash vehicle fit` hold the truth, of three flights each, by vehicles drawn at random.

vehicle_fit.py BACKWASH OUT [WORLDS [FIRST]]    a table by key; a line of JSON for each world goes to OUT/results.jsonl

Half of the worlds are of tests/other_worlds, which shares no line and no form with the fit: a rigid body whose attitude loop is of third
order behind second-order actuators, rotors that differ, a battery that sags, an estimator with errors, set-points that come with jitter,
gusts of another form. There `attitude_lag` is the mean lateness of the attitude, as docs/interfaces.md has it, and the thrust curve of
the vehicle file is the true one up to the sag. The other half are by `backwash simulate`, whose loop is the fit's own. The vehicle file
that the fit begins with is wrong by a factor of up to 1.5 in every gain, and says the latency and lag of the vehicles that ship.
"""
import json
import math
import pathlib
import subprocess
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/other_worlds"))
import generate  # noqa: E402
import simulate  # noqa: E402
import vehicle  # noqa: E402

KEYS = ("controller.kp.horizontal", "controller.kd.horizontal", "controller.latency", "controller.attitude_lag", "controller.kp.vertical", "controller.kd.vertical")
OTHER = ("none", "ground", "flapping", "battery", "slung", "sluggish", "shots")


def drawn(rng):
    """Gains of a damped loop, latency and what the attitude loop is made of."""
    level, up = rng.uniform(4, 11), rng.uniform(5, 13)
    damping = rng.uniform(0.7, 1.0, 2)
    return dict(kp=[level, up], kd=list(2 * damping * np.sqrt([level, up])), latency=rng.uniform(0.008, 0.06), tilt=rng.uniform(14, 24))


def by_other_hands(out, rng, seed, name):
    """Logs, and the truth of each key."""
    d = drawn(rng)
    for module in (simulate, vehicle):
        module.KP, module.KD, module.LATENCY = np.array([d["kp"][0]] * 2 + d["kp"][1:]), np.array([d["kd"][0]] * 2 + d["kd"][1:]), d["latency"]
    plain = generate.parameters
    generate.parameters = lambda *of: {**plain(*of), "tilt": d["tilt"], "tilt_rate": 2.5 * d["tilt"]}
    try:
        folder = next(iter(generate.generate(str(out), [(name, seed)], flights=3)))
        c = generate.parameters(name, seed)
    finally:
        generate.parameters = plain
    lag = vehicle.attitude_lag(c["rotor_frequency"], c["tilt"], c["tilt_rate"])
    text = (pathlib.Path(folder) / "vehicle.toml").read_text()
    return [f"{folder}/flight{n:02d}.csv" for n in range(3)], text, [d["kp"][0], d["kd"][0], d["latency"], lag, d["kp"][1], d["kd"][1]]


def by_the_simulation(program, out, rng, seed):
    d, lag = drawn(rng), rng.uniform(0.03, 0.09)
    text = subprocess.run([program, "vehicle", "print", "builtin:quad-5in"], capture_output=True, text=True, check=True).stdout
    own = changed(text, d["kp"], d["kd"], d["latency"], lag)
    (out / "true.toml").write_text(own)
    (out / "flight.toml").write_text("start = [0, 0, 1]\n[grid]\nlow = [-1.5, -1.2, 0.5]\nhigh = [1.5, 1.2, 1.7]\ncount = [2, 2, 2]\njitter = 0.1\ndwell = 4.0\n")
    logs = []
    for n in range(3):
        logs.append(f"{out}/own{n}.csv")
        subprocess.run([program, "simulate", "--map", "builtin:parallel-walls-4m", "--vehicle", out / "true.toml", "--model", "builtin:quad-5in", "--flight", out / "flight.toml",
                        "--seed", str(3 * seed + n), "--out", logs[-1], "--force", "--quiet"], check=True, capture_output=True)
    return logs, text, [d["kp"][0], d["kd"][0], d["latency"], lag, d["kp"][1], d["kd"][1]]


def changed(text, kp, kd, latency, lag):
    values = dict(kp=f"{{ horizontal = {kp[0]}, vertical = {kp[1]} }}", kd=f"{{ horizontal = {kd[0]}, vertical = {kd[1]} }}", latency=latency, attitude_lag=lag)
    return "\n".join(next((f"{key} = {value}" for key, value in values.items() if line.startswith(key + " ")), line) for line in text.splitlines()) + "\n"


def main():
    program, out, worlds, first = sys.argv[1], pathlib.Path(sys.argv[2]), int((sys.argv + ["20"])[3]), int((sys.argv + ["", "1"])[4]) if len(sys.argv) > 4 else 1
    out.mkdir(parents=True, exist_ok=True)
    tally = {kind: {key: [0, 0, [], []] for key in KEYS} for kind in ("other hands", "own simulation")}
    with open(out / "results.jsonl", "a", encoding="ascii") as results:
        for seed in range(first, first + worlds):
            rng = np.random.default_rng([seed, 21])
            kind = ("other hands", "own simulation")[seed % 2]
            name = OTHER[seed // 2 % len(OTHER)] if seed % 2 == 0 else "simulate"
            logs, text, truth = by_other_hands(out, rng, seed, name) if seed % 2 == 0 else by_the_simulation(program, out, rng, seed)
            wrong = np.exp(rng.uniform(-math.log(1.5), math.log(1.5), 4))
            (out / "begun.toml").write_text(changed(text, [truth[0] * wrong[0], truth[4] * wrong[1]], [truth[1] * wrong[2], truth[5] * wrong[3]], 0.02, 0.05))
            ran = subprocess.run([program, "vehicle", "fit", *logs, "--vehicle", out / "begun.toml", "--json", "--quiet"], capture_output=True, text=True)
            told = json.loads(ran.stdout) if ran.stdout else {"keys": {}}
            print(json.dumps(dict(seed=seed, world=name, truth=dict(zip(KEYS, truth)), keys=told["keys"], said=ran.stderr.strip())), file=results, flush=True)
            for key, value in zip(KEYS, truth):
                count = tally[kind][key]
                if not (found := told["keys"].get(key)):
                    count[1] += 1
                    continue
                low, high = found["ci90"]
                count[0] += low <= value <= high
                scale = value if "k" in key.split(".")[1][:1] else 1
                count[2].append((high - low) / 2 / scale), count[3].append((found["value"] - value) / scale)
    for kind, keys in tally.items():
        for key, (held, refused, half, off) in keys.items():
            if half:
                print(f"{kind:15} {key:26} held {held} of {len(half)}, refused {refused}, half width median {np.median(half):.4f}, off median {np.median(off):+.4f}, worst {max(map(abs, off)):.4f}")


if __name__ == "__main__":
    main()
