#!/bin/bash
# fuzz.sh TARGET|all SECONDS       libFuzzer on a target, or on each of them for so long
# fuzz.sh --coverage TARGET|all    which lines the corpus reaches
# fuzz.sh --minimise TARGET|all    what was found becomes the smallest corpus that reaches as much
# fuzz.sh --list                   names of the targets
# fuzz.sh --hours                  CPU time of each, over all versions (tests/fuzz/hours.csv)
# Builds with clang, libFuzzer, address and undefined behaviour sanitizers (preset fuzz, folder
# build-fuzz). What is found interesting is kept in build-fuzz/corpus, findings in build-fuzz/findings;
# the corpus that the default tests run is tests/fuzz/corpus. Exit code 1: there are findings.
# The seconds of hours.csv are those of the CPU: others may be at work on the machine. The first 162
# rows have those of the clock on the wall.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage() {
  sed -n '2,6s/^# //p' "$0"
  exit 2
}

build() {
  scripts/install_dependencies.sh --fuzz
  local ignored="'$PWD/tests/fuzz/ignored.txt'"
  cmake --preset fuzz -DVIWO_WERROR=ON "-DCMAKE_CXX_FLAGS_RELWITHDEBINFO=-O1 -gline-tables-only \
-fsanitize-ignorelist=$ignored -fsanitize-coverage-ignorelist=$ignored" > build-fuzz.log 2>&1 || { cat build-fuzz.log; exit 1; }
  rm build-fuzz.log
  cmake --build --preset fuzz --parallel "${VIWO_JOBS:-$(nproc)}" --target viwo_fuzz viwo_fuzz_replay
}

# Inputs that need more than this are findings. To look for leaks after each takes longer than the input.
limits=(-rss_limit_mb=1024 -malloc_limit_mb=512 -timeout=20 -detect_leaks=0)
options=(-max_len=16384 -print_final_stats=1 -print_funcs=0 -use_value_profile=1)

fuzz() {  # TARGET SECONDS
  local corpus=build-fuzz/corpus/$1 log=build-fuzz/fuzz_$1.log status=0 user system
  mkdir -p "$corpus" build-fuzz/findings
  local limits=("${limits[@]}") options=("${options[@]}")
  if [[ $1 = filter* ]]; then
    # An execution takes long, and each brings other numbers: by the values that are compared nearly
    # all would be new, and to read them back would take all of the time.
    limits+=(-timeout=120)
    options+=(-max_len=2048 -use_value_profile=0)
  fi
  local TIMEFORMAT='%0U %0S'
  {
    time VIWO_FUZZ_TARGET=$1 build-fuzz/tests/fuzz/viwo_fuzz "${limits[@]}" "${options[@]}" \
      -max_total_time="$2" -artifact_prefix="build-fuzz/findings/$1-" "$corpus" "tests/fuzz/corpus/$1" \
      > "$log" 2>&1
  } 2> "$log.cpu" || status=1
  # Of one that a signal ended the shell says so before.
  read -r user system <<< "$(tail -n 1 "$log.cpu")"
  rm "$log.cpu"
  local executions edges seconds=$((user + system))
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  echo "$(date +%F),$version,$1,$seconds,${executions:-0},$status" >> "$hours"
  edges=$(grep -o 'cov: [0-9]*' "$log" | tail -n 1 || true)
  echo "$1: ${executions:-0} executions in $2 s, ${edges:-cov: 0} edges$( ((status)) && echo ', FINDING' || true)"
  if ((status)); then
    grep -E 'ERROR|runtime error|what\(\)|SUMMARY|Test unit written' "$log" | sed 's/^/  /'
  fi
  return "$status"
}

coverage() {  # TARGET
  local profile=build-fuzz/$1.profdata raw=build-fuzz/coverage_$1 objects=() sources=() library
  rm -rf "$raw"
  VIWO_FUZZ_TARGET=$1 LLVM_PROFILE_FILE=$raw/%m.profraw build-fuzz/tests/fuzz/viwo_fuzz \
    "${limits[@]}" -runs=0 build-fuzz/corpus/"$1" tests/fuzz/corpus/"$1" > "$raw.log" 2>&1
  llvm-profdata merge -sparse "$raw"/*.profraw -o "$profile"
  for library in build-fuzz/lib/viwo/plugins/*/*.so; do objects+=(-object "$library"); done
  read -ra sources <<< "$(sed -n "s/^$1 //p" <<< "$list")"
  llvm-cov export -summary-only build-fuzz/tests/fuzz/viwo_fuzz "${objects[@]}" \
    -instr-profile="$profile" "${sources[@]}" |
    python3 -c 'import json, sys
lines = json.load(sys.stdin)["data"][0]["totals"]["lines"]
print("%s: %d of %d lines, %.1f %%" % (sys.argv[1], lines["covered"], lines["count"], lines["percent"]))' "$1"
  rm -rf "$raw" "$raw.log"
}

minimise() {  # TARGET
  local corpus=tests/fuzz/corpus/$1 merged=build-fuzz/merged_$1
  rm -rf "$merged" && mkdir -p "$merged"
  VIWO_FUZZ_TARGET=$1 build-fuzz/tests/fuzz/viwo_fuzz "${limits[@]}" -merge=1 -use_counters=0 -max_len=16384 \
    "$merged" "$corpus" build-fuzz/corpus/"$1" > "$merged.log" 2>&1
  rm -rf "$corpus" && mv "$merged" "$corpus" && rm "$merged.log"
  echo "$1: $(find "$corpus" -type f | wc -l) files, $(du -bs "$corpus" | cut -f 1) bytes"
}

hours=tests/fuzz/hours.csv
if [ "${1:-}" = --hours ]; then
  awk -F , 'NR > 1 {s[$3] += $4; n[$3] += $5; f[$3] += $6}
    END {for (t in s) printf "%-18s %6.2f h %12d executions %3d runs with findings\n", t, s[t] / 3600, n[t], f[t]}' \
    "$hours" | sort
  exit
fi
version=$(git describe --always 2> /dev/null || echo unknown)
git diff --quiet HEAD -- . ":!$hours" 2> /dev/null || version+=-dirty
action=fuzz
case ${1:-} in
  --coverage | --minimise | --list) action=${1#--} && shift ;;
esac
build > build-fuzz.txt 2>&1 || { cat build-fuzz.txt; exit 1; }
rm build-fuzz.txt
# What targets write need not go to a disk.
if [ -d /dev/shm ] && [ -w /dev/shm ]; then export TMPDIR=/dev/shm; fi
# Plugins that are loaded bring their own counters; a profile is written only where it is asked for.
export LLVM_PROFILE_FILE=/dev/null
list=$(build-fuzz/tests/fuzz/viwo_fuzz_replay --list)
names=$(cut -d ' ' -f 1 <<< "$list")
if [ "$action" = list ]; then echo "$names" && exit; fi
[ $# -ge 1 ] || usage
[ "$action" != fuzz ] || [[ ${2:-} =~ ^[0-9]+$ ]] || usage
if [ "$1" != all ]; then
  grep -qx -e "$1" <<< "$names" || { echo "no target '$1'; there are:" $names >&2; exit 2; }
  names=$1
fi
failed=0
for name in $names; do
  "$action" "$name" "${2:-}" || failed=1
done
exit "$failed"
