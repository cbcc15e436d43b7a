#!/bin/bash
# test.sh [CTEST ARGUMENTS]
# Installs what is missing, builds viwo with its tests and runs them, all but those labelled
# nightly. Arguments go to ctest: ./test.sh -R preintegration, ./test.sh -L nightly
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

echo "== Dependencies"
scripts/install_dependencies.sh --tests

echo "== Configuring (folder build)"
cmake --preset release -DVIWO_BUILD_TESTS=ON -DVIWO_WERROR="${VIWO_WERROR:-OFF}"

echo "== Building with $(nproc) cores"
cmake --build --preset release --parallel "$(nproc)"

echo "== Testing"
selection=(-LE '^nightly$')
for argument in "$@"; do
  case $argument in
    -L* | --label-*) selection=() ;;  # the caller chooses by label
  esac
done
log=$(mktemp)
trap 'rm -f "$log"' EXIT
status=0
ctest --test-dir build --output-on-failure --no-tests=error --parallel "$(nproc)" \
  "${selection[@]}" "$@" < /dev/null 2>&1 | tee "$log" || status=$?

echo
# ctest calls a run in which every test was skipped a success.
if ! grep -Eq '^ *[0-9]+/[0-9]+ Test .*(Passed|Failed|Timeout|Exception)' "$log"; then
  echo "No test was run."
  if [ "$status" -eq 0 ]; then status=1; fi
else
  grep -E '^[0-9]+% tests passed' "$log" || echo "ctest did not finish."
fi
exit "$status"
