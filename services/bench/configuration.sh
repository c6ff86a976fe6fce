# SPDX-License-Identifier: BSD-3-Clause
# Sourced by every script that starts the daemon; needs $work and $domain.

# write_configuration VEHICLE RAW_LOG [ODOMETRY_TOPIC]: $work/backwashd.toml. Of its other values, $model is the vehicle's
# $interface is lo, $device the bench's and $baud 921600 if they are not set; $more_dds and $more_link hold further lines of [dds] and [link], $more_tables whole tables.
write_configuration() {
  cat >"$work/backwashd.toml" <<TOML
vehicle = "$1"
model = "${model:-$1}"
[dds]
domain = $domain
interface = "${interface:-lo}"
namespace = "backwash"
odometry_topic = "${3:-rt/backwash/odometry}"${more_dds:+
$more_dds}
[link]
device = "${device:-$work/autopilot}"
baud = ${baud:-921600}
system = ${system:-1}
${more_link:-}
[control]
priority = 80
cpu = -1
battery_land = 0.15
[log]
file = "$2"
${more_tables:-}
TOML
}
