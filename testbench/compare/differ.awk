# differ.awk HPU OTHER: the first edge at which two traces differ and the nets that do there, or nothing. The first file
# has a header, and is read up to -v edges=N.

function words(line, into) { split(line, into, ",") }

function told(hpu_line, other_line,    hpu, other, hpu_was, other_was, edge, net, text) {
    words(hpu_line, hpu); words(other_line, other); words(hpu_before, hpu_was); words(other_before, other_was)
    edge = hpu_line == "" || (other_line != "" && other[1] + 0 < hpu[1] + 0) ? other[1] : hpu[1]
    text = "edge " edge ":"
    for (net = 2; net <= nets; net++) {
        left = hpu[1] == edge ? hpu[net] : hpu_was[net]
        right = other[1] == edge ? other[net] : other_was[net]
        if (left != right) text = text sprintf(" %s %s, hpu %s;", names[net], right, left)
    }
    sub(/;$/, "", text)
    print text
}

BEGIN {
    getline header <ARGV[1]
    nets = split(header, names, ",")
    do {
        hpu_line = other_line = ""
        if ((getline hpu_line <ARGV[1]) > 0 && hpu_line + 0 > edges) hpu_line = ""
        getline other_line <ARGV[2]
        if (hpu_line != other_line) {
            told(hpu_line, other_line)
            exit
        }
        hpu_before = hpu_line
        other_before = other_line
    } while (hpu_line != "")
}
