# Sourced by ./quickstart and ./tests/run: rcs_setup [TARGET...] installs the Debian packages that are
# missing, then configures and builds the release preset. Quiet unless something fails.

rcs_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

rcs_packages() { sed -e 's/#.*//' "$rcs_root/docker/packages.txt" | tr -s ' \t\n' '\n' | sed '/^$/d'; }

rcs_missing_packages() {
    local package
    for package in $(rcs_packages); do
        [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || echo "$package"
    done
}

# Runs a step with its output in a log; shows the log only if the step fails.
rcs_quietly() {
    local log=$1
    shift
    "$@" >"$log" 2>&1 </dev/null || {
        local code=$?
        cat "$log" >&2
        echo "failed ($code): $*" >&2
        return "$code"
    }
}

rcs_as_root() {
    if [ "$(id -u)" = 0 ]; then
        env DEBIAN_FRONTEND=noninteractive "$@"
    else
        sudo env DEBIAN_FRONTEND=noninteractive "$@"
    fi
}

rcs_install_packages() {
    local missing
    missing=$(rcs_missing_packages)
    [ -n "$missing" ] || return 0
    # sudo -v asks for a password where there is a terminal to ask on.
    if [ "$(id -u)" != 0 ] && ! sudo -n true 2>/dev/null && ! { [ -t 0 ] && sudo -v; }; then
        echo "Packages are missing, and installing them takes root or sudo. As root, run:" >&2
        echo "  apt-get install --no-install-recommends" $missing >&2
        return 1
    fi
    echo "installing:" $missing
    rcs_quietly "$rcs_root/build/packages.log" rcs_as_root apt-get update
    rcs_quietly "$rcs_root/build/packages.log" rcs_as_root apt-get install -y --no-install-recommends $missing
}

# Arguments: the targets to build; none builds all.
rcs_build() {
    local targets=()
    [ $# = 0 ] || targets=(--target "$@")
    echo "building librcs and rcsplat"
    rcs_quietly "$rcs_root/build/configure.log" cmake -S "$rcs_root" --preset release
    rcs_quietly "$rcs_root/build/build.log" cmake --build "$rcs_root/build/release" "${targets[@]}"
}

rcs_setup() {
    command -v dpkg-query >/dev/null || {
        echo "this script knows Debian's packages only; see README.md to build elsewhere" >&2
        return 1
    }
    mkdir -p "$rcs_root/build"
    rcs_install_packages
    (cd "$rcs_root" && rcs_build "$@")
}
