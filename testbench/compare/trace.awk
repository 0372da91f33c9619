# From hpu's wave.vcd to a trace: a header, then a line for each clock edge after which any net of the wiring has
# changed, words as unsigned numbers. -v period_ps=P is the clock's period.

function word(bits,    value, place) {
    value = 0
    for (place = 1; place <= length(bits); place++) value = 2 * value + substr(bits, place, 1)
    return value
}

function show(    net) {
    if (!changed || edge == 0) return
    printf "%d", edge
    for (net = 1; net <= nets; net++) printf ",%d", words[net]
    printf "\n"
    changed = 0
}

$1 == "$timescale" { unit_ps = $2 * 1000 ^ ((index("ps ns us ms", $3) - 1) / 3) }
# The nets of the wiring are those of the outermost scope, the reset apart.
$1 == "$scope" && ++scopes == 2 {
    printf "edge"
    for (net = 1; net <= nets; net++) printf ",%s", names[net]
    printf "\n"
}
$1 == "$var" && scopes == 1 && $5 != "rst" && $2 == "reg" {
    names[++nets] = $5
    sub(/\[.*/, "", names[nets])
    place_of[$4] = nets
}
/^#/ { show(); edge = substr($1, 2) * unit_ps / period_ps }
/^[01]/ { set(substr($1, 2), substr($1, 1, 1)) }
/^b/ { set($2, word(substr($1, 2))) }
END { show() }

function set(code, value) {
    if (!(code in place_of)) return
    words[place_of[code]] = value
    changed = 1
}
