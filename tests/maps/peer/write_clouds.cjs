// SPDX-License-Identifier: BSD-3-Clause
// Writes a recording of a lidar in a room by libraries that are not ours (@mcap/core, @foxglove/rosmsg2-serialization: MIT, for tests
// alone), and beside it the same points placed by matrices as a CSV: what a reader should make of it.
//   node write_clouds.cjs MODULES OUT KIND
// KIND: tf: all by transforms, the lidar upside down on the body. odometry: the body by Odometry. placed: Odometry, and clouds in its own
// frame, in doubles. second: tf, and clouds on another topic. still: no pose. parents: a body with two of them. zstd, lz4: tf, its chunks
// compressed by the program of that name. bzip2, ros1, corner: chunks that say so, messages that do, fields that lie beyond their point.
const fs = require('node:fs')
const { execFileSync } = require('node:child_process')
const [modules, out, kind] = process.argv.slice(2)
const load = (name) => require(require.resolve(name, { paths: [modules] }))
const { McapWriter } = load('@mcap/core')
const { MessageWriter } = load('@foxglove/rosmsg2-serialization')
const { ros2humble } = load('@foxglove/rosmsg-msgs-common')

/// Definitions of a type, its own first.
function definitions(name, known = new Map()) {
  if (known.has(name)) return [...known.values()]
  known.set(name, ros2humble[name])
  for (const member of ros2humble[name].definitions) if (member.isComplex) definitions(member.type, known)
  return [...known.values()]
}

// Rotations: yaw, pitch, roll about z, y, x; as a matrix for the oracle, as a quaternion for the messages.
const turn = ([y, p, r]) => {
  const [cy, sy, cp, sp, cr, sr] = [Math.cos(y), Math.sin(y), Math.cos(p), Math.sin(p), Math.cos(r), Math.sin(r)]
  return [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]]
}
const quaternion = ([y, p, r]) => {
  const [cy, sy, cp, sp, cr, sr] = [y, p, r].flatMap((a) => [Math.cos(a / 2), Math.sin(a / 2)])
  return { x: cy * cp * sr - sy * sp * cr, y: sy * cp * sr + cy * sp * cr, z: sy * cp * cr - cy * sp * sr, w: cy * cp * cr + sy * sp * sr }
}
const put = ({ at, angles }, p) => turn(angles).map((row, k) => row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + at[k])
const back = ({ at, angles }, p) => {
  const m = turn(angles), d = p.map((v, k) => v - at[k])
  return [0, 1, 2].map((k) => m[0][k] * d[0] + m[1][k] * d[1] + m[2][k] * d[2])
}
const xyz = ([x, y, z]) => ({ x, y, z })
const stamp = (t) => ({ sec: Math.floor(1000 + t), nanosec: Math.round((1000 + t - Math.floor(1000 + t)) * 1e9) })

const mapOdom = { at: [0.2, -0.1, 0.05], angles: [0.5, 0, 0] }
const lidar = { at: [0.1, 0, 0.15], angles: [0, 0.1, Math.PI] }
const body = (t) => ({ at: [0.3 * t, 0.2 * t, 1 + 0.05 * t], angles: [0.4 * t, 0, 0] })
const low = [-2.03, -1.53, 0.02], high = [3.07, 2.21, 2.43]

/// Where a ray from inside the room meets it.
function wall(from, direction) {
  const lengths = direction.map((d, k) => ((d > 0 ? high[k] : low[k]) - from[k]) / d)
  const length = Math.min(...lengths)
  return from.map((v, k) => v + length * direction[k])
}

