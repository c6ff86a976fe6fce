// SPDX-License-Identifier: BSD-3-Clause
// What the page says and sends. It listens to /events; what it asks for goes to /command, with the token.
import { fill, rows, say, showCheck, showError } from '/panels.js'
import { Picture } from '/picture.js'

const $ = (id) => document.getElementById(id)
const kLost_s = 0.6 // without news what is shown is no longer now
const kDrift = 1e-4 // two machines' clocks run apart by no more than that

// The token leaves the address bar, and with it the history. Both survive a reload of this tab.
const draw = () => Array.from(crypto.getRandomValues(new Uint8Array(16)), (b) => b.toString(16).padStart(2, '0')).join('')
if (location.hash.length > 1) {
  sessionStorage.setItem('token', location.hash.slice(1))
  history.replaceState(null, '', '/')
}
const token = sessionStorage.getItem('token') ?? ''
let page = sessionStorage.getItem('page') ?? draw()
sessionStorage.setItem('page', page)

const picture = new Picture($('picture'))
const shown = { live: false, status: null, flown: null, preview: null, goal: null }
let event = null, heard = -Infinity, begun = performance.now(), failed = ''
let behind_s = 0, least_s = Infinity // by how much more than the fastest event of this stream the newest one was under way

// --- what comes in ---------------------------------------------------------------------------------------------------

let stream = null, refusals = 0
const post = (path, body) => fetch(path, {
  method: 'POST', headers: { 'Content-Type': 'application/json', 'X-Token': token }, body: JSON.stringify(body), signal: AbortSignal.timeout(1500),
})

async function listen() {
  if (token) await post('/enter', { page }).catch(() => null) // pages without the token cannot take this one's place
  stream = new EventSource('/events?page=' + page)
  least_s = Infinity
  stream.onmessage = (message) => {
    refusals = 0
    event = JSON.parse(message.data)
    const now = performance.now(), way_s = now / 1e3 - event.now_s
    least_s = Math.min(least_s + Math.max(0, now - heard) * kDrift / 1e3, way_s)
    behind_s = way_s - least_s
    heard = now
    if ('flown' in event) shown.flown = event.flown
    if (event.preview) offer(event.preview)
  }
  stream.onerror = () => {
    stream.close()
    // A tab that was copied has the name of its original: it takes one of its own.
    if (++refusals % 6 === 0 && performance.now() - heard > 3000) sessionStorage.setItem('page', (page = draw()))
    setTimeout(listen, 300)
  }
}

// Why what is shown is not now; "": it is.
function lost() {
  const silent = (performance.now() - Math.max(heard, begun)) / 1e3
  if (!event) return silent > kLost_s ? 'No connection to backwashctl.' : ''
  if (silent > kLost_s) return `NO DATA for ${silent.toFixed(1)} s: backwashctl does not answer. Nothing below is now.`
  if (event.age_s === null) return 'NO DATA: the daemon has said nothing yet.'
  if (behind_s > kLost_s) return `NO DATA of now: it arrives ${behind_s.toFixed(1)} s late, the connection is too slow. Nothing below is now.`
  const age = event.age_s + silent + behind_s
  return age > kLost_s ? `NO DATA for ${age.toFixed(1)} s: the daemon is silent. Nothing below is now.` : ''
}

// --- what is shown ---------------------------------------------------------------------------------------------------

function showSession(why) {
  const { mine, holder, left_s: left } = event?.session ?? {}
  const may = token && !holder
  say('session', !token ? 'Read-only: this page was opened without its token.'
    : holder ? `Read-only: the session is held by ${holder}, for ${Math.ceil(left)} s after its last command. STOP is anybody's.`
    : mine ? `This page holds the session, for ${Math.ceil(left)} s after its last command.`
    : 'The session is free: the first command takes it.')
  $('stop').disabled = !token
  $('hold').disabled = $('land').disabled = !may
  $('fly').disabled = !may || why !== ''
  $('release').hidden = !mine
}

function showCommand() {
  const told = failed ? { state: 'failed', text: failed } : event?.command
  if (!told) return
  const name = told.verb?.toUpperCase()
  const text = told.text ?? { sent: `${name}: sent, not answered yet`, accepted: `${name}: accepted: ${told.reason}`,
    refused: `${name}: REFUSED: ${told.reason}`, silent: `${name}: NOT ANSWERED: ${told.reason}` }[told.state]
  $('command').dataset.state = told.state
  say('command', text)
}

let checked = ''
function show() {
  const why = lost(), status = event?.status
  shown.live = why === '' && Boolean(status)
  shown.status = status
  document.body.classList.toggle('stale', !shown.live)
  say('lost', why)
  showSession(why)
  showCommand()
  if (!shown.live) {
    say('mode', 'not known now')
    for (const value of document.querySelectorAll('#state dd')) value.textContent = '–'
    showError(null)
    if (checked) showCheck([])
    checked = ''
  } else {
    document.title = `${status.state} – ${status.vehicle}`
    say('vehicle', status.vehicle)
    say('mode', `${status.state}: ${status.reason}${status.task ? '. ' + status.task : ''}${status.autopilot_says ? '. The autopilot says: ' + status.autopilot_says : ''}`)
    fill($('state'), rows(event))
    showError(event.over_bound)
    const now = JSON.stringify(event.preflight)
    if (now !== checked) showCheck(event.preflight)
    checked = now
    follow()
  }
  paint()
}

// --- the slice -------------------------------------------------------------------------------------------------------

// On the ground the slice is where the vehicle would hover.
function wanted() {
  const said = $('height').valueAsNumber
  if (!Number.isNaN(said)) return said
  return event.status.landed ? event.status.position[2] + 1 : event.status.position[2]
}

