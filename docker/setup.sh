# Sourced by ./quickstart and ./tests/run: rcs_prepare installs the Debian packages that are missing and configures the
# release preset, rcs_build TARGET... builds.

rcs_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

rcs_packages() { sed -e 's/#.*//' "$rcs_root/docker/packages.txt" | tr -s ' \t\n' '\n' | sed '/^$/d'; }

rcs_missing_packages() {
    local package
    for package in $(rcs_packages); do
        [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || echo "$package"
    done
}

# Runs a step with its output in a log, and says how far it is; shows the log only if the step fails.
rcs_step() {
    local words=$1 log=$2 code
    shift 2
    if "$@" </dev/null 2>&1 | tee "$log" | rcs_progress "$words"; then
        return 0
    fi
    code=1
    cat "$log" >&2
    echo "failed: $*" >&2
    return "$code"
}

# Reads what ninja ([3/80]) or apt (pmstatus:PACKAGE:40.0:...) say: on a terminal one line that moves, else a line each tenth.
rcs_progress() {
    local words=$1 line percent shown=-1
    echo "$words"
    while IFS= read -r line; do
        if [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]]; then
            percent=$((100 * BASH_REMATCH[1] / BASH_REMATCH[2]))
        elif [[ $line =~ ^pmstatus:[^:]*:([0-9]+) ]]; then  # unpacked and set up; fetched before that
            percent=$((50 + BASH_REMATCH[1] / 2))
        elif [[ $line =~ ^dlstatus:[^:]*:([0-9]+) ]]; then
            percent=$((BASH_REMATCH[1] / 2))
        else
            continue
        fi
        if [ -t 1 ]; then
            printf '\r  %3d %%' "$percent"
        elif ((percent / 10 > shown / 10 || shown < 0)); then
            echo "  $percent %"
        else
            continue
        fi
        shown=$percent
    done
    if [ -t 1 ] && ((shown >= 0)); then echo; fi
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
    # Another apt may be at work: it is waited for.
    local apt=(rcs_as_root apt-get -o DPkg::Lock::Timeout=600 -o APT::Status-Fd=1)
    rcs_step "looking for packages" "$rcs_root/build/packages.log" "${apt[@]}" update
    rcs_step "installing $(wc -w <<<"$missing") packages and what they need" "$rcs_root/build/packages.log" \
        "${apt[@]}" install -y --no-install-recommends $missing
}

# Installs what is missing and configures the release preset. The log of a step is in build/.
rcs_prepare() {
    command -v dpkg-query >/dev/null || {
        echo "this script knows Debian's packages only; see README.md to build elsewhere" >&2
        return 1
    }
    mkdir -p "$rcs_root/build"
    rcs_install_packages
    rcs_step "configuring" "$rcs_root/build/configure.log" cmake -S "$rcs_root" -B "$rcs_root/build/release" --preset release
}

# Arguments: the targets to build.
rcs_build() {
    rcs_step "building $*" "$rcs_root/build/build.log" cmake --build "$rcs_root/build/release" --target "$@"
}
