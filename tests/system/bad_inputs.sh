#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every bad input gives the documented exit code and exactly one line on stderr that names the verb and what is wrong.
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
set +e
failed=0

# refused CODE WORDS ARGUMENTS…: runs backwash and checks code, one line, its beginning, and the words in it.
refused() {
  local code=$1 words=$2 line
  shift 2
  prlimit --cpu=20 "$backwash" "$@" >stdout 2>stderr
  local got=$? below=
  [[ ${1:-} != vehicle ]] || below=" $2"
  line=$(cat stderr)
  if [[ $got != "$code" || $(wc -l <stderr) != 1 || $line != "backwash${1:+ }${1:-}$below:"* || $line != *"$words"* ]]; then
    echo "backwash $*"
    echo "  wanted exit $code and one line with '$words'; got exit $got and:"
    sed 's/^/  /' stderr
    failed=1
  fi
}

quad=builtin:quad-5in
fly=(fly --map builtin:narrow-gap)
cp "$here/../../core/config/files/quad-5in.vehicle.toml" own.toml
printf 'not a map at all\n' >corrupt.bt
printf '[base]\nhorizontal = 0.004\nvertical = 0.006\nsideways = 1\n' >unknown_key.toml
printf 't_s,cmd_x_m,cmd_y_m,cmd_z_m\n0,0,0,1\n0.02,0,0,1\n0.05,0,0,1\n' >gap.csv
header=t_s,cmd_x_m,cmd_y_m,cmd_z_m,sigma_xx,sigma_xy,sigma_xz,sigma_yy,sigma_yz,sigma_zz
printf '%s\n0,0,0,1,1,0,0,1,0,1\n0.02,0,0,1,1,2,0,1,0,1\n' $header >indefinite.csv
printf '%s\n0,0,0,1,1,0,0,1,0,1\n0.02,0,0,one,1,0,0,1,0,1\n' $header >word.csv
printf 't_s,cmd_x_m,cmd_y_m\n0,0,0\n' >no_z.csv
printf 'x_m,y_m\n0,0\n' >no_z_points.csv
printf 'start = [1, 0, 1]\n[[hover]]\np = [2, 0, 1]\ndwel = 3\n' >spec_key.toml
printf 'start = [1, 1.5, 1]\n[[hover]]\np = [5, 1.5, 1]\ndwell = 3\n' >spec_wall.toml
printf 'start = [1, 0, 1]\n[[hover]]\np = [1.2, 0, 1]\ndwell = 1\n' >spec_good.toml
touch exists a.csv
printf 'ULog\x01\x12\x35\x01' >corrupt.ulg
cp "$here/../data/ardupilot/door.bin" flight.bin
cp corrupt.bt corrupt.bwlog
mkfifo fifo
# Column maps, and tables of others.
table() { printf 't,x,y,z\n'; for n in $(seq 0 200); do echo "$(($1 * n)),0,0,0.$n"; done; }
table 10 >ms.csv
printf '[columns]\nt_s = "t [ms]"\nx_m = "x"\ny_m = "y"\nz_m = "z"\n' >map.toml
sed 's/ms/fortnight/' map.toml >unit.toml
sed 's/^z_m/height/' map.toml >unknown_column.toml
sed '/^z_m/d' map.toml >no_height.toml
sed 's/\[ms\]/[us]/' map.toml >too_fast.toml
printf '[frame]\nworld = "nwu"\n' | cat - map.toml >frame.toml
printf 'vx_mps = "x"\n' | cat map.toml - >one_axis.toml
{ cat map.toml; for key in qw qx qy qz roll pitch yaw; do echo "$key = \"x\""; done; } >two_attitudes.toml
# An OctoMap of two free cubes, from (-1.6, -1.6, -1.6) to the origin and from there to (1.6, 1.6, 1.6); the rest of its
# extent is unknown. Two bytes a node, two bits a child: 00 unknown, 10 free, 11 inner.
{
  printf '# Octomap OcTree binary file\nid OcTree\nsize 25\nres 0.1\ndata\n\x03\xc0'
  for _ in 1 2 3 4 5 6 7 8 9 10; do printf '\x00\xc0'; done
  printf '\x00\x40'
  for _ in 1 2 3 4 5 6 7 8 9 10; do printf '\x03\x00'; done
  printf '\x01\x00'
} >two_rooms.bt