let asking = false
async function follow() {
  if (asking || !event.map.number) return
  const z = wanted(), { slice } = picture
  if (slice && slice.number === event.map.number && (slice.field || !event.plans) && Math.abs(slice.z - z) <= slice.resolution / 2 + 0.02) return
  if (event.map.refused) return say('legend', `The map cannot be shown: ${event.map.refused}`)
  asking = true
  try {
    const answer = await fetch('/slice?z=' + z)
    if (answer.ok) picture.setSlice(await answer.json())
    if (answer.ok) say('legend', `Map at z = ${picture.slice.z.toFixed(2)} m. ${matchMedia('(prefers-color-scheme: dark)').matches ? 'Light' : 'Dark'}: occupied; grey: unknown. Line and bands: trajectory and tube.${picture.slice.field ? ` Red: the disturbance's bound, up to ${picture.slice.field.most.toFixed(1)} m/s².` : event.plans ? ' The bounds are being computed.' : ''}`)
  } catch { /* the banner says that there is no connection */ }
  await new Promise((done) => setTimeout(done, 200))
  asking = false
}

// --- what is asked for -----------------------------------------------------------------------------------------------

// What cannot be delivered is tried again until something else is asked for; a STOP goes on for as long as it takes.
let attempt = 0
async function command(verb, goal) {
  const mine = ++attempt, stops = event?.session?.stops // as the person who asks for it sees it
  failed = ''
  for (let n = 1; mine === attempt; ++n) {
    try {
      const answer = await post('/command', { page, verb, goal, stops })
      if (mine !== attempt) return
      failed = answer.ok ? '' : `${verb.toUpperCase()}: REFUSED: ${(await answer.json().catch(() => ({}))).error ?? answer.status}`
      if (answer.ok || answer.status !== 503) return show()
    } catch {
      if (mine !== attempt) return
      failed = `${verb.toUpperCase()}: NOT DELIVERED after ${n} attempts: backwashctl does not answer`
    }
    show()
    if (verb !== 'stop' && n >= 5) return
    await new Promise((done) => setTimeout(done, 300))
  }
}

function propose(goal) {
  shown.goal = goal
  shown.preview = null
  for (const [n, id] of ['x', 'y', 'z'].entries()) $(id).value = goal[n].toFixed(2)
  $('ask').hidden = false
  const question = `Fly to ${goal.map((v) => v.toFixed(2)).join(', ')} m? The daemon plans, and refuses what is not clear.`
  say('asked', event?.plans ? question + ' Planning here …' : question + ' Started without --vehicle, backwashctl shows no way before it is flown.')
  if (event?.plans && token)
    post('/preview', { page, goal }).catch(() => null)
}

// What backwashctl planned to the goal that is asked about. The daemon plans anew.
function offer(preview) {
  if (!shown.goal || preview.state === 'planning' || preview.goal.some((v, n) => v !== shown.goal[n])) return
  const goal = shown.goal.map((v) => v.toFixed(2)).join(', ')
  if (preview.state !== 'ok') return say('asked', `Fly to ${goal} m? This station finds no way: ${preview.message}`)
  shown.preview = preview
  say('asked', `Fly to ${goal} m? ${preview.time_s.toFixed(1)} s, ${preview.clearance_m.toFixed(2)} m clear of obstacles beyond its sets (dashed). The daemon plans anew.`)
}
function forget() {
  shown.goal = shown.preview = null
  $('ask').hidden = true
}

for (const verb of ['stop', 'hold', 'land', 'release']) $(verb).addEventListener('click', () => command(verb))
$('goto').addEventListener('submit', (e) => {
  e.preventDefault()
  propose(['x', 'y', 'z'].map((id) => $(id).valueAsNumber))
})
$('fly').addEventListener('click', () => {
  command('goto', shown.goal)
  forget()
})
$('forget').addEventListener('click', forget)
addEventListener('keydown', (e) => {
  if (e.ctrlKey || e.altKey || e.metaKey || e.repeat) return
  if (e.key === 'Escape') return $('stop').click()
  if (e.target instanceof HTMLInputElement) return
  if (e.key === 'h') $('hold').click()
  if (e.key === 'l') $('land').click()
})

// --- the picture -----------------------------------------------------------------------------------------------------

let drag = null
const at = (e) => [e.offsetX, e.offsetY]
$('picture').addEventListener('pointerdown', (e) => {
  $('picture').setPointerCapture(e.pointerId)
  drag = { from: at(e), view: { ...picture.view }, far: false }
})
$('picture').addEventListener('pointermove', (e) => {
  if (!drag) return
  const [dx, dy] = [e.offsetX - drag.from[0], e.offsetY - drag.from[1]]
  drag.far ||= Math.hypot(dx, dy) > 6
  if (drag.far) Object.assign(picture.view, { x: drag.view.x - dx / picture.view.scale, y: drag.view.y + dy / picture.view.scale })
  paint()
})
$('picture').addEventListener('pointerup', (e) => {
  if (drag && !drag.far && shown.live) propose([...picture.place(at(e)), picture.slice?.z ?? shown.status.position[2]])
  drag = null
})
$('picture').addEventListener('pointercancel', () => (drag = null))
$('picture').addEventListener('wheel', (e) => {
  e.preventDefault()
  picture.zoom(Math.exp(-e.deltaY / 400), at(e))
}, { passive: false })
$('nearer').addEventListener('click', () => picture.zoom(1.4))
$('farther').addEventListener('click', () => picture.zoom(1 / 1.4))
$('whole').addEventListener('click', () => picture.whole())
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => picture.slice && picture.paint())

let painting = false
function paint() {
  if (painting) return
  painting = true
  requestAnimationFrame(() => {
    painting = false
    picture.draw(shown)
  })
}
setInterval(show, 100)
listen()
