#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Makes the reference implementation of MCAP be in a folder: install.sh FOLDER
# Fetched once, and kept in ~/.cache/toftwin (or $TOFTWIN_CACHE) for other folders.
# Exits with 77 (the test is skipped) where npm is missing or the registry cannot be reached.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
lock=$here/package-lock.json
mkdir -p "$1"
cd "$1"
skip() { echo "skipped: $*"; exit 77; }

if [ -d node_modules ] && cmp -s "$lock" installed; then
  echo "already installed"
  exit 0
fi
command -v npm > /dev/null && command -v node > /dev/null || skip "npm and node are not installed"
# A registry that did not answer is not waited for at every run.
[ -z "$(find . -maxdepth 1 -name failed -mmin -60)" ] ||
  skip "npm could not install the packages within the last hour; rm $PWD/failed to try at once"

cache=${TOFTWIN_CACHE:-${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/toftwin}
kept=$cache/mcap-reference_$(cksum < "$lock" | tr ' ' _)
if [ ! -d "$kept" ]; then
  mkdir -p "$cache"
  work=$(mktemp -d "$cache/work.XXXXXX")
  trap 'rm -rf "$work"' EXIT
  cp "$here/package.json" "$lock" "$work"
  (cd "$work" && npm ci --ignore-scripts --no-audit --no-fund --prefer-offline --fetch-timeout=20000 \
    --fetch-retries=1 --fetch-retry-mintimeout=1000 --fetch-retry-maxtimeout=2000) ||
    { touch failed; skip "npm could not install the packages; can the registry be reached?"; }
  mv -T "$work" "$kept" || [ -d "$kept" ]  # another was faster
fi
rm -rf node_modules failed
ln -s "$kept/node_modules" node_modules
cp "$lock" installed
