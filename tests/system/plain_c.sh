#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The plain link's C code as a microcontroller takes it: the MISRA C:2012 rules that Debian's cppcheck knows, and C99 for
# Cortex-M without any library (nothing undefined), its size below what its README says.
#   plain_c.sh SOURCE_DIR
set -euo pipefail
source "$1/tests/support/skip.sh"
needs cppcheck arm-none-eabi-gcc
source=$1/firmware_bridge/plain
# Rule 2.5 (unused macros) is about a program: these are for the user of the header.
cppcheck --std=c99 --enable=warning,style,performance,portability --addon=misra --quiet --error-exitcode=1 \
  --suppress=misra-c2012-2.5 "$source/plain.c"
echo "cppcheck with its MISRA addon: nothing found"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for cpu in cortex-m0 cortex-m4 cortex-m7; do
  arm-none-eabi-gcc -std=c99 -pedantic -ffreestanding -mcpu=$cpu -mthumb -Os -Wall -Wextra -Wconversion -Werror -fstack-usage \
    -c "$source/plain.c" -o "$work/$cpu.o"
  missing=$(arm-none-eabi-nm -u "$work/$cpu.o")
  [[ -z $missing ]] || { echo "$cpu: not in the file: $missing"; exit 1; }
  text=$(arm-none-eabi-size "$work/$cpu.o" | awk 'NR == 2 { print $1 }') data=$(arm-none-eabi-size "$work/$cpu.o" | awk 'NR == 2 { print $2 + $3 }')
  stack=$(sort -k2 -n -t$'\t' "$work/$cpu.su" | tail -n 1 | cut -f2)
  echo "$cpu: $text bytes of code, $data of data, at most $stack of stack in one function"
  ((text <= 1600 && data == 0 && stack <= 64)) || { echo "$cpu: more than the README says"; exit 1; }
done