# usage
refused 64 "--nonsense" fly --nonsense
refused 64 "three numbers" fly --start 1,2 --goal 1,0,3
refused 64 "both --start and --goal" fly --start 1,0,1
refused 64 "'-3' is below 0" fly --seed -3
refused 64 "is too large" fly --seed 99999999999999999999 --ends
refused 64 "takes a number from 1e-06" "${fly[@]}" --sigma-scale 0
refused 64 "finite number" "${fly[@]}" --sigma-scale inf
refused 64 "finite number" plan --map builtin:narrow-gap --model $quad --vehicle $quad --start 1,0,1 --goal 5,0,1 --vmax nan
refused 64 "takes a number from 0.5 to 0.99;" calibrate --log a.csv --vehicle $quad --quantile 2
refused 64 "'none' is not one of tight, paper" plan --map builtin:narrow-gap --model $quad --vehicle $quad --start 1,0,1 --goal 5,0,1 --method none
refused 64 "no model of its own" "${fly[@]}" --vehicle own.toml
refused 64 ".svg or .png" field --map builtin:narrow-gap --model $quad --slice z=1 --out s.jpg
[[ ! -e s.jpg ]] || { echo "s.jpg was written"; failed=1; }
refused 64 "--vehicle" reach --track gap.csv
refused 64 "exactly one" field --map builtin:narrow-gap --model $quad
refused 64 "z=0.5" field --map builtin:narrow-gap --model $quad --slice w=3
refused 64 "continuous" reach --vehicle $quad --track gap.csv --method paper --loop vehicle
refused 64 "magic" reach --vehicle $quad --track gap.csv --method magic
# inputs that are not there
refused 66 "absent.bt" fly --map absent.bt
refused 66 "apartment" fly --map builtin:no-such-world
refused 66 "absent.toml" fly --vehicle absent.toml
refused 66 "absent.csv" reach --vehicle $quad --track absent.csv
refused 66 "absent.toml" simulate --map builtin:narrow-gap --vehicle $quad --flight absent.toml --out log.csv
# what would never end: a FIFO without a writer, a device without an end
refused 66 "fifo: is a FIFO; needs an OctoMap file" fly --map fifo
refused 66 "/dev/zero: is a device; needs an OctoMap file" fly --map /dev/zero
refused 66 "fifo: is a FIFO; needs the path of a TOML file" fly --model fifo
refused 66 "/dev/zero: is a device; needs the path of a TOML file" fly --vehicle /dev/zero
refused 66 "fifo:1: is a FIFO; needs a readable CSV file" reach --vehicle $quad --track fifo
refused 66 "/dev/zero:1: is a device; needs a readable CSV file" field --map builtin:narrow-gap --model $quad --points /dev/zero
refused 66 "fifo:1: is a FIFO; needs a flight specification" simulate --map builtin:narrow-gap --vehicle $quad --flight fifo --out log.csv
refused 66 "/dev/zero:1: is a device; needs a raw log" replay --log /dev/zero
refused 66 "fifo:1: is a FIFO; needs a raw log" replay --log fifo
# bad data
refused 65 "corrupt.bt" fly --map corrupt.bt
refused 65 "gap.csv:4:" reach --vehicle $quad --track gap.csv
refused 65 "indefinite.csv:3:" reach --vehicle $quad --track indefinite.csv
refused 65 "word.csv:3:" reach --vehicle $quad --track word.csv
refused 65 "cmd_z_m" reach --vehicle $quad --track no_z.csv
refused 65 "z_m" field --map builtin:narrow-gap --model $quad --points no_z_points.csv
refused 65 "spec_wall.toml" simulate --map builtin:narrow-gap --vehicle $quad --flight spec_wall.toml --out log.csv
# configuration
refused 78 "unknown_key.toml:4:" fly --model unknown_key.toml
refused 78 "spec_key.toml:4:" simulate --map builtin:narrow-gap --vehicle $quad --flight spec_key.toml --out log.csv
# nothing is overwritten
refused 73 "--force" fly --report exists
refused 73 "--force" fly --log exists
# what cannot be written is said before the work: no world was built
for out in nowhere/out.html /dev/null/out.html; do
  refused 73 "$out:1: cannot be created" fly --report $out
  refused 73 "$out:1: cannot be created" fly --log $out
  refused 73 "$out:1: cannot be created" compare --report $out
  refused 73 "$out:1: cannot be created" compare --out $out
  refused 73 "$out:1: cannot be created" calibrate --log a.csv --vehicle $quad --out $out
  refused 73 "$out:1: cannot be created" study --log a.csv --vehicle $quad --report $out
  refused 73 "$out:1: cannot be created" simulate --map gone.bt --vehicle gone.toml --flight gone.toml --out $out
