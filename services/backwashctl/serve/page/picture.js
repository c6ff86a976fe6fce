// SPDX-License-Identifier: BSD-3-Clause
// The map from above: a slice of it, the vehicle, its way and tubes. Lengths in m, map; x to the right, y up.

const S = Math.SQRT1_2
// Inner normals of a set's eight sides, by the half width that each belongs to: x, y, (1,1)/√2, (1,−1)/√2.
const SIDES = [[1, 0, 3], [S, S, 6], [0, 1, 4], [-S, S, 7], [-1, 0, 3], [-S, -S, 6], [0, -1, 4], [S, -S, 7]]

// Corners of the octagon that a set's half widths bound, from above; a set is a row in mm.
function octagon(set) {
  const corners = []
  let from = [[-1e6, -1e6], [1e6, -1e6], [1e6, 1e6], [-1e6, 1e6]]
  for (const [nx, ny, h] of SIDES) {
    const to = []
    for (let n = 0; n < from.length; ++n) {
      const a = from[n], b = from[(n + 1) % from.length]
      const da = nx * a[0] + ny * a[1] - set[h], db = nx * b[0] + ny * b[1] - set[h]
      if (da <= 0) to.push(a)
      if ((da < 0 && db > 0) || (da > 0 && db < 0)) to.push([a[0] + (b[0] - a[0]) * da / (da - db), a[1] + (b[1] - a[1]) * da / (da - db)])
    }
    from = to
  }
  for (const [x, y] of from) corners.push([(set[0] + x) / 1e3, (set[1] + y) / 1e3])
  return corners
}

export class Picture {
  constructor(canvas) {
    this.canvas = canvas
    this.view = { x: 0, y: 0, scale: 40 } // middle, pixels a metre
    this.fitted = false
    this.trail = []
  }

  colour(name) { return getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim() }

  setSlice(slice) {
    this.slice = slice
    this.paint()
    if (!this.fitted) this.whole()
  }

  // The slice as an image of one pixel a voxel, in the colours of now.
  paint() {
    const { size: [nx, ny], runs, field } = this.slice
    const image = document.createElement('canvas')
    image.width = nx
    image.height = ny
    const context = image.getContext('2d'), pixels = context.createImageData(nx, ny)
    const rgb = ['unknown', 'free', 'occupied', 'rough'].map((name) => [1, 3, 5].map((at) => parseInt(this.colour(name).slice(at, at + 2), 16)))
    let cell = 0
    for (let n = 0; n < runs.length; n += 2)
      for (let end = cell + runs[n + 1]; cell < end; ++cell) {
        const row = ny - 1 - Math.floor(cell / nx), at = 4 * (row * nx + cell % nx)
        const share = runs[n] === 1 && field ? Math.min(1, field.values[cell] / 100 / field.most) * 0.75 : 0
        for (let c = 0; c < 3; ++c) pixels.data[at + c] = rgb[runs[n]][c] * (1 - share) + rgb[3][c] * share
        pixels.data[at + 3] = 255
      }
    context.putImageData(pixels, 0, 0)
    this.image = image
  }

  whole() {
    if (!this.slice) return
    const { low, size, resolution } = this.slice, box = this.canvas.getBoundingClientRect()
    if (box.width === 0) return
    this.view = {
      x: low[0] + size[0] * resolution / 2, y: low[1] + size[1] * resolution / 2,
      scale: 0.96 * Math.min(box.width / (size[0] * resolution), box.height / (size[1] * resolution)),
    }
    this.fitted = true
  }

  zoom(factor, at) {
    const before = at && this.place(at)
    this.view.scale = Math.min(2000, Math.max(2, this.view.scale * factor))
    if (!at) return
    const after = this.place(at)
    this.view.x += before[0] - after[0]
    this.view.y += before[1] - after[1]
  }

