#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What a start must not do (docs/faults.md rows 29, 38, 45): with an invalid configuration, or with credentials that no
# peer would take, no port is opened, no file is waited for and nothing is made; a start that fails, and one that does not,
# leaves every earlier log byte for byte.
#   attack_start.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset CYCLONEDDS_URI
# Credentials of DDS Security, each with one thing wrong.
keys() { "$2/services/backwash" keys "${@:3}" >/dev/null; }
for authority in net others; do
  keys "$@" init "$work/$authority"
  for name in good other; do keys "$@" add "$work/$authority" $name --role vehicle; done
done
for bad in open keyless unlike foreign forged revoked tampered unfit ended; do cp -r "$work/net/good" "$work/$bad"; done
chmod 0640 "$work/open/key.pem"
rm "$work/keyless/key.pem"
cp "$work/net/other/key.pem" "$work/unlike"
cp "$work/others/good/identity_ca.cert.pem" "$work/foreign" && rm "$work/foreign/crl.pem"
cp "$work/others/good/governance.p7s" "$work/forged"
sed -i 's,rt/backwash/ack,rt/backwash/xyz,' "$work/tampered/permissions.p7s"
cp "$work/net/other/permissions.p7s" "$work/unfit"
cp "$work/net/other/"*.pem "$work/net/other/permissions.p7s" "$work/revoked"
keys "$@" revoke "$work/net" other && cp "$work/net/crl.pem" "$work/revoked"
keys "$@" add "$work/net" ended --role vehicle --until "$(date -u -d '+2 seconds' +%Y-%m-%dT%H:%M:%SZ)"
cp "$work/net/ended/"* "$work/ended" && sleep 3
python3 - "${2:?usage: attack_start.sh SOURCE_DIR BUILD_DIR}/services/backwashd" "$work" <<'PYTHON'
import fcntl, os, select, signal, struct, subprocess, sys, time
daemon, work = sys.argv[1:]
log = work + "/flight.bwlog"


class Port:
    """A pseudo-terminal whose far end can tell whether the near one was ever opened: then, and only then, it hangs up."""

    def __init__(self):
        self.far = os.open("/dev/ptmx", os.O_RDWR | os.O_NOCTTY)
        fcntl.ioctl(self.far, 0x40045431, struct.pack("i", 0))  # TIOCSPTLCK
        self.path = "/dev/pts/%d" % struct.unpack("I", fcntl.ioctl(self.far, 0x80045430, b"\0" * 4))[0]  # TIOCGPTN

    def was_opened(self):
        poll = select.poll()
        poll.register(self.far, select.POLLIN)
        return bool(poll.poll(0))

    def __del__(self):
        os.close(self.far)


def configuration(port, **changed):
    keys = dict(vehicle="builtin:quad-5in", model="builtin:quad-5in", domain="9", interface="lo", namespace="backwash",
                topic="rt/backwash/odometry", security="", baud="921600", file=log, more="")
    keys.update(changed)
    return """vehicle = "{vehicle}"
model = "{model}"
[dds]
domain = {domain}
interface = "{interface}"
namespace = "{namespace}"
odometry_topic = "{topic}"
{security}
[link]
device = "{device}"
baud = {baud}
system = 1
[control]
priority = 0
cpu = -1
battery_land = 0.15
{more}
[log]
file = "{file}"
""".format(device=port, **keys)


def start(path):
    ran = subprocess.run([daemon, "--config", path], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=20)
    return ran.returncode, ran.stderr


def logs():
    return {name: open(work + "/" + name, "rb").read() for name in os.listdir(work) if name.endswith(".bwlog")}


path = work + "/daemon.toml"
os.mkfifo(work + "/fifo")
with open(work + "/large.toml", "wb") as f:
    f.truncate(1 << 40)
