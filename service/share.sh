#!/bin/sh
# usage: share.sh RCSPLAT FOLDER    writes completions and manual pages there, laid out as in /usr/share
set -eu
program=$1 folder=$2
mkdir -p "$folder/bash-completion/completions" "$folder/zsh/site-functions" "$folder/fish/vendor_completions.d" "$folder/man/man1"
"$program" completion bash >"$folder/bash-completion/completions/rcsplat"
"$program" completion zsh >"$folder/zsh/site-functions/_rcsplat"
"$program" completion fish >"$folder/fish/vendor_completions.d/rcsplat.fish"
"$program" manual >"$folder/man/man1/rcsplat.1"
for command in $(sed -n 's/^complete -c rcsplat -n __fish_use_subcommand -a \([a-z]*\) .*/\1/p' "$folder/fish/vendor_completions.d/rcsplat.fish"); do
    "$program" manual "$command" >"$folder/man/man1/rcsplat-$command.1"
done
gzip -9nf "$folder"/man/man1/*.1  # as Debian has them; man reads both
touch "$folder/stamp"
