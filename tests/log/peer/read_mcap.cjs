// SPDX-License-Identifier: BSD-3-Clause
// Reads an MCAP file by libraries that are not ours (@mcap/core, @foxglove/rosmsg, rosmsg2-serialization and schemas: MIT, for tests
// alone): from its beginning to its end, then by its indexes. Every checksum is held against the bytes, every schema against ROS 2's own or Foxglove's,
// and every message is decoded and encoded again. Says what it found as one line of JSON; exit 1 and why at the first defect. With
// cut the file is one that a kill ended: it is read from its beginning alone.
//   node read_mcap.cjs MODULES FILE [cut]
const assert = require('node:assert'), crypto = require('node:crypto'), fs = require('node:fs')
const [modules, path, cut] = process.argv.slice(2)
const load = (name) => require(require.resolve(name, { paths: [modules] }))
const { McapStreamReader, McapIndexedReader } = load('@mcap/core')
const { parse } = load('@foxglove/rosmsg')
const { MessageReader, MessageWriter } = load('@foxglove/rosmsg2-serialization')
const { ros2humble } = load('@foxglove/rosmsg-msgs-common')
const { crc32 } = load('@foxglove/crc')
const { foxgloveMessageSchemas, generateRosMsgMergedSchema } = load('@foxglove/schemas/internal')

const bytes = fs.readFileSync(path)
const members = (all) => all.definitions.filter((d) => !d.isConstant).map((d) => [d.name, d.type, !!d.isArray, d.arrayLength ?? 0, d.defaultValue ?? null])

/// A type as those who made it publish it.
function published(name) {
  if (!name.startsWith('foxglove_msgs/')) return ros2humble[name]
  const text = generateRosMsgMergedSchema(foxgloveMessageSchemas[name.split('/')[1]], { rosVersion: 2 })
  return parse(text, { ros2: true }).find((one) => !one.name)
}

/// The definitions in a schema, each as it is published.
function definitions(schema) {
  assert.equal(schema.encoding, 'ros2msg')
  const all = parse(new TextDecoder().decode(schema.data), { ros2: true })
  for (const one of all) {
    const name = one.name ?? schema.name.replace('/msg/', '/')
    assert.deepEqual(members(one), members(published(name)), name)
  }
  return all
}

/// Every message in the file's order.
function stream() {
  const reader = new McapStreamReader({ validateCrcs: true }), schemas = new Map(), channels = new Map(), messages = []
  let header, statistics, dataEnd
  reader.append(bytes)
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === 'Header') header = record
    if (record.type === 'Statistics') statistics = record
    if (record.type === 'DataEnd') dataEnd = record
    if (record.type === 'Schema') schemas.set(record.id, { name: record.name, definitions: definitions(record) })
    if (record.type === 'Channel') {
      const { definitions: all, name } = schemas.get(record.schemaId)
      assert.equal(record.messageEncoding, 'cdr')
      assert.ok(record.metadata.has('offered_qos_profiles'))
      channels.set(record.id, { topic: record.topic, type: name, reader: new MessageReader(all), writer: new MessageWriter(all) })
    }
    if (record.type === 'Message') messages.push(record)
  }
  assert.equal(reader.done(), !cut, 'of the file\'s end')
  return { header, statistics, dataEnd, channels, messages }
}

const same = (a, b) => a.channelId === b.channelId && a.sequence === b.sequence && a.logTime === b.logTime

