#!/bin/bash
# on_fresh_machine.sh FOLDER: the packages in FOLDER, step by step, on a minimal Debian. As root.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
say() { echo "== $*"; }
fail() { echo "FAILED: $*"; exit 1; }
# says TEXT CODE COMMAND...: the command ends with the code, and the text is in what it prints.
says() {
  local text=$1 code=$2 printed status=0
  shift 2
  printed=$("$@" 2>&1) || status=$?
  [ "$status" = "$code" ] || fail "$*: exit code $status, not $code: $printed"
  grep -qF -- "$text" <<< "$printed" || fail "$*: '$text' is not in: $printed"
}
# The system may be that of an earlier run.
DEBIAN_FRONTEND=noninteractive apt-get purge -y -q 'viwo*' > /dev/null 2>&1 || true
DEBIAN_FRONTEND=noninteractive apt-get autoremove -y -q > /dev/null 2>&1 || true
work=$(mktemp -d)
cd "$work"

say "viwo alone"
"$here/install_packages.sh" "$1" viwo > install.log 2>&1 || { cat install.log; exit 1; }
echo "$(dpkg-query -W | wc -l) packages on the system"
needs=(apt-cache depends --recurse --installed --no-recommends --no-suggests --no-conflicts
  --no-breaks --no-replaces --no-enhances)
if "${needs[@]}" viwo | grep -E '^(lib)?(ros|fastrtps|fastdds|fastcdr|dds|opencv-(imgcodecs|highgui))'; then
  fail "the package viwo brings ROS, DDS, image files or a toolkit"
fi
says "viwo " 0 viwo --version
viwo plugins list > plugins.txt
! grep -q 'refused' plugins.txt || fail "plugins are refused: $(cat plugins.txt)"
! grep -qE 'ros1_|ros2_|klt_tracker' plugins.txt || fail "plugins of other packages are listed"
configs=/usr/share/viwo/configs/runs
viwo run $configs/simulated_swerve.yaml --out wheels
viwo run $configs/viwo_swerve.yaml --set sensors.simulator0.duration_s=10 --out filter
test -s filter/report.html && grep -q '"status": *"ok"' filter/summary.json || fail "no results"
says "Debian package viwo-ros" 2 viwo run $configs/viwo_live_ros2.yaml --out live
says "Debian package viwo-images" 2 viwo run $configs/viwo_images.yaml --out images
says "Debian package viwo-dev" 2 viwo plugins new kinematics mine

say "viwo-images, viwo-ros"
"$here/install_packages.sh" "$1" viwo-images viwo-ros > install.log 2>&1 || { cat install.log; exit 1; }
echo "$(dpkg-query -W | wc -l) packages on the system"
viwo plugins list > plugins.txt
! grep -q 'refused' plugins.txt || fail "plugins are refused: $(cat plugins.txt)"
for plugin in ros1_bag ros1_topics ros2_bag ros2_topics klt_tracker; do
  grep -q "  $plugin  " plugins.txt || fail "no $plugin"
done
viwo run $configs/viwo_images.yaml --set sensors.simulator0.duration_s=3 --out images
viwo simulate $configs/viwo_images.yaml --set sensors.simulator0.duration_s=3 --out log
for version in 1 2; do
  bag=robot$version$([ $version = 2 ] || echo .bag)
  viwo_bag log "$bag"
  viwo run $configs/viwo_bag.yaml --set "placeholders.bag=$PWD/$bag" \
    --set sensors.bag0.type=ros${version}_bag --mcap run.mcap --out from_ros$version
  test -s run.mcap && grep -q '"status": *"ok"' from_ros$version/summary.json || fail "ROS $version"
done
cmp from_ros1/trajectory.tum from_ros2/trajectory.tum || fail "ROS 1 and ROS 2 differ"
ROS_LOCALHOST_ONLY=1 says "nothing has come: no IMU sample arrived" 1 viwo run \
  $configs/viwo_live_ros2.yaml --set sensors.ros0.idle_timeout_s=2 --out live
says "viwo-show" 1 viwo run $configs/viwo_swerve.yaml --set sensors.simulator0.duration_s=3 \
  --video tracks.mp4 --out video

say "viwo-dev: a plugin of one's own"
"$here/install_packages.sh" "$1" viwo-dev > install.log 2>&1 || { cat install.log; exit 1; }
for kind in kinematics update sensor; do
  viwo plugins new $kind "my_$kind"
  cmake -S "my_$kind" -B "my_$kind/build" > build.log 2>&1 || { cat build.log; exit 1; }
  cmake --build "my_$kind/build" >> build.log 2>&1 || { cat build.log; exit 1; }
  ctest --test-dir "my_$kind/build" --output-on-failure
done

say "all of it goes away"
DEBIAN_FRONTEND=noninteractive apt-get purge -y -q 'viwo*' > purge.log 2>&1 || { cat purge.log; exit 1; }
rest=$(find /usr -path '*viwo*' | head -3)
[ -z "$rest" ] || fail "left behind: $rest"
echo "ALL STEPS PASSED"
