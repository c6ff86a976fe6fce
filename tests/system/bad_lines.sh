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
  timeout 20 "$bin/$@" >stdout 2>stderr
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

# What a program has to say where standard output is full.
for program in backwashd backwashctl backwash-bench; do
  "$bin/$program" --help >/dev/full 2>stderr
  [[ $? == 74 && $(<stderr) == *"standard output"* ]] || { echo "$program --help on a full disk: $(<stderr)"; failed=1; }
done
"$bin/backwashd" --config builtin:backwashd --check-config >/dev/full 2>stderr
[[ $? == 74 ]] || { echo "--check-config on a full disk: $(<stderr)"; failed=1; }
exit $failed
