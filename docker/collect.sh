#!/bin/bash
# Makes a folder a root file system that holds some programs, what they load, and nothing else: docker/collect.sh FOLDER PROGRAM...
# rcsplat opens OpenGL's drivers by itself, so those of Mesa come along; a runtime that has a GPU puts its vendor's beside them.
set -euo pipefail
shopt -s nullglob

image=$1
shift
mkdir -p "$image"/{etc,scenes,state,run/rcsplat,tmp,usr/bin,usr/lib,usr/lib64}
chmod 1777 "$image/tmp"
for folder in bin lib lib64; do ln -sfn usr/$folder "$image/$folder"; done

libraries=/usr/lib/$(gcc -print-multiarch)
files=("$@" "$libraries"/libEGL.so.1 "$libraries"/libOpenGL.so.0 "$libraries"/libGL.so.1 "$libraries"/libEGL_mesa.so.0
       "$libraries"/dri/swrast_dri.so)
for file in "${files[@]}"; do
    [ -e "$file" ] || continue
    echo "$file"
    ldd "$file" | sed -nE 's/^\s*(.* => )?(\/[^ ]+) \(0x.*/\2/p'
done | sort -u | xargs cp -L --parents -t "$image"
# The driver is one file under many names, and strips of what only debuggers read.
find "$image/usr/lib" -name '*.so*' -type f -exec strip --strip-unneeded {} + 2>/dev/null || true
cp --parents -t "$image" /usr/share/glvnd/egl_vendor.d/50_mesa.json /usr/share/fonts/truetype/dejavu/DejaVuSans.ttf
[ ! -d /usr/share/drirc.d ] || cp -r --parents -t "$image" /usr/share/drirc.d

# Whom it runs as, where nobody else is named; OpenGL's loader and OpenSSL look up users and hosts.
echo 'rcsplat:x:7741:7741:rcsplat:/state:/nonexistent' >"$image/etc/passwd"
echo 'rcsplat:x:7741:' >"$image/etc/group"
echo 'hosts: files dns' >"$image/etc/nsswitch.conf"
chown -R 7741:7741 "$image/state" "$image/run/rcsplat"
ldconfig -r "$image"
