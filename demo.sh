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

echo "== Running the experiment configs/experiments/demo.yaml"
build/bin/viwo experiment configs/experiments/demo.yaml --out results/demo

echo
echo "The report: $PWD/results/demo/report.html"