done
refused 73 "cannot be created" fly --force --report .
refused 73 "--force" field --map builtin:narrow-gap --model $quad --slice z=1 --out exists
# places that cannot be flown from or to
refused 69 "occupied" "${fly[@]}" --start 3,1.2,1 --goal 5,0,1
refused 69 "unknown" fly --map two_rooms.bt --start 0.8,-0.8,0.8 --goal 0.8,0.8,0.8
refused 69 "not hover-safe" "${fly[@]}" --start 1,-1.75,1 --goal 5,0,1
refused 69 "outside the map" "${fly[@]}" --start 1,0,1 --goal 50,0,1
refused 69 "is occupied" field --map builtin:narrow-gap --model $quad --at 3,1.2,1
refused 69 "is outside the map" field --map builtin:narrow-gap --model $quad --at 50,0,1
refused 69 "is unknown" field --map two_rooms.bt --model $quad --at 0.8,-0.8,0.8
refused 69 "start_blocked" plan --map builtin:narrow-gap --model $quad --vehicle $quad --start 3,1.2,1 --goal 5,0,1
grep -q '^status  *start_blocked' stdout || { echo "plan does not say its status on stdout"; failed=1; }
refused 69 "goal_blocked" plan --map builtin:narrow-gap --model $quad --vehicle $quad --start 1,0,1 --goal 50,0,1 --json
python3 -c 'import json, sys; assert json.load(open("stdout"))["status"] == "goal_blocked"' || { echo "plan --json is not JSON when refused"; failed=1; }

# a list of points says nothing of those inside a wall, and is not refused for them
printf 'x_m,y_m,z_m\n1,0,1\n3,1.2,1\n' >points.csv
"$backwash" field --map builtin:narrow-gap --model $quad --points points.csv --json >points.json || { echo "field --points is refused"; failed=1; }
python3 -c 'import json; free, wall = json.load(open("points.json"))["points"]; assert free["sigma"] and wall["sigma"] is None' || failed=1

# What is misspelt is told before what is missing, and what was meant; values that are none, twice or empty.
refused 64 "no option '--modle', did you mean --model?" plan --map builtin:narrow-gap --modle $quad
for verb in plan reach field feasibility report import replay adapt; do
  refused 64 "no option '--seed'" $verb --seed -3
