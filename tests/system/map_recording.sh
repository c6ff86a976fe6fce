#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# `backwash map convert` of recordings that libraries of others wrote: the map is, bit for bit, that of the same points placed by matrices
# (tests/maps/peer). What cannot be placed is refused by name.
#   map_recording.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/tests/support/skip.sh"
needs_peers
needs zstd lz4
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
cd "$out"
die() { echo "$*"; exit 1; }
convert() { "$build/services/backwash" map convert "$@" --force; }
written() { node "$source_dir/tests/maps/peer/write_clouds.cjs" "$modules" "$1.mcap" "$1"; }
refused() { # refused KIND TEXT [OPTION …]
  local kind=$1 text=$2 code=0
  shift 2
  written "$kind"
  convert "$kind.mcap" -o no.bt "$@" >said 2>&1 || code=$?
  [[ $code == 65 && ! -e no.bt && $(wc -l <said) == 1 ]] && grep -qF -- "$text" said || die "$kind: $code $(<said)"
}
same() { cmp "$1.bt" "$1-csv.bt" || die "$1: another map than of the same points placed by matrices"; }

for kind in tf odometry placed; do
  written $kind
  convert $kind.mcap -o $kind.bt --json >$kind.json
  convert $kind.csv -o $kind-csv.bt --json >$kind-csv.json
  same $kind
  python3 - $kind.json $kind-csv.json $kind <<'PYTHON'
import json, sys
a, b = (json.load(open(f)) for f in sys.argv[1:3])
print(f"{sys.argv[3]}: {a['points']} points, {a['free_voxels']} free and {a['occupied_voxels']} occupied voxels")
assert a["points"] == b["points"] == 10 * 599 and a["points_not_finite"] == 10, a
assert a["free_voxels"] > 5000 and a["freed_voxels"] == b["freed_voxels"], a
frame = "camera_init" if sys.argv[3] == "placed" else "map"
notes = " ".join(a["notes"])
assert f"10 clouds of /points in frame '{frame}'" in notes and "1 of 11 clouds have no pose at their time" in notes, notes
PYTHON
done
for kind in zstd lz4; do
  written $kind
  [[ $(stat -c %s $kind.mcap) -lt $(stat -c %s tf.mcap) ]] || die "$kind: not smaller"
  convert $kind.mcap -o $kind.bt >said
  cmp $kind.bt tf.bt || die "$kind: another map than of the same recording without compression"
  # What does not unpack is damaged, wherever a bit turns: the same map, one of the rest with the share lost told, or none.
  python3 - $kind.mcap <<'PYTHON'
import random, sys
whole = open(sys.argv[1], "rb").read()
random.seed(7)
for n in range(12):
    b = bytearray(whole)
    b[random.randrange(3000, len(b) // 2)] ^= 1 << random.randrange(8)
    open(f"bad-{n}.mcap", "wb").write(b)
PYTHON
  for n in {0..11}; do
    code=0
    convert bad-$n.mcap -o no.bt >said 2>&1 || code=$?
    [[ $code == 65 && ! -e no.bt ]] || { [[ $code == 0 ]] && { grep -q 'it is damaged in [0-9]* places: [0-9.]* % of its messages lost' said || cmp no.bt tf.bt; }; } || die "$kind, bit $n: $code $(<said)"
    rm -f no.bt
  done
done
refused second 'holds clouds of /depth/points and /points; choose one by --topic'
convert second.mcap --topic /points -o second.bt >said
convert second.csv -o second-csv.bt >/dev/null
same second
refused second "holds no sensor_msgs/msg/PointCloud2 on /scan" --topic /scan
refused parents "frame 'base_link' is placed in 'odom' and in 'world'; record one of them"
refused bzip2 "a chunk is compressed by 'bzip2'; lz4 and zstd are read; write it without: mcap decompress FILE -o OTHER.mcap"
refused ros1 "is of ROS 1"
refused corner "/points: a point_step of 16 bytes does not hold x, y and z"

refused still "nothing says where frame 'lidar' was: its clouds would lie on each other"

# Cut short: what is whole is used, and that is told; so is what a bit that is not the writer's costs.
head -c 60000 tf.mcap >cut.mcap
convert cut.mcap -o cut.bt >said
grep -q 'it was cut short at byte [0-9]*: what is before is used' said || die "cut: $(<said)"
python3 -c 'b = bytearray(open("tf.mcap", "rb").read()); b[30000] ^= 1; open("bad.mcap", "wb").write(b)'
code=0
convert bad.mcap -o no.bt >said 2>&1 || code=$?
[[ $code == 0 ]] && grep -q 'it is damaged in 1 places: [0-9.]* % of its messages lost' said || die "damaged: $code $(<said)"
