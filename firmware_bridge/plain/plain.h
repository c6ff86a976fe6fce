/* SPDX-License-Identifier: BSD-3-Clause */
/* The plain serial link between backwash and a flight controller without MAVLink: docs/plain_link.md.
 *
 * C99, for both ends and for any microcontroller: no allocation, no library, no global state, no recursion, and every
 * loop is bounded by the size of a frame. One byte in costs a few instructions, the last one of a frame its checksum.
 *
 * Lengths in m, m/s, m/s^2; angles in rad; axes z-up: L is the controller's local frame, B the body, x forward, y left.
 */
#ifndef BACKWASH_PLAIN_H
#define BACKWASH_PLAIN_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define PLAIN_VERSION 1U
/* Bytes of a frame on the wire, delimiter included. */
#define PLAIN_COMMAND_SIZE 58U
#define PLAIN_POSE_SIZE 58U
#define PLAIN_STATE_SIZE 74U
#define PLAIN_LARGEST_SIZE PLAIN_STATE_SIZE

/* What the operator wants of the controller, once. */
#define PLAIN_REQUEST_NONE 0U
#define PLAIN_REQUEST_FOLLOW 1U /* set-points, from now on */
#define PLAIN_REQUEST_ARM 2U
#define PLAIN_REQUEST_DISARM 3U
#define PLAIN_REQUEST_LAND 4U /* the controller's own landing */

#define PLAIN_ANSWER_NONE 0U
#define PLAIN_ANSWER_DONE 1U
#define PLAIN_ANSWER_REFUSED 2U

/* Down, 50 times a second while the controller is to follow, once a second otherwise. */
typedef struct {
  uint16_t sequence;
  uint8_t request;   /* PLAIN_REQUEST_; any other number is to be refused */
  bool has_setpoint; /* otherwise what follows is zero and means nothing */
  uint32_t time_ms;  /* of the sender's clock */
  float position[3]; /* in L */
  float velocity[3];
  float acceleration[3];
  float yaw; /* of body x in L, anticlockwise from x */
} plain_command_t;

/* Down, where the vehicle is: for a controller without a position sensor of its own. */
typedef struct {
  uint16_t sequence;
  uint8_t reset_counter;  /* changes when the VIO's frame jumps */
  uint16_t age_tenths_ms; /* of the sample when it was sent; 65535: that or more */
  uint32_t time_ms;
  float position[3];   /* in the VIO's frame O, z-up; a controller that flies on it has L = O */
  float attitude[4];   /* w x y z, body to O */
  float velocity_b[3]; /* in B */
} plain_pose_t;

/* Up, at 20 Hz or more, better 50. */
typedef struct {
  uint16_t sequence;
  bool armed;
  bool following; /* the set-points */
  bool on_ground; /* counts where ground_known */
  bool ground_known;
  bool failsafe;         /* one acts, or the pilot does: the vehicle is not ours */
  uint8_t reset_counter; /* changes when L jumps */
  uint16_t answered;     /* sequence of the last command with a request */
  uint8_t answer;        /* PLAIN_ANSWER_ */
  uint32_t time_ms;
  bool pose_known;   /* otherwise position, velocity, attitude and rates are zero and mean nothing */
  float position[3]; /* in L */
  float velocity[3];
  float attitude[4];           /* w x y z, body to L */
  float rates[3];              /* rad/s in B */
  uint8_t battery_percent;     /* 0 to 100; 255: not known */
  uint16_t battery_millivolts; /* 0: not known */
} plain_state_t;

/* Writes the whole frame, delimiter included. */
void plain_write_command(const plain_command_t* command, uint8_t wire[PLAIN_COMMAND_SIZE]);
void plain_write_pose(const plain_pose_t* pose, uint8_t wire[PLAIN_POSE_SIZE]);
void plain_write_state(const plain_state_t* state, uint8_t wire[PLAIN_STATE_SIZE]);

/* What a byte completed. */
typedef enum {
  PLAIN_NOTHING = 0, /* more bytes are needed */
  PLAIN_REFUSED = 1, /* a frame ended that is damaged, of another version, or holds a number that is not finite */
  PLAIN_COMMAND = 2, /* plain_read_command() has it until the next byte */
  PLAIN_POSE = 3,
  PLAIN_STATE = 4
} plain_event_t;

/* A receiver starts as all zero. */
typedef struct {
  uint8_t bytes[PLAIN_LARGEST_SIZE];
  uint8_t length;
  bool too_long; /* passed over up to the next delimiter */
} plain_receiver_t;

plain_event_t plain_receive(plain_receiver_t* receiver, uint8_t byte);

/* Precondition of each: plain_receive() has just returned its event. */
void plain_read_command(const plain_receiver_t* receiver, plain_command_t* command);
void plain_read_pose(const plain_receiver_t* receiver, plain_pose_t* pose);
void plain_read_state(const plain_receiver_t* receiver, plain_state_t* state);

#ifdef __cplusplus
}
#endif

#endif
