#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Curves, limits and a picture of what `race fly` wrote: summary.py race RACE.csv [CURVES.svg]
The sieves of `race sieve`: summary.py sieve RIVALS.csv
Real flights, of `race real`: summary.py real REAL.csv [RELIABILITY.svg]"""
import collections
import csv
import math
import random
import sys

import picture
from limits import limits

PER_1000 = 0.1  # contacts per 1,000 flights that count as none


class Sum:
    """Pairs of a way: shares of each pair's flights that touched, summed."""

    def __init__(self):
        self.pairs = self.flown = self.flights = self.touched = 0
        self.shares = self.stated = self.time = 0.0

    def add(self, row):
        self.pairs += 1
        if row["planned"] == "1":
            flights, touched = int(row["flights"]), int(row["touched"])
            self.flown += 1
            self.flights += flights
            self.touched += touched
            self.shares += touched / flights
            self.stated += float(row["stated"])
            self.time += float(row["time_s"])

    def __iadd__(self, other):
        for key, value in vars(other).items():
            setattr(self, key, getattr(self, key) + value)
        return self

    def share(self, of=None):
        return self.flown / max(1, of.flown if of else self.pairs)

    def rate(self):
        return 1000 * self.shares / max(1, self.flown)

    def text(self, of):
        low, high = limits(self.shares, self.flown) if self.flown else (0, 1)
        return (f"{self.flown} | {self.share():.3f} | {self.share(of):.3f} | {self.touched} of {self.flights} | "
                f"{self.rate():.2f} [{1000 * low:.2f}, {1000 * high:.2f}]")


def total(sums):
    result = Sum()
    for s in sums:
        result += s
    return result


def read(path):
    """Rows of heats that came to their end, {(vehicle, air, map, v_max): {way: Sum}}, and the rows."""
    heats, lines = set(), []
    for line in open(path, encoding="utf-8"):
        if line.endswith(",end\n"):
            heats.add(tuple(line[:-5].split(",")))
        else:
            lines.append(line)
    rows = {}
    for row in csv.DictReader(lines):
        if (row["round"], row["map"], row["vehicle"]) in heats:  # what was begun twice counts once
            rows[tuple(row[k] for k in ("round", "map", "vehicle", "v_max", "pair", "air", "way"))] = row
    cells = collections.defaultdict(lambda: collections.defaultdict(Sum))
    for row in rows.values():
        cells[row["vehicle"], row["air"], row["map"], row["v_max"]][row["way"]].add(row)
    return cells, rows.values()


def pooled(cells, keep=lambda cell: True):
    ways = collections.defaultdict(Sum)
    for cell, by_way in cells.items():
        if keep(cell):
            for way, s in by_way.items():
                ways[way] += s
    return ways


def margins(ways):
    return sorted(w for w in ways if w.startswith("margin"))


def best_margin(ways):
    """The constant that flies most with no more contacts than count as none; chosen afterwards."""
    clear = [m for m in margins(ways) if ways[m].rate() <= PER_1000]
    return max(clear, key=lambda m: ways[m].flown)


def hindsight(cells, group):
    """(b): the best constant of each group of cells."""
    groups = {group(cell) for cell in cells}
    chosen = {g: pooled(cells, lambda cell, g=g: group(cell) == g) for g in groups}
    return {g: (best_margin(ways), ways[best_margin(ways)]) for g, ways in chosen.items()}


def realised(rows):
    """What was stated against what touched, over flights of the same stated risk."""
    for way in ("risk 1e-2", "risk 1e-3", "risk 1e-4"):
        of = [r for r in rows if r["way"] == way and r["planned"] == "1"]
        touched, flights = sum(int(r["touched"]) for r in of), sum(int(r["flights"]) for r in of)
        stated = sum(float(r["stated"]) * int(r["flights"]) for r in of)
        routes = len({(r["round"], r["map"], r["vehicle"], r["pair"]) for r in of})
        print(f"\n{way}: touched {touched} of {flights} flights of {routes} routes, {stated:.3g} by what was stated of each")
    print("\nstated risk of a plan | pairs | mean stated | touched of flights | realised/stated [95 %]")
    edges = [0, 1e-6, 1e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2]
    for way in ("risk 1e-2", "risk 1e-3", "risk 1e-4"):
        of = [r for r in rows if r["way"] == way and r["planned"] == "1"]
        for low, high in zip(edges, edges[1:]):
            bin_ = [r for r in of if low <= float(r["stated"]) < high or (low == 0 and float(r["stated"]) == 0)]
            if not bin_:
                continue
            s = total_of(bin_)
            mean = s.stated / s.flown
            lower, upper = limits(s.shares, s.flown)
            if mean > 0:
                print(f"{way}: {low:g} to {high:g} | {s.flown} | {mean:.2g} | {s.touched} of {s.flights} | "
                      f"{s.shares / s.flown / mean:.2g} [{lower / mean:.2g}, {upper / mean:.2g}]")


