#!/bin/bash
# compare_peers.sh --openvins SOURCE [--sqrtvins SOURCE] [--euroc SEQUENCE] [OPTIONS]
# Builds peers from where you have them and measures them beside viwo, on the same measurements and the
# same images, in turn, each on one core: accuracy, CPU time, allocations, memory, as a table
# (build-peers/table.md).
#   --openvins SOURCE   source tree, or a .tar.gz of it (github.com/rpng/open_vins); its simulator makes the data
#   --sqrtvins SOURCE   the same of github.com/rpng/sqrtVINS
#   --euroc SEQUENCE    folder that holds mav0, with images and truth, of the EuRoC MAV dataset
#   --seeds N           exports of the simulator, for the means (10)
#   --seconds S         of an export, at most (120)
#   --rounds N          of every run, for the medians of times (3)
#   --rows TEXT         only rows whose name contains TEXT
#   --no-images         no rendered images
# OpenVINS is GPL-3.0, sqrtVINS LGPL-3.0; nothing of them is part of viwo. Everything is built for this
# machine's instruction set. Times mean something on a machine that is otherwise idle.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

usage() {
  sed -n '2,17s/^# \{0,1\}//p' "$root/scripts/compare_peers.sh"
  exit "${1:-2}"
}

openvins='' sqrtvins='' rest=()
while (($#)); do
  case $1 in
    -h | --help) usage 0 ;;
    --no-images) rest+=("$1") && shift && continue ;;
    --openvins | --sqrtvins | --euroc | --seeds | --seconds | --rounds | --rows) ;;
    *) echo "compare_peers.sh: unknown option $1" >&2 && usage ;;
  esac
  if (($# < 2)); then echo "compare_peers.sh: $1 needs a value" >&2 && usage; fi
  case $1 in
    --openvins) openvins=$(realpath "$2") ;;
    --sqrtvins) sqrtvins=$(realpath "$2") ;;
    --euroc) rest+=("$1" "$(realpath "$2")") ;;
    *) rest+=("$1" "$2") ;;
  esac
  shift 2
done
if [[ -z $openvins ]]; then echo "compare_peers.sh: --openvins says where its source is" >&2 && usage; fi
cd "$root"
if [[ ! -x build/bin/viwo ]]; then echo "compare_peers.sh: build viwo first (./demo.sh)" >&2 && exit 2; fi

scripts/install_dependencies.sh --peers >&2
work=$PWD/build-peers
mkdir -p "$work"
cores=$(nproc)
# Eigen's alignment: with the machine's, a peer hands vectors on unaligned and crashes.
flags=(-w -march=native -DEIGEN_MAX_STATIC_ALIGN_BYTES=16)

source_of() {  # NAME WHERE CORE: the folder that holds CORE, unpacked where it is an archive
  local where=$2
  if [[ -f $where ]]; then
    rm -rf "$work/$1-source" && mkdir "$work/$1-source"
    tar -xzf "$where" -C "$work/$1-source"
    where=$work/$1-source
  fi
  local core
  core=$(find "$where" -maxdepth 2 -type d -name "$3" | head -n 1)
  if [[ -z $core ]]; then echo "compare_peers.sh: $2 holds no $3" >&2 && exit 2; fi
  (cd "$core/.." && pwd)
}

build_peer() {  # NAME SOURCE CORE MACROS...
  local name=$1 source=$2 core=$3 launcher=()
  # As the peer's own build defines them.
  local macros=(-DROS_AVAILABLE=0 -DENABLE_ARUCO_TAGS=1 "${@:4}")
  if command -v ccache > /dev/null; then launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
  echo "== Building $name (several minutes the first time; $work/$name.log)" >&2
  {
    cmake -S "$source/$core" -B "$work/$name" -G Ninja -DENABLE_ROS=OFF "${launcher[@]}" \
      -DCMAKE_DISABLE_FIND_PACKAGE_ament_cmake=ON -DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON \
      -DCMAKE_BUILD_TYPE=Release -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=9 \
      -DEIGEN3_INCLUDE_DIR=/usr/include/eigen3 -DCMAKE_CXX_FLAGS="${flags[*]}"
    cmake --build "$work/$name" --parallel "$cores" --target "${core}_lib"
  } > "$work/$name.log" 2>&1 || { tail -n 20 "$work/$name.log" >&2; exit 1; }
  local includes=(-I"$source/$core/src" -I"$source/ov_core/src" -I"$source/ov_init/src" -I/usr/include/eigen3
    -I/usr/include/opencv4)
  local program
  for program in feed export_openvins; do
    if [[ $program = export_openvins && $name != openvins ]]; then continue; fi
    # Hidden: the inline functions of the library remain its own.
    g++ -std=c++17 -O3 -DNDEBUG -fvisibility=hidden -fvisibility-inlines-hidden "${flags[@]}" \
      "${macros[@]}" "${includes[@]}" "scripts/peers/$program.cpp" -o "$work/$name/$program" \
      -L"$work/$name" -Wl,-rpath,"$work/$name" "-l${core}_lib" -lopencv_core \
      -lopencv_imgcodecs -lopencv_imgproc -lopencv_calib3d -lboost_filesystem -lboost_system
  done
}

openvins=$(source_of openvins "$openvins" ov_msckf)
build_peer openvins "$openvins" ov_msckf -DPEER_OPENVINS
arguments=(--openvins "$work/openvins/feed" "$openvins" --export "$work/openvins/export_openvins")
if [[ -n $sqrtvins ]]; then
  sqrtvins=$(source_of sqrtvins "$sqrtvins" ov_srvins)
  build_peer sqrtvins "$sqrtvins" ov_srvins -DPEER_SQRTVINS -DUSE_FLOAT=1
  arguments+=(--sqrtvins "$work/sqrtvins/feed" "$sqrtvins")
fi
gcc -O2 -fPIC -shared scripts/peers/count_allocations.c -o "$work/libcount_allocations.so"

exec python3 scripts/peers/compare.py --viwo "$PWD/build/bin/viwo" --work "$work" \
  --count "$work/libcount_allocations.so" "${arguments[@]}" "${rest[@]}"
