#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Command lines of the daemon, the ground station and the bench that cannot be carried out: the documented exit code, and one
# line on stderr that says where and what would be right; nothing on standard output.
#   bad_lines.sh SOURCE_DIR BUILD_DIR
set -uo pipefail
source_dir=${1:?usage: bad_lines.sh SOURCE_DIR BUILD_DIR} bin=$(realpath "${2:?}")/services
export BACKWASH_DOMAIN=${BACKWASH_DOMAIN:-199}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 70
failed=0

# refused CODE WORDS PROGRAM ARGUMENTS…: the last line on stderr has the words.
refused() {
  local code=$1 words=$2 got
  shift 2
  prlimit --cpu=20 "$bin/$@" >stdout 2>stderr
  got=$?
  if [[ $got != "$code" || -s stdout || $(tail -n 1 stderr) != *"$words"* || $(wc -l <stderr) -gt 2 ]]; then
    echo "$*: wanted exit $code and one line with '$words'; got exit $got and:"
    sed 's/^/  /' stdout stderr
    failed=1
  fi
}
# configuration KEY VALUE: the file that ships with one other value.
configuration() { sed "s|^$1 = .*|$1 = $2|" "$source_dir/core/config/files/backwashd.daemon.toml" >"$work/$1.toml"; }
configuration file '"/nowhere/flight.bwlog"'
sed -i 's|^device = .*|device = "/dev/absent"|' file.toml
configuration vehicle '"absent.toml"'
configuration model '"absent.toml"'
configuration baud '"fast"'

refused 64 "--config" backwashd
refused 66 "absent.toml" backwashd --config absent.toml
refused 66 "absent.toml" backwashd --config vehicle.toml --check-config
refused 66 "absent.toml" backwashd --config model.toml --check-config
refused 78 "baud" backwashd --config baud.toml --check-config
refused 73 "/nowhere/flight.bwlog" backwashd --config file.toml

refused 64 "no verb 'frobnicate': one of enable," backwashctl frobnicate
refused 64 "a verb is needed" backwashctl
refused 64 "from 0 to 230" backwashctl --domain 300 status
refused 64 "number above 0" backwashctl --timeout 0 status
refused 64 "finite" backwashctl goto 1,2,nan
refused 64 "finite" backwashctl takeoff --height inf
refused 71 "nowhere0" backwashctl --interface nowhere0 status
refused 64 "no verb 'enabl', did you mean 'enable'?" backwashctl enabl
refused 64 "no option '--jaw', did you mean --yaw?" backwashctl goto 1,2,3 --jaw 1
refused 64 "goal has 2 values; it takes 3" backwashctl goto 1,2
refused 64 "goal: 'b' is no number" backwashctl goto 1,b,3
refused 64 "'-1' is not expected here" backwashctl enable -1
refused 64 "'a b' is no namespace" backwashctl --namespace "a b" status
refused 64 "is empty" backwashctl --station "" status
printf 'x,y\xff\n1,2\n' >foreign.csv
refused 65 'x,y\xff' backwashctl follow foreign.csv
printf 'x_m,y_m,z_m\r\n1,2,3\r\n' >crlf.csv
refused 69 "no daemon answered" backwashctl --timeout 0.2 follow crlf.csv
# With --json what became of a command is on standard output too.
"$bin/backwashctl" --timeout 0.2 land --wait --json >stdout 2>stderr
[[ $? == 69 && $(<stderr) == *"no daemon answered"* ]] || { echo "land --json: $(<stderr)"; failed=1; }
python3 -c 'import json; a = json.load(open("stdout")); assert a["verb"] == "land" and not a["accepted"] and a["done"] is None and "no daemon" in a["reason"]' || failed=1

bench=(backwash-bench --map builtin:apartment --duration 1 --domain "$BACKWASH_DOMAIN")
at=(--start 2,2,1.2)
refused 64 "--start" "${bench[@]}" --link link
refused 64 "--link or --in-loop" "${bench[@]}" "${at[@]}"
refused 64 "is below 0" "${bench[@]}" "${at[@]}" --link link --seed -3
refused 64 "finite" "${bench[@]}" --start 2,2,inf --link link
refused 66 "absent.toml" "${bench[@]}" "${at[@]}" --link link --vehicle absent.toml
refused 69 "--start is not in free space" "${bench[@]}" --start 200,2,1.2 --link link
refused 71 "--interface" "${bench[@]}" "${at[@]}" --link link --interface nowhere0
refused 73 "--link /nowhere/link" "${bench[@]}" "${at[@]}" --link /nowhere/link
refused 73 "--log /nowhere/log.csv" "${bench[@]}" "${at[@]}" --link link --log /nowhere/log.csv
refused 73 "--wire /nowhere/wire.csv" "${bench[@]}" "${at[@]}" --link link --wire /nowhere/wire.csv
refused 74 "--in-loop /dev/absent" "${bench[@]}" "${at[@]}" --in-loop /dev/absent
refused 74 "tcpin:ADDRESS:PORT" "${bench[@]}" "${at[@]}" --in-loop tcpin:127.0.0.1:port
refused 66 "no such world" backwash-bench --map builtin:nowhere "${at[@]}" --link link
refused 64 "takes a number above 0" "${bench[@]}" "${at[@]}" --link link --crate 1,2,1 --crate-edge 0
refused 64 "0 or more" "${bench[@]}" "${at[@]}" --link link --stop-odometry -3
refused 64 "--start has 2 values; it takes 3" "${bench[@]}" --start 2,2 --link link
refused 64 "--start: 'a' is no number" "${bench[@]}" --start a,b,c --link link
refused 64 "--seed: '1.5' is no whole number" "${bench[@]}" "${at[@]}" --link link --seed 1.5
refused 64 "--link and --in-loop exclude each other" "${bench[@]}" "${at[@]}" --link link --in-loop tcpin:127.0.0.1:4560
refused 64 "--namespace: is empty" "${bench[@]}" "${at[@]}" --link link --namespace ""
for wrong in MPC_XY_P =3 MPC_XY_P=nan MPC_XY_P=; do
  refused 64 "--parameter $wrong: is not NAME=NUMBER" "${bench[@]}" "${at[@]}" --link link --parameter $wrong
done
mkdir folder
refused 66 "folder: is no file that can be read; needs a timeline" "${bench[@]}" "${at[@]}" --link link --faults folder
refused 66 "absent.toml: is no file that can be read" "${bench[@]}" "${at[@]}" --link link --faults absent.toml
# What is there stays: a file in the link's place, and logs without --force.
echo "of somebody else" >kept
refused 73 "kept: exists and is no symbolic link" "${bench[@]}" "${at[@]}" --link kept
refused 73 "--log kept: exists already" "${bench[@]}" "${at[@]}" --link link --log kept
refused 73 "--wire kept: exists already" "${bench[@]}" "${at[@]}" --link link --wire kept
[[ $(<kept) == "of somebody else" ]] || { echo "a file in the way was replaced"; failed=1; }

# What a program has to say where standard output is full.
for program in backwashd backwashctl backwash-bench; do
  "$bin/$program" --help >/dev/full 2>stderr
  [[ $? == 74 && $(<stderr) == *"standard output"* ]] || { echo "$program --help on a full disk: $(<stderr)"; failed=1; }
done
"$bin/backwashd" --config builtin:backwashd --check-config >/dev/full 2>stderr
[[ $? == 74 ]] || { echo "--check-config on a full disk: $(<stderr)"; failed=1; }
exit $failed
