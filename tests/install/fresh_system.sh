# SPDX-License-Identifier: GPL-3.0-or-later
# For scripts to read: fresh minimal systems of the host's release of Debian, from the host's mirror, below the folder $work, which is
# removed in the end. Exits with 77 where they cannot be made.
skip() {
  echo "skipped: $1"
  exit 77
}
[ "$(id -u)" = 0 ] || skip 'only root can make a system to install into'
command -v debootstrap >/dev/null || skip 'debootstrap is not installed'
. /etc/os-release
mirror=$(apt-get indextargets --format '$(RELEASE) $(COMPONENT) $(REPO_URI)' 'Created-By: Packages' |
  sed -n "s/^$VERSION_CODENAME main //p" | head -n 1)
[ -n "$mirror" ] || skip "apt has no mirror of $VERSION_CODENAME"
proxy=$(apt-config shell proxy Acquire::http::Proxy)
[ -z "$proxy" ] || { eval "$proxy"; export http_proxy="$proxy"; }

work=$(mktemp -d)
# Mounted file systems are not removed.
trap 'umount "$work"/*/proc 2>/dev/null || true; rm -rf --one-file-system "$work"' EXIT
# make_system NAME: makes a system in $work/NAME
make_system() {
  debootstrap --variant=minbase "$VERSION_CODENAME" "$work/$1" "$mirror" </dev/null >"$work/log" 2>&1 || { tail -n 20 "$work/log"; exit 1; }
  cp /etc/resolv.conf "$work/$1/etc/resolv.conf" 2>/dev/null || true
  # The program needs /proc/self/fd to write whole files.
  mount -t proc proc "$work/$1/proc" || skip 'nothing may be mounted here'
}
