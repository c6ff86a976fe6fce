#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Credentials that were made before a topic was there (docs/faults.md row 29). What is only shown is left out: the daemon
# says which topic and which command makes new credentials, flies, and sends the topics that are allowed. That command, as
# the daemon said it, ends the warnings. Without the right to tell its status no daemon starts.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
keys=$work/keys
credentials() { "$build/services/backwash" keys "$@" >>"$log" || die "backwash keys $*"; }
install_credentials() { # under a name that is not the holder's, as on a vehicle
  rm -rf "$work/security"
  cp -rp "$keys/drone" "$work/security"
}
granted() { # granted TOPIC …: the vehicle may write these alone
  credentials add "$keys" drone --role observer --force $(printf -- '--topic rt/backwash/%s ' "$@")
  install_credentials
}
credentials init "$keys"
credentials add "$keys" eyes --role vio
credentials add "$keys" pilot --role station
more_dds="security = \"$work/security\"" ctl_options=(--security "$keys/pilot")
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --security "$keys/eyes"

granted ack tube trajectory
write_configuration builtin:quad-5in "$work/mute.bwlog"
code=0
said=$(timeout 30 "$bin/backwashd" --config "$work/backwashd.toml" 2>&1) || code=$?
[[ $code != 0 && $code != 124 && $said == *'rt/backwash/status: the permissions of its credentials do not allow it'* ]] ||
  die "a daemon that may not tell its status: $code $said"

granted ack status tube trajectory
start_daemon builtin:quad-5in "$work/old.bwlog"
not_allowed=($("$source_dir/tests/support/topics.py" "$source_dir" | awk '$3 == "out" {print $1}' | grep -vxE 'ack|status|tube|trajectory'))
for topic in "${not_allowed[@]/#/rt/backwash/}" rt/diagnostics; do
  (($(grep -c "do not allow $topic, which is not sent" "$log") == 1)) || die "of $topic it is not said once that it is not allowed"
done
(($(grep -c 'which is not sent' "$log") == ${#not_allowed[@]} + 1)) || die 'a topic that is allowed is said not to be'
enable
ctl takeoff --height 1.2 --wait
ctl goto 0,0,1.2 --wait
ctl land --wait
kill -TERM "$daemon_pid" && wait "$daemon_pid" || die 'the daemon did not end well'

again=$(sed -n 's/.*KEYS, backwash \(keys add KEYS drone .*--force\) makes new ones.*/\1/p' "$log" | sort -u)
[[ $again && $again != *$'\n'* ]] || die "not one command for new credentials: $again"
"$bin/backwash" ${again//KEYS/$keys} >>"$log"
install_credentials
lines=$(wc -l <"$log")
start_daemon builtin:quad-5in "$work/new.bwlog"
! tail -n +"$((lines + 1))" "$log" | grep -q 'which is not sent' || die 'the new credentials allow no more than the old ones'
echo 'five topics left out and named, flown without them; none is left out with the credentials of the command that was said'
