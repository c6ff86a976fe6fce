# SPDX-License-Identifier: BSD-3-Clause
"""MAVLink's checksum (X.25), for the scripts that make or judge frames themselves."""


def crc(data):
    value = 0xFFFF
    for byte in data:
        byte ^= value & 0xFF
        byte = (byte ^ byte << 4) & 0xFF
        value = (value >> 8) ^ (byte << 8) ^ (byte << 3) ^ (byte >> 4)
    return value & 0xFFFF
