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

# with_progress LOG SCALE COMMAND…: runs the command with its output in LOG. Every few seconds it
# prints the newest line that holds "n/m" and, from the share done, how long is left; at the latest
# after 15 seconds it says that it is still at work. SCALE multiplies m (1, or more where each item
# is counted several times). Prints the end of LOG and returns the exit code if the command fails.
with_progress() {
  local log=$1 scale=$2 started=$SECONDS said=$SECONDS fraction line n m spent
  shift 2
  : > "$log"
  "$@" > "$log" 2>&1 < /dev/null &
  local child=$!
  trap 'kill '"$child"' 2> /dev/null; exit 130' INT TERM
  while kill -0 "$child" 2> /dev/null; do
    sleep 1
    spent=$((SECONDS - started))
    [ $((SECONDS - said)) -ge 10 ] || continue
    said=$SECONDS
    line=$(grep -oE '[0-9]+/ *[0-9]+[] ][^/]*$' "$log" | tail -n 1)
    fraction=$(printf '%s' "$line" | grep -oE '^[0-9]+/ *[0-9]+')
    n=${fraction%%/*} m=${fraction##*/}
    if [ -n "$fraction" ] && [ "$n" -gt 0 ] && [ "$m" -ge "$n" ]; then
      printf '      %d of %d after %s, about %s left\n' "$n" "$((m * scale))" "$(as_time $spent)" \
        "$(as_time $((spent * (m * scale - n) / n)))"
    else
      printf '      at work for %s: %s\n' "$(as_time $spent)" "$(tail -n 1 "$log" | cut -c 1-90)"
    fi
  done
  trap - INT TERM
  if wait "$child"; then
    printf '      done in %s\n' "$(as_time $((SECONDS - started)))"
    return 0
  fi
  local code=$?
  tail -n 40 "$log" >&2
  printf '\nThat failed (exit code %d). The whole output is in %s\n' "$code" "$log" >&2
  return "$code"
}