cases = [
    ("baud", {"baud": "12"}, ":11: key 'link.baud' = 12"),
    ("unknown key", {"more": "turbo = 1"}, ":17: key 'control.turbo' = 1"),
    ("domain", {"domain": "231"}, ":4: key 'dds.domain' = 231"),
    ("XML in the interface", {"interface": r"lo\"/><x y=\""}, ":5: key 'dds.interface'"),
    ("namespace", {"namespace": "back wash"}, ":6: key 'dds.namespace' = "),
    ("topic", {"topic": "rt/9lives"}, ":7: key 'dds.odometry_topic' = "),
    ("not TOML", {"more": "]["}, ":17: not valid TOML"),
    ("vehicle huge", {"vehicle": work + "/large.toml"}, "/large.toml: has 1048576 MiB, the cap is 1 MiB"),
]
no_files = [
    ("vehicle absent", {"vehicle": work + "/absent.toml"}, "/absent.toml: cannot be read: No such file"),
    ("vehicle FIFO", {"vehicle": work + "/fifo"}, "/fifo: is a FIFO; needs the path of a TOML file"),
    ("model endless", {"model": "/dev/zero"}, "/dev/zero: is a device; needs the path of a TOML file"),
    ("model a directory", {"model": work}, ": is a directory; needs the path of a TOML file"),
]
refused = dict(open="open/key.pem: has mode 0640, needs 0600", keyless="keyless/key.pem: cannot be opened: No such file",
               unlike="unlike/cert.pem: is of another key", foreign="foreign/cert.pem: ", forged="forged/governance.p7s: is not signed",
               tampered="tampered/permissions.p7s: is not signed", unfit="unfit/permissions.p7s: grants nothing to CN=good",
               revoked="revoked/cert.pem: certificate revoked", ended="ended/cert.pem: certificate has expired",
               absent="absent/key.pem: cannot be opened")
cases += [("credentials " + folder, {"security": f'security = "{work}/{folder}"'}, f"dds.security: {work}/{words}")
          for folder, words in refused.items()]
for name, changed, words in cases + no_files:
    port = Port()
    open(path, "w").write(configuration(port.path, **changed))
    code, said = start(path)
    wanted = 66 if (name, changed, words) in no_files else 78
    assert code == wanted and words in said and said.count("\n") == 1, (name, code, said)
    assert not port.was_opened(), f"{name}: the port was opened"
    assert not logs(), f"{name}: a log was made"
for special, words in ((work + "/fifo", "is a FIFO"), ("/dev/zero", "is a device"), (work, "is a directory")):
    code, said = start(special)
    assert code == 66 and words in said and said.count("\n") == 1, (special, code, said)
print(f"{len(cases)} invalid configurations: exit 78; {len(no_files) + 3} that are no files: exit 66; no port opened")

# What is not the configuration's fault has codes of its own; what an earlier flight left is not touched.
open(log, "wb").write(b"an earlier flight")
earlier = logs()
code, said = start((open(path, "w").write(configuration(path)), path)[1])
assert code == 74 and path + ": is not a serial port" in said and logs() == earlier, (code, said)
port = Port()
open(path, "w").write(configuration(port.path, file="/nowhere/flight.bwlog"))
code, said = start(path)
assert code == 73 and "/nowhere/flight.bwlog" in said and port.was_opened() and logs() == earlier, (code, said)
port = Port()
open(path, "w").write(configuration(port.path, interface="nowhere0"))
code, said = start(path)
assert code == 71 and "nowhere0" in said, (code, said)
assert logs() == earlier, "a start that failed left a log"

# A port that is missing at start is waited for, said once, and opened when it appears.
later = work + "/later"
open(path, "w").write(configuration(later))
running = subprocess.Popen([daemon, "--config", path], stderr=subprocess.PIPE, text=True)
for line in running.stderr:
    if later in line:
        break
assert "cannot be opened: No such file or directory; waiting for it" in line, line
port = Port()
os.symlink(port.path, later)
time.sleep(5)
running.send_signal(signal.SIGTERM)
assert running.wait(20) == 0 and port.was_opened(), "a port that appeared was not opened"

# A good one, with good credentials: the port is opened, and the log is a new file beside the earlier ones.
before = logs()
port = Port()
open(path, "w").write(configuration(port.path, security=f'security = "{work}/net/good"'))
running = subprocess.Popen([daemon, "--config", path], stderr=subprocess.PIPE, text=True)
for line in running.stderr:
    if "raw log" in line:
        break
made = line.split("raw log ")[1].strip()
running.send_signal(signal.SIGTERM)
assert running.wait(20) == 0
assert port.was_opened(), "the far end cannot tell an opened port"
assert made == work + "/flight-%d.bwlog" % (len(before) + 1), (made, list(before))
after = logs()
assert all(after[name] == text for name, text in before.items()), "an earlier log was touched"
assert after[os.path.basename(made)].startswith(b"\x89MCAP0\r\n") and os.stat(made).st_mode & 0o777 == 0o640
print("exit 74, 73, 71 for port, log, interface; the earlier logs are untouched, the new one is", os.path.basename(made))
PYTHON
