#!/usr/bin/env bash
# Installs the Debian packages that are missing. Usage: install_packages.sh build|package|tests|quality
set -euo pipefail

build=(g++ cmake ninja-build libboost-dev libboost-program-options-dev libeigen3-dev libglm-dev libsqlite3-dev
  libsqlitecpp-dev libusb-1.0-0-dev nettle-dev nlohmann-json3-dev pkg-config pybind11-dev python3-dev python3-numpy
  libdeflate-dev libexpat1-dev libzip-dev libzstd-dev zlib1g-dev
  fonts-noto-core libasound2-dev libegl-dev libepoxy-dev libfontconfig-dev libglfw3-dev libimgui-dev libpango1.0-dev
  libpng-dev libsamplerate0-dev libsndfile1-dev libstb-dev libwebp-dev libx11-dev libxrandr-dev)
package=(dpkg-dev file help2man)  # `cmake --install` and cpack
tests=(dbus-daemon imagemagick libbenchmark-dev libbullet-dev libegl1 libfcl-dev libode-dev libgl1-mesa-dri libgtest-dev librsvg2-bin
  libumockdev-dev libxml2-utils man-db openbox python3 python3-jsonschema python3-pytest umockdev x11-utils x11-xserver-utils xdotool xfwm4
  xserver-xorg-core xserver-xorg-video-dummy xvfb zstd)
quality=(chromium clang clang-format clang-tidy devscripts firefox-esr iproute2 lintian munge mypy octave python3-matplotlib rt-tests slurm-wlm valgrind)
command -v npm > /dev/null || quality+=(npm)  # it comes with other people's nodejs, too

case "${1:-}" in
  build) wanted=("${build[@]}") ;;
  package) wanted=("${build[@]}" "${package[@]}") ;;
  tests) wanted=("${build[@]}" "${package[@]}" "${tests[@]}") ;;
  quality) wanted=("${build[@]}" "${package[@]}" "${tests[@]}" "${quality[@]}") ;;
  *)
    echo "usage: $0 build|package|tests|quality" >&2
    exit 2
    ;;
esac

missing=()
for package in "${wanted[@]}"; do
  dpkg-query -W -f '${Status}' "$package" 2> /dev/null | grep -q 'ok installed' || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then exit 0; fi

if [ "$(id -u)" -eq 0 ]; then
  as_root=()
elif command -v sudo > /dev/null; then
  as_root=(sudo)
else
  echo "These packages are missing and need an administrator: apt-get install ${missing[*]}" >&2
  exit 1
fi
echo "Installing: ${missing[*]}" >&2
"${as_root[@]}" apt-get update -q > /dev/null
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" > /dev/null
