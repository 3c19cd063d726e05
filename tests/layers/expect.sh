#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# expect.sh zero|nonzero PATTERN COMMAND…: runs the command, whose exit status must be as said and whose
# output must match the extended regular expression, line breaks and indents counting as one space.
wanted=$1 pattern=$2
shift 2
output=$("$@" 2>&1)
status=$?
printf '%s\n' "$output"
case $wanted in
  zero) [ "$status" -eq 0 ] || { echo "expect.sh: exit status $status instead of 0"; exit 1; } ;;
  nonzero) [ "$status" -ne 0 ] || { echo "expect.sh: exit status 0, though it must fail"; exit 1; } ;;
  *) echo "expect.sh: '$wanted' is neither zero nor nonzero"; exit 1 ;;
esac
printf '%s' "$output" | tr -s ' \n' ' ' | grep -Eq -- "$pattern" || {
  echo "expect.sh: nothing in the output matches: $pattern"
  exit 1
}
