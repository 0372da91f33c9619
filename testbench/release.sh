#!/bin/bash
# Makes the archive of the command that a release has: hpu with the explorer's page, libhpu with its header,
# completions, manual pages and checksums. For Linux, zig links it for glibc 2.17.
# Usage: testbench/release.sh [OUT [TARGET]]: the folder of the archive [dist], one of Rust's targets [this machine's].
#        testbench/release.sh --check [TAG]: whether this commit can become a release: one version everywhere, its
#        section in CHANGELOG.md with a date, a clean tree, and no such tag yet. Ends with the commands that make the
#        tag. With TAG, that tag is made, and has to be this version's.
#        testbench/release.sh --notes: prints the notes of this version.
#        testbench/release.sh --sums OUT: writes OUT/SHA256SUMS of all archives and wheels there.
# Exit codes: 0 made, or ready; 1 or 101 it could not be made, or is not ready; 3 a tool is missing.
set -euo pipefail
cd "$(dirname "$0")/.."

# shellcheck source=testbench/tools.sh
. testbench/tools.sh

version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
# macOS has another program.
sums() { if command -v sha256sum >/dev/null; then sha256sum "$@"; else shasum -a 256 "$@"; fi; }

# Says all that is in the way.
check() { # TAG
    local wrong=0 found
    not_yet() { echo "not yet: $1" && wrong=1; }
    for manifest in $(git ls-files 'crates/*/Cargo.toml'); do
        grep -q '^version.workspace = true$' "$manifest" || not_yet "$manifest has a version of its own"
    done
    while read -r line; do
        [[ $line == *"version = \"$version\""* ]] || not_yet "Cargo.toml, not $version: $line"
    done < <(grep '^hpu.* = { path = ' Cargo.toml)
    while read -r found; do
        [ "$found" = "$version" ] || not_yet "Cargo.lock has $found of a crate of the workspace"
    done < <(awk '/^name = "hpu(-[a-z]*)?"$/ { getline; print $3 }' Cargo.lock | tr -d '"' | sort -u)
    grep -qx "version: $version" CITATION.cff || not_yet "CITATION.cff has another version"
    found=$(awk '/HPU_VERSION_(MAJOR|MINOR|PATCH) [0-9]/ { printf "%s%s", dot, $3; dot = "." }' \
        crates/capi/include/hpu.h)
    [ "$found" = "$version" ] || not_yet "crates/capi/include/hpu.h has $found"
    found=$(sed -n 's/^## //p' CHANGELOG.md | head -n 1)
    [[ $found =~ ^$version\ \([0-9]{4}-[0-9]{2}-[0-9]{2}\)$ ]] ||
        not_yet "CHANGELOG.md begins with '## $found'; a release has '## $version (YEAR-MONTH-DAY)' there"
    ! grep -q 'hpu\.example' Cargo.toml || not_yet "Cargo.toml names no public place (repository)"
    [ -z "$(git status --porcelain)" ] || not_yet "the tree has changes that are in no commit"
    if [ -n "$1" ]; then
        [ "$1" = "v$version" ] || not_yet "the tag $1 is not v$version"
    elif git rev-parse -q --verify "refs/tags/v$version" >/dev/null; then
        not_yet "the tag v$version exists"
    fi
    [ "$wrong" = 0 ] || return 1
    echo "version $version is ready"
    [ -n "$1" ] || printf 'git tag -a v%s -m "hpu %s"\ngit push origin v%s\n' "$version" "$version" "$version"
}

case ${1:-} in
--check)
    check "${2:-}"
    exit
    ;;
--sums)
    cd "$2"
    files=$(find . -maxdepth 1 -type f \( -name '*.tar.gz' -o -name '*.whl' \) | sed 's,^\./,,' | LC_ALL=C sort)
    # shellcheck disable=SC2086  # names without blanks
    sums $files | tee SHA256SUMS
    exit
    ;;
--notes)
    awk '/^## / { sections++ } sections == 1 && !/^## /' CHANGELOG.md
    exit
    ;;
-*) echo "error: $1: write --check, --notes or --sums, or a folder" >&2 && exit 2 ;;
esac

mkdir -p "${1:-dist}"
dist=$(cd "${1:-dist}" && pwd)
own=$(rustc -vV | sed -n 's/^host: //p')
target=${2:-$own}
built=${CARGO_TARGET_DIR:-target}/$target/release
library=$built/deps
work=$(mktemp -d)
trap 'rm -rf "$work"; rm -f crates/cli/explorer.html' EXIT

# The page is in no commit.
testbench/explorer.sh
cp "${CARGO_TARGET_DIR:-target}/explorer.html" crates/cli/explorer.html
case $target in
*-linux-*)
    # Maturin has zig link it, as it does for the wheel, and looks at the symbols of glibc.
    need python3 "python3 python3-venv"
    builder=$(need_python wheel-venv "$WHEEL_TOOLS")
    PATH=$builder/bin:$PATH maturin build --quiet --release --locked --manifest-path crates/cli/Cargo.toml \
        --features explorer --target "$target" --zig --compatibility manylinux2014 -o "$work/wheel" >&2
    ;;
*)
    cargo build --locked --release --quiet -p hpu -p hpu-capi --features hpu/explorer --target "$target"
    library=$built
    ;;
esac

name=hpu-$version-$target
made=$work/$name
mkdir -p "$made/include" "$made/completions" "$made/man/man1"
# Those that the target has; Windows needs both files of a library.
for file in "$built"/hpu "$built"/hpu.exe "$library"/{libhpu.so,libhpu.dylib,hpu.dll,hpu.dll.lib}; do
    [ ! -f "$file" ] || cp "$file" "$made"
done
cp crates/capi/include/hpu.h "$made/include"
cp LICENSE-MIT LICENSE-APACHE README.md CHANGELOG.md "$made"
# A command for another machine does not run here; this machine's says the same of itself.
runs=$made/hpu
[ -f "$runs" ] || runs=$made/hpu.exe
[ "$target" = "$own" ] || runs=${HPU:?for another machine, HPU=FILE names a command of this commit that runs here}
"$runs" man -o "$made/man/man1" >/dev/null
while read -r shell file; do
    "$runs" completions "$shell" >"$made/completions/$file"
done <<'FILES'
bash hpu.bash
zsh _hpu
fish hpu.fish
powershell hpu.ps1
elvish hpu.elv
FILES
(cd "$made" && find . -type f | sed 's,^\./,,' | LC_ALL=C sort |
    while read -r file; do sums "$file"; done) >"$work/sums"
mv "$work/sums" "$made/SHA256SUMS"
tar -czf "$dist/$name.tar.gz" -C "$work" "$name"
echo "$name.tar.gz: $(($(wc -c <"$dist/$name.tar.gz") / 1000)) kB"
[ "$target" = "$own" ] || exit 0

# Unpacked anywhere, it is whole and runs.
mkdir "$work/there"
cd "$work/there"
tar -xzf "$dist/$name.tar.gz"
cd "$name"
sums --check SHA256SUMS >/dev/null
[ "$(find man/man1 -name 'hpu*.1' | wc -l)" -gt 20 ] || { echo "error: manual pages are missing" >&2 && exit 1; }
./hpu --version
./hpu --quiet run hybrid-wall -o out | sed -n 2p
./hpu --quiet explore hybrid-wall -o page.html
case $target in x86_64-*-linux-*) ./hpu --quiet export fmu hybrid-wall -o wall.fmu ;; esac
