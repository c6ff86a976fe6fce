#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# raw_logs.sh BACKWASH: an autopilot's log without any file of ours: a report, and a vehicle file that is good.
set -u
backwash=$1
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d) && cd "$work" || exit 1
trap 'rm -rf "$work"' EXIT
die() { echo "$*"; exit 1; }

# A PX4 that hovers at 0.4 and swings sideways; its attitude follows the set-point with 0.08 s. A fixed wing of it, and one of six rotors.
cat >make.py <<'EOF'
import math, struct, sys
def log(path, hover=0.4, gaps=False, parameters=()):
    def message(kind, body): return struct.pack("<Hc", len(body), kind) + body
    topics = [("vehicle_local_position", "float x;float y;float z;float vx;float vy;float vz;", "<Q6f"), ("vehicle_attitude", "float[4] q;", "<Q4f"),
              ("vehicle_attitude_setpoint", "float[4] q_d;", "<Q4f"), ("vehicle_thrust_setpoint", "float[3] xyz;", "<Q3f"),
              ("vehicle_local_position_setpoint", "float x;float y;float z;float vx;float vy;float vz;float[3] acceleration;", "<Q9f")]
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    for name, fields, _ in topics: out += message(b"F", f"{name}:uint64_t timestamp;{fields}".encode())
    for name, value in {"MPC_XY_P": 0.95, "MPC_XY_VEL_P_ACC": 1.8, "MPC_Z_P": 1.0, "MPC_Z_VEL_P_ACC": 4.0, "MPC_THR_HOVER": 0.5, "THR_MDL_FAC": 0.2,
                        "MPC_TILTMAX_AIR": 30.0, **dict(parameters)}.items():
        key = f"float {name}".encode()
        out += message(b"P", bytes([len(key)]) + key + struct.pack("<f", value))
    for number, (name, _, _) in enumerate(topics): out += message(b"A", struct.pack("<BH", 0, number) + name.encode())
    pitch = 0.0
    for k in range(2000):
        t = 0.02 * k
        asked = 0.1 * math.sin(3 * t) + 0.05 * math.sin(7 * t)
        error, vx = 0.1 * math.sin(2.3 * t), 0.3 * math.cos(t)  # flown with gains of 1.2 and 2.5, and a controller's noise
        vx_sp = 1.2 * error + 0.004 * math.sin(50 * t)
        for number, values in enumerate([(0.3 * math.sin(t), 0, -1, 0.3 * math.cos(t), 0, 0), (math.cos(pitch / 2), 0, math.sin(pitch / 2), 0),
                                         (math.cos(asked / 2), 0, math.sin(asked / 2), 0), (0, 0, -hover),
                                         (0.3 * math.sin(t) + error, 0, -1, vx_sp, 0, 0, 2.5 * (vx_sp - vx), 0, 0)]):
            out += message(b"D", struct.pack("<H", number) + struct.pack(topics[number][2], int(1e6 + 1e6 * t), *values))
        pitch += (1 - math.exp(-0.02 / 0.08)) * (asked - pitch)
    open(path, "wb").write(out[:9000] + out[9300:] if gaps else out)
log("flight.px4log")
log("gaps", gaps=True)
log("wing.ulg", parameters=[("MAV_TYPE", 1)])
EOF
python3 make.py || die "no log was made"

"$backwash" vehicle from flight.px4log --out own.toml 2>stderr || die "vehicle from: $(<stderr)"
"$backwash" vehicle check --vehicle own.toml --json >check.json || die "vehicle check refuses it"
python3 - <<'EOF' || die "the vehicle file: $(<own.toml)"
import json, math, re
check, text = json.load(open("check.json")), open("own.toml").read()
assert check["notes"] == [], check["notes"]
assert abs(check["hover_command"] - 0.4) < 0.005, check
assert math.isclose(check["kp"]["horizontal"], 0.95 * 1.8, rel_tol=1e-5) and math.isclose(check["kd"]["vertical"], 4, rel_tol=1e-5)
values = dict(re.findall(r"(?m)^(\S+) = (\S+)  # ", text))
assert abs(float(values["attitude_lag"]) - 0.08) < 0.01, values
assert abs(float(values["thr_mdl_fac"]) - 0.2) < 1e-6
assert all("  # " in line for line in text.splitlines() if " = " in line and not line.startswith("name"))
EOF
"$backwash" report flight.px4log --vehicle own.toml --out page.html --json >report.json 2>stderr || die "report: $(<stderr)"
python3 - <<'EOF' || die "the report: $(<report.json)"
import json
said = json.load(open("report.json"))
assert abs(said["hover"]["value"] - 0.4) < 0.005 and abs(said["attitude_lag"]["value"] - 0.08) < 0.01
assert not any("another vehicle" in note for note in said["notes"])
assert {q["asks"]: bool(q["without"]) for q in said["questions"]}["variance of the air in hover"]
assert [said["gains"][k][1] for k in ("position", "velocity")] == [None, None]  # it did not move along z
for name, flown in (("position", 1.2), ("velocity", 2.5)):
    gain = said["gains"][name][0]
    assert gain["low"] < flown < gain["high"] and gain["high"] < 1.1 * gain["low"], gain
assert said["notes"][-1].startswith("next flight, for variance of the air in hover: "), said["notes"]
assert all(word in open("page.html").read() for word in ("cannot be told", "0.95 1/s"))
assert all(word in open("page.html").read() for word in ("MPC_THR_HOVER 0.5", "-20 %", "MPC_XY_VEL_P_ACC", "What can be asked"))
EOF
sed 's/^max_thrust = [0-9.]*/max_thrust = 14/' own.toml >other.toml
"$backwash" report flight.px4log --vehicle other.toml | grep -q 'this log hovers at 0.40, the vehicle file says 0.6.*: another vehicle' || die "the other vehicle is believed"
"$backwash" report gaps | grep -q '% of it is lost, at 1 damaged place' || die "the gap is silent"
"$backwash" report wing.ulg 2>stderr; [[ $? == 65 && $(<stderr) == *"a fixed wing (MAV_TYPE 1)"* ]] || die "a wing: $(<stderr)"
"$backwash" vehicle from page.html 2>stderr; [[ $? == 65 && $(<stderr) == *"a page of the web"* ]] || die "a page: $(<stderr)"
"$backwash" import flight.px4log gaps -o logs >imported || die "import"
grep -q 'left out: gaps:1: .* % of the positions are those of flight.px4log' imported || die "twice: $(<imported)"
here=$here/../../../shared/data/field
[[ -e $here/flight.ulg ]] || exit 0
for log in flight.ulg copter364.bin wifi_gaps.ulg; do
  "$backwash" vehicle from "$here/$log" --out "$log.toml" 2>/dev/null && "$backwash" vehicle check --vehicle "$log.toml" --json >check.json || die "$log: no vehicle"
  python3 -c 'import json; assert json.load(open("check.json"))["notes"] == []' || die "$log: $(<check.json)"
  "$backwash" report "$here/$log" >said || die "$log: no report"
done
grep -q '^hover thrust .*MPC_THR_HOVER 0.5; the flight: 0.[0-9]' said || die "$(<said)"
