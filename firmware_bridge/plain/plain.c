/* SPDX-License-Identifier: BSD-3-Clause */
#include "plain.h"

/* A body is kind, version, sequence, fields, numbers and CRC-32, little-endian; README.md has the table. */
#define KIND_COMMAND 0x43U /* 'C' */
#define KIND_POSE 0x50U    /* 'P' */
#define KIND_STATE 0x53U   /* 'S' */
#define CRC_SIZE 4U
#define NUMBERS_AT 12U /* the floats of every kind begin here */
#define COMMAND_NUMBERS 10U
#define POSE_NUMBERS 10U
#define STATE_NUMBERS 13U
#define FLOAT_SIZE 4U
#define COBS_OVERHEAD 2U /* one code byte, one delimiter: bodies are shorter than 254 bytes */

#define FLAG_SETPOINT 0x01U

#define FLAG_ARMED 0x01U
#define FLAG_FOLLOWING 0x02U
#define FLAG_ON_GROUND 0x04U
#define FLAG_GROUND_KNOWN 0x08U
#define FLAG_FAILSAFE 0x10U
#define FLAG_POSE_KNOWN 0x20U

static void put_u16(uint8_t* at, uint16_t value) {
  at[0] = (uint8_t)(value & 0xFFU);
  at[1] = (uint8_t)(value >> 8);
}

static uint16_t get_u16(const uint8_t* at) { return (uint16_t)((uint32_t)at[0] | ((uint32_t)at[1] << 8)); }

static void put_u32(uint8_t* at, uint32_t value) {
  put_u16(at, (uint16_t)(value & 0xFFFFU));
  put_u16(&at[2], (uint16_t)(value >> 16));
}

static uint32_t get_u32(const uint8_t* at) { return (uint32_t)get_u16(at) | ((uint32_t)get_u16(&at[2]) << 16); }

/* A float's bits, in the machine's own order of bytes. */
static void copy_4(uint8_t* to, const uint8_t* from) {
  uint8_t i;
  for (i = 0U; i < FLOAT_SIZE; i++) {
    to[i] = from[i];
  }
}

static void put_floats(uint8_t* at, const float* values, uint8_t count) {
  uint8_t i;
  for (i = 0U; i < count; i++) {
    uint32_t bits = 0U;
    copy_4((uint8_t*)&bits, (const uint8_t*)&values[i]);
    put_u32(&at[i * FLOAT_SIZE], bits);
  }
}

static void get_floats(const uint8_t* at, float* values, uint8_t count) {
  uint8_t i;
  for (i = 0U; i < count; i++) {
    const uint32_t bits = get_u32(&at[i * FLOAT_SIZE]);
    copy_4((uint8_t*)&values[i], (const uint8_t*)&bits);
  }
}

/* IEEE 754: an exponent of all ones is an infinity or no number. */
static bool all_finite(const uint8_t* at, uint8_t count) {
  bool finite = true;
  uint8_t i;
  for (i = 0U; i < count; i++) {
    if ((get_u32(&at[i * FLOAT_SIZE]) & 0x7F800000U) == 0x7F800000U) {
      finite = false;
    }
  }
  return finite;
}

/* CRC-32 of Ethernet and zlib: reflected polynomial 0xEDB88320, start and final xor all ones. */
static uint32_t crc_32(const uint8_t* bytes, uint8_t count) {
  uint32_t crc = 0xFFFFFFFFU;
  uint8_t i;
  for (i = 0U; i < count; i++) {
    uint8_t bit;
    crc ^= (uint32_t)bytes[i];
    for (bit = 0U; bit < 8U; bit++) {
      const uint32_t out = crc & 1U;
      crc >>= 1;
      if (out != 0U) {
        crc ^= 0xEDB88320U;
      }
    }
  }
  return crc ^ 0xFFFFFFFFU;
}

static void put_head(uint8_t* body, uint8_t kind, uint16_t sequence, uint32_t time_ms) {
  body[0] = kind;
  body[1] = PLAIN_VERSION;
  put_u16(&body[2], sequence);
  put_u32(&body[8], time_ms);
}

/* Puts the checksum behind the body at wire[1] and stuffs it where it lies: each zero becomes the distance to the next
 * one, and the code byte before the body is the distance to the first (COBS). */
