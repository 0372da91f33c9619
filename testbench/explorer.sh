#!/bin/sh
# Makes the explorer's page, one file: the engine as WebAssembly, and the page around it. `hpu explore` writes it from
# there.
# The page is target/explorer.html, or explorer.html in the target folder of cargo.
# Exit codes: 0 made, 1 a build failed, 3 the target of WebAssembly is missing.
set -eu
cd "$(dirname "$0")/.."

target=wasm32-unknown-unknown
folder=${CARGO_TARGET_DIR:-target}
if ! [ -d "$(rustc --print sysroot)/lib/rustlib/$target" ]; then
    [ -z "${NO_INSTALL:-}" ] && command -v rustup >/dev/null 2>&1 && rustup target add $target || {
        echo "error: Rust's target $target is missing; install it and run this again: rustup target add $target" >&2
        exit 3
    }
fi
cargo build --locked --quiet --profile web --target $target -p hpu-web

page=crates/web/page
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Modules become one script, in the order of their uses: lines that import go, and so do the words `export`.
for module in dom link worker engine controls picture map main; do
    sed -e '/^import /d' -e 's/^export //' "$page/$module.js"
done >"$work/script"
cat crates/chart/src/web/plot.css "$page/page.css" >"$work/style"
cp crates/chart/src/web/plot.js "$work/plot"
gzip -9 -n <"$folder/$target/web/hpu_web.wasm" | base64 | tr -d '\n' >"$work/module"
awk -v work="$work" '
    function put(name,  line) { while ((getline line < (work "/" name)) > 0) print line }
    /^\/\* STYLE \*\/$/ { put("style"); next }
    /^\/\* PLOT \*\/$/ { put("plot"); next }
    /^\/\* SCRIPT \*\/$/ { put("script"); next }
    />MODULE</ {
        sub(/MODULE<.*/, "")
        ORS = ""
        print
        getline line < (work "/module")
        print line
        ORS = "\n"
        print "</script>"
        next
    }
    { print }
' "$page/index.html" >"$folder/explorer.html.$$"
mv "$folder/explorer.html.$$" "$folder/explorer.html"
echo "$folder/explorer.html: $(wc -c <"$folder/explorer.html") bytes, of which the engine is $(wc -c <"$work/module")"