def total_of(rows):
    s = Sum()
    for row in rows:
        s.add(row)
    return s


def race(path, file=None):
    cells, rows = read(path)
    ways = pooled(cells)
    bare = ways["margin 0.00"]
    print(f"{len(cells)} cells of vehicle, air, map and speed; {bare.pairs} pairs of one each; "
          f"{sum(s.flights for s in ways.values())} flights, {sum(s.flown for s in ways.values())} planned pairs flown")
    print("way | pairs flown | share | of margin 0's | touched of flights | per 1,000 [95 %] | mean planned s | stated")
    for way in [w for w in ways if not w.startswith("margin")] + margins(ways):
        s = ways[way]
        print(f"{way} | {s.text(bare)} | {s.time / max(1, s.flown):.2f} | {1000 * s.stated / max(1, s.flown):.3g}")
    if "margin 0.60" not in ways:  # risks alone were flown
        return realised(rows)
    clear_ends(rows)
    print("\n(a) best one constant for all:", best_margin(ways))
    named = {"vehicle": lambda c: c[0], "vehicle and air": lambda c: c[:2]}
    for name, group in named.items():
        best = hindsight(cells, group)
        print(f"(b) best constant for each {name}:", total(s for _, s in best.values()).text(bare))
    print("\nvehicle | tight | risk 1e-3 (of the way to b) | b: margin, share | a | risk 1e-3 touched of flights")
    one = best_margin(ways)
    for vehicle, (margin, s) in sorted(hindsight(cells, named["vehicle"]).items()):
        own = pooled(cells, lambda cell, v=vehicle: cell[0] == v)
        of, tight, risk = own["margin 0.00"], own["tight"], own["risk 1e-3"]
        gain = s.flown - tight.flown
        way = f"{(risk.flown - tight.flown) / gain:.2f}" if gain > 0 else "b below tight"
        print(f"{vehicle} | {tight.share(of):.3f} | {risk.share(of):.3f} ({way}) | {margin[7:]}, {s.share(of):.3f} | "
              f"{own[one].share(of):.3f} | {risk.touched} of {risk.flights}")
    for key, what in ((1, "air"), (2, "map"), (3, "speed")):
        for value in sorted({c[key] for c in cells}):
            own = pooled(cells, lambda cell, k=key, v=value: cell[k] == v)
            of = own["margin 0.00"]
            print(f"{what} {value}: tight {own['tight'].share(of):.3f}, risk 1e-3 {own['risk 1e-3'].share(of):.3f}, "
                  f"(a) {own[one].share(of):.3f}; risk 1e-3 touched {own['risk 1e-3'].touched} of {own['risk 1e-3'].flights}")
    doors(rows)
    realised(rows)
    if file:
        picture.curves(file, ways, bare, {n: total(s for _, s in hindsight(cells, g).values()) for n, g in named.items()})


def clear_ends(rows):
    """Of what no margin flew clear in each of its flights: the share that a way flies."""
    key = lambda r: tuple(r[k] for k in ("round", "map", "vehicle", "v_max", "pair", "air"))
    clear = {key(r) for r in rows if r["way"] == "margin 0.00" and r["planned"] == "1" and r["touched"] == "0"}
    for way in ("tight", "risk 1e-2", "risk 1e-3", "risk 1e-4"):
        flown = sum(r["way"] == way and r["planned"] == "1" and key(r) in clear for r in rows)
        print(f"{way}: {flown} of {len(clear)} pairs that no margin flew clear, {flown / max(1, len(clear)):.3f}")


def doors(rows):
    """Narrowest door that is flown, shipped loops."""
    for vehicle in ("5in-shipped", "7in-shipped"):
        for way in ("tight", "risk 1e-3", "margin 0.00"):
            count = collections.defaultdict(Sum)
            for r in rows:
                if r["map"] == "gaps" and r["vehicle"] == vehicle and r["way"] == way:
                    count[0.6 + 0.1 * (int(r["pair"]) % 7)].add(r)
            print(f"doors, {vehicle}, {way}: " + ", ".join(f"{d:.1f} m {s.share():.2f}" for d, s in sorted(count.items())))


def auc(good, bad):
    """Chance that a good one's score is above a bad one's; ties count half."""
    scored = sorted([(s, 1) for s in good] + [(s, 0) for s in bad])
    ranks, n = 0.0, 0
    while n < len(scored):
        end = n
        while end < len(scored) and scored[end][0] == scored[n][0]:
            end += 1
        ranks += sum(k for _, k in scored[n:end]) * (n + end + 1) / 2
        n = end
    return (ranks - len(good) * (len(good) + 1) / 2) / max(1, len(good) * len(bad))


