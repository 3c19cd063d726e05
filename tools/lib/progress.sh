# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts beside this folder: says what is going on and how long it will take.

step_count=0
steps_done=0

# steps N: how many calls of `step` will follow.
steps() { step_count=$1; }

# step "what": announces the next step.
step() {
  steps_done=$((steps_done + 1))
  printf '\n[%d/%d] %s\n' "$steps_done" "$step_count" "$1"
}

as_time() {
  if [ "$1" -ge 60 ]; then printf '%d min %02d s' $(($1 / 60)) $(($1 % 60)); else printf '%d s' "$1"; fi
}

# thousandths LOG N M [COSTS]: how much of the work is done when N of M steps are. COSTS is what ctest keeps of how
# long each test took (CTestCostData.txt); it runs the longest first, so there each counts by its time.
thousandths() {
  local by_time=0
  if [ -f "${4:-}" ]; then
    by_time=$(awk 'FNR == NR { if (/^---/) after = 1; if (!after && NF == 3) { cost[$1] = $3; all += $3 } next }
                   $1 ~ /^[0-9]+\/[0-9]+$/ && $2 == "Test" { done += cost[$4] }
                   END { printf "%d", (all > 0 && done < all) ? 1000 * done / all : 0 }' "$4" "$1")
  fi
  if [ "$by_time" -gt 0 ]; then echo "$by_time"; else echo $((1000 * $2 / $3)); fi
}

# with_progress LOG COMMAND…: runs the command with its output in LOG. Every ten seconds it prints how
# far it is, from the newest "n/m" that a line of LOG begins with, and how long is left when a fiftieth is
# done: before, there is nothing to go by. TEST_COSTS: see thousandths. If the command fails, it prints the
# end of LOG and returns the command's exit code.
with_progress() {
  local log=$1 started=$SECONDS said=$SECONDS fraction n m spent share left
  shift
  : > "$log"
  "$@" > "$log" 2>&1 < /dev/null &
  local child=$!
  trap 'kill '"$child"' 2> /dev/null; exit 130' INT TERM
  while kill -0 "$child" 2> /dev/null; do
    sleep 1
    spent=$((SECONDS - started))
    [ $((SECONDS - said)) -ge 10 ] || continue
    said=$SECONDS
    fraction=$({ grep -oE '^ *[0-9]+/ *[0-9]+ ' "$log" || true; } | tail -n 1 | tr -d ' ')
    n=${fraction%%/*} m=${fraction##*/}
    if [ -n "$fraction" ] && [ "$n" -gt 0 ] && [ "$m" -ge "$n" ]; then
      share=$(thousandths "$log" "$n" "$m" "${TEST_COSTS:-}")
      left=
      [ "$share" -lt 20 ] || left=", about $(as_time $((spent * (1000 - share) / share))) left"
      printf '      %d of %d after %s%s\n' "$n" "$m" "$(as_time $spent)" "$left"
    else
      printf '      at work for %s: %s\n' "$(as_time $spent)" "$(tail -n 1 "$log" | cut -c 1-90)"
    fi
  done
  trap - INT TERM
  local code=0
  wait "$child" || code=$?
  if [ "$code" -ne 0 ]; then
    tail -n 40 "$log" >&2
    printf '\nThat failed (exit code %d). The whole output is in %s\n' "$code" "$log" >&2
    return "$code"
  fi
  printf '      done in %s\n' "$(as_time $((SECONDS - started)))"
}