done
for verb in fly simulate compare calibrate study; do refused 64 "--seed: '-3' is below 0" $verb --seed -3; done
refused 64 "'extra' is not expected here" fly extra
refused 64 "--seed: '1.5' is no whole number of 0 or more" fly --seed 1.5
refused 64 "--seed: '' is no whole number" fly --seed ""
refused 64 "--seed is given 2 times; give it once" fly --seed 1 --seed 2
refused 64 "--report needs a value" fly --report
refused 64 "--report: is empty" fly --report ""
refused 64 "--json takes no value" fly --json=3
refused 64 "from 1e-06 to 1e+06" fly --sigma-scale 1e308
refused 64 "from 1 to 100000" compare --flights 0
refused 64 "two outputs" fly --report both.html --log both.html
refused 64 "two outputs" study --log a.csv --vehicle $quad --report both.html --out ./both.html
refused 64 "--judge fits nothing" calibrate --log a.csv --vehicle $quad --judge --out model.toml
refused 64 "--design" study --log a.csv --vehicle $quad --start 1,0,1
refused 64 "not finite" field --map builtin:narrow-gap --model $quad --slice z=nan
refused 65 "the map spans z from" field --map builtin:narrow-gap --model $quad --slice z=100
printf 'x_m,y_m,z_m\n' >none.csv
refused 65 "has no point" field --map builtin:narrow-gap --model $quad --points none.csv
refused 64 "is no kind of recording; known are airgarage" import nanobench
refused 64 "without --out" import --propose ms.csv -o logs
refused 65 "no ULog magic; give a .ulg file" calibrate --log corrupt.ulg --vehicle $quad
refused 65 "backwash export --csv" study --log corrupt.bwlog --vehicle $quad
refused 65 "backwash export --csv" calibrate --log corrupt.bwlog --vehicle $quad
printf 'backwash raw log 3\n' >begun.bwlog
refused 65 "no tick flew a set-point" study --log begun.bwlog --vehicle $quad
refused 65 "no tick flew a set-point" export begun.bwlog --csv begun.csv
refused 64 "give --mcap, --csv or both" export begun.bwlog
refused 64 "two outputs" export begun.bwlog --mcap both.out --csv ./both.out
refused 66 "" export none.bwlog --mcap none.mcap
refused 65 "does not begin as a raw log" export ms.csv --mcap none.mcap
refused 65 "does not say which part" export begun.bwlog begun.bwlog --mcap none.mcap
printf '\x89MCAP0\r\n' >begun.mcap
refused 65 "byte 8: no channel /backwash/raw_log" replay --log begun.mcap
refused 64 "needs two logs" merge begun.bwlog -o both.mcap
refused 64 "is no autopilot's log; give" merge begun.bwlog begun.mcap -o both.mcap
refused 65 "no answer of the autopilot to TIMESYNC" merge begun.bwlog corrupt.ulg -o both.mcap
refused 74 "cannot be written to its end" export begun.bwlog --mcap /dev/full --force
# tables that no flight can be: gravity in the acceleration, heights downwards, an attitude without length
flown() {
  awk -v z="$1" -v a="$2" -v q="$3" 'BEGIN { print "t_s,x_m,y_m,z_m,ax_mps2,ay_mps2,az_mps2,qw,qx,qy,qz"
    for (i = 0; i < 300; ++i) printf "%.2f,2,2,%.4f,0,0,%g,%g,0,0,0\n", i / 50, z + 0.05 * sin(i / 20), a, q }'
}
flown 1.2 9.81 1 >gravity.csv && flown -1.2 0 1 >downwards.csv && flown 1.2 0 0 >no_attitude.csv && flown 1.2 0 1 >sound.csv
# tells WORDS ARGUMENTS…: goes on without what is wrong, and says so on stderr
tells() {
  "$backwash" "${@:2}" >stdout 2>stderr || { echo "${*:2}: $(cat stderr)"; failed=1; }
  grep -qF -- "$1" stderr || { echo "${*:2}: '$1' is not said but: $(cat stderr)"; failed=1; }
}
refused 65 "gravity.csv:1: az_mps2 has a median of 9.81 m/s²" study --log gravity.csv --vehicle $quad
tells "gravity.csv:1: az_mps2 has a median of 9.81 m/s²" study --log sound.csv gravity.csv --vehicle $quad --json
python3 -c 'import json; said = json.load(open("stdout")); assert said["flights"] == 1 and said["left_out"][0]["log"] == "gravity.csv"' || failed=1
refused 65 "downwards.csv:1: lies where the map lets no craft be: 0.0 % inside of something, 0.0 % too near for its body, 100.0 % outside of the map, first at t_s 0.00 at 2.00,2.00,-1.20" \
  study --log downwards.csv --vehicle $quad --map builtin:apartment
