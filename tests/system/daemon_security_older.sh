#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Credentials that were made before there were the topics that are shown (openssl signs such permissions): the daemon starts, names each
# topic that it may not send and the command that makes other credentials, and flies. Without its answers nobody could command it: no start.
#   daemon_security_older.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
bin=$build/services keys=$work/keys
credentials() { "$bin/backwash" keys "$@" >>"$log" || die "backwash keys $*"; }
credentials init "$keys"
credentials add "$keys" drone --role vehicle
credentials add "$keys" eyes --role vio
credentials add "$keys" pilot --role station

# without TOPIC …: the permissions of the vehicle allow all others.
without() {
  openssl smime -verify -text -CAfile "$keys/drone/permissions_ca.cert.pem" -in "$keys/drone/permissions.p7s" 2>>"$log" >"$work/permissions.xml"
  local topic
  for topic in "$@"; do
    grep -q "<topic>$topic</topic>" "$work/permissions.xml" || die "$topic was not allowed before"
    sed -i "s|<topic>$topic</topic>||" "$work/permissions.xml"
  done
  openssl smime -sign -text -in "$work/permissions.xml" -signer "$keys/authority/cert.pem" -inkey "$keys/authority/key.pem" \
    -out "$keys/drone/permissions.p7s" 2>>"$log" || die 'openssl signs no permissions'
}
more_dds="security = \"$keys/drone\"
tf = \"vehicle\"" ctl_options=(--security "$keys/pilot")
start_bench "$bin" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --log "$work/truth.csv" --security "$keys/eyes"
start_daemon builtin:quad-5in "$work/whole.bwlog"
! grep 'is not sent' "$log" || die 'a topic of new credentials is not allowed'
kill -TERM "$daemon_pid" && wait "$daemon_pid"

shown=(rt/backwash/{tube,trajectory,markers,disturbance} rt/diagnostics rt/tf)
without "${shown[@]}"
start_daemon builtin:quad-5in "$work/flight.bwlog"
for topic in "${shown[@]}"; do
  grep -q " $topic is not sent: the permissions in dds.security do not allow it.*backwash keys add FOLDER NAME --role vehicle --namespace backwash --force" "$log" ||
    die "nothing was said of $topic"
done
[[ $(grep -c 'is not sent' "$log") == "${#shown[@]}" ]] || die 'not one line for each topic'
enable
ctl takeoff --height 1.2 --wait
ctl goto 0,0,1.2 --wait
"$bin/backwashctl" --domain "$domain" "${ctl_options[@]}" status --json >"$work/status.json" || die 'no status'
python3 - "$work/status.json" <<'PYTHON' || die 'it did not fly there'
import json, math, sys
s = json.load(open(sys.argv[1]))
assert s["state"] == "tracking" and math.dist(s["position"], (0, 0, 1.2)) < 0.2 and s["samples_outside"] == 0, s
PYTHON
ctl land --wait
kill -TERM "$daemon_pid" && wait "$daemon_pid"
daemon_pid=''

# The command that it names makes credentials with which all is sent again.
credentials add "$keys" drone --role vehicle --namespace backwash --force
without rt/backwash/ack
write_configuration builtin:quad-5in "$work/mute.bwlog"
code=0
"$bin/backwashd" --config "$work/backwashd.toml" >"$work/said" 2>&1 || code=$?
cat "$work/said"
[[ $code == 78 ]] && grep -q 'rt/backwash/ack.*permissions.*backwash keys add' "$work/said" || die "without its answers: $code"
