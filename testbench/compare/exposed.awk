# A copy of hybrid_loop, called hybrid_nets, with every net a port: what synthesis keeps, and Verilog's tools can see.
# The file is read twice.

{ gsub(/hybrid_loop/, "hybrid_nets") }
/^architecture / { in_architecture = 1 }
FNR == 1 { in_architecture = 0 }
in_architecture && /^  signal / {
    if (NR == FNR) {
        sub(/^  signal /, "    ")
        sub(/;.*/, "")
        sub(/: /, ": out ")
        ports = ports ";\n" $0
    }
    next
}
NR == FNR { next }
!in_architecture && previous ~ /: out / && /^  \);/ { previous = previous ports }
FNR > 1 { print previous }
{ previous = $0 }
END { print previous }
