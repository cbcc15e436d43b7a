#!/bin/bash
# install_packages.sh FOLDER PACKAGE...
# Installs packages of viwo (viwo, viwo-images, viwo-ros, viwo-show, viwo-dev) from the files in FOLDER,
# and of Debian what they need and no more. As root.
set -euo pipefail
folder=$(realpath "$1")
shift
files=()
for package in "$@"; do files+=("$folder/${package}"_*.deb); done
export DEBIAN_FRONTEND=noninteractive
apt-get update -q
apt-get install -y -q --no-install-recommends "${files[@]}"
apt-get clean
rm -rf /var/lib/apt/lists/*