static void finish(uint8_t* wire, uint8_t wire_size) {
  const uint8_t size = (uint8_t)(wire_size - COBS_OVERHEAD);
  uint8_t distance = 1U;
  uint8_t i;
  put_u32(&wire[1U + size - CRC_SIZE], crc_32(&wire[1], (uint8_t)(size - CRC_SIZE)));
  for (i = size; i > 0U; i--) {
    if (wire[i] == 0U) {
      wire[i] = distance;
      distance = 0U;
    }
    distance++;
  }
  wire[0] = distance;
  wire[size + 1U] = 0U;
}

void plain_write_command(const plain_command_t* command, uint8_t wire[PLAIN_COMMAND_SIZE]) {
  uint8_t* const body = &wire[1];
  put_head(body, KIND_COMMAND, command->sequence, command->time_ms);
  body[4] = command->request;
  body[5] = command->has_setpoint ? FLAG_SETPOINT : 0U;
  put_u16(&body[6], 0U);
  put_floats(&body[NUMBERS_AT], command->position, 3U);
  put_floats(&body[24], command->velocity, 3U);
  put_floats(&body[36], command->acceleration, 3U);
  put_floats(&body[48], &command->yaw, 1U);
  finish(wire, PLAIN_COMMAND_SIZE);
}

void plain_write_pose(const plain_pose_t* pose, uint8_t wire[PLAIN_POSE_SIZE]) {
  uint8_t* const body = &wire[1];
  put_head(body, KIND_POSE, pose->sequence, pose->time_ms);
  body[4] = pose->reset_counter;
  body[5] = 0U;
  put_u16(&body[6], pose->age_tenths_ms);
  put_floats(&body[NUMBERS_AT], pose->position, 3U);
  put_floats(&body[24], pose->attitude, 4U);
  put_floats(&body[40], pose->velocity_b, 3U);
  finish(wire, PLAIN_POSE_SIZE);
}

static uint8_t flags_of(const plain_state_t* state) {
  uint32_t flags = 0U;
  flags |= state->armed ? FLAG_ARMED : 0U;
  flags |= state->following ? FLAG_FOLLOWING : 0U;
  flags |= state->on_ground ? FLAG_ON_GROUND : 0U;
  flags |= state->ground_known ? FLAG_GROUND_KNOWN : 0U;
  flags |= state->failsafe ? FLAG_FAILSAFE : 0U;
  flags |= state->pose_known ? FLAG_POSE_KNOWN : 0U;
  return (uint8_t)flags;
}

void plain_write_state(const plain_state_t* state, uint8_t wire[PLAIN_STATE_SIZE]) {
  uint8_t* const body = &wire[1];
  put_head(body, KIND_STATE, state->sequence, state->time_ms);
  body[4] = flags_of(state);
  body[5] = state->reset_counter;
  put_u16(&body[6], state->answered);
  put_floats(&body[NUMBERS_AT], state->position, 3U);
  put_floats(&body[24], state->velocity, 3U);
  put_floats(&body[36], state->attitude, 4U);
  put_floats(&body[52], state->rates, 3U);
  body[64] = state->answer;
  body[65] = state->battery_percent;
  put_u16(&body[66], state->battery_millivolts);
  finish(wire, PLAIN_STATE_SIZE);
}

/* Undoes COBS where the bytes lie, code byte first. False: they are not the coding of anything. The last distance must
 * point right behind the end, where the delimiter was. */
static bool unstuff(uint8_t* bytes, uint8_t length) {
  bool good = true;
  uint8_t at = 0U;
  while (good && (at < length)) {
    const uint8_t distance = bytes[at];
    bytes[at] = 0U;
    good = (distance != 0U) && (distance <= (uint8_t)(length - at));
    at = (uint8_t)(at + distance);
  }
  return good;
}

static bool checked(const uint8_t* body, uint8_t size, uint8_t numbers) {
  return (get_u32(&body[size - CRC_SIZE]) == crc_32(body, (uint8_t)(size - CRC_SIZE))) &&
         all_finite(&body[NUMBERS_AT], numbers);
}

