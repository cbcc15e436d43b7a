#!/bin/bash
# install_dependencies.sh [--tests | --engines | --fuzz | --packages | --peers | --arm64 | --libraries]
# Installs with apt what building viwo needs and this machine lacks; nothing when all is there.
# --tests adds what only the tests use, --engines also Slurm and Open MPI for the nightly tests of
# campaigns, --fuzz clang and its tools for scripts/fuzz.sh, --packages what cpack needs, --peers what
# the peers of scripts/compare_peers.sh need, --arm64 what scripts/arm64.sh needs. --libraries: only what
# viwo links, for a system that another one builds for. Never asks a question.
set -euo pipefail

missing=()

# Readers of MCAP by others, for tests/mcap; without network those tests are skipped. At the end: npm
# itself may be what is installed.
tests=${1:-}
install_readers() {
  if [ "$tests" != --tests ] || ! command -v npm > /dev/null; then return 0; fi
  npm ci --silent --no-audit --no-fund --prefix "$(dirname "$0")/../tests/mcap" < /dev/null ||
    echo "npm packages of tests/mcap cannot be had: these tests are skipped."
}

# need_command PACKAGE COMMAND...: one of the commands must be there, wherever it comes from.
need_command() {
  local package=$1 command
  shift
  for command in "$@"; do
    if command -v "$command" > /dev/null; then return; fi
  done
  missing+=("$package")
}

need_package() {
  local status
  status=$(dpkg-query -W -f '${db:Status-Status}' "$1" 2> /dev/null || true)
  if [ "$status" != installed ]; then missing+=("$1"); fi
}

if ! command -v apt-get > /dev/null || ! command -v dpkg-query > /dev/null; then
  echo "This is not a Debian or Ubuntu system: install the dependencies listed in DEVELOPERS.md" \
    "yourself. Going on with what is here."
  exit 0
fi

if [ "${1:-}" = --libraries ]; then
  need_command() { :; }
  for package in libc6-dev libstdc++-12-dev; do need_package "$package"; done
fi
need_command g++ c++
need_command cmake cmake
need_command git git
if [ "${1:-}" = --fuzz ]; then
  for package in clang llvm libclang-rt-dev; do need_package "$package"; done
fi
if [ "${1:-}" = --packages ]; then
  need_command dpkg-dev dpkg-shlibdeps
  need_command file file
fi
if [ "${1:-}" = --peers ]; then
  need_command python3 python3
  for package in libboost-{date-time,filesystem,system,thread}-dev; do need_package "$package"; done
fi
if [ "${1:-}" = --arm64 ]; then
  for package in g++-aarch64-linux-gnu qemu-user-static binfmt-support debootstrap; do
    need_package "$package"
  done
fi
need_command ninja-build ninja
need_command ccache ccache
need_command python3 python3
# Of Debian or of anybody else: two installations of npm on one machine do not go together.
need_command npm npm
for package in ca-certificates libeigen3-dev libboost-dev libboost-program-options-dev \
  libyaml-cpp-dev libtbb-dev nlohmann-json3-dev libceres-dev zlib1g-dev libgtest-dev \
  libgmock-dev libbenchmark-dev libopencv-dev libpng-dev libjpeg-dev; do
  need_package "$package"
done

# What is left out where it is not to be had: bags and live topics of ROS, fixes of satellites, PNG
# files read fast.
required=("${missing[@]}")
missing=()
for package in librosbag-storage-dev libroscpp-dev libsensor-msgs-dev libnav-msgs-dev \
  libgeometry-msgs-dev libtf2-msgs-dev libdiagnostic-msgs-dev libsqlite3-dev libfastcdr-dev \
  liblz4-dev libzstd-dev libdeflate-dev libtinyxml2-dev; do
  need_package "$package"
done
# DDS, by its name in Debian 13 or else in Debian 12.
if ! dpkg-query -W -f '${db:Status-Status}' libfastdds-dev 2> /dev/null | grep -qx installed; then
  need_package libfastrtps-dev
fi
# Ubuntu 22.04 has it by another name.
if ! dpkg-query -W -f '${db:Status-Status}' libgeographic-dev 2> /dev/null | grep -qx installed; then
  need_package libgeographiclib-dev
fi
if [ "${1:-}" = --engines ]; then
  for package in slurmctld slurmd slurm-client munge openmpi-bin; do need_package "$package"; done
fi
if [ "${1:-}" = --tests ] || [ "${1:-}" = --engines ]; then
  need_command clang-format-14 clang-format-14
  need_command gnuplot-nox gnuplot
  # On Ubuntu Chromium is a snap, which cannot be had in a container: the test is skipped there.
  if ! grep -qsx 'ID=ubuntu' /etc/os-release; then
    need_command chromium chromium chromium-browser google-chrome
  fi
  for package in python3-rosmaster python3-rosbag librosbag-dev python3-jsonschema python3-yaml xvfb \
    liburdfdom-dev pkg-config cyclonedds-dev cyclonedds-tools; do
    need_package "$package"
  done
fi
optional=("${missing[@]}")
missing=("${required[@]}")

if [ ${#missing[@]} -eq 0 ] && [ ${#optional[@]} -eq 0 ]; then
  echo "All dependencies are installed."
  install_readers
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo > /dev/null; then
    echo "Missing: ${missing[*]} ${optional[*]}" >&2
    echo "Neither root nor sudo: ask an administrator to run apt-get install with these." >&2
    if [ ${#missing[@]} -eq 0 ]; then exit 0; fi
    exit 1
  fi
  as_root=(sudo)
fi
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -y -q)

echo "Installing with apt: ${missing[*]} ${optional[*]}"
"${apt[@]}" update < /dev/null
# What this release may not have: parts and tests that need it are then left out.
for package in "${optional[@]}"; do
  if [ "$package" = libgeographiclib-dev ] && ! apt-cache show "$package" > /dev/null 2>&1; then
    package=libgeographic-dev
  fi
  if [ "$package" = libfastrtps-dev ] && apt-cache show libfastdds-dev > /dev/null 2>&1; then
    package=libfastdds-dev
  fi
  if apt-cache show "$package" > /dev/null 2>&1; then
    missing+=("$package")
  else
    echo "There is no package $package here: what needs it is left out."
  fi
done
if [ ${#missing[@]} -gt 0 ]; then
  "${apt[@]}" install --no-install-recommends "${missing[@]}" < /dev/null
fi
install_readers
