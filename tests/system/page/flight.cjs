// SPDX-License-Identifier: BSD-3-Clause
// A flight as a person sees and steers it in Chromium (playwright-core: Apache-2.0, for tests alone). Exit 1 and why at the
// first thing that is not so. What the daemon did is asked of `backwashctl status`, not of the page.
//   node flight.cjs MODULES URL BACKWASHCTL DOMAIN DAEMON_PID SERVE_PID ROUTE [FOLDER_OF_SCREENSHOTS]
const assert = require('node:assert'), { execFileSync, spawnSync } = require('node:child_process')
const [modules, url, ctl, domain, daemon, serve, route, pictures] = process.argv.slice(2)
const { chromium } = require(require.resolve('playwright-core', { paths: [modules] }))
const [address, token] = url.split('#')
const sleep = (ms) => new Promise((done) => setTimeout(done, ms))
const status = () => JSON.parse(execFileSync(ctl, ['--domain', domain, 'status', '--json'], { encoding: 'utf8' }))

async function until(what, holds, ms = 10000) {
  const begun = Date.now()
  for (;;) {
    const found = await holds()
    if (found) return found
    assert.ok(Date.now() - begun < ms, `${what}: not within ${ms} ms`)
    await sleep(20)
  }
}

const asked = [], said = []
async function open(browser, where, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1000, height: 700 }, ...options })
  await context.addInitScript(() => { // events can be made to come late, each by as much
    const Plain = window.EventSource
    window.EventSource = class extends Plain {
      set onmessage(hear) {
        super.onmessage = (message) => (window.late ? setTimeout(hear, window.late, message) : hear(message))
      }
    }
  })
  const page = await context.newPage()
  page.on('request', (request) => asked.push({ url: request.url(), referer: request.headers().referer ?? '' }))
  page.on('console', (line) => line.type() === 'error' && said.push(line.text()))
  page.on('pageerror', (error) => said.push(String(error)))
  await page.goto(where)
  return page
}
const text = (page, id) => page.locator('#' + id).textContent()
const row = (page, name) => page.evaluate((wanted) => {
  const at = [...document.querySelectorAll('#state dt')].find((dt) => dt.textContent === wanted)
  return at?.nextElementSibling.textContent ?? '–'
}, name)
const place = async (page) => (await row(page, 'position, m')).split(', ').map(Number)
const lives = (page) => until('the page lives', async () => !Number.isNaN((await place(page))[1] ?? NaN))

async function reload(page) {
  await page.evaluate(() => { window.before = true; setTimeout(() => location.reload()) })
  await until('it is loaded anew', () => page.evaluate(() => !window.before).catch(() => false))
}

async function fly(page, goal) {
  for (const [n, id] of ['x', 'y', 'z'].entries()) await page.fill('#' + id, String(goal[n]))
  await page.click('#show')
  await until('the way is shown', async () => (await text(page, 'asked')).includes('m clear of obstacles beyond its sets'), 20000)
  if (pictures) await page.screenshot({ path: `${pictures}/way.png` })
  await page.click('#fly')
  await until('goto is accepted', async () => (await text(page, 'command')).startsWith('GOTO: accepted'))
}

async function command(page, verb) {
  await page.click('#' + verb)
  await until(`${verb} is accepted`, async () => (await text(page, 'command')).startsWith(`${verb.toUpperCase()}: accepted`))
}

async function shoot(page) {
  for (const width of [360, 900, 1600])
    for (const colorScheme of ['light', 'dark']) {
      await page.setViewportSize({ width, height: width === 360 ? 740 : 1000 })
      await page.emulateMedia({ colorScheme })
      await page.click('#whole')
      await sleep(400)
      if (pictures) await page.screenshot({ path: `${pictures}/${width}-${colorScheme}.png`, fullPage: true })
      const wide = await page.evaluate(() => document.documentElement.scrollWidth)
      assert.ok(wide <= width, `${wide} pixels wide at ${width}`)
      for (const id of ['stop', 'hold', 'land']) {
        const box = await page.locator('#' + id).boundingBox()
        assert.ok(box.y >= 0 && box.y + box.height < 300 && box.x + box.width <= width, `${id} is out of sight at ${width}`)
      }
    }
}

// Each step of the flight, when it is done.
const begun = Date.now()
const done = (what) => console.log(`${((Date.now() - begun) / 1e3).toFixed(1)} s: ${what}`)

