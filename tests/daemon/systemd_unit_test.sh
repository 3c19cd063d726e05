#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# systemd_unit_test.sh verify|security UNIT: what systemd thinks of the unit. 77: skipped.
set -u
if ! command -v systemd-analyze >/dev/null; then
  echo "skipped: there is no systemd-analyze here (Debian: apt install systemd)"
  exit 77
fi
case "$1" in
  verify)
    # It says nothing when all is well; it fails only for some mistakes and prints all of them.
    said=$(systemd-analyze verify --man=no "$2" 2>&1); failed=$?
    echo "$said"
    # What other units of this machine do is not ours to mend.
    [ $failed -eq 0 ] && ! grep -q toftwind <<<"$said" ;;
  security)
    # The threshold is ten times the score.
    systemd-analyze security --offline=true --threshold=25 --no-pager "$2" | tail -1
    exit "${PIPESTATUS[0]}" ;;
  *) echo "usage: $0 verify|security UNIT"; exit 2 ;;
esac
