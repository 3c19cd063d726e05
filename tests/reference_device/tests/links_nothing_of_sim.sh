#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The first program holds no symbol of what simulates a camera (scenes, tracers, sensors, decoders); the second does, or else this
# looks for the wrong thing. The daemon's own code takes learned errors off any camera, and with that come the effects' symbols.
simulates='toftwin::sim::\(SensorModel\|Scene\|RealtimeTracer\|Tracer\|Simulator\|correlate\|decode\)\|rtcNewScene'
count() { nm -C "$1" | grep -c "$simulates"; }
symbols=$(nm "$1" | wc -l)
own=$(count "$1") other=$(count "$2")
echo "$1: $own of $symbols symbols are the simulator's; $2: $other"
[ "$symbols" -gt 1000 ] && [ "$own" -eq 0 ] && [ "$other" -gt 100 ]