  // The place in the map of a pixel of the canvas, and back.
  place([px, py]) {
    const { clientWidth: w, clientHeight: h } = this.canvas
    return [this.view.x + (px - w / 2) / this.view.scale, this.view.y - (py - h / 2) / this.view.scale]
  }
  pixel([x, y]) {
    const { clientWidth: w, clientHeight: h } = this.canvas
    return [w / 2 + (x - this.view.x) * this.view.scale, h / 2 - (y - this.view.y) * this.view.scale]
  }

  line(points, closed) {
    const c = this.context
    c.beginPath()
    points.forEach((p, n) => c[n ? 'lineTo' : 'moveTo'](...this.pixel(p)))
    if (closed) c.closePath()
  }

  path(shown, line, fill, dash) {
    const c = this.context
    c.fillStyle = fill
    c.strokeStyle = fill
    c.lineWidth = 1
    c.globalAlpha = 0.16
    for (const set of shown.tube) {
      this.line(octagon(set), true)
      c.fill()
    }
    c.globalAlpha = 1
    c.strokeStyle = line
    c.lineWidth = 2
    c.setLineDash(dash)
    this.line(shown.path.map(([x, y]) => [x / 1e3, y / 1e3]))
    c.stroke()
    c.setLineDash([])
  }

  mark([x, y], colour, text) {
    const c = this.context, [px, py] = this.pixel([x, y])
    c.strokeStyle = c.fillStyle = colour
    c.lineWidth = 2.5
    c.beginPath()
    c.arc(px, py, 8, 0, 2 * Math.PI)
    c.moveTo(px - 12, py)
    c.lineTo(px + 12, py)
    c.moveTo(px, py - 12)
    c.lineTo(px, py + 12)
    c.stroke()
    if (text) c.fillText(text, px + 12, py - 10)
  }

  draw({ live, status, flown, preview, goal }) {
    const ratio = window.devicePixelRatio || 1, { clientWidth: w, clientHeight: h } = this.canvas
    if (this.canvas.width !== Math.round(w * ratio) || this.canvas.height !== Math.round(h * ratio)) {
      this.canvas.width = Math.round(w * ratio)
      this.canvas.height = Math.round(h * ratio)
    }
    const c = this.context = this.canvas.getContext('2d')
    c.setTransform(ratio, 0, 0, ratio, 0, 0)
    c.clearRect(0, 0, w, h)
    c.font = '14px system-ui, sans-serif'
    if (this.slice) {
      const { low, size, resolution } = this.slice, [x, y] = this.pixel([low[0], low[1] + size[1] * resolution])
      c.imageSmoothingEnabled = false
      c.drawImage(this.image, x, y, size[0] * resolution * this.view.scale, size[1] * resolution * this.view.scale)
    }
    if (live && flown) this.path(flown, this.colour('path'), this.colour('tube'), [])
    if (preview) this.path(preview, this.colour('goal'), this.colour('goal'), [8, 5])
    if (goal) this.mark(goal, this.colour('goal'), `${goal.map((v) => v.toFixed(2)).join(', ')}`)
    if (live && status) this.vehicle(status.position)
    else this.trail = []
    this.bar(w, h)
  }

  vehicle(p) {
    const c = this.context, last = this.trail.at(-1)
    if (!last || Math.hypot(p[0] - last[0], p[1] - last[1]) > 0.02) this.trail.push([p[0], p[1]])
    if (this.trail.length > 3000) this.trail.shift()
    c.strokeStyle = this.colour('quiet')
    c.lineWidth = 1.5
    this.line(this.trail)
    c.stroke()
    c.fillStyle = this.colour('accent')
    c.strokeStyle = this.colour('paper')
    c.lineWidth = 2.5
    c.beginPath()
    c.arc(...this.pixel(p), 8, 0, 2 * Math.PI)
    c.fill()
    c.stroke()
  }

  bar(w, h) {
    const c = this.context, length = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50].findLast((m) => m * this.view.scale < w / 3) ?? 0.1
    c.fillStyle = c.strokeStyle = this.colour('ink')
    c.lineWidth = 3
    c.beginPath()
    c.moveTo(12, h - 12)
    c.lineTo(12 + length * this.view.scale, h - 12)
    c.stroke()
    c.fillText(`${length} m`, 12, h - 20)
  }
}
