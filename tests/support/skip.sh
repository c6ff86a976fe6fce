# SPDX-License-Identifier: BSD-3-Clause
# Sourced by tests: the one way to be skipped. It is for what this machine cannot do, never for what a command of ours did wrong or
# ./check forgot to install: that fails, with the command's words. tests/support/skipped.py asks for the kind.

# skip KIND WORDS: right (the user's or the container's), device, kernel, network, stalled (this machine stood still); in a
# GTEST_SKIP() also sanitizer, and data (files beside the tree are absent).
skip() { echo "skipped: $1: ${*:2}"; exit 77; }
# failed WORDS: the test fails.
failed() { echo "$*" >&2; exit 1; }

kept_back=$(dirname "${BASH_SOURCE[0]}")/../../build/lacking
# installed WHAT LIST COMMAND …: whether COMMAND holds. If not, ./check forgot WHAT, unless it says why it could not install it.
installed() {
  "${@:3}" && return
  [[ ! -s $kept_back ]] || skip "$(paste -sd';' "$kept_back")"
  failed "$1 is not there: ./check installs it ($2)"
}
# needs COMMAND …: programs of Debian packages.
found() { command -v "$1" >/dev/null; }
needs() {
  local command
  for command; do installed "$command" tests/packages.txt found "$command"; done
}
# needs_peers: libraries of others from npm's registry, for node; none of them is a part of the programs.
needs_peers() {
  needs node
  modules=$(realpath -m "$(dirname "$kept_back")/peers")
  installed "$modules" tests/peers/package.json test -d "$modules/node_modules"
}
# of_debian COMMAND …: one that downloads Debian's packages, once more with new lists.
of_debian() {
  local said
  said=$("$@" 2>&1) && return
  said=$(apt-get update -qq -o APT::Update::Error-Mode=any 2>&1) || skip network "Debian's mirrors: $(tail -n 1 <<<"$said")"
  said=$("$@" 2>&1) || failed "$*: $said"
}
needs_root() { [[ $(id -u) -eq 0 ]] || skip right root; }
# own_network [tun] SCRIPT [ARGUMENT …]: runs it again in a network of its own, with TUN devices if it asks for them.
own_network() {
  [[ $1 != tun ]] || { shift; [[ -c /dev/net/tun ]] || skip device /dev/net/tun; }
  unshare --net true 2>/dev/null || skip right "to make a network of its own"
  exec unshare --net bash -c 'ip link set lo up && exec "$@"' - "$@"
}