tells "no_attitude.csv:1: qw, qx, qy and qz have no length of 1 in 300 of 300 rows" study --log no_attitude.csv --vehicle $quad
echo "t_s,x_m" >short.csv
tells "short.csv:1: no column 'y_m'" study --log sound.csv short.csv --vehicle $quad
"$backwash" study --log gravity.csv short.csv --vehicle $quad >stdout 2>stderr
[[ $? == 65 && $(wc -l <stderr) == 3 ]] || { echo "none of two logs is left: $(cat stderr)"; failed=1; }
refused 66 "absent.csv" study --log sound.csv absent.csv --vehicle $quad
refused 64 "--map builtin:apartment is followed by no --log" \
  study --map builtin:apartment --map builtin:narrow-gap --log sound.csv --vehicle $quad
head -1 sound.csv >header_only.csv
tells "header_only.csv:1: 0 rows are no flight" study --log sound.csv header_only.csv --vehicle $quad
sed '5s/,[^,]*$/,nan/' sound.csv >gap.csv
tells "1 of 300 rows left out: gaps in $(head -1 sound.csv | sed 's/.*,//')" study --log gap.csv --vehicle $quad
refused 65 "needs 4 flights or more that are not judged" study --log sound.csv --reference sound.csv --vehicle $quad
refused 65 "gravity.csv:1: az_mps2" study --log sound.csv --reference gravity.csv --vehicle $quad
refused 66 "quad-5in: no built-in vehicle; give builtin:quad-5in or" vehicle print quad-5in
refused 66 "builtin:quad-5in: no built-in daemon" vehicle print builtin:quad-5in --kind daemon
refused 64 "'modle' is not one of vehicle, model, daemon" vehicle print $quad --kind modle
sed 's/^attitude_lag = 0.05/attitude_lag = 0.9/' "$here/../../core/config/files/quad-5in.vehicle.toml" >lag.toml
refused 78 "lag.toml:10: key 'controller' = {…}: loop is unstable" vehicle check --vehicle lag.toml
tune=(vehicle tune --map builtin:narrow-gap --model $quad --vehicle $quad --start 1,0,1 --goal 5,0,1)
refused 66 "is a directory; needs the autopilot's parameter file" "${tune[@]}" --parameters .
refused 66 "is a device; needs the autopilot's parameter file" "${tune[@]}" --parameters /dev/zero
refused 74 "cannot be written to its end" simulate --map builtin:narrow-gap --vehicle $quad --flight spec_good.toml --out /dev/full --force
[[ ! -e both.html ]] || { echo "one of two outputs was written"; failed=1; }

# A name that is no UTF-8: escaped in messages, replaced in JSON, never a defect; a table as a spreadsheet writes it.
foreign=$(printf 'f\xffn.csv')
refused 66 'f\xffn.csv' adapt "$foreign" --vehicle $quad
"$backwash" simulate --map builtin:narrow-gap --vehicle $quad --flight spec_good.toml --out "$foreign" --json >simulated.json ||
  { echo "simulate into a foreign name fails"; failed=1; }
python3 -c 'import json; assert json.load(open("simulated.json"))["log"] == "f\ufffdn.csv"' || failed=1
{ printf '\xef\xbb\xbf'; sed 's/$/\r/' "$foreign"; } >sheet.csv
"$backwash" simulate --map builtin:narrow-gap --vehicle $quad --setpoints sheet.csv --out again.csv >/dev/null ||
  { echo "a table with a byte order mark is refused"; failed=1; }

