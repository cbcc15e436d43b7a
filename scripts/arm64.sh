#!/bin/bash
# arm64.sh                       builds for arm64 on another machine, and runs unit tests under qemu
# arm64.sh CTEST ARGUMENT...     the same, with the tests that these arguments choose
# arm64.sh --packages            builds and makes the Debian packages for arm64, in build-arm64
# With Debian's cross compiler and the libraries of a minimal Debian of this machine's release, which
# debootstrap puts into /var/tmp/viwo_arm64_RELEASE the first time (2 GB; VIWO_ARM64_SYSTEM names another
# folder). As root. Without arguments those of tests/not_under_qemu.txt are left out.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
if [[ ${1:-} = -h || ${1:-} = --help ]]; then
  sed -n '2,7s/^# //p' "$0"
  exit
fi
if [ "$(id -u)" -ne 0 ]; then echo "arm64.sh: a system in a folder is made as root" >&2 && exit 2; fi
release=$(sed -n 's/^VERSION_CODENAME=//p' /etc/os-release)
system=${VIWO_ARM64_SYSTEM:-/var/tmp/viwo_arm64_$release}
mapfile -t proxies < <(env | grep -iE '^(https?_proxy|no_proxy)=' || true)

inside() {  # COMMAND: runs it in the system for arm64, which sees this folder
  mkdir -p "$system$PWD"
  trap outside EXIT
  mount -t proc proc "$system/proc"
  mount --bind /dev "$system/dev"
  mount --bind "$PWD" "$system$PWD"
  env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin "${proxies[@]}" \
    chroot "$system" bash -c "cd '$PWD' && $1"
  outside
}

outside() {
  local folder
  for folder in "$PWD" /dev /proc; do
    if mountpoint -q "$system$folder"; then umount "$system$folder"; fi
  done
}

echo "== Dependencies"
scripts/install_dependencies.sh --arm64
programs=/proc/sys/fs/binfmt_misc
if [ ! -e $programs/qemu-aarch64 ]; then  # no system that does it at boot, such as a container
  mountpoint -q $programs || mount -t binfmt_misc binfmt_misc $programs
  update-binfmts --enable qemu-aarch64
fi
if [ ! -e "$system/complete" ]; then
  echo "== Debian $release for arm64 in $system (a quarter of an hour, once)"
  mirror=$(grep -hoE 'https?://[^ ]+/debian/?( |$)' /etc/apt/sources.list /etc/apt/sources.list.d/* 2> /dev/null |
    head -n 1 || true)
  if [ -d "$system/debootstrap" ]; then rm -rf --one-file-system "$system"; fi  # it broke off
  mkdir -p "$system"
  debootstrap --arch=arm64 --variant=minbase "$release" "$system" ${mirror:+"$mirror"}
  cp -a /etc/apt/apt.conf.d/*proxy* "$system/etc/apt/apt.conf.d/" 2> /dev/null || true
  cp /etc/resolv.conf /etc/hosts "$system/etc/"
  inside 'apt-get -q update && scripts/install_dependencies.sh --libraries'
  # Links and CMake's files mean this system, also when seen from outside.
  find "$system" -xdev -type l -lname '/*' | while read -r link; do
    ln -sfnr "$system$(readlink "$link")" "$link"
  done
  find "$system/usr" -iname '*targets*.cmake' -o -path '*/cmake/fast*' -name '*.cmake' |
    xargs sed -i -E 's#(["; ])/usr(["/;])#\1${CMAKE_SYSROOT}/usr\2#g'
  touch "$system/complete"
fi

echo "== Configuring and building (folder build-arm64)"
cmake --preset arm64 -DVIWO_SYSROOT="$system" -DVIWO_WERROR="${VIWO_WERROR:-OFF}"
cmake --build --preset arm64 --parallel "$(nproc)"

if [ "${1:-}" = --packages ]; then
  echo "== Packages"
  inside 'scripts/install_dependencies.sh --packages && cd build-arm64 && cpack'
  exit
fi
echo "== Testing under qemu"
export QEMU_LD_PREFIX=$system
if [ $# -eq 0 ]; then
  set -- --exclude-regex "$(grep -v '^#' tests/not_under_qemu.txt | paste -sd '|')"
fi
ctest --preset arm64 --output-on-failure --parallel "$(nproc)" "$@"
