#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs the steps of cli/package/Containerfile in fresh minimal systems, on the committed files, and bakes with the program of the image.
# Exits with 77 if it cannot run: not root, no debootstrap, or no clone made by git.
# usage: container.sh
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
. "$root/tests/install/fresh_system.sh"
[ -e "$root/.git" ] || skip 'the files of the image come from git'
mkdir "$work/context"
git -C "$root" archive HEAD | tar -x -C "$work/context"

number=0 folder=/
# A backslash at the end of a line continues it.
while read instruction arguments; do
  case $instruction in
    '' | '#'*) ;;
    FROM)
      number=$((number + 1))
      [ "${arguments%% *}" = debian:12 ] && [ "$VERSION_ID" = 12 ] || skip "the image is ${arguments%% *}, the host Debian $VERSION_ID"
      make_system $number
      [ "${arguments##* AS }" = "$arguments" ] || ln -s $number "$work/stage-${arguments##* AS }" ;;
    RUN)
      echo "$instruction $arguments"
      chroot "$work/$number" /bin/sh -c "cd $folder && $arguments" >"$work/log" 2>&1 </dev/null || { tail -n 50 "$work/log"; exit 1; } ;;
    COPY)
      case $arguments in
        --from=*)
          from=${arguments%% *} arguments=${arguments#* }
          source=$work/stage-${from#--from=} ;;
        *) source=$work/context/ ;;
      esac
      mkdir -p "$work/$number${arguments##* }"
      cp -r "$source"${arguments%% *} "$work/$number${arguments##* }" ;;
    WORKDIR)
      folder=$arguments
      mkdir -p "$work/$number$folder" ;;
    ENTRYPOINT) program=$(echo "$arguments" | sed 's/^\["\([a-z]*\)"\]$/\1/') ;;
    *) echo "container.sh does not know the instruction $instruction"; exit 1 ;;
  esac
done <"$work/context/cli/package/Containerfile"

# What `podman run -v "$PWD:/work" vpsbake bolt.obj --voxel 0.5mm` does.
cp "$root/sample_meshes/bolt.obj" "$work/$number$folder"
chroot "$work/$number" /bin/sh -c "cd $folder && exec $program bolt.obj --voxel 0.5mm"
chroot "$work/$number" /bin/sh -c "cd $folder && exec $program validate bolt.vps.hdf"
chroot "$work/$number" "$program" version | head -n 1
du -sh --one-file-system --exclude=proc "$work/$number" | sed 's/\t.*/ is the size of the image/'
