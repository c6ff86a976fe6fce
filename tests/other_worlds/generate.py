#!/usr/bin/env python3
"""Worlds with one hidden effect, or none: flight logs, map, vehicle and model file for `backwash study`.

generate.py OUT NAME:SEED ...   writes OUT/NAME-SEED/{flight00.csv ...,room.bt,vehicle.toml,model.toml,truth.json}
"""
import argparse
import json
import os

import numpy as np

from effects import EFFECTS, parameters
from flights import bobbing, flight
from room import model_toml, stored_field, write_octomap
from sensors import write_log
from simulate import fly
from vehicle import vehicle_toml

ROOMS = [(5.0, 4.0, 2.4), (4.4, 4.4, 2.2), (6.0, 3.6, 2.6)]  # m


def craft(rng, c, count):
    """What this craft and each of its flights have of their own: (flights, ...) each. Rotors differ by 0.7 %, flights by 0.3 % of thrust."""
    rotors = 1 + c["uneven"] * rng.standard_normal(4)
    rotors /= rotors.mean()
    rotors *= (1 / rotors).mean()  # rotors that differ balance at the same collective command
    torque = np.ones(4)
    rotors[int(c["damaged"])] *= 1 - c["damage"]
    torque[int(c["damaged"])] *= 1 + 0.8 * c["damage"]
    return dict(thrust=rotors * (1 + 0.003 * rng.standard_normal((count, 1))), torque=np.tile(torque, (count, 1)),
                strength=np.exp(0.2 * rng.standard_normal(count)), charge=rng.uniform(0.86, 1.0, count), phase=rng.uniform(0, 2 * np.pi, (count, 4)))


def write_files(folder, c, size, name, seed):
    os.makedirs(folder, exist_ok=True)
    write_octomap(os.path.join(folder, "room.bt"), size)
    for file, text in (("vehicle.toml", vehicle_toml(c)), ("model.toml", model_toml()),
                       ("truth.json", json.dumps(dict(name=name, seed=seed, room=size, constants={k: float(v) for k, v in c.items()})))):
        with open(os.path.join(folder, file), "w", encoding="ascii") as out:
            out.write(text)


def generate(out, worlds, flights=12, seconds=80.0):
    """Yields the folder of each world of [(name, seed), ...] when its logs are written. All are simulated at once."""
    cache = os.path.join(out, "fields")
    os.makedirs(cache, exist_ok=True)
    constants, own, plans, rooms, generators, segments, folders = [], [], [], [], [], [], []
    for name, seed in worlds:
        rng = np.random.default_rng([seed, list(EFFECTS).index(name), 1])
        c, size = parameters(name, seed), ROOMS[seed % len(ROOMS)]
        folders.append(os.path.join(out, f"{name}-{seed}"))
        write_files(folders[-1], c, size, name, seed)
        constants.append(c)
        own.append(craft(rng, c, flights))
        for _ in range(flights):
            plan = (bobbing if c["bobbing"] else flight)(rng, size, seconds)
            plans.append(np.column_stack([plan["p"], plan["v"], plan["a"], plan["yaw"]]))
            segments.append(plan["segment"])
        rooms.append(size)
        generators.append(rng)
    kinds = [(stored_field(size, cache), np.repeat([r == size for r in rooms], flights).nonzero()[0]) for size in sorted(set(rooms))]
    each = {k: np.repeat([c[k] for c in constants], flights).astype(float) for k in constants[0]}
    record = fly(each, {k: np.concatenate([o[k] for o in own]) for k in own[0]}, np.array(plans), kinds, generators)
    for w, folder in enumerate(folders):
        for f in range(flights):
            i = w * flights + f
            part = {k: v[:, i] for k, v in record.items()}
            path = os.path.join(folder, f"flight{f:02d}.csv")
            write_log(path, generators[w], constants[w], part, plans[i], segments[i], own[w]["phase"][f], f)
        yield folder


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("worlds", nargs="+", help="NAME:SEED; names: " + " ".join(EFFECTS))
    parser.add_argument("--flights", type=int, default=12)
    parser.add_argument("--seconds", type=float, default=80.0)
    a = parser.parse_args()
    worlds = [(w.split(":")[0], int(w.split(":")[1])) for w in a.worlds]
    for folder in generate(a.out, worlds, a.flights, a.seconds):
        print(folder)


if __name__ == "__main__":
    main()
