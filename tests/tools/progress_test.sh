#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# progress_test.sh PROGRESS.SH: what tools/check and tools/demo say of how much is left.
set -eu
. "$1"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

expect() {  # WHAT IS WANTED
  [ "$2" = "$3" ] || { echo "$1: \"$2\", where \"$3\" was expected"; exit 1; }
}

printf '  1/200 Test #7: long ....   Passed  70.0 sec\n' > "$work/log"
expect "by count" "$(thousandths "$work/log" 1 200)" 5
expect "without a record" "$(thousandths "$work/log" 1 200 "$work/none")" 5
printf 'long 3 70.0\nmiddle 3 20.0\nshort 3 10.0\n---\nshort\n' > "$work/costs"
expect "by time" "$(thousandths "$work/log" 1 200 "$work/costs")" 700
printf '  2/200 Test  #9: middle ....***Failed  20.0 sec\n' >> "$work/log"
expect "by time" "$(thousandths "$work/log" 2 200 "$work/costs")" 900
printf '  1/200 Test #8: new ....   Passed  1.0 sec\n' > "$work/log"
expect "a test without a record" "$(thousandths "$work/log" 1 200 "$work/costs")" 5

# Every second counts as ten more, so that it says something.
quick() { echo " $1/200 step"; sleep 1.5; }
sleep() { command sleep "$1"; SECONDS=$((SECONDS + 10)); }
expect "nothing to go by" "$(with_progress "$work/log" quick 1 | grep -c left || true)" 0
[[ $(with_progress "$work/log" quick 100) == *"100 of 200 after "*", about "*" left"* ]] ||
  { echo "half is done, and it does not say how long is left"; exit 1; }

# As tools/check runs it, where any failing line ends all: a step may be silent for longer than it takes to ask.
bash -euo pipefail -c '. "$1"; sleep() { command sleep "$1"; SECONDS=$((SECONDS + 10)); }
                       with_progress "$2/log" command sleep 1.5' - "$1" "$work" > "$work/said" ||
  { echo "a step that prints nothing for ten seconds ends who waits for it"; exit 1; }
grep -q "at work for " "$work/said" || { echo "a step that prints nothing is not spoken of"; exit 1; }
echo "says what there is to go by"
