#!/bin/bash
# Installs the packages of a folder into a fresh root of this Debian release, and uses them there as a user would.
# Usage: packages.sh FOLDER. Exit status 77: not root, or the archive cannot be reached.
set -euo pipefail
packages="$(realpath "$1")"
cd "$(dirname "$0")/../.."
. scripts/fresh_root.sh

work="$(mktemp -d)"
make_root "$(. /etc/os-release && echo "$VERSION_CODENAME")" "$work/root" "$work/archives"
trap 'unmount_root; rm -rf --one-file-system "$work"' EXIT
cp "$packages"/*.deb "$root/root/"
cp -r examples "$root/root/examples"

inside "apt-get update -q && apt-get install -yq --no-install-recommends /root/tandem_*.deb man-db"
inside "tandem --version && tandem estimate docking_a --out /root/run && test -s /root/run/summary.json"
inside "man tandem-estimate >/root/page && grep -q 'tandem-estimate' /root/page && head -n 5 /root/page"
if [ -e "$(echo "$packages"/python3-tandem_*.deb)" ]; then
  inside "apt-get install -yq --no-install-recommends /root/python3-tandem_*.deb && cd / &&
    python3 -c 'import tandem; print(tandem.estimate(\"docking_a\").summary.cost)'"
fi
inside "apt-get install -yq --no-install-recommends /root/libtandem-dev_*.deb cmake ninja-build g++ pkg-config"
inside "cmake -S /root/examples -B /root/build -G Ninja && cmake --build /root/build --target 01_track_a_target &&
  \$(find /root/build -name 01_track_a_target -type f)"
inside "printf '#include <tandem/lie/se3.hpp>\nint main() { return tandem::SE3().matrix()(0, 0) != 1; }\n' >/root/use.cpp &&
  g++ -std=c++20 /root/use.cpp \$(pkg-config --cflags --libs tandem) -o /root/use && /root/use"
echo "packages: passed"
