#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The first program holds no symbol of the simulator; the second does, or else this looks for the wrong thing.
count() { nm -C "$1" | grep -c 'toftwin::sim::\|rtcNewScene'; }
symbols=$(nm "$1" | wc -l)
own=$(count "$1") other=$(count "$2")
echo "$1: $own of $symbols symbols are the simulator's; $2: $other"
[ "$symbols" -gt 1000 ] && [ "$own" -eq 0 ] && [ "$other" -gt 100 ]
