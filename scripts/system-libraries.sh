#!/usr/bin/env bash
# Checks the system libraries that Open3D needs (its import fails without any of them); installs them when it may.
set -euo pipefail
[ "$(uname -s)" = Linux ] || exit 0
packages=(libegl1 libgl1 libx11-6 libusb-1.0-0 libudev1 libidn2-0)
files=(libEGL.so.1 libGL.so.1 libX11.so.6 libusb-1.0.so.0 libudev.so.1 libidn2.so.0)
cache=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p)
missing=()
for i in "${!files[@]}"; do
    grep -qF "${files[$i]} " <<<"$cache" || missing+=("${packages[$i]}")
done
[ "${#missing[@]}" -eq 0 ] && exit 0
install="apt-get install -y ${missing[*]}"
if [ "$(id -u)" -eq 0 ]; then
    as_root=()
elif sudo -n true 2>/dev/null; then
    as_root=(sudo -n)
else
    echo "missing system libraries; run this once, then try again:  sudo apt-get update && sudo $install" >&2
    exit 1
fi
echo "installing ${missing[*]}" >&2
"${as_root[@]}" apt-get update -qq
DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq "${missing[@]}" >/dev/null
