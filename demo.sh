#!/bin/bash
# Installs what is missing, builds viwo and runs a simulated A/B comparison with its report.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

echo "== Dependencies"
scripts/install_dependencies.sh

echo "== Configuring (folder build)"
cmake --preset release -DVIWO_WERROR="${VIWO_WERROR:-OFF}"

echo "== Building with $(nproc) cores"
cmake --build --preset release --parallel "$(nproc)" --target viwo viwo_plugins

echo "== Running configs/experiments/drive_only_twist_full.yaml with 5 seeds (20 without --seeds)"
build/bin/viwo experiment configs/experiments/drive_only_twist_full.yaml --seeds 5 --out results/demo

echo
echo "The report: $PWD/results/demo/report.html"
