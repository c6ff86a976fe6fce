#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What `map` refuses: the documented exit code, and one line that names the file and what would be right. Nothing is written then.
#   bad_maps.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
set +e
failed=0
refused() { # CODE WORDS ARGUMENTS …
  local code=$1 words=$2 got
  shift 2
  prlimit --cpu=30 "$backwash" map "$@" >stdout 2>stderr
  got=$?
  if [[ $got != "$code" || $(wc -l <stderr) != 1 || $(<stderr) != "backwash map"*": "*"$words"* || -e out.bt ]]; then
    echo "backwash map $*: wanted exit $code and one line with '$words', and no out.bt; got exit $got and: $(<stderr)"
    failed=1
    rm -f out.bt
  fi
}
convert() { refused "$1" "$2" convert "${@:3}" -o out.bt; }

printf 'v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nf 1 2 3 4\n' >floor.obj
printf 'v 0 0 0\nv 4000 0 0\nv 4000 3000 0\nf 1 2 3\n' >mm.obj
printf 'ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n500000 5600000 0\n' >utm.ply
printf 'x,y,z\n500000,5600000,101\n500004,5600003,103\n' >utm.csv
printf 'x,y,z\n1,1,1\n2,2,2\n' >cloud.csv
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n' >indices.obj
printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n1 1 1\n' >short.ply
printf 'LASF' >room.las
printf '# Octomap OcTree binary file\nid OcTree\nsize 5\nres 0.1\ndata\n' >short.bt
mkfifo fifo.ply
touch there.bt

# usage
refused 64 "convert, info" frobnicate
refused 64 "file is required" convert -o out.bt
refused 64 "--out is required" convert floor.obj
refused 64 "name it .bt" convert floor.obj -o out.ot
convert 64 "number from 0.001 to 10;" floor.obj --resolution 0
convert 64 "above 0;" floor.obj --scale -1
convert 64 "is not one of x, y, z" floor.obj --up w
convert 64 "--rotate: '1,2' must be three angles yaw,pitch,roll in rad" floor.obj --rotate 1,2
convert 64 "--origin: '1,2,3,4' must be three numbers" floor.obj --origin 1,2,3,4
convert 64 "--crop: '0,0,0,1,1' must be six numbers" floor.obj --crop 0,0,0,1,1
convert 64 "must have x0 < x1" floor.obj --crop 0,0,0,1,-1,1
convert 64 "--free-from: '1,nan,3' must be three numbers" floor.obj --free-from 1,nan,3
convert 64 "number from 1 to 65535;" cloud.csv --points-least 0
convert 64 "--scale makes voxels of 100.0000 m" builtin:apartment --scale 1000
convert 64 "are of clouds; floor.obj is a mesh" floor.obj --sensor 1,1,1
convert 64 "are of clouds; builtin:apartment is none" builtin:apartment --points-least 2
refused 64 ".svg or .png" info builtin:apartment --out a.jpg
refused 64 "--height is of the picture" info builtin:apartment --height 1
refused 64 "--model is asked with a --vehicle" info builtin:apartment --model builtin:quad-5in
# files
convert 66 "absent.ply: cannot be read" absent.ply
convert 66 "absent.bt" absent.bt
convert 66 "fifo.ply: is a FIFO; needs a mesh, a cloud or a recording" fifo.ply
convert 66 "builtin:nowhere" builtin:nowhere
refused 66 "absent.bt" info absent.bt
convert 65 "pdal translate room.las room.ply" room.las
convert 65 "indices.obj:4: '9' names none of 3 vertices" indices.obj
convert 65 "short.ply:10: ends too early in vertex 3 of 3" short.ply
convert 65 "short.bt" short.bt
refused 65 "short.bt" info short.bt
# sizes
convert 65 "--scale 0.001 if that is mm" mm.obj
convert 65 "536870912 are the most: a smaller --crop, or --resolution " cloud.csv --resolution 0.001
convert 65 "in 32 bits are off by up to 0.334 m" utm.ply
convert 65 "--origin 500002,5600002,102" utm.csv
convert 65 "nothing of it is in the map" floor.obj --crop 10,10,10,11,11,11
convert 65 "fewer --points-least" cloud.csv --points-least 2
# places
convert 69 "--free-from (2.00, 2.00, 0.00) is occupied" floor.obj --free-from 2,2,0
convert 69 "--free-from (9.00, 2.00, 0.00) is outside the map" floor.obj --free-from 9,2,0
refused 69 "--height 9.00 is outside the map, whose heights are " info builtin:apartment --out a.svg --height 9
# outputs
refused 73 "there.bt:1: exists already" convert floor.obj -o there.bt
refused 73 "nowhere/out.bt:1: cannot be created" convert absent.obj -o nowhere/out.bt
ln -s /dev/full full.bt
refused 74 "full.bt:1: cannot be written to its end" convert floor.obj -o full.bt --force

# What was asked with --origin is done, by the words of the refusal; --force overwrites.
"$backwash" map convert utm.csv --origin 500002,5600002,102 -o utm.bt >/dev/null || { echo "the origin that was told does not do"; failed=1; }
"$backwash" map convert floor.obj -o there.bt --force >stdout || { echo "--force does not overwrite"; failed=1; }
grep -q 'note: 2 of 2 triangles lie on faces of voxels and occupy both sides' stdout || { echo "a floor on faces: $(<stdout)"; failed=1; }
exit $failed
