#!/bin/sh
# Runs forestrl in a container. Says where results go if no folder is there to keep them, and what to
# do if they cannot be written.
set -eu

mount="docker run --user \"\$(id -u):\$(id -g)\" -v \"\$PWD:$PWD\" forestrl $*"

say() {
    echo "forestrl: $*" >&2
}

is_writable() {
    probe=$(mktemp "$1/.writable-XXXXXX" 2>/dev/null) && rm "$probe"
}

is_mounted() { # itself or with a folder around it, but not with the whole container
    [ "$(findmnt --noheadings --output TARGET --target "$1")" != / ]
}

# The image brings compiled kernels and a list of fonts in the home folder. Their libraries use them
# only where they could write: with a read-only root, a copy has to do.
if ! is_writable "$HOME"; then
    if ! copy=$(mktemp -d 2>/dev/null); then
        say "no temporary folder can be written: add --tmpfs /tmp to docker run"
        exit 1
    fi
    cp -R "$HOME/." "$copy"
    export HOME="$copy" MPLCONFIGDIR="$copy/matplotlib" NUMBA_CACHE_DIR="$copy/numba"
fi

check_results() {
    kept=no
    for folder in "$PWD" "$PWD/outputs" "$PWD/multirun"; do
        [ -d "$folder" ] || continue
        is_mounted "$folder" && kept=yes
        is_writable "$folder" && continue
        owner=$(stat --format %u:%g "$folder")
        if ! is_mounted "$folder"; then
            say "results go to $folder, which is read-only: mount a folder of yours: $mount"
        elif [ "${owner%:*}" = 0 ]; then
            say "$folder belongs to root, as docker makes folders that it does not find: give it to" \
                "yourself with sudo chown \"\$(id -u):\$(id -g)\", or make it before docker does"
        else
            say "$folder cannot be written by user $(id -u): add --user $owner to docker run"
        fi
        exit 1
    done
    [ $kept = yes ] ||
        say "results stay in this container, in $PWD; to have them in a folder of yours: $mount"
}

case " $* " in
"  " | *" --help "* | *" -h "* | *" --version "* | *" --cfg "* | *" -c "*) ;; # write nothing
*" hydra.run.dir="* | *" hydra.sweep.dir="*) ;;                              # say where themselves
*) check_results ;;
esac

exec forestrl "$@"
