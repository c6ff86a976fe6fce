#!/bin/busybox sh
# SPDX-License-Identifier: BSD-3-Clause
# First process of the guest of gpio_guest.sh: a simulated chip with three named lines, the daemon on it, and what becomes of
# both. Every line on the console that begins with "gpio:" is told by the test; the last of a good run is "all seen".
/bin/busybox --install -s /bin
export PATH=/bin
mount -t proc none /proc && mount -t sysfs none /sys && mount -t devtmpfs none /dev
ip link set lo up
insmod /configfs.ko && mount -t configfs none /config && insmod /gpio_guest.ko

end() {
  echo "gpio: $*"
  poweroff -f
}
failed() {
  ls -l /dev/gpiochip* && dmesg | tail -n 5
  grep -v 'deadline missed' /tmp/log
  end "FAILED: $*"
}
bank=/config/gpio-sim/board/bank
mkdir -p $bank/line0 $bank/line1 $bank/line2
echo 8 >$bank/num_lines
echo BENCH >$bank/label
echo STOP >$bank/line0/name
echo WATCHDOG >$bank/line1/name
echo STATUS >$bank/line2/name
echo 1 >/config/gpio-sim/board/live || end "FAILED: no simulated chip"
chip() { echo /sys/devices/platform/$(cat /config/gpio-sim/board/dev_name)/$(cat $bank/chip_name); }
level() { cat $(chip)/sim_gpio$1/value; }
switch() { echo $1 >$(chip)/sim_gpio0/pull; }

# said TEXT: waits until the daemon has said it since the last call.
from=1
said() {
  for n in $(seq 600); do
    at=$(tail -n +$from /tmp/log | grep -n "$1" | head -n 1 | cut -d: -f1)
    [ -n "$at" ] && from=$((from + at)) && echo "gpio: said: $1" && return
    usleep 100000
  done
  failed "not said: $1"
}
# edges LINE: how often its level differs between 200 readings.
edges() {
  value=$(chip)/sim_gpio$1/value count=0
  read last <$value
  for n in $(seq 200); do
    read now <$value
    usleep 5000
    [ $now = $last ] || count=$((count + 1))
    last=$now
  done
  echo $count
}
# refused REASON: asks to enable until this is the answer; a slow guest may not be heard at once.
refused() {
  for n in $(seq 20); do
    answer=$(backwashctl --domain 3 enable 2>&1 | tail -n 1)
    case $answer in *"refused: $1"*) echo "gpio: refused: $1" && return ;; esac
  done
  failed "not refused for \"$1\" but: $answer"
}

touch /tmp/log
backwashd --config /etc/backwashd.toml 2>/tmp/log &
daemon=$!
said 'stop switch: BENCH, line STOP'
said 'stop switch: not seen in both positions yet'
[ "$(level 0)" = 1 ] || failed "the line is not pulled up"
refused 'stop switch: not seen in both positions'
switch pull-down
said 'stop switch: released'
refused 'no map'
switch pull-up
said 'stop switch: pressed'
refused 'stop switch: pressed'
pull=$(chip)/sim_gpio0/pull  # changed without a new process each time: faster than a level counts
(while [ ! -e /tmp/quiet ]; do echo pull-down >$pull; echo pull-up >$pull; done) &
said 'stop switch: chatters'
touch /tmp/quiet
wait $!
switch pull-down
said 'stop switch: released'

alive=$(edges 1)
kill -STOP $daemon
usleep 300000
stopped=$(edges 1)
kill -CONT $daemon
usleep 300000
again=$(edges 1)
echo "gpio: edges of the strobe in 200 readings: $alive, $stopped with the daemon stopped, $again after it"
[ $alive -gt 3 ] && [ $stopped = 0 ] && [ $again -gt 3 ] || failed "the strobe"

echo 0 >/config/gpio-sim/board/live
said 'line STOP: No such device'
refused 'stop switch: its line cannot be read'
echo 1 >/config/gpio-sim/board/live # with another number, for the daemon still held the old one
said 'stop switch: BENCH, line STOP'
said 'stop switch: not seen in both positions yet'
kill -0 $daemon || failed "the daemon has ended"
kill -TERM $daemon
wait $daemon || failed "the daemon failed"
end "all seen"
