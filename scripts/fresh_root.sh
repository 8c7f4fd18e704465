# Functions for scripts that try Tandem on a fresh root directory of a Debian release. Source this file; needs bash, root,
# debootstrap and the network.

# make_root RELEASE ROOT ARCHIVES: makes a minimal root of the release in the folder ROOT, with the network as it is set up
# here. ARCHIVES keeps the downloaded packages. Exits with status 77 if this is impossible here, before changing anything.
make_root() {
  local release="$1" archives="$3" log file
  root="$2"
  if [ "$(id -u)" -ne 0 ]; then
    echo "$0: must run as root: it mounts into, and changes, a root directory" >&2 && exit 77
  fi
  command -v debootstrap >/dev/null || scripts/setup debootstrap
  trap unmount_root EXIT
  unmount_root
  rm -rf --one-file-system "$root"
  mkdir -p "$archives"
  log="$(mktemp)"
  if ! debootstrap --variant=minbase --cache-dir="$archives" "$release" "$root" >"$log" 2>&1; then
    tail -n 3 "$log" >&2
    rm -f "$log"
    echo "$0: cannot make a root of $release: is it a Debian release, and is its archive reachable?" >&2
    exit 77
  fi
  rm -f "$log"
  cp /etc/resolv.conf "$root/etc/resolv.conf"
  for file in /etc/apt/apt.conf.d/*; do
    if grep -qi 'proxy\|Check-Valid' "$file"; then cp "$file" "$root/etc/apt/apt.conf.d/"; fi
  done
  if ! mount -t proc proc "$root/proc"; then
    echo "$0: cannot mount here" >&2 && exit 77
  fi
  mount -t sysfs -o ro sysfs "$root/sys"
  mount --bind /dev "$root/dev"
  mount --bind /dev/pts "$root/dev/pts"
  bind "$archives" /var/cache/apt/archives
}

# bind PLACE INSIDE [OPTION ...]: mounts the folder PLACE at INSIDE in the root.
bind() {
  mkdir -p "$root$2"
  mount --bind "${@:3}" "$1" "$root$2"
}

# unmount_root: removes all mounts below $root, the last first.
unmount_root() {
  awk -v root="$root/" 'index($2, root) == 1 { print $2 }' /proc/mounts | tac | while read -r place; do umount "$place"; done
}

# inside COMMAND: runs the shell command in the root as a user who has just logged in.
inside() {
  echo "== $*"
  chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin TERM=dumb LANG=C.UTF-8 \
    DEBIAN_FRONTEND=noninteractive ${TANDEM_REQUIRE_SHARED:+TANDEM_REQUIRE_SHARED=1} sh -c "$*"
}