async function main() {
  const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: ['--no-sandbox', '--disable-gpu'] })
  const pilot = await open(browser, url)
  await lives(pilot)
  assert.equal(pilot.url(), address, 'the token stays in the address')
  await until('preflight', async () => (await pilot.locator('#check li').count()) > 8)
  const check = JSON.parse(spawnSync(ctl, ['--domain', domain, 'check', '--json'], { encoding: 'utf8' }).stdout).findings
  assert.deepEqual(await pilot.locator('#check li').evaluateAll((items) => items.map((item) => [item.className === 'good', item.textContent.split(': ')[0].slice(7)])),
    check.map(({ good, name }) => [good, name]))

  done('preflight')
  // A flight is seen: where the page has the vehicle, and where its picture has it.
  const before = await place(pilot)
  assert.ok(Math.abs(before[1] + 3) < 0.2 && before[2] > 1, `${before}`)
  await fly(pilot, [2, 3, 1.2])
  await until('the page sees the vehicle move', async () => (await place(pilot))[1] > before[1] + 0.3)
  done('the vehicle moved')
  const power = (await row(pilot, 'battery')).match(/^(\d+) %, (\d+\.\d\d) V$/)
  assert.ok(power && Number(power[1]) <= 100 && Number(power[2]) > 14 && Number(power[2]) < 16.7, await row(pilot, 'battery'))
  assert.match(await row(pilot, 'age of battery'), /^[01]\.\d s$/)
  // Hold, on the way.
  await command(pilot, 'hold')
  const watcher = await open(browser, url), stranger = await open(browser, address)
  const held = await until('the daemon holds', () => { const now = status(); return !now.moving && now })
  assert.equal(held.state, 'tracking')
  assert.ok(held.setpoint[1] > before[1] + 0.3 && held.setpoint[1] < 2.8, `held at ${held.setpoint}`)
  await sleep(1000)
  assert.deepEqual(status().setpoint, held.setpoint)
  assert.equal(held.samples_outside, 0)

  done('held')
  const blue = await pilot.evaluate(() => {
    const canvas = document.getElementById('picture'), { width, height } = canvas, seen = []
    const { data } = canvas.getContext('2d').getImageData(0, 0, width, height)
    for (let n = 0; n < data.length; n += 4) if (data[n] === 0x0b && data[n + 1] === 0x57 && data[n + 2] === 0xb0) seen.push(n)
    return seen.length
  })
  assert.ok(blue > 100, `${blue} pixels of vehicle and path`)

  // A second page only shows, and says who has the session; one without the token cannot even stop.
  await lives(watcher)
  await lives(stranger)
  await pilot.click('#hold') // the session of 10 s begins anew
  await until('the second page is read-only', async () => (await text(watcher, 'session')).includes('Read-only: the session is held by another page, of 127.0.0.1'))
  for (const id of ['hold', 'land']) assert.ok(await watcher.locator('#' + id).isDisabled(), `${id} of the second page`)
  assert.ok(await watcher.locator('#stop').isEnabled())
  const refused = await watcher.evaluate(async (key) => (await fetch('/command', {
    method: 'POST', headers: { 'Content-Type': 'application/json', 'X-Token': key }, body: JSON.stringify({ page: sessionStorage.getItem('page'), verb: 'land' }) })).status, token)
  assert.equal(refused, 409)
  for (const id of ['stop', 'hold', 'land']) assert.ok(await stranger.locator('#' + id).isDisabled(), `${id} without the token`)
  assert.ok((await text(stranger, 'session')).startsWith('Read-only: this page was opened without its token'))

  done('read-only pages')
  // Reloaded it comes back with its session, and gives that up when it is told to; reloaded while another station's route is flown it sees that.
  for (let n = 0; n < 5; ++n) { // a machine that needs longer than the session's 2 s is asked again
    await command(pilot, 'hold')
    const left = Date.now()
    await reload(pilot)
    await lives(pilot)
    if (Date.now() - left < 2000) break
  }
  assert.ok((await text(pilot, 'session')).startsWith('This page holds the session'), await text(pilot, 'session'))
  await pilot.click('#release')
  await until('the session is free', async () => (await text(watcher, 'session')).startsWith('The session is free'))
  await shoot(pilot)
  execFileSync(ctl, ['--domain', domain, 'follow', route])
  await until('the route is flown', () => status().moving)
  await reload(pilot)
  await lives(pilot)
  const then = await place(pilot)
  await until('the reloaded page sees it move', async () => Math.abs((await place(pilot))[1] - then[1]) > 0.2)

  done('reloaded')
  // STOP is anybody's: the second page's.
  await command(watcher, 'stop')
  await until('the daemon stops', () => { const now = status(); return now.state === 'hold' && !now.moving })

  done('stopped')
  // Without news nothing old looks like now.
  const dies = async (pid, page, words) => {
    const first = page.evaluate((wanted) => new Promise((done) => {
      const line = document.getElementById('lost')
      new MutationObserver(() => line.textContent.includes(wanted) && done(Date.now())).observe(line, { childList: true, characterData: true, subtree: true })
    }), words)
    await sleep(200)
    process.kill(pid, 'SIGSTOP')
    const begun = Date.now()
    const took = await Promise.race([first, sleep(5000).then(() => Infinity)]) - begun
    process.kill(pid, 'SIGCONT')
    assert.ok(took < 1000, `said after ${took} ms`)
    return took
  }
  const blank = pilot.waitForFunction(() => document.body.classList.contains('stale') && [...document.querySelectorAll('#state dd')].every((dd) => dd.textContent === '–'))
  const silent = await dies(Number(daemon), pilot, 'the daemon is silent')
  await blank
  await lives(pilot)
  const cut = await dies(Number(serve), pilot, 'backwashctl does not answer')
  await lives(pilot)
  // News that a slow line has kept for two seconds comes at its full rate, and is not now.
  await pilot.evaluate(() => (window.late = 2000))
  await until('late news is said to be late', async () => (await text(pilot, 'lost')).includes('late, the connection is too slow'))
  assert.ok(await pilot.evaluate(() => document.body.classList.contains('stale')))
  await pilot.evaluate(() => (window.late = 0))
  await lives(pilot)
  console.log(`said after ${silent} ms that the daemon, after ${cut} ms that the page's server is silent`)

  for (const request of asked) {
    assert.ok(request.url.startsWith(address), `asked for ${request.url}`)
    assert.ok(!request.url.split('#')[0].includes(token) && !request.referer.includes(token), `the token is in ${request.url}`)
  }
  // But for commands that were refused, and a page that was loaded anew before its old stream had ended.
  assert.deepEqual(said.filter((line) => !line.includes('409 (Conflict)')), [])
  await browser.close()
}

main().catch((error) => {
  console.error(error)
  process.exit(1)
})
