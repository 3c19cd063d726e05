#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# mcap_reference_install_test.sh INSTALL.SH: asks a registry that is not there once, and one that is there once for
# all folders. npm is one of ours that counts.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat > "$work/npm" << 'END'
#!/bin/sh
echo asked >> "$ASKED"
[ "$ANSWERS" = yes ] && mkdir node_modules
END
printf '#!/bin/sh\n' > "$work/node"
chmod +x "$work/npm" "$work/node"
export PATH="$work:$PATH" ASKED="$work/asked" TOFTWIN_CACHE="$work/cache" ANSWERS=no

# expect STATUS TIMES_ASKED WHAT FOLDER
expect() {
  status=0
  said=$("$install" "$work/$4") || status=$?
  asked=$(wc -l < "$ASKED")
  [ "$status" -eq "$1" ] && [ "$asked" -eq "$2" ] && return
  echo "$3: status $status, npm asked $asked times, where $1 and $2 were expected; it said: $said"
  exit 1
}
install=$1
: > "$ASKED"
expect 77 1 "no registry" a
expect 77 1 "no registry, asked a moment ago" a
[ "$(ls "$TOFTWIN_CACHE")" = "" ] || { echo "left in the cache: $(ls "$TOFTWIN_CACHE")"; exit 1; }
touch -d '61 minutes ago' "$work/a/failed"
expect 77 2 "no registry, an hour later" a
touch -d '61 minutes ago' "$work/a/failed"
ANSWERS=yes
expect 0 3 "the registry is there again" a
expect 0 3 "installed" a
expect 0 3 "another build tree" b
[ -d "$work/b/node_modules" ] || { echo "nothing is installed"; exit 1; }
rm -rf "$TOFTWIN_CACHE"
expect 0 4 "the cache is gone" b
echo "asked as often as needed"
