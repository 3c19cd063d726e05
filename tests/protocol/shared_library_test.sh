#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# shared_library_test.sh LIBRARY ARCHIVE…: whether the shared library exports every function of the namespace toftwin that the
# archives define, and nothing of the namespaces in it or of others. protocol/client/exports.map says which.
set -euo pipefail
library=$1
shift
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# "toftwin::Client::sources()", once however many kinds of a constructor there are.
names() { sed -E 's/^[0-9a-f]* *[TWVBDRu] //' | LC_ALL=C sort -u; }
nm -C --defined-only "$@" 2>/dev/null | grep -E '^[0-9a-f]+ T ' | names |
  grep -E '^toftwin::(Client|Subscription)::|^toftwin::[A-Za-z]+(\[abi:cxx11\])?\(' >"$folder/wanted" || true
nm -CD --defined-only "$library" | names >"$folder/exported"
[ -s "$folder/wanted" ] || { echo "the archives define nothing"; exit 1; }
missing=$(LC_ALL=C comm -23 "$folder/wanted" "$folder/exported")
if [ -n "$missing" ]; then echo "not exported; add it to protocol/client/exports.map:"; echo "$missing"; exit 1; fi
strangers=$(grep -vE '^toftwin::(Client|Subscription)::|^toftwin::[A-Za-z]+(\[abi:cxx11\])?\(' "$folder/exported" || true)
if [ -n "$strangers" ]; then echo "exported, but no program's business:"; echo "$strangers"; exit 1; fi
