#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# packages_test.sh SOURCE BUILD: whether the Debian packages would have what they should: everything that is installed is in one of
# them, each has the files that packages.txt lists, and their scripts are such of a shell.
set -euo pipefail
source=$1 build=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

components=$(sed -n 's/^set(CPACK_COMPONENTS_ALL "\(.*\)")/\1/p' "$build/CPackConfig.cmake" | tr ';' '\n')
# Below a folder of its own, wherever a file's place is.
put() { DESTDIR="$folder/$1" cmake --install "$build" --prefix /usr "${@:2}" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }; }
for component in $components; do
  put packaged --component "$component"
  put "$component" --component "$component"
  # Without what differs from machine to machine, and the list of others' parts, which tools/package makes.
  (cd "$folder/$component" && find . -type f -o -type l) | sed 's|^\./||; s|^usr/||; s|x86_64-linux-gnu/||; s|\.cpython-[^.]*||; s|Targets-[a-z]*\.cmake|Targets-release.cmake|' |
    grep -vE '/(toftwin\.spdx\.json|THIRD-PARTY-NOTICES)$' | LC_ALL=C sort | sed "s|^|$component |"
done >"$folder/found"
put whole
bad=0
# Whatever a user gets who installs by hand is in a package, too.
left=$(cd "$folder/whole" && find . -type f -o -type l | while read -r file; do [ -e "$folder/packaged/$file" ] || [ -L "$folder/packaged/$file" ] || echo "$file"; done)
if [ -n "$left" ]; then echo "in no package, as their component is none of CPACK_COMPONENTS_ALL:"; echo "$left"; bad=1; fi
# The lists are of a build with all that is optional; of one with less only what it has.
grep -E "^($(tr '\n' '|' <<<"$components" | sed 's/|$//')) " "$source/tests/tools/packages/contents.txt" >"$folder/wanted" || true
if ! diff "$folder/wanted" "$folder/found"; then echo "tests/tools/packages/contents.txt (<) is not what the packages have (>)"; bad=1; fi
for script in "$source"/systemd/debian/{postinst,prerm,postrm} "$source"/tools/debian/python/*; do sh -n "$script" || bad=1; done
while read -r file; do
  [ "$file" = /etc/toftwin/toftwind.toml ] || { echo "conffiles has $file"; bad=1; }
done <"$source/systemd/debian/conffiles"
exit $bad
