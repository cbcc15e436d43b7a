#!/bin/bash
# check_threads.sh
# Built with the thread sanitizer (folder build-tsan): every kinematic model of the tree through
# viwo_conformance, as const calls on one object may run concurrently - a model with a race that
# nothing else shows must fail -, and the tests of what hands measurements from thread to thread: the
# sensors that are read ahead, and the queues of live sensors.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

models=()
for source in plugins/kinematics/*/model.md; do
  models+=("$(basename "$(dirname "$source")")")
done

tests=(framework/feed/test_feed plugins/shared/live/test_shared_live)

echo "== Building with the thread sanitizer (folder build-tsan)"
cmake --preset tsan -DVIWO_BUILD_BENCHMARKS=OFF > build-tsan.log 2>&1 || { cat build-tsan.log; exit 1; }
rm build-tsan.log
cmake --build --preset tsan --parallel "$(nproc)" \
  --target viwo_conformance_program viwo_kinematics_broken_race "${models[@]/#/viwo_kinematics_}" \
  "${tests[@]##*/}"
export TSAN_OPTIONS="halt_on_error=1 suppressions=tests/tsan.supp"
# A race is told by the file that code is mapped from (docs/adr/0016).
export VIWO_PLUGINS_STAY_MAPPED=1

echo "== Conformance of ${#models[@]} kinematic models"
failed=0
for model in "${models[@]}"; do
  # An older build may have left one of another version of the API.
  library=$(printf '%s\n' build-tsan/lib/viwo/plugins/v*/libviwo_kinematics_"$model".so | sort -V | tail -n 1)
  config=framework/conformance/tests/configs/kinematics_$model.yaml
  arguments=()
  if [ -e "$config" ]; then arguments=(--config "$config"); fi
  if output=$(build-tsan/bin/viwo_conformance "$library" "${arguments[@]}" 2>&1); then
    echo "$model: passed"
  else
    echo "$model: FAILED"
    echo "$output"
    failed=$((failed + 1))
  fi
done

race=build-tsan/tests/conformance/libviwo_kinematics_broken_race.so
if output=$(build-tsan/bin/viwo_conformance "$race" 2>&1) || [[ $output != *"concurrent calls"* ]]; then
  echo "the model with a race: not found"
  echo "$output"
  failed=$((failed + 1))
else
  echo "the model with a race: found"
fi

echo "== Tests of ${#tests[@]} parts"
for test in "${tests[@]}"; do
  if output=$(build-tsan/"$test" 2>&1); then
    echo "${test##*/}: passed"
  else
    echo "${test##*/}: FAILED"
    echo "$output"
    failed=$((failed + 1))
  fi
done
echo "$((${#models[@]} + 1 + ${#tests[@]} - failed)) passed, $failed failed"
exit "$((failed > 0))"