def sieve(path):
    rows = list(csv.DictReader(open(path, encoding="utf-8")))
    widths = collections.defaultdict(list)
    for r in rows:
        widths[r["vehicle"], r["air"]].append(float(r["width"]))
    for r in rows:
        own = sorted(widths[r["vehicle"], r["air"]])
        r["constant"] = float(r["clearance"])
        r["own width"] = float(r["clearance"]) / own[len(own) // 2]
        r["tight"] = float(r["scale"])
        r["risk"] = -float(r["risk"])
    scores = ("constant", "own width", "tight", "risk")

    def line(name, of):
        good, bad = [r for r in of if r["touched"] == "0"], [r for r in of if r["touched"] != "0"]
        figures = []
        for score in scores:
            worst = max((r[score] for r in bad), default=-math.inf)
            figures.append(f"{sum(r[score] > worst for r in of) / len(of):.3f}, {auc([r[score] for r in good], [r[score] for r in bad]):.3f}")
        print(f"{name} | {len(of)} | {len(bad)} | " + " | ".join(figures))

    print("of | trajectories | that touched | " + " | ".join(f"{s}: accepted without contact, AUC" for s in scores))
    line("all", rows)
    for key in ("vehicle", "air", "map", "by"):
        for value in sorted({r[key] for r in rows}):
            line(f"{key} {value}", [r for r in rows if r[key] == value])
    for vehicle, air in sorted(widths):
        line(f"{vehicle}, air {air}", [r for r in rows if (r["vehicle"], r["air"]) == (vehicle, air)])
    print("\nrule | accepted | touched of flights, per 1,000 [95 % over trajectories]")
    for name, ok in [("tight", lambda r: r["tight"] > 1)] + \
            [(f"risk {p:g}", lambda r, p=p: -r["risk"] <= p) for p in (1e-1, 1e-2, 1e-3, 1e-4)] + \
            [(f"constant {m:g} m", lambda r, m=m: r["constant"] > m) for m in (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)]:
        of = [r for r in rows if ok(r)]
        x = sum(int(r["touched"]) / int(r["flights"]) for r in of)
        low, high = limits(x, len(of))
        print(f"{name} | {len(of) / len(rows):.3f} | {sum(int(r['touched']) for r in of)} of {sum(int(r['flights']) for r in of)}, "
              f"{1000 * x / len(of):.2f} [{1000 * low:.2f}, {1000 * high:.2f}]")
    print("\nstated risk | trajectories | mean stated | touched a flight | realised/stated [95 %]")
    edges = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1]
    for low, high in zip(edges, edges[1:]):
        of = [r for r in rows if low <= -r["risk"] < high and r["constant"] > 0]
        if of:
            mean, x = sum(-r["risk"] for r in of) / len(of), sum(int(r["touched"]) / int(r["flights"]) for r in of)
            lower, upper = limits(x, len(of))
            print(f"{low:g} to {high:g} | {len(of)} | {mean:.2g} | {x / len(of):.2g} | {x / len(of) / mean:.2g} "
                  f"[{lower / mean:.2g}, {upper / mean:.2g}]")


def real(path, file=None):
    """Exits a second against what is promised; intervals of 95 % by drawing flights, the units, anew."""
    flights = collections.defaultdict(lambda: collections.defaultdict(list))
    for r in csv.DictReader(open(path, encoding="utf-8")):
        flights[r["data"]][r["flight"]].append(r)
    draw, points = random.Random(1), []
    print("data | promised exits a second | flights, axis seconds | seen [95 %] | flights with any of as many expected")
    for data, by_flight in flights.items():
        for promised in ("1e-1", "1e-2", "1e-3"):
            units = [(sum(int(r[f"exits_{promised}"]) for r in rows), sum(float(r["seconds"]) for r in rows))
                     for rows in by_flight.values()]

            def rate(of):
                return sum(x for x, _ in of) / sum(s for _, s in of)
            again = sorted(rate([draw.choice(units) for _ in units]) for _ in range(2000))
            seconds, p = sum(s for _, s in units), float(promised)
            # Where nothing was seen, nothing can be drawn: three in all flights' seconds would pass unseen.
            low, high = again[50], max(again[-51], 3 / seconds if rate(units) == 0 else 0)
            any_ = sum(x > 0 for x, _ in units)
            expected = sum(1 - math.exp(-p * s) for _, s in units)
            print(f"{data} | {promised} | {len(units)}, {seconds:.0f} | {rate(units):.3g} [{low:.3g}, {high:.3g}] | {any_} of {len(units)}, {expected:.1f}")
            points.append((data, p, rate(units), low, high))
    if file:
        picture.reliability(file, points)


if __name__ == "__main__":
    {"race": race, "sieve": sieve, "real": real}[sys.argv[1]](*sys.argv[2:])
