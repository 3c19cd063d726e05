#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs the reference implementation of MCAP into a folder, once: install.sh FOLDER
# Exits with 77 (the test is skipped) where npm is missing or the registry cannot be reached.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$1"
cd "$1"
if [ -f installed ] && cmp -s "$here/package-lock.json" installed; then
  echo "already installed"
  exit 0
fi
command -v npm > /dev/null && command -v node > /dev/null || { echo "skipped: npm and node are not installed"; exit 77; }
cp "$here/package.json" "$here/package-lock.json" .
npm ci --ignore-scripts --no-audit --no-fund --prefer-offline ||
  { echo "skipped: npm could not install the packages; can the registry be reached?"; exit 77; }
cp package-lock.json installed
