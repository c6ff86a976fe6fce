#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# An extended model changes what is simulated, in either air; the set-points of a log are flown again at its stamps. The
# specifications of the README fly in the rooms that it names.
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"

quad=builtin:quad-5in
cp "$here/../../core/config/files/quad-5in.model.toml" plain.toml
extended() { # FILE KIND VALUES
  { cat plain.toml; printf '\n[[extension.term]]\ncause = "x"\nsimulation = [{ kind = "%s", value = [%s] }]\n' "$2" "$3"; } >"$1"
}
extended heavy.toml thrust_share 0.05
extended wrong.toml thrust_share 5
fly() { "$backwash" simulate --map builtin:parallel-walls-4m --vehicle $quad "$@" >/dev/null; }
printf 'start = [0, 0, 1]\n[[hover]]\np = [1, 0, 1]\ndwell = 8.0\n' >spec.toml

fly --flight spec.toml --out none.csv
fly --flight spec.toml --model plain.toml --out plain.csv
cmp -s none.csv plain.csv || die "a model without an extension changes the flight"
fly --flight spec.toml --model heavy.toml --out heavy.csv
fly --flight spec.toml --model plain.toml --air model --out still.csv
fly --setpoints none.csv --model plain.toml --air model --out again.csv
fly --setpoints none.csv --model heavy.toml --air model --out again_heavy.csv

awk '/^## /{of = /^## Flight specification/} of && /^```toml/{file = "readme" ++n ".toml"; next} /^```/{file = ""} file {print >file}' \
  "$here/../../services/backwash/README.md"
"$backwash" simulate --map builtin:apartment --vehicle $quad --flight readme1.toml --out first.csv >/dev/null
"$backwash" simulate --map builtin:parallel-walls-1m --vehicle $quad --flight readme2.toml --out grid.csv >/dev/null

python3 - <<'PYTHON'
import csv
def column(name, file):
    return [float(row[name]) for row in csv.DictReader(open(file))]
def low(file):
    z = column("z_m", file)[-200:]
    return sum(z) / len(z)
sinks = low("plain.csv") - low("heavy.csv"), low("again.csv") - low("again_heavy.csv")
for sink in sinks:
    assert 0.02 < sink < 0.2, f"5 % of the thrust make the vehicle sink by {sink} m"
assert abs(sinks[0] - sinks[1]) < 0.02, "in both airs by as much"
assert column("t_s", "again.csv") == column("t_s", "none.csv"), "the log's stamps"
assert column("cmd_x_m", "again.csv") == column("cmd_x_m", "none.csv"), "the log's set-points"
assert column("ax_mps2", "still.csv") != column("ax_mps2", "plain.csv"), "another air"
assert "rpm4" in open("again.csv").readline() and "rpm4" not in open("none.csv").readline()
PYTHON

refused() { # CODE TEXT ARGUMENTS…
  local code=0
  "$backwash" simulate --map builtin:parallel-walls-4m --vehicle $quad "${@:3}" >out 2>err || code=$?
  [ "$code" = "$1" ] && grep -q -- "$2" err || die "${*:3}: exit $code, $(cat err); expected $1, $2"
}
refused 78 "wrong.toml:" --flight spec.toml --model wrong.toml --out x.csv
refused 64 "either --flight or --setpoints" --out x.csv
refused 64 "either --flight or --setpoints" --flight spec.toml --setpoints none.csv --out x.csv
refused 64 "--air model needs --model" --flight spec.toml --air model --out x.csv
printf 't_s,x_m,y_m,z_m\n0,0,0,1\n0.02,0,0,1\n' >bare.csv
refused 65 "cmd_x_m" --setpoints bare.csv --out x.csv

# What the simulation flies in the model's own air lacks nothing: short passes between hovers, rotors that turn alike.
printf 'start = [0, 0, 1]\n[grid]\nlow = [0, -0.7, 0.35]\nhigh = [0, 0.7, 2.2]\ncount = [1, 3, 4]\njitter = 0.03\ndwell = 5.0\n' >room.toml
sed 's/^tau_w = [0-9.]*/tau_w = 0.6/' plain.toml >slow.toml  # the model's own, not the one that ships
for own in "0 builtin:quad-5in" "100 builtin:quad-5in" "200 builtin:quad-5in" "300 slow.toml"; do
  read -r first model <<<"$own"
  for day in 1 2 3 4 5 6 7 8 9 10 11 12; do
    "$backwash" simulate --map builtin:parallel-walls-2m --vehicle $quad --model $model --air model --flight room.toml \
      --seed $((first + day)) --out own-$day.csv --force --quiet >/dev/null
  done
  "$backwash" study own-*.csv --map builtin:parallel-walls-2m --vehicle $quad --model $model --quick --json --quiet >own.json
  grep -q '"verdict":"nothing_found"' own.json || die "flights of the own air of $model, seeds $first: $(head -c 400 own.json)"
done
