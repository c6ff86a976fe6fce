#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Conventions of every verb: --help with an example that works, --version with a commit, --json that is one JSON object.
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"

mapfile -t verbs < <("$backwash" --help | sed -n '/^Subcommands:/,$ s/^  \([a-z]\+\) .*/\1/p')
[[ ${#verbs[@]} -ge 13 ]] || die "only ${#verbs[@]} verbs in --help"
verbs=("${verbs[@]/vehicle/vehicle tune}")
verbs=("${verbs[@]/campaign/campaign run}")
verbs=("${verbs[@]/keys/keys init}")
for verb in "${verbs[@]/#map/map info}" "map convert" "vehicle print" "vehicle check" "vehicle fit"; do
  read -ra words <<<"$verb"
  "$backwash" "${words[@]}" --help >help || die "$verb --help fails"
  grep -q "^  backwash $verb " help || die "$verb --help has no example"
  # One that needs no file of the reader's works as it stands. compare's takes minutes.
  sed -n '/^Example:/,$ { /^  /p; }' help >example.sh
  [[ $verb == compare ]] || grep -qE '[a-z0-9*]+\.(txt|csv|bwlog|mcap|toml|bt|ulg|obj|pcd)' example.sh && continue
  mkdir -p examples
  (cd examples && PATH=$(dirname "$backwash"):$PATH bash -e ../example.sh) >/dev/null || die "the example of $verb --help fails"
  examples+=("$verb")
done
[[ ${#examples[@]} -ge 5 ]] || die "only the examples of ${examples[*]} were run"
"$backwash" --version | grep -Eq '^backwash [0-9.]+ \([0-9a-f]{12}\)$|unknown commit' || die "--version has no version and commit"

quad=builtin:quad-5in
printf 't_s,cmd_x_m,cmd_y_m,cmd_z_m,sigma_xx,sigma_xy,sigma_xz,sigma_yy,sigma_yz,sigma_zz\n' >track.csv
for k in 0 1 2 3 4; do printf '%s,1,2,3,0.09,0.01,0,0.04,0,0.01\n' "0.0$((2 * k))" >>track.csv; done
for method in tight paper; do
  "$backwash" reach --vehicle $quad --track track.csv --method $method --direction 1,1,0 --json >$method.json
done
sed 's/^latency/velocity_integrator = { horizontal = 0.4, vertical = 0.4 }\nlatency/' \
  "$here/../../core/config/files/quad-5in.vehicle.toml" >holding.toml
"$backwash" reach --vehicle holding.toml --track track.csv --json >holding.json
! "$backwash" reach --vehicle holding.toml --track track.csv --method chance --probability 1e-3 2>refusal.txt || die "chance sets of an integrator"
grep -q "holding.toml:1: controller.velocity_integrator: --method chance" refusal.txt || die "the refusal names no file and key"
# The autopilot's integral gains are taken with its others: the same sets as of a vehicle file that says them.
tuned() { "$backwash" vehicle tune --map builtin:narrow-gap --model $quad --start 1,0,1 --goal 5,0,1 --json "$@"; }
gains='MPC_XY_P = 1.2, MPC_XY_VEL_P_ACC = 2.5, MPC_Z_P = 1.2, MPC_Z_VEL_P_ACC = 3, MPC_XY_VEL_I_ACC = 0.4, MPC_Z_VEL_I_ACC = 0.5'
sed "s/^kp = .*/px4 = { $gains }/; /^kd = /d" "$here/../../core/config/files/quad-5in.vehicle.toml" >px4.toml
tr ',' '\n' <<<"$gains" | sed 's/^ *//; s/ = /=/' >px4.params
printf 'PSC_POSXY_P,1.2\nPSC_VELXY_P,2.5\nPSC_POSZ_P,1.2\nPSC_VELZ_P,3\nPSC_VELXY_I,1\n' >copter.params
tuned --vehicle px4.toml >of_file.json || [[ $? == 69 ]] || die "tune"
tuned --vehicle $quad --parameters px4.params >of_parameters.json || [[ $? == 69 ]] || die "tune with parameters"
tuned --vehicle $quad --parameters copter.params >of_copter.json || [[ $? == 69 ]] || die "tune with ArduPilot's"
cmp -s of_file.json of_parameters.json || die "other sets of the parameters' gains than of the file's"
python3 - <<'PYTHON'
import json
px4, copter = (json.load(open(f"of_{name}.json")) for name in ("parameters", "copter"))
assert px4["velocity_integrator"] == {"horizontal": 0.4, "vertical": 0.5} and px4["left_out"] is None, px4["velocity_integrator"]
assert copter["velocity_integrator"] == {"horizontal": 0, "vertical": 0} and "PSC_VELXY_I 1 is left out" in copter["left_out"]
widths = lambda j: [s["tightest"]["half_widths_m"] for s in j["steps"] if s["stable"] and s["tightest"] and s["tightest"]["bounded"]]
assert widths(px4) and widths(copter) and widths(px4) != widths(copter)
PYTHON
for probability in 1e-3 1e-6; do
  "$backwash" reach --vehicle $quad --track track.csv --method chance --probability $probability --json >chance-$probability.json
done
"$backwash" field --map builtin:parallel-walls-1m --model $quad --vehicle $quad --at 0,0,1 --json >exact.json
"$backwash" field --map builtin:parallel-walls-1m --model $quad --vehicle $quad --at 0,0,1 --interpolated --json >stored.json
"$backwash" field --map builtin:parallel-walls-1m --model $quad --slice z=1 --out slice.svg --json >slice.json
grep -q '<svg' slice.svg || die "the slice's picture is not an SVG"
# Through voxel centres a slice shows stored values themselves.
"$backwash" field --map builtin:apartment --model $quad --slice z=1.05 --json >centres.json
python3 - <<'PYTHON'
import json, random
points = json.load(open("centres.json"))["points"]
random.seed(1)
json.dump(random.sample(points, 300), open("sample.json", "w"))
rows = (",".join(repr(x) for x in point["p"]) for point in json.load(open("sample.json")))
open("sample.csv", "w").write("x_m,y_m,z_m\n" + "\n".join(rows) + "\n")
PYTHON
"$backwash" field --map builtin:apartment --model $quad --points sample.csv --json >asked.json
printf 'start = [1, 0, 1]\n[[hover]]\np = [1.5, 0, 1]\ndwell = 1.0\n[[hover]]\np = [1, 0, 1.2]\ndwell = 2.0\n' >spec.toml
"$backwash" simulate --map builtin:narrow-gap --vehicle $quad --flight spec.toml --seed 3 --out a.csv --json >simulate.json
"$backwash" simulate --map builtin:narrow-gap --vehicle $quad --flight spec.toml --seed 3 --out b.csv >/dev/null
"$backwash" simulate --map builtin:narrow-gap --vehicle $quad --flight spec.toml --seed 4 --out c.csv >/dev/null
cmp -s a.csv b.csv || die "the same seed gives another log"
! cmp -s a.csv c.csv || die "another seed gives the same log"

python3 - <<'PYTHON'
import csv, json, math
for method in ("tight", "paper"):
    reach = json.load(open(method + ".json"))
    assert reach["method"] == method and len(reach["steps"]) == 6, method
    for k, step in enumerate(reach["steps"]):
        assert abs(step["t"] - 0.02 * k) < 1e-12
        assert ("shape" in step) == (method == "paper")
        h = step["half_widths"]
        assert set(h) == {"x", "y", "z", "xy_plus", "xy_minus"} == set(step["half_widths_interval"])
        assert all(step["half_widths_interval"][d] >= h[d] - 1e-12 for d in h)
        assert abs(step["support"] - h["xy_plus"]) < 1e-9
        assert step["center"] == reach["steps"][0]["center"] or max(abs(a - b) for a, b in zip(step["center"], [1, 2, 3])) < 1e-9
    assert all(abs(reach["steps"][0]["half_widths"][d] - 0.02) < 1e-12 for d in h), "the first set is the initial error"
    q = reach["steps"][-1].get("shape")
    if q:  # the ellipsoid's own support and largest axis follow from its shape
        h = reach["steps"][-1]["half_widths"]
        assert abs(h["x"] - math.sqrt(q[0])) < 1e-12 and abs(h["xy_plus"] - math.sqrt((q[0] + 2 * q[1] + q[3]) / 2)) < 1e-12
plain, holding = (json.load(open(f"{n}.json"))["steps"][-1]["half_widths"] for n in ("tight", "holding"))
assert all(holding[d] > plain[d] + 1e-6 for d in plain), "what an integrator holds makes the sets of a track larger"
likely, rare = (json.load(open(f"chance-{p}.json")) for p in ("1e-3", "1e-6"))
assert likely["method"] == "chance" and len(likely["steps"]) == 6
a, b = likely["steps"][-1]["half_widths"], rare["steps"][-1]["half_widths"]
assert all(0 < a[d] < b[d] for d in a), "a rarer excursion needs a wider set"
exact = json.load(open("exact.json"))["points"][0]
parts = [sum(exact[part][n] for part in ("ground", "corner", "wall", "base")) for n in range(6)]
assert all(abs(a - b) < 1e-12 for a, b in zip(parts, exact["sigma"])), "parts do not sum to sigma"
stored = json.load(open("stored.json"))["points"][0]["sigma"]
assert abs(stored[5] - exact["sigma"][5]) < 0.1 * exact["sigma"][5], "stored and exact differ"
assert len(json.load(open("slice.json"))["points"]) > 100
for shown, asked in zip(json.load(open("sample.json")), json.load(open("asked.json"))["points"], strict=True):
    off = max(abs(a - b) for a, b in zip(shown["sigma"], asked["sigma"]))
    assert off <= 1e-6 * max(map(abs, asked["sigma"])), f"slice and exact query differ at {asked['p']}"
rows = list(csv.DictReader(open("a.csv")))
assert json.load(open("simulate.json"))["rows"] == len(rows)
assert {row["segment"] for row in rows} == {"-1", "0", "1"}
assert sum(row["segment"] == "1" for row in rows) == 100, "2 s of dwell at 50 Hz"
PYTHON
