#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# hardening_test.sh SOURCE: whether the preset that users build with makes programs that are hard to break into: checked
# calls of the C library, guarded stacks, landing pads for jumps, relocations that nobody can write, at a random address. Of a
# program made for it with the preset's flags, and of toftwind and toftwin where the preset was built. 77: skipped.
set -eu
source=$1
for tool in readelf objdump python3; do
  command -v $tool >/dev/null || { echo "skipped: there is no $tool here (Debian: apt install binutils python3)"; exit 77; }
done
[ "$(uname -m)" = x86_64 ] || { echo "skipped: the landing pads are those of x86-64"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# The flags that `release` and what it inherits set.
flags() {
  python3 - "$source/CMakePresets.json" "$1" <<'PYTHON'
import json, sys
presets = {one["name"]: one for one in json.load(open(sys.argv[1]))["configurePresets"]}
def value(name):
    one = presets[name]
    if sys.argv[2] in one.get("cacheVariables", {}):
        return one["cacheVariables"][sys.argv[2]]
    above = one.get("inherits", [])
    found = [value(each) for each in ([above] if isinstance(above, str) else above)]
    return next((each for each in found if each), "")
print(value("release"))
PYTHON
}
cat > "$folder/small.cpp" <<'CPP'
#include <cstdio>
#include <cstring>
int main(int count, char** words) {
  char text[16];
  std::strcpy(text, words[count - 1]);
  return std::puts(text);
}
CPP
# shellcheck disable=SC2046 # words, on purpose
c++ -O2 -fPIE $(flags CMAKE_CXX_FLAGS) $(flags CMAKE_EXE_LINKER_FLAGS) "$folder/small.cpp" -o "$folder/small"

bad=0
must() { # must PROGRAM WHAT OUTPUT PATTERN
  grep -qE -- "$4" <<<"$3" || { echo "$1: no $2"; bad=1; }
}
check() {
  must "$1" "address of its own at each start (PIE)" "$(readelf -h "$1")" 'Type: +DYN'
  must "$1" "relocations that are read-only" "$(readelf -lW "$1")" GNU_RELRO
  must "$1" "relocations that are made at the start (BIND_NOW)" "$(readelf -d "$1")" 'BIND_NOW|Flags:.*NOW'
  must "$1" "guarded stacks" "$(readelf -sW --dyn-syms "$1")" __stack_chk_fail
  must "$1" "checked calls (FORTIFY)" "$(readelf -sW --dyn-syms "$1")" '__(str|mem|read|poll|recv|v?f?s?n?printf)[a-z]*_chk'
  must "$1" "landing pads (CET)" "$(objdump -d --no-show-raw-insn --disassemble=main "$1")" endbr64
  must "$1" "stack that cannot be run" "$(readelf -lW "$1" | grep GNU_STACK)" 'RW +0x'
}
check "$folder/small"
for program in {release,package}/{daemon/toftwind,tools/toftwin}; do
  if [ -x "$source/build/$program" ]; then check "$source/build/$program"; fi
done
exit $bad
