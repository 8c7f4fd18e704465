#!/bin/bash
# Installs the packages of a folder into a fresh root of this Debian release, and uses them there as a user would.
# Usage: packages.sh FOLDER. Exit status 77: not root, or the archive cannot be reached.
set -euo pipefail
packages="$(realpath "$1")"
here="$(cd "$(dirname "$0")" && pwd)"
[ "$(id -u)" -eq 0 ] || { echo "packages.sh: needs root" >&2; exit 77; }
release="$(. /etc/os-release && echo "$VERSION_CODENAME")"
root="$(mktemp -d)"
finish() {
  umount "$root/proc" "$root/dev" 2>/dev/null || true
  rm -rf --one-file-system "$root"
}
trap finish EXIT
debootstrap --variant=minbase "$release" "$root" >"$root.log" 2>&1 || { tail -n 3 "$root.log" >&2; exit 77; }
rm -f "$root.log"
cp /etc/resolv.conf "$root/etc/"
for file in /etc/apt/apt.conf.d/*; do
  if grep -qi 'proxy\|Check-Valid' "$file"; then cp "$file" "$root/etc/apt/apt.conf.d/"; fi
done
mount -t proc proc "$root/proc"
mount --bind /dev "$root/dev"
cp "$packages"/*.deb "$root/root/"
cp -r "$here/../../examples" "$root/root/examples"

inside() { chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive sh -c "$*"; }
inside "apt-get update -q && apt-get install -yq --no-install-recommends /root/tandem_*.deb man-db"
inside "tandem --version && tandem estimate docking_a --out /root/run && test -s /root/run/summary.json"
inside "man tandem-estimate | head -n 5"
inside "apt-get install -yq --no-install-recommends /root/libtandem-dev_*.deb cmake ninja-build g++ pkg-config"
inside "cmake -S /root/examples -B /root/build -G Ninja && cmake --build /root/build --target 01_track_a_target && \$(find /root/build -name 01_track_a_target -type f)"
inside "pkg-config --cflags --libs tandem"
echo "packages: passed"
