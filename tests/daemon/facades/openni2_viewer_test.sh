#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# The library's own viewer shows a source, and records it: openni2_viewer_test.sh TOFTWIND FOLDER_OF_libOpenNI2
# Prints "SKIP: why" where viewer or display are not there.
set -u
toftwind=$1 library=$2
for program in NiViewer2 Xvfb; do
  command -v $program > /dev/null || { echo "SKIP: no $program (apt-get install openni2-utils xvfb)"; exit 0; }
done
folder=$(mktemp -d)
trap 'kill $(jobs -p) 2> /dev/null; sleep 0.5; kill -9 $(jobs -p) 2> /dev/null; rm -rf "$folder"' EXIT
cat > "$folder/toftwind.toml" << END
[[source]]
name = 'cam'
driver = 'pattern'
width = 320
height = 240
END
"$toftwind" --config "$folder/toftwind.toml" --port 0 --socket "$folder/s" 2> "$folder/daemon.log" &
Xvfb -displayfd 1 -screen 0 640x480x24 -fbdir "$folder" > "$folder/display" 2> /dev/null &
for i in $(seq 100); do [ -s "$folder/display" ] && break; sleep 0.1; done
display=$(cat "$folder/display")
[ -n "$display" ] || { echo "SKIP: Xvfb does not start"; exit 0; }
for i in $(seq 100); do [ -S "$folder/s" ] && break; sleep 0.1; done

export DISPLAY=:$display TOFTWIN_OPENNI2=unix:$folder/s LD_LIBRARY_PATH=$library LIBGL_ALWAYS_SOFTWARE=1
colors() { od -v -An -tx4 -w4 "$folder/Xvfb_screen0" | sort -u | wc -l; }  # of the screen, as a XWD file
record() {  # its keys: s starts, x stops; the file is Captured.oni
  local tool="$(dirname "$0")/openni2_recording.py"
  python3 -c 'import ctypes; ctypes.CDLL("libXtst.so.6")' 2> /dev/null || { echo "SKIP: no python3 with libXtst"; return; }
  python3 "$tool" type s && sleep 2 && python3 "$tool" type x && sleep 1
  local file=$(ls "$folder"/*.oni 2> /dev/null)
  [ -n "$file" ] || { echo "FAILED: no recording"; cat "$folder/viewer.log"; return 1; }
  TOFTWIN_OPENNI2=off timeout 60 python3 "$tool" judge "$file" "$library/libOpenNI2.so.0"
}
(cd "$folder" && exec NiViewer2 toftwin:cam > viewer.log 2>&1) &
viewer=$!
for i in $(seq 60); do
  sleep 0.5
  # A black window with a line of text has a few dozen, with the file's header; a depth image hundreds.
  [ "$(colors)" -gt 150 ] && { echo "it shows $(colors) colours"; record; exit; }
  kill -0 $viewer 2> /dev/null && continue
  grep -qi -e "display" -e "glx" -e "opengl" "$folder/viewer.log" && { echo "SKIP: $(head -1 "$folder/viewer.log")"; exit 0; }
  break
done
echo "FAILED: the viewer shows no image ($(colors) colours)"
cat "$folder/viewer.log" "$folder/daemon.log"
exit 1