async function main() {
  const parts = []
  let size = 0n
  const writable = { write: async (b) => { parts.push(Buffer.from(b)); size += BigInt(b.length) }, position: () => size }
  const options = { writable, chunkSize: 20000 }
  if (kind === 'bzip2') options.compressChunk = (bytes) => ({ compression: kind, compressedData: bytes })
  if (kind === 'lz4' || kind === 'zstd') options.compressChunk = (input) => ({ compression: kind, compressedData: execFileSync(kind, ['-c', '-q'], { input }) })
  const writer = new McapWriter(options)
  await writer.start({ profile: 'ros2', library: 'test' })
  const channels = new Map()
  async function say(topic, type, message, t) {
    if (!channels.has(topic)) {
      const schemaId = await writer.registerSchema({ name: type.replace('/', '/msg/'), encoding: 'ros2msg', data: new Uint8Array() })
      const channelId = await writer.registerChannel({ schemaId, topic, messageEncoding: kind === 'ros1' ? 'ros1' : 'cdr', metadata: new Map() })
      channels.set(topic, { channelId, writer: new MessageWriter(definitions(type)) })
    }
    const channel = channels.get(topic), time = BigInt(Math.round((1000 + t) * 1e9))
    await writer.addMessage({ channelId: channel.channelId, sequence: 0, publishTime: time, logTime: time, data: channel.writer.writeMessage(message) })
  }
  const placed = kind === 'placed'
  const transform = (frame_id, child_frame_id, pose, t) => ({ header: { stamp: stamp(t), frame_id }, child_frame_id, transform: { translation: xyz(pose.at), rotation: quaternion(pose.angles) } })
  const tf = (topic, ...transforms) => say(topic, 'tf2_msgs/TFMessage', { transforms }, 0)
  const rows = ['x_m,y_m,z_m,sensor_x_m,sensor_y_m,sensor_z_m']

  async function cloud(topic, t, seen) {
    const base = body(t)
    const toMap = (p) => (placed ? p : put(mapOdom, put(base, put(lidar, p))))
    const fromMap = (p) => (placed ? p : back(lidar, back(base, back(mapOdom, p))))
    const sensor = placed ? base.at : toMap([0, 0, 0])
    const width = 200, height = 3, bytes = placed ? 8 : 4, step = 4 + 3 * bytes, row = width * step + 24
    const data = new DataView(new ArrayBuffer(height * row))
    for (let n = 0; n < width * height; ++n) {
      const a = 2.399963 * n + 0.013, z = 0.9 - 1.8 * (n + 0.37) / (width * height), r = Math.sqrt(1 - z * z)
      const p = n === 7 ? [NaN, NaN, NaN] : fromMap(wall(sensor, [r * Math.cos(a), r * Math.sin(a), z]))
      const at = Math.floor(n / width) * row + (n % width) * step
      const written = p.map((v, k) => (placed ? (data.setFloat64(at + 4 + 8 * k, v, true), v) : (data.setFloat32(at + 4 + 4 * k, v, true), Math.fround(v))))
      if (seen) rows.push([...toMap(written), ...sensor].map((v) => (Number.isNaN(v) ? 'nan' : String(v))).join(','))
    }
    const datatype = placed ? 8 : 7
    const fields = [['intensity', 0, 7], ...['x', 'y', 'z'].map((name, k) => [name, (kind === 'corner' ? 8 : 4) + bytes * k, datatype])]
    await say(topic, 'sensor_msgs/PointCloud2', {
      header: { stamp: stamp(t), frame_id: placed ? 'camera_init' : 'lidar' }, height, width,
      fields: fields.map(([name, offset, type]) => ({ name, offset, datatype: type, count: 1 })),
      is_bigendian: false, point_step: step, row_step: row, data: new Uint8Array(data.buffer), is_dense: false }, t)
  }

  if (!placed && kind !== 'still') await tf('/tf_static', transform('base_link', 'lidar', lidar, 0))
  if (kind === 'parents') await tf('/tf', transform('world', 'base_link', body(0), 0))
  await cloud('/points', -5, false) // before anything is known of its place
  for (let n = 0; n <= 40; ++n) {
    const t = n / 20, base = body(t)
    if (n % 4 === 1) await cloud('/points', t + 0.025, true) // before the poses on both of its sides
    if (n % 2 === 0 && !placed && kind !== 'still') await tf('/tf', transform('map', 'odom', mapOdom, t))
    const [frame, child] = placed ? ['camera_init', 'body'] : ['odom', 'base_link']
    const zeros = new Array(36).fill(0), none = { x: 0, y: 0, z: 0 }
    if (placed || kind === 'odometry')
      await say('/odometry', 'nav_msgs/Odometry', {
        header: { stamp: stamp(t), frame_id: frame }, child_frame_id: child,
        pose: { pose: { position: xyz(base.at), orientation: quaternion(base.angles) }, covariance: zeros },
        twist: { twist: { linear: none, angular: none }, covariance: zeros } }, t)
    else if (kind !== 'still') await tf('/tf', transform(frame, child, base, t))
    if (kind === 'second' && n % 10 === 0) await cloud('/depth/points', t, false)
  }
  await writer.end()
  fs.writeFileSync(out, Buffer.concat(parts))
  fs.writeFileSync(out.replace('.mcap', '.csv'), rows.join('\n') + '\n')
}
main()