# verbs that are none, and a bare call, without a verb to name
for wrong in frobnicate "vehicle frobnicate"; do
  "$backwash" $wrong >stdout 2>stderr
  [[ $? == 64 && $(wc -l <stderr) == 1 && $(<stderr) == *"no verb 'frobnicate': one of "* ]] || { echo "$wrong: $(<stderr)"; failed=1; }
done
grep -q "no verb 'stdy', did you mean 'study'?: one of fly" <("$backwash" stdy 2>&1) || { echo "stdy: study was meant"; failed=1; }
grep -q 'no verb .frobnicate.: one of fly, plan,' <("$backwash" frobnicate 2>&1) || { echo "frobnicate: the verbs are not named"; failed=1; }

# standard output that cannot be written is told
for full in "field --map builtin:narrow-gap --model $quad --at 1,0,1" "field --map builtin:narrow-gap --model $quad --at 1,0,1 --json" \
  --help --version "fly --help"; do
  "$backwash" $full >/dev/full 2>stderr
  [[ $? == 74 && $(wc -l <stderr) == 1 && $(<stderr) == *"standard output"* ]] || { echo "$full on a full disk: $(<stderr)"; failed=1; }
done

# a bare call is a usage error as well
"$backwash" >stdout 2>stderr
[[ $? == 64 && $(wc -l <stderr) == 1 ]] || { echo "bare call: not 64 with one line"; failed=1; }
refused 66 'absent.toml' import --map-columns absent.toml ms.csv -o logs
refused 78 "unit.toml:2: key 'columns.t_s'" import --map-columns unit.toml ms.csv -o logs
refused 78 "unknown_column.toml:5: key 'columns.height'" import --map-columns unknown_column.toml ms.csv -o logs
refused 78 "key 'columns.z_m'" import --map-columns no_height.toml ms.csv -o logs
refused 78 "is 'enu', 'ned', or our x, y and z" import --map-columns frame.toml ms.csv -o logs
refused 78 'give all of vx_mps, vy_mps, vz_mps or none' import --map-columns one_axis.toml ms.csv -o logs
refused 78 'give this or qw' import --map-columns two_attitudes.toml ms.csv -o logs
refused 65 'is the unit of the time right?' import --map-columns too_fast.toml ms.csv -o logs
refused 65 "no column 't', which the column map takes for t_s" import --map-columns map.toml no_z_points.csv -o logs
refused 65 'called like a time' import --propose no_z_points.csv
printf 'recording,ceiling\nms,yes\n' >no_number.csv
printf 'recording,z_m\nms,1\n' >measured.csv
refused 66 'absent.csv' import --map-columns map.toml ms.csv -o logs --labels absent.csv
refused 65 "no_number.csv:2: column 'ceiling' holds 'yes'" import --map-columns map.toml ms.csv -o logs --labels no_number.csv
refused 64 "without --out and --labels" import --propose ms.csv --labels measured.csv
refused 64 'no kind of recording' import nanobench ms.csv -o logs
refused 64 'no recording given' import ulog -o logs
refused 65 'no format message (FMT)' import ardupilot corrupt.bt -o logs
refused 64 'in this log 1 faces 2' study --vehicle $quad --log flight.bin --reference sound.csv
printf 't_s,x_m,y_m,z_m\n0,1,1,1\n0.02,1,1,1\n' >sparse.csv
refused 64 'adapt needs logs and --vehicle' adapt --vehicle $quad
refused 66 'absent.csv' adapt absent.csv --vehicle $quad
refused 65 "no columns 'vx_mps'" adapt sparse.csv --vehicle $quad
refused 64 '--gusts' adapt absent.csv --vehicle $quad --gusts strong
refused 64 '--out' import --map-columns map.toml ms.csv
gzip -k ms.csv && head -c 100 ms.csv.gz >short.csv.gz
refused 65 'cut short' import --map-columns map.toml short.csv.gz -o logs
exit $failed