/// What the indexes find is what is there: everything, and from 50 places a second of it, by topic too.
async function seek({ messages, channels }) {
  const handle = { size: async () => BigInt(bytes.length), read: async (from, size) => bytes.subarray(Number(from), Number(from + size)) }
  const reader = await McapIndexedReader.Initialize({ readable: handle })
  const found = async (args) => {
    const all = []
    for await (const message of reader.readMessages(args)) all.push(message)
    return all
  }
  const expect = (got, wanted, what) => {
    assert.equal(got.length, wanted.length, what)
    got.forEach((m, n) => assert.ok(n === 0 || got[n - 1].logTime <= m.logTime, what))
    const key = (m) => `${m.channelId} ${m.sequence}`
    assert.deepEqual(new Set(got.map(key)), new Set(wanted.map(key)), what)
  }
  expect(await found({}), messages, 'all')
  const first = messages[0].logTime, last = messages.at(-1).logTime
  const topics = [...channels.values()].map((c) => c.topic)
  for (let n = 0n; n < 50n; ++n) {
    const startTime = first + ((last - first) * n) / 50n, endTime = startTime + 1_000_000_000n, topic = topics[Number(n) % topics.length]
    const inside = messages.filter((m) => startTime <= m.logTime && m.logTime <= endTime)
    expect(await found({ startTime, endTime }), inside, `from ${startTime}`)
    expect(await found({ startTime, endTime, topics: [topic] }), inside.filter((m) => channels.get(m.channelId).topic === topic), topic)
  }
  return { chunks: reader.chunkIndexes.length, dataSectionCrc: reader.dataSectionCrc }
}

async function main() {
  const { header, statistics, dataEnd, channels, messages } = stream()
  assert.equal(header.profile, 'ros2')
  const end = bytes.lastIndexOf(Buffer.from([0x0f, 4, 0, 0, 0, 0, 0, 0, 0]))
  if (!cut) assert.equal(crc32(bytes.subarray(0, end)), dataEnd.dataSectionCrc)
  const raw = crypto.createHash('sha256'), counts = {}, types = {}, said = {}
  let before = 0n
  for (const message of messages) {
    const { topic, type, reader, writer } = channels.get(message.channelId), decoded = reader.readMessage(message.data)
    assert.ok(message.logTime >= before && message.publishTime <= message.logTime, 'times fall')
    before = message.logTime
    assert.equal(message.sequence, counts[topic] ?? 0)
    counts[topic] = message.sequence + 1
    types[topic] = type
    assert.ok(Buffer.from(writer.writeMessage(decoded)).equals(Buffer.from(message.data)), `${topic}: encoded otherwise`)
    if (topic === '/backwash/raw_log') raw.update(decoded.data)
    else (said[topic] ??= []).push({ t: Number(message.publishTime) * 1e-9, ...shown(topic, decoded) })
  }
  if (cut) return console.log(JSON.stringify({ counts, raw: raw.digest('hex') }))
  assert.equal(Number(statistics.messageCount), messages.length)
  for (const [id, { topic }] of channels) assert.equal(Number(statistics.channelMessageCounts.get(id)), counts[topic] ?? 0)
  const indexed = await seek({ messages, channels })
  console.log(JSON.stringify({ counts, types, chunks: indexed.chunks, raw: raw.digest('hex'), said }))
}

/// What the test compares with other sources.
function shown(topic, m) {
  const xyz = (v) => [v.x, v.y, v.z]
  if (topic === '/tf') {
    const { header, child_frame_id, transform } = m.transforms[0], { z, w } = transform.rotation
    return { p: xyz(transform.translation), yaw: 2 * Math.atan2(z, w), parent: header.frame_id, child: child_frame_id }
  }
  if (topic.endsWith('/odometry')) {
    const { x, y, z, w } = m.pose.pose.orientation
    return { p: xyz(m.pose.pose.position), q: [w, x, y, z], v: xyz(m.twist.twist.linear), stamp: m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 }
  }
  if (topic.endsWith('/setpoint')) return { p: xyz(m.pose.position) }
  if (topic.endsWith('/trajectory')) return { p: m.poses.map((pose) => xyz(pose.pose.position)) }
  if (topic.endsWith('/markers') || topic.endsWith('/voxels'))
    return { shapes: m.markers.map((s) => ({ type: s.type, action: s.action, p: xyz(s.pose.position), scale: xyz(s.scale), points: s.points.map(xyz) })) }
  if (topic.endsWith('/scene')) {
    const { id, frame_id, cubes, lines } = m.entities[0]
    return { entities: m.entities.length, id, frame_id, cubes: cubes.map((c) => ({ p: xyz(c.pose.position), scale: xyz(c.size) })), lines: lines.map((l) => l.points.map(xyz)) }
  }
  if (topic.endsWith('/error_over_bound')) return { v: xyz(m.vector) }
  return { text: m.data ?? m.msg }
}

main().catch((error) => {
  console.error(error.message)
  process.exit(1)
})
