#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# docs/guide.md, followed literally: every command of it, as written and in its order, in one fresh folder. What it says is made is
# there. In domain 0, as a reader's: no other test uses it.
#   guide.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$(realpath "$1") build=$(realpath "$2")
work=$(mktemp -d)
cleanup() {
  local status=$?
  for pid in $(jobs -p); do kill -- "$pid" 2>/dev/null || true; done
  [[ $status == 0 ]] || { tail -n 30 "$work/said" "$work"/*.txt >&2 || true; }
  rm -rf "$work"
}
trap cleanup EXIT
export PATH=$build/services:$PATH XDG_CACHE_HOME=$work/cache
PYTHONPATH=$source_dir/tests/docs python3 -c 'import guide, pathlib, sys; print(guide.commands(pathlib.Path(sys.argv[1]).read_text()))' \
  "$source_dir/docs/guide.md" >"$work/guide"
mkdir "$work/fresh"
cd "$work/fresh"
# The programs that the guide starts in the background end with it, whatever fails.
bash -c 'trap "kill \$(jobs -p) 2>/dev/null || true" EXIT; set -eux -o pipefail; source "$1"' guide "$work/guide" >"$work/said" 2>&1 || {
  cp ./*.txt "$work" 2>/dev/null || true
  echo "guide: a command fails: $(grep '^++ [a-z]' "$work/said" | tail -n 1)" >&2
  exit 1
}
# What a section says in `…` that its commands print ("verdict: flights", a headline, a measure) is what they print.
while IFS= read -r line; do
  grep -qF -- "$line" "$work/said" || { echo "guide: nothing prints '$line'" >&2; exit 1; }
done < <(PYTHONPATH=$source_dir/tests/docs python3 -c 'import guide, pathlib, sys; print("\n".join(guide.printed(pathlib.Path(sys.argv[1]).read_text())))' "$source_dir/docs/guide.md")
made=$(grep -oE '(--report|--out|-o|--mcap) [a-z0-9-]+(\.[a-z]+)+' "$work/guide" | awk '{print $2}' | sort -u)
[[ $(wc -w <<<"$made") -ge 12 ]] || { echo "guide: hardly anything is made" >&2; exit 1; }
for file in $made flight.mcap; do
  [[ -s $file ]] || { echo "guide: $file was not made" >&2; exit 1; }
done
echo "$(grep -c '^++ backwash' "$work/said") commands, $(wc -w <<<"$made") files"