static plain_event_t judge(plain_receiver_t* receiver) {
  plain_event_t event = PLAIN_REFUSED;
  const uint8_t length = receiver->length;
  const uint8_t* const body = &receiver->bytes[1];
  if (unstuff(receiver->bytes, length) && (body[1] == PLAIN_VERSION)) {
    const uint8_t size = (uint8_t)(length - 1U);
    if ((body[0] == KIND_COMMAND) && (length == (PLAIN_COMMAND_SIZE - 1U))) {
      event = checked(body, size, COMMAND_NUMBERS) ? PLAIN_COMMAND : PLAIN_REFUSED;
    } else if ((body[0] == KIND_POSE) && (length == (PLAIN_POSE_SIZE - 1U))) {
      event = checked(body, size, POSE_NUMBERS) ? PLAIN_POSE : PLAIN_REFUSED;
    } else if ((body[0] == KIND_STATE) && (length == (PLAIN_STATE_SIZE - 1U))) {
      event = checked(body, size, STATE_NUMBERS) ? PLAIN_STATE : PLAIN_REFUSED;
    } else {
      event = PLAIN_REFUSED;
    }
  }
  return event;
}

plain_event_t plain_receive(plain_receiver_t* receiver, uint8_t byte) {
  plain_event_t event = PLAIN_NOTHING;
  if (byte != 0U) {
    if (receiver->length < (PLAIN_LARGEST_SIZE - 1U)) {
      receiver->bytes[receiver->length] = byte;
      receiver->length++;
    } else {
      receiver->too_long = true;
    }
  } else {
    if (receiver->too_long) {
      event = PLAIN_REFUSED;
    } else if (receiver->length > 0U) {
      event = judge(receiver);
    } else {
      event = PLAIN_NOTHING; /* delimiters in a row */
    }
    receiver->length = 0U;
    receiver->too_long = false;
  }
  return event;
}

void plain_read_command(const plain_receiver_t* receiver, plain_command_t* command) {
  const uint8_t* const body = &receiver->bytes[1];
  command->sequence = get_u16(&body[2]);
  command->request = body[4];
  command->has_setpoint = (body[5] & FLAG_SETPOINT) != 0U;
  command->time_ms = get_u32(&body[8]);
  get_floats(&body[NUMBERS_AT], command->position, 3U);
  get_floats(&body[24], command->velocity, 3U);
  get_floats(&body[36], command->acceleration, 3U);
  get_floats(&body[48], &command->yaw, 1U);
}

void plain_read_pose(const plain_receiver_t* receiver, plain_pose_t* pose) {
  const uint8_t* const body = &receiver->bytes[1];
  pose->sequence = get_u16(&body[2]);
  pose->reset_counter = body[4];
  pose->age_tenths_ms = get_u16(&body[6]);
  pose->time_ms = get_u32(&body[8]);
  get_floats(&body[NUMBERS_AT], pose->position, 3U);
  get_floats(&body[24], pose->attitude, 4U);
  get_floats(&body[40], pose->velocity_b, 3U);
}

void plain_read_state(const plain_receiver_t* receiver, plain_state_t* state) {
  const uint8_t* const body = &receiver->bytes[1];
  const uint8_t flags = body[4];
  state->sequence = get_u16(&body[2]);
  state->armed = (flags & FLAG_ARMED) != 0U;
  state->following = (flags & FLAG_FOLLOWING) != 0U;
  state->on_ground = (flags & FLAG_ON_GROUND) != 0U;
  state->ground_known = (flags & FLAG_GROUND_KNOWN) != 0U;
  state->failsafe = (flags & FLAG_FAILSAFE) != 0U;
  state->pose_known = (flags & FLAG_POSE_KNOWN) != 0U;
  state->reset_counter = body[5];
  state->answered = get_u16(&body[6]);
  state->time_ms = get_u32(&body[8]);
  get_floats(&body[NUMBERS_AT], state->position, 3U);
  get_floats(&body[24], state->velocity, 3U);
  get_floats(&body[36], state->attitude, 4U);
  get_floats(&body[52], state->rates, 3U);
  state->answer = body[64];
  state->battery_percent = body[65];
  state->battery_millivolts = get_u16(&body[66]);
}
