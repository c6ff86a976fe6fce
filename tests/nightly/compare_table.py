# SPDX-License-Identifier: BSD-3-Clause
"""The tables of research/compare/README.md from the JSON of `backwash compare`. usage: compare_table.py FILE"""
import json
import sys

found = json.load(open(sys.argv[1]))
methods = found["methods"]
first = methods[0]["method"]


def row(*cells):
    print("| " + " | ".join(cells) + " |")


def header(*cells):
    row(*cells)
    row(*["---"] * len(cells))


def interval(x):
    return f"{x['value']:.2f} ({x['ci95'][0]:.2f}–{x['ci95'][1]:.2f})"


print(f"{methods[0]['pairs']} pairs, {found['common_pairs']} of them solved by all methods. Totals over those:\n")
header("method", "length, m", "time, s", "jerk², (m/s³)² s", "energy, kJ")
for m in methods:
    c = m["common"]
    row(f"`{m['method']}`", *(f"{x:.1f}" for x in (c["length_m"], c["time_s"], c["jerk2"], c["energy_J"] / 1000)))

print("\nAll pairs:\n")
header("method", "flown, m", "flights with contact", "no path (of these: end blocked)",
       f"solved where `{first}`'s ends are safe", "samples outside", "planning, ms, median / 95 %")
for m in methods:
    ends = m["status"].get("start_blocked", 0) + m["status"].get("goal_blocked", 0)
    ms = m["planning_ms"]
    row(f"`{m['method']}`", f"{m['flown_m']:.0f}", str(m["contacts"]), f"{m['no_path']} ({ends})",
        f"{m['solved_of_eligible']} of {m['eligible']}", f"{m['samples_outside']} of {m['samples']}",
        f"{ms['median']:.0f} / {ms['p95']:.0f}" if ms else "not timed")

print(f"\nRatios, `{first}` over the method, on the pairs that all solve and on those that both solve:\n")
header("over", "pairs", "jerk², totals", "the paper's", "jerk², geometric mean", "shape, geometric mean", "length", "time",
       "energy")
for m in methods[1:]:
    over = m["first_over_this"]
    for key, name in (("common", "all"), ("pairwise", "both")):
        t, g = over[key]["totals"], over[key]["geometric_mean"]
        paper = over.get("paper_jerk2")
        row(f"`{m['method']}`", f"{over[key]['pairs']} {name}", interval(t["jerk2"]),
            f"{paper:.2f}" if paper and key == "common" else "", interval(g["jerk2"]),
            interval(g["jerk2_time5_per_length2"]), interval(t["length_m"]), interval(t["time_s"]), interval(t["energy_J"]))
