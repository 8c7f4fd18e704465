#!/bin/sh
# Checks that plots ignore infinite values as they ignore missing ones.
# Usage: quantile_test.sh SOURCE WORK      SOURCE: root of the repository; WORK: scratch folder, replaced
set -eu
source="$1" work="$2"
fail() { echo "quantile_test: $1" >&2 && exit 1; }

# A comparison of a value with itself is true for infinity.
if grep -nE '\b([a-z_]+(\([^()]*\))?) == \1( |$)' "$source"/share/plots/*.gp; then fail "use x < 1e300"; fi

command -v gnuplot >/dev/null || { echo "skipped: no gnuplot" && exit 77; }
rm -rf "$work"
mkdir -p "$work"
cd "$work"
printf 'sigma,type\n1,a\n2,a\ninf,a\n-inf,b\n3,a\n,a\n4,b\n' >errors.csv
quantile() { # quantile SHARE [EXCEPT]
  gnuplot -e "set datafile separator ','; cells = ','; set datafile columnheaders; set loadpath '$source/share/plots';
              call 'quantile.gp' 'errors.csv' 'sigma' '$1' '${2:-}'; print quantile" 2>&1
}
[ "$(quantile 0.5)" = 2.5 ] || fail "median $(quantile 0.5) instead of 2.5"
[ "$(quantile 1)" = 4.0 ] || fail "largest value $(quantile 1) instead of 4.0"
[ "$(quantile 1 b)" = 3.0 ] || fail "largest value of type a $(quantile 1 b) instead of 3.0"
