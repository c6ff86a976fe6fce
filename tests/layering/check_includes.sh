#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Checks the layers of the code from its include lines: each folder may include only the folders named for it below.
set -euo pipefail
cd "${1:?usage: check_includes.sh SOURCE_DIR}"

declare -A may=(
  [core/types]="core/types"
  [core/sync]="core/types core/sync"
  [core/files]="core/files"
  [core/config]="core/types core/files core/config"
  [core/map]="core/types core/files core/map"
  [core/field]="core/types core/map core/field"
  [core/reach]="core/types core/map core/field core/reach"
  [core/plan]="core/types core/map core/field core/reach core/plan"
  [core/track]="core/types core/map core/field core/reach core/plan core/track"
  [core/sim]="core"
  [core/study]="core"
  [firmware_bridge]="core/types firmware_bridge"
  [services]="core firmware_bridge services idl"
)
status=0
for folder in "${!may[@]}"; do
  while IFS=: read -r file line text; do
    included=$(sed -E 's/^[^"]*"([^"]+)".*/\1/' <<<"$text")
    allowed=no
    for prefix in ${may[$folder]}; do
      [[ $included == "$prefix"/* ]] && allowed=yes
    done
    # Generated headers (IDL, embedded configuration) have no folder of ours in their name.
    [[ $included == core/* || $included == firmware_bridge/* || $included == services/* ]] || allowed=yes
    if [[ $allowed == no ]]; then
      echo "$file:$line: $folder may not include $included (allowed: ${may[$folder]})"
      status=1
    fi
  done < <(grep -rnE '^\s*#\s*include\s+"' --include='*.hpp' --include='*.cpp' "$folder" 2>/dev/null || true)
done
# core knows no middleware and no operating-system service.
if grep -rnE '#\s*include\s*[<"](dds|gpiod|systemd|mavlink|thread|pthread)' core; then
  echo "core may not include DDS, MAVLink, GPIO, systemd or thread headers"
  status=1
fi
exit $status
