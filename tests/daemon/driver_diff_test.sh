#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# driver_diff_test.sh REPOSITORY: every line that docs/add-a-driver.md shows of a commit is in that commit.
cd "$1" || exit 1
page=docs/add-a-driver.md
commit=$(grep -o 'commit [0-9a-f]\{7,\}' "$page" | head -1 | cut -d' ' -f2)
git cat-file -e "$commit^{commit}" 2>/dev/null || { echo "no history here that has $commit: skipped"; exit 77; }
shown=$(sed -n '/^```diff$/,/^```$/p' "$page" | grep '^[+-]')
[ "$(wc -l <<<"$shown")" -gt 50 ] || { echo "$page: there is no diff any more"; exit 1; }
wrong=$(grep -vxFf <(git show "$commit" | sed 's/ *$//') <<<"$shown")
[ -z "$wrong" ] || { echo "$page: not in commit $commit:"; echo "$wrong"; exit 1; }
