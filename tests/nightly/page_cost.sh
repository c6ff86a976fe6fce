#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What an open page of `backwashctl serve` costs the 50 Hz tick: one hovering flight, Chromium with the page open and without by
# turns of SECONDS, eight times each. Prints median and p99 of the tick's compute time and wake-up lateness, and their ratios.
#   page_cost.sh SOURCE_DIR BUILD_DIR [SECONDS]
set -euo pipefail
source_dir=$1 build=$2 seconds=${3:-8}
source "$source_dir/tests/support/skip.sh"
needs chromium
needs_peers
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:apartment 3.0,4.2,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
"$bin/backwashctl" --domain "$domain" --json serve --port 0 --vehicle builtin:quad-5in >"$work/serve.json" 2>>"$log" &
more_pids+=($!)
for _ in $(seq 100); do [[ -s $work/serve.json ]] && break; sleep 0.05; done
HOME=$work nice -n 10 node - "$modules" "$work/serve.json" "$seconds" >"$work/turns" <<'NODE'
const [modules, file, seconds] = process.argv.slice(2)
const { chromium } = require(require.resolve('playwright-core', { paths: [modules] }))
const url = JSON.parse(require('node:fs').readFileSync(file)).url
const sleep = (s) => new Promise((done) => setTimeout(done, 1e3 * s))
const now = () => Number(process.hrtime.bigint()) * 1e-9
;(async () => {
  const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox', '--disable-gpu'] })
  for (let n = 0; n < 16; ++n) {
    const page = n % 2 ? await browser.newPage() : null
    if (page) await page.goto(url)
    if (page) await page.waitForFunction(() => !document.body.classList.contains('stale'))
    await sleep(1)
    const begun = now()
    await sleep(Number(seconds))
    console.log(n % 2, begun, now())
    await page?.close()
  }
  await browser.close()
})()
NODE
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work" <<'PYTHON'
import sys
import raw_log

work = sys.argv[1]
turns = [[float(v) for v in line.split()] for line in open(work + "/turns")]
ticks = list(raw_log.ticks(work + "/flight.bwlog"))
told = {}
for open_ in (0, 1):
    mine = [t for t in ticks if any(o == open_ and a <= t.t <= b for o, a, b in turns)]
    assert len(mine) > 500, len(mine)
    for name in ("compute_us", "lateness_us"):
        values = sorted(getattr(t, name) for t in mine)
        told[open_, name] = [values[int(q * (len(values) - 1))] for q in (0.5, 0.99)]
    print(f"{'with' if open_ else 'without'} the page: {len(mine)} ticks, missed {sum(t.missed for t in mine)}")
for name in ("compute_us", "lateness_us"):
    (a50, a99), (b50, b99) = told[0, name], told[1, name]
    print(f"{name}: median {a50:.0f} -> {b50:.0f} ({b50 / a50:.2f}), p99 {a99:.0f} -> {b99:.0f} ({b99 / a99:.2f})")
PYTHON
