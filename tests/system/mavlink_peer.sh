#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The link against an independent MAVLink library, node-mavlink from the npm registry, as the flight controller: over a serial
# line and over UDP, both directions, unsigned, signed, with another key, and unsigned where a key is asked for. Then the daemon
# itself with a key (docs/faults.md row 29).
#   mavlink_peer.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/tests/support/skip.sh"
needs_peers
source "$source_dir/services/bench/session.sh"
key=000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f other=${key//0/f}

# meet NAME TRANSPORT OUR_KEY PEER_KEY: three seconds of the peer, ours around them; what each heard goes to $work/NAME.ours and .peer.
meet() {
  local name=$1 where='' link
  : >"$work/$name.out"
  "$build/tests/link_peer" "$2" ${3:+"$3"} >"$work/$name.out" &
  link=$!
  more_pids+=("$link")
  for _ in $(seq 100); do where=$(head -n 1 "$work/$name.out"); [[ -n $where ]] && break; sleep 0.05; done
  node "$source_dir/tests/bridge/peer/peer.cjs" "$modules" "$2" "$where" 3 ${4:+"$4"} >"$work/$name.peer"
  kill -TERM "$link"
  wait "$link" || die "$name: our end failed"
  tail -n 1 "$work/$name.out" >"$work/$name.ours"
}
for transport in pty udp; do
  meet "$transport.unsigned" $transport '' ''
  meet "$transport.signed" $transport $key $key
  meet "$transport.other_key" $transport $key $other
  meet "$transport.not_signed" $transport $key ''
  meet "$transport.no_key" $transport '' $key
done
python3 - "$work" <<'PYTHON'
import json, sys
for transport in "pty", "udp":
    for case in "unsigned", "signed", "other_key", "not_signed", "no_key":
        ours, peer = (json.load(open(f"{sys.argv[1]}/{transport}.{case}.{end}")) for end in ("ours", "peer"))
        print(transport, case, ours, peer)
        assert ours["frames"] > 100 and ours["bad_crc"] == ours["skipped"] == 0, ours
        if case in ("other_key", "not_signed"):
            assert ours["vehicle"] == ours["good"] == ours["sent"] == peer["frames"] == 0, (ours, peer)
            assert ours["wrong" if case == "other_key" else "unsigned"] == ours["frames"]
            continue
        assert ours["vehicle"] == 42 and ours["armed"] and ours["attitude"] and ours["clock"], ours
        assert ours["position"] == [-2.25, 1.5, 3.125] and ours["arm"] == 4 and ours["parameter"] == 0.5, ours
        assert abs(ours["voltage"] - 15.6) < 1e-9, ours
        assert peer["sender"] == [42, 191] and peer["text"] == "of an independent peer", peer
        assert peer["odometry"] == [5, 4, -6], peer
        *numbers, mask = peer["setpoint"]
        assert mask == 2048 and all(abs(a - b) < 1e-6 for a, b in zip(
            numbers, [2, 1, -3, -0.25, 0.5, -0.125, 0, -1, -1, 1.5707963 - 0.5])), peer
        assert peer["kinds"]["SET_POSITION_TARGET_LOCAL_NED"] > 80, peer
        assert peer["wrong"] == 0 and peer["rising"], peer
        if case == "signed":
            assert peer["good"] == peer["frames"] and 1 <= ours["replayed"] <= 10, (ours, peer)  # those sent twice
            assert ours["good"] + ours["replayed"] == ours["frames"], ours
        else:
            assert peer["unsigned"] == peer["frames"], peer
PYTHON

# The daemon with a key: 3 s of a controller that does not sign, then 3 s of one that does. Disarmed: a daemon that starts
# beside an armed vehicle says nothing at all (docs/faults.md row 36).
device=udpin:127.0.0.1:14599 system=42 more_link="signing_key_file = \"$work/key\""
write_configuration builtin:quad-5in "$work/flight.bwlog"
(umask 077 && echo $key >"$work/key")
chmod 0640 "$work/key"
code=0
"$build/services/backwashd" --config "$work/backwashd.toml" >"$work/refused" 2>&1 || code=$?
[[ $code == 78 ]] && grep -q "backwashd.toml:12: key 'link.signing_key_file' = .*needs 0600" "$work/refused" ||
  { cat "$work/refused"; die "a key that others may read was taken, exit $code"; }
chmod 0600 "$work/key"
"$build/services/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
daemon_pid=$!
for _ in $(seq 100); do grep -q 'backwashd runs' "$log" && break; sleep 0.1; done
run_peer() { DISARMED=1 node "$source_dir/tests/bridge/peer/peer.cjs" "$modules" udp 14599 3 ${1:+"$1"}; }
run_peer >"$work/silent"
"$build/services/backwashctl" --domain "$domain" status --json >"$work/status.json" 2>>"$log"
stop
grep -q 'no frame with a good signature' "$log" || die "the operator was not told"
"$build/services/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
daemon_pid=$!
for _ in $(seq 100); do [[ $(grep -c 'backwashd runs' "$log") == 2 ]] && break; sleep 0.1; done
run_peer $key >"$work/spoken"
stop
python3 - "$work" <<'PYTHON'
import json, sys
silent, status, spoken = (json.load(open(f"{sys.argv[1]}/{f}")) for f in ("silent", "status.json", "spoken"))
print("daemon", silent, status["frames_refused"], spoken)
assert silent["frames"] == 0 and status["frames_refused"] > 20 and not status["armed"], (silent, status)
assert spoken["frames"] > 3 and spoken["good"] == spoken["frames"] and spoken["rising"], spoken
assert spoken["sender"] == [42, 191], spoken
PYTHON
grep -Eq '^[0-9]{15}$' "$work/mavlink_signing.time" || die "no time was kept"
! grep -aq "$key" "$log" "$work"/*.bwlog || die "the key is in a log"
