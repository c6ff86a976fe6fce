// SPDX-License-Identifier: BSD-3-Clause
// The page's tables and lists.

const $ = (id) => document.getElementById(id)

export function say(id, text) {
  if ($(id).textContent !== text) $(id).textContent = text
}

// What the autopilot says of its battery, and how old that is.
function power(battery) {
  if (!battery) return ['not said', 'none']
  const share = battery.share === null ? 'share not said' : `${(100 * battery.share).toFixed(0)} %`
  const voltage = battery.voltage_v === null ? 'voltage not said' : `${battery.voltage_v.toFixed(2)} V`
  return [`${share}, ${voltage}`, `${battery.age_s.toFixed(1)} s`]
}

// What the daemon says by name, and what is made of several members.
export function rows({ status, age_s, battery, rows: named }) {
  const [said, said_age] = power(battery)
  return {
    ...Object.fromEntries(named),
    armed: status.armed ? 'armed' : 'disarmed',
    autopilot: `${status.autopilot}, ${status.offboard ? 'follows us' : 'does not follow us'}`,
    flight: status.landed ? 'on the ground' : status.moving ? 'moving' : 'at rest',
    battery: said,
    'age of battery': said_age,
    'inside its sets': `${status.samples_inside} of ${status.samples_inside + status.samples_outside}`,
    'age of status': `${age_s.toFixed(1)} s`,
  }
}

export function fill(list, all) {
  if (list.childElementCount !== 2 * Object.keys(all).length) {
    list.replaceChildren(...Object.keys(all).flatMap((name) => [document.createElement('dt'), document.createElement('dd')]))
  }
  Object.entries(all).forEach(([name, value], n) => {
    list.children[2 * n].textContent = name
    list.children[2 * n + 1].textContent = value
  })
}

export function showError(over) {
  const names = ['x', 'y', 'z', 'x+y', 'x−y'], box = $('error')
  if (!box.childElementCount)
    for (const name of names) {
      const bar = document.createElement('div')
      bar.className = 'bar'
      bar.innerHTML = '<span></span><meter min="0" max="1.2" low="0.8" high="1" optimum="0"></meter><span></span>'
      bar.firstChild.textContent = name
      bar.children[1].setAttribute('aria-label', `error over bound along ${name}`)
      box.append(bar)
    }
  names.forEach((name, n) => {
    const value = over ? Math.abs(over[n]) : 0
    box.children[n].children[1].value = value
    box.children[n].lastChild.textContent = over ? value.toFixed(2) : '–'
    box.children[n].lastChild.className = value > 1 ? 'outside' : ''
  })
}

export function showCheck(findings) {
  const items = findings.map(({ name, good, found, advice }) => {
    const item = document.createElement('li')
    item.className = good ? 'good' : 'bad'
    item.append(Object.assign(document.createElement('b'), { textContent: good ? '✓ good' : '✗ FAIL' }), ` ${name}: ${found}`)
    if (!good) item.append(Object.assign(document.createElement('small'), { textContent: advice }))
    return item
  })
  const bad = findings.filter((f) => !f.good).length
  say('check-title', !items.length ? 'Preflight' : bad ? `Preflight: ${bad} of ${items.length} fail` : `Preflight: all ${items.length} good`)
  if (!items.length) items.push(Object.assign(document.createElement('li'), { textContent: 'Two seconds of the status are needed.' }))
  $('check').replaceChildren(...items)
}
