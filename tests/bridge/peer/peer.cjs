// SPDX-License-Identifier: BSD-3-Clause
// The other end of the test against an independent MAVLink library: a flight controller made of node-mavlink (LGPL, a
// separate program for tests alone). Says at its end, as one line of JSON, what it heard.
//   node peer.cjs MODULES pty|udp PATH|PORT SECONDS [KEY_HEX]
// Armed, unless DISARMED is set in the environment.
const [modules, kind, where, seconds, keyHex] = process.argv.slice(2)
const mav = require(require.resolve('node-mavlink', { paths: [modules] }))
const { minimal, common } = mav
const armed = process.env.DISARMED ? 0 : 128
const key = keyHex ? Buffer.from(keyHex, 'hex') : null

let output, input
if (kind === 'udp') {
  const socket = require('dgram').createSocket('udp4')
  socket.bind(0, '127.0.0.1')
  input = new (require('stream').PassThrough)()
  socket.on('message', (bytes) => input.write(bytes))
  output = (bytes) => socket.send(bytes, Number(where), '127.0.0.1')
} else {
  const fs = require('fs'), tty = require('tty')
  input = new tty.ReadStream(fs.openSync(where, 'r'))
  input.setRawMode(true)
  const writer = new tty.WriteStream(fs.openSync(where, 'w'))
  output = (bytes) => writer.write(bytes)
}

const protocol = new mav.MavLinkProtocolV2(42, 1, key ? mav.MavLinkProtocolV2.IFLAG_SIGNED : 0)
let sequence = 0, first = null, time = 0
function send(message) {
  let bytes = protocol.serialize(message, sequence++ & 255)
  // By itself it takes whole milliseconds, and two frames of one would have the same time: a replay.
  time = Math.max(Date.now(), time + 0.02)
  if (key) bytes = protocol.sign(bytes, 7, key, time)
  first ??= Buffer.from(bytes)
  output(bytes)
}
const make = (Type, values) => Object.assign(new Type(), values)

const registry = { ...minimal.REGISTRY, ...common.REGISTRY }
const heard = { frames: 0, good: 0, wrong: 0, unsigned: 0, rising: true, kinds: {} }
let last = 0
const parser = input.pipe(new mav.MavLinkPacketSplitter()).pipe(new mav.MavLinkPacketParser())
parser.on('data', (packet) => {
  heard.frames++
  if (!packet.signature) heard.unsigned++
  else if (key && packet.signature.matches(key)) heard.good++
  else heard.wrong++
  if (packet.signature) {
    heard.rising = heard.rising && packet.signature.timestamp > last
    last = packet.signature.timestamp
  }
  const Type = registry[packet.header.msgid]
  if (!Type) return
  const m = packet.protocol.data(packet.payload, Type)
  heard.kinds[Type.MSG_NAME] = (heard.kinds[Type.MSG_NAME] ?? 0) + 1
  heard.sender = [packet.header.sysid, packet.header.compid]
  if (m instanceof common.SetPositionTargetLocalNed)
    heard.setpoint = [m.x, m.y, m.z, m.vx, m.vy, m.vz, m.afx, m.afy, m.afz, m.yaw, m.typeMask]
  if (m instanceof common.Odometry) heard.odometry = [m.x, m.y, m.z]
  if (m instanceof common.StatusText) heard.text = m.text
  if (m instanceof common.CommandLong)
    send(make(common.CommandAck, { command: m.command, result: 4, targetSystem: 42, targetComponent: 191 }))
  if (m instanceof common.ParamRequestRead)
    send(make(common.ParamValue, { paramId: m.paramId, paramValue: 0.5, paramType: 9, paramCount: 1, paramIndex: 0 }))
  if (m instanceof common.TimeSync && m.tc1 === 0n)
    send(make(common.TimeSync, { tc1: process.hrtime.bigint(), ts1: m.ts1, targetSystem: 42, targetComponent: 191 }))
})

let tick = 0
const timer = setInterval(() => {
  const t = 20 * tick
  if (tick % 10 === 0) {
    send(make(minimal.Heartbeat, { type: 2, autopilot: 12, baseMode: 1 | armed, customMode: 393216, systemStatus: 4 }))
    send(make(common.BatteryStatus, { id: 0, voltages: [15600, 65535, 65535, 65535, 65535, 65535, 65535, 65535, 65535, 65535],
                                      batteryRemaining: 70 }))
  }
  send(make(common.LocalPositionNed, { timeBootMs: t, x: 1.5, y: -2.25, z: -3.125, vx: 0.5, vy: 0, vz: 0 }))
  send(make(common.AttitudeQuaternion, { timeBootMs: t, q1: 1, q2: 0, q3: 0, q4: 0 }))
  if (tick % 25 === 24) output(first) // a replay, where frames are signed
  tick++
}, 20)
setTimeout(() => {
  clearInterval(timer)
  console.log(JSON.stringify(heard))
  process.exit(0)
}, Number(seconds) * 1000)
