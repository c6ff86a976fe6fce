#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Draws core/reach/figure.svg, the paper's figure: horizontal reachable sets along a flight, both methods, with the
# commands as dots. Usage: core/reach/figure.sh build/release/services/backwash
set -euo pipefail
backwash=$(realpath "$1")
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# 4 s along an S-shaped path at up to 1 m/s; the disturbance is strongest halfway, along y twice as strong as along x.
awk 'BEGIN {
  print "t_s,cmd_x_m,cmd_y_m,cmd_z_m,sigma_xx,sigma_xy,sigma_xz,sigma_yy,sigma_yz,sigma_zz"
  for (k = 0; k < 200; ++k) {
    t = k * 0.02; s = 0.02 + 0.25 * exp(-(t - 2) ^ 2)
    printf "%.2f,%.4f,%.4f,1,%.5f,0,0,%.5f,0,%.5f\n", t, 0.8 * t, 0.5 * sin(1.6 * t), s / 4, s, s / 4
  }
}' >track.csv
for method in tight paper; do
  "$backwash" reach --vehicle builtin:quad-5in --track track.csv --method $method --loop continuous |
    awk 'NR > 1 && (NR - 2) % 20 == 0' >$method.txt
done

# Table columns: 2, 3 centre; 5, 6, 8, 9 half widths along x, y and both diagonals. Vertices of the octagon: where the
# slabs meet, each edge at half width h of its normal.
awk '{
  split("", n); n[0] = $5; n[1] = $8; n[2] = $6; n[3] = $9; n[4] = $5; n[5] = $8; n[6] = $6; n[7] = $9
  for (i = 0; i <= 8; ++i) {
    a = i % 8; b = (i + 1) % 8; pi = atan2(0, -1); u = a * pi / 4; v = b * pi / 4; d = sin(v - u)
    printf "%.4f %.4f\n", $2 + (n[a] * sin(v) - n[b] * sin(u)) / d, $3 + (n[b] * cos(u) - n[a] * cos(v)) / d
  }
  print ""
}' tight.txt >octagons.txt

gnuplot <<'PLOT'
set terminal svg size 900,520 font "sans,13" background "white"
set output "figure.svg"
set size ratio -1
set samples 40
set xlabel "x, m"; set ylabel "y, m"; set key top right; set grid lc rgb "#e0e0e0"
plot "paper.txt" using 2:3:(2*$5):(2*$6) with ellipses fill solid 0.12 noborder fc rgb "#d95f02" notitle, \
     "" using 2:3:(2*$5):(2*$6) with ellipses fill empty lc rgb "#d95f02" title "paper", \
     "octagons.txt" using 1:2 with lines lw 1.5 lc rgb "#1b6ca8" title "tight (exact)", \
     "tight.txt" using 2:3 with points pt 1 ps 0.6 lc rgb "#1b6ca8" title "predicted centres", \
     "< tr , ' ' <track.csv | awk 'NR > 1 && (NR - 2) % 5 == 0'" using 2:3 with points pt 7 ps 0.35 lc rgb "#404040" title "commands"
PLOT
mv figure.svg "$here/figure.svg"
