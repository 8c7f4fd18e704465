#!/bin/sh
# Checks that scripts/benchmarks rewrites exactly the requested table, and leaves the page as it is after an error.
# Usage: benchmarks_test.sh SOURCE WORK      SOURCE: root of the repository; WORK: scratch folder, replaced
set -eu
source="$1" work="$2"
command -v python3 >/dev/null || { echo "skipped: no python3" && exit 77; }

rm -rf "$work"
mkdir -p "$work/scripts" "$work/docs" "$work/build/bin"
cp "$source/scripts/benchmarks" "$source/scripts"/benchmark_*.py "$work/scripts"
cp "$source/docs/benchmarks.md" "$work/docs"
cp "$source/docs/benchmarks.md" "$work/before.md"
cd "$work"

fail() { echo "benchmarks_test: $1" >&2 && exit 1; }
measure() { scripts/benchmarks --no-build --build build "$@" >out.txt 2>err.txt; }
refuse() { # refuse TEXT ARGUMENT ...: exit status 1, TEXT in the message, the page unchanged, no other file
  text="$1" && shift
  if measure "$@"; then fail "$*: no error"; else status=$?; fi
  [ "$status" = 1 ] || fail "$*: exit status $status"
  grep -q -- "$text" err.txt || fail "$*: the message is $(cat err.txt)"
  cmp -s docs/benchmarks.md before.md || fail "$*: the page has changed"
  [ "$(ls docs)" = benchmarks.md ] || fail "$*: files are left in docs"
}
program() { # program NAME: writes build/bin/NAME, a shell script from standard input
  { echo "#!/bin/sh" && cat; } >"build/bin/$1"
  chmod +x "build/bin/$1"
}

scripts/benchmarks --list >names.txt
sed -n 's/^<!-- benchmarks: \(.*\) -->$/\1/p' docs/benchmarks.md | grep -v '^machine$' | sort >marked.txt
sort names.txt | cmp -s - marked.txt || fail "the page and --list have different tables"

PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=scripts python3 - <<'END' || fail "the page and the scripts have different options"
from benchmark_recordings import AUV, FERRY, MAV, ROV
from benchmark_tables import CONSTRAINTS
page = " ".join(open("docs/benchmarks.md", encoding="utf-8").read().split())
missing = [" ".join(options) for options in (AUV, FERRY, MAV, ROV, *CONSTRAINTS.values()) if " ".join(options) not in page]
raise SystemExit("; ".join(missing) or None)
END

refuse "unknown table speed" speed
refuse "unknown option --quick" --quick
refuse "cannot run" planning
program bench_planning <<'END'
echo "no times"
END
refuse "cannot read the output" planning
program bench_planning <<'END'
echo "no memory" >&2 && exit 3
END
refuse "exit status 3: no memory" planning

program bench_planning <<'END'
echo "REMUS 100        damped-sqp first         $1 steps: cold     4.7 ms; warm median    0.68, 99 %    1.60," \
  "worst    2.28 ms;   4 iterations; 100 of 100 by damped-sqp, 99 accepted, violation 9.0e-07"
END
sed 's/^<!-- benchmarks: planning -->$/<!-- lost -->/' before.md >docs/benchmarks.md
cp docs/benchmarks.md lost.md
if measure planning; then fail "a page without markers: no error"; fi
cmp -s docs/benchmarks.md lost.md || fail "a page without markers has changed"
cp before.md docs/benchmarks.md

measure planning || fail "$(cat err.txt)"
grep -q '^| 50 | 4.7 | 0.68 | 1.6 | 4 | 99 of 100 |$' docs/benchmarks.md || fail "the page has no new table"
grep -q '^\$ bench_planning 50 100 all$' out.txt || fail "the command is not printed"
without() { sed '/^<!-- benchmarks: planning -->$/,/^$/d' "$1"; }
without before.md >before_rest.md
without docs/benchmarks.md | cmp -s - before_rest.md || fail "other parts of the page have changed"
cp docs/benchmarks.md first.md
measure planning
cmp -s docs/benchmarks.md first.md || fail "a second run with the same numbers gives another page"
