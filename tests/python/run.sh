#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# run.sh PYTHON TEST: runs a test of this folder, or says what it lacks (77: skipped).
cd "$(dirname "$0")" || exit 1
"$1" -c 'import numpy' 2>/dev/null || { echo "SKIP: $1 has no numpy (Debian: apt install python3-numpy)"; exit 77; }
exec "$1" -B -X faulthandler "$2"
