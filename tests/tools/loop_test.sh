#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# loop_test.sh RUN BUILD: the loop of tools/demo on a small camera and few places, with centimetres hidden.
set -euo pipefail
run=$1 build=$2 source=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/loop"
cp "$source/docs/examples/demo/room.toml" "$work/"
sed -e 's/^width = .*/width = 32/; s/^height = .*/height = 24/; s/^f\([xy]\) = .*/f\1 = 28.0/' \
    -e 's/^cx = .*/cx = 15.5/; s/^cy = .*/cy = 11.5/' "$source/docs/examples/demo/loop/twin.toml" > "$work/loop/twin.toml"
printf '[[imperfection]]\ntype = "%s"\nwords = "%s"\nfound = "%s"\n%s\n' \
  warm_up "It reads too near when it is cold." "a drift" $'fast_mm = [60.0, 80.0]\nslow_mm = 0.0\nslow_time_s = 900.0' \
  delay "All is too near." "a delay" 'offset_mm = [-60.0, -50.0]' > "$work/loop/hidden.toml"
# plan NAME LOCKED X...: the camera at these places, looking ahead.
plan() {
  printf 'name = "%s"\nframes = 8\n[[block]]\nname = "%s"\nkind = "distance"\ninterval_s = 40.0\nlocked = %s\n' "$1" "$1" "$2"
  shift 2
  for x in "$@"; do printf '[[block.pose]]\nname = "x %s"\nposition_m = [%s, 0.0, 0.1]\n' "$x" "$x"; done
}
plan learned 2 -0.3 -0.2 -0.1 0.0 0.1 0.2 0.3 0.4 > "$work/loop/plan.toml"
plan unseen 0 -0.25 0.05 0.35 > "$work/loop/unseen.toml"

"$run" --build "$build" --files "$work/loop" --out "$work/out" --seed 1 --tab "More=more.html" > "$work/said" 2>&1 ||
  { cat "$work/said"; exit 1; }
cd "$work/out"

fail() { echo "$1"; tail -20 "$work/said"; cat loop.json; exit 1; }
[ "$(sha256sum opened.toml | cut -d' ' -f1)" = "$(cat sealed.sha256)" ] || fail "what was opened is not what was sealed"
grep -q "SHA-256 $(cat sealed.sha256)" <(head -1 "$work/said") || fail "the seal is not said before the captures"
[ ! opened.toml -ot found/report.json ] || fail "what was hidden was opened before the verdict"
cmp -s found/model.toml "$work/loop/twin.toml" && fail "nothing was added to the twin"
python3 - << 'END' || fail "the figures do not say that the twin got better"
import json
said = json.load(open("loop.json"))
before, after, noise = (said[f"rms_{what}_mm"] for what in ("before", "after", "noise"))
assert sorted(place["name"] for place in said["places"]) == [f"unseen: x {x}" for x in ("-0.25", "0.05", "0.35")], said
assert {one["type"] for one in said["hidden"]} == {"warm_up", "delay"}, said
assert before > 2 * noise, "what was hidden is hardly seen"
assert noise < 1.5 * after and after < 0.6 * before, (before, after, noise)
END
for words in "It reads too near when it is cold." "All is too near." "More" "$(cat sealed.sha256)" "data:image/png"; do
  grep -qF "$words" index.html || fail "the page does not say: $words"
done
[ "$(grep -o "<figure>" index.html | wc -l)" = 4 ] || fail "there are not four pictures"
grep -q '\$[a-z]' <(sed '/<style>/,/<\/style>/d' index.html) && fail "a place of the template was not filled"
echo "the loop is closed: $(tail -2 "$work/said" | head -1)"
