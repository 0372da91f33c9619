# Functions for the scripts of this folder that need tools; they source this file.
#
# What is missing is installed where that is possible, after saying so; with a terminal, after a line of yours. With
# NO_INSTALL=1 (test.sh --no-install) a missing tool is a failure with its name.
# shellcheck shell=bash

# Returns whether this run may install, and says what.
# may_install WHAT-IS-MISSING WHERE-FROM-AND-WHAT
may_install() {
    [ -z "${NO_INSTALL:-}" ] || return 1
    echo "missing: $1; installs $2" >&2
    if [ -t 0 ] && [ -t 2 ]; then
        printf 'Return goes on, Control-C ends this: ' >&2
        read -r _
    fi
}

# Installs Debian's packages if one of the tools is missing, as root; ends the script with 3 where it may not.
# need "TOOL ..." "PACKAGE ..."
need() {
    local tool missing=
    for tool in $1; do
        command -v "$tool" >/dev/null 2>&1 || missing="$missing $tool"
    done
    [ -n "$missing" ] || return 0
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1 && may_install "${missing# }" "from Debian: $2"; then
        apt-get update -qq
        # shellcheck disable=SC2086  # one word a package
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $2
        return
    fi
    echo "error: missing: ${missing# }; install and run this again: sudo apt-get install $2" >&2
    exit 3
}

# What makes wheels and archives of a release, from PyPI: for testbench/wheel.sh and testbench/release.sh.
# shellcheck disable=SC2034
WHEEL_TOOLS="maturin==1.16.0 ziglang==0.17.1 auditwheel==6.8.2"

# Returns the folder of an environment's programs, which has another name on Windows.
bin_of() { if [ -d "$1/Scripts" ]; then echo "$1/Scripts"; else echo "$1/bin"; fi; }

# Makes an environment of Python with these packages, if it is not there; ends the script with 3 where it may not.
# need_python NAME "PACKAGE==VERSION ..."; prints the environment's folder
need_python() {
    local venv=${XDG_CACHE_HOME:-$HOME/.cache}/hpu/$1
    if [ "$(cat "$venv/installed" 2>/dev/null)" != "$2" ]; then
        # Debian has the module in a package of its own.
        python3 -m ensurepip --version >/dev/null 2>&1 || need python3-venv "python3 python3-venv" >&2
        # shellcheck disable=SC2086  # one word a package
        if ! { may_install "$1" "from PyPI into $venv: $2" && python3 -m venv --clear "$venv" >&2 &&
            "$(bin_of "$venv")/python" -m pip install -q $2 >&2; }; then
            echo "error: missing in $venv, from PyPI: $2; this takes python3-venv too" >&2
            exit 3
        fi
        echo "$2" >"$venv/installed"
    fi
    echo "$venv"
}
