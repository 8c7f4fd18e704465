#!/bin/sh
# two_hosts.sh TANDEM WORK: tests a study on two hosts, simulated by two network namespaces with one MPI rank each.
# 1. Without failures, the tables equal those of a single process.
# 2. The link between the hosts goes down during the run. Rank 0 must complete the study with the same tables.
# 3. A killed rank ends the run, and --resume completes it with the same tables.
# Exit status: 0 passed, 1 failed, 77 skipped.
set -u
tandem=$1 work=$2

missing() {
  echo "$1 is missing; skipped: studies on two hosts"
  exit 77
}

if [ "${3:-}" != inside ]; then
  for program in mpirun ip unshare hostname; do command -v $program > /dev/null || missing $program; done
  unshare -n -m true 2> /dev/null || { echo "network namespaces are not permitted; skipped: two hosts"; exit 77; }
  exec unshare -n -m --propagation private sh "$0" "$tandem" "$work" inside
fi

fail() { echo "two_hosts: $1"; cat "$work/log"; exit 1; }

rm -rf "$work" && mkdir -p "$work" || exit 1
{
  mkdir -p /run/netns && mount -t tmpfs none /run/netns && ip netns add one && ip netns add two &&
    ip link add name link1 netns one type veth peer name link2 netns two
} || { echo "pairs of network namespaces are not permitted; skipped: two hosts"; exit 77; }
ip -n one address add 10.77.0.1/24 dev link1 && ip -n two address add 10.77.0.2/24 dev link2 || exit 1
for host in "one link1" "two link2"; do
  set -- $host
  ip -n "$1" link set lo up && ip -n "$1" link set "$2" up || exit 1
done
printf '#!/bin/sh\nshift\nexec ip netns exec two unshare -u sh -c "hostname two; $*"\n' > "$work/agent"
chmod +x "$work/agent"
cat > "$work/study.yaml" << 'END'
name: hosts
parameters: {minutes: 8}
models: [constant-twist, mode-b]
seeds: 60
END

on_hosts() {  # OUT OPTION…: runs the study with one rank per host
  out=$1
  shift
  ip netns exec one timeout 300 mpirun --allow-run-as-root --host 10.77.0.1,10.77.0.2 -n 2 \
    --mca plm_rsh_agent "$work/agent" "$tandem" study run "$work/study.yaml" --out "$out" --quiet "$@" > "$work/log" 2>&1
}
trials() { "$tandem" study show "$1" 2> /dev/null | sed -n 's/^\([0-9]*\) of [0-9]* trials.*/\1/p'; }
wait_for_trials() {  # OUT N
  for i in $(seq 600); do
    [ "$(trials "$1")" -ge "$2" ] 2> /dev/null && return
    sleep 0.1
  done
  fail "$1 did not reach $2 trials within a minute"
}
same_tables() {  # OUT
  for table in tables.txt summary.csv pairs.csv consistency.csv; do
    cmp "$1/$table" "$work/alone/$table" || fail "$1/$table differs"
  done
}

"$tandem" study run "$work/study.yaml" --out "$work/alone" --quiet || exit 1
on_hosts "$work/whole" --resume
grep -q "this build has no MPI" "$work/log" && missing "MPI in this build"
same_tables "$work/whole"

on_hosts "$work/cut" &
run=$!
wait_for_trials "$work/cut" 10
ip -n two link set link2 down
for i in $(seq 1200); do
  [ -e "$work/cut/tables.txt" ] && break
  sleep 0.1
done
ip netns pids one | xargs -r kill  # mpirun waits for the unreachable host
wait $run || true
grep -q "1 ranks stopped responding" "$work/log" || fail "the lost host was not detected"
[ "$(trials "$work/cut")" = 120 ] || fail "the lost host's trials are missing"
same_tables "$work/cut"
ip -n two link set link2 up

on_hosts "$work/killed" &
run=$!
wait_for_trials "$work/killed" 10
for rank in $(ip netns pids two); do
  grep -q "$work/study.yaml" "/proc/$rank/cmdline" 2> /dev/null && [ "$(cat "/proc/$rank/comm")" = tandem-study ] && kill -9 "$rank"
done
wait $run && fail "the killed rank was not detected"
[ "$(trials "$work/killed")" -lt 120 ] || fail "the run ended before a rank was killed"
on_hosts "$work/killed" --resume
same_tables "$work/killed"
echo "two hosts: passed"
