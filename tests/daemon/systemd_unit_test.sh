#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# systemd_unit_test.sh verify|security UNIT [DROP_IN]: what systemd thinks of the unit, with what the drop-in changes
# and has in comments to be set. 77: skipped.
set -u
if ! command -v systemd-analyze >/dev/null; then
  echo "skipped: there is no systemd-analyze here (Debian: apt install systemd)"
  exit 77
fi
unit=$2
if [ -n "${3:-}" ]; then
  folder=$(mktemp -d)
  trap 'rm -rf "$folder"' EXIT
  unit=$folder/${2##*/}
  mkdir "$unit.d"
  cp "$2" "$unit"
  sed -E 's/^# ([A-Za-z]+=)/\1/' "$3" > "$unit.d/${3##*/}"
fi
case "$1" in
  verify)
    # It says nothing when all is well; it fails only for some mistakes and prints all of them.
    said=$(systemd-analyze verify --man=no "$unit" 2>&1); failed=$?
    echo "$said"
    # What other units of this machine do is not ours to mend.
    [ $failed -eq 0 ] && ! grep -q toftwind <<<"$said" ;;
  security)
    # The threshold is ten times the score that docs/daemon.md tells.
    threshold=13
    [ -z "${3:-}" ] || threshold=15
    systemd-analyze security --offline=true --threshold=$threshold --no-pager "$unit" | tail -1
    exit "${PIPESTATUS[0]}" ;;
  *) echo "usage: $0 verify|security UNIT [DROP_IN]"; exit 2 ;;
esac
