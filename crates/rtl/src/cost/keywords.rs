//! Names of VHDL that are no names of Verilog: GHDL 2.0 writes them as they are.
//!
//! A keyword of SystemVerilog, such as `ref`, becomes the escaped identifier `\ref `, which is the same name to every
//! tool. An extended identifier, `\a-b\`, becomes `\a-b `. A name that Verilator reads as its own even then, such as
//! `this`, becomes `\this$ `; no name of VHDL ends so.

/// The keywords of SystemVerilog (IEEE 1800-2017, annex B) that may be identifiers of VHDL.
#[rustfmt::skip]
const KEYWORDS: [&str; 216] = [
    "accept_on", "always", "always_comb", "always_ff", "always_latch", "assign", "automatic", "before", "bind",
    "bins", "binsof", "bit", "break", "buf", "bufif0", "bufif1", "byte", "casex", "casez", "cell", "chandle",
    "checker", "class", "clocking", "cmos", "config", "const", "constraint", "context", "continue", "covergroup",
    "coverpoint", "cross", "deassign", "default", "defparam", "design", "disable", "dist", "do", "edge", "endcase",
    "endchecker", "endclass", "endclocking", "endconfig", "endfunction", "endgenerate", "endgroup", "endinterface",
    "endmodule", "endpackage", "endprimitive", "endprogram", "endproperty", "endsequence", "endspecify", "endtable",
    "endtask", "enum", "event", "eventually", "expect", "export", "extends", "extern", "final", "first_match",
    "force", "foreach", "forever", "fork", "forkjoin", "genvar", "global", "highz0", "highz1", "iff", "ifnone",
    "ignore_bins", "illegal_bins", "implements", "implies", "import", "incdir", "include", "initial", "input",
    "inside", "instance", "int", "integer", "interconnect", "interface", "intersect", "join", "join_any", "join_none",
    "large", "let", "liblist", "local", "localparam", "logic", "longint", "macromodule", "matches", "medium",
    "modport", "module", "negedge", "nettype", "nexttime", "nmos", "noshowcancelled", "notif0", "notif1", "output",
    "packed", "parameter", "pmos", "posedge", "primitive", "priority", "program", "property", "protected", "pull0",
    "pull1", "pulldown", "pullup", "pulsestyle_ondetect", "pulsestyle_onevent", "rand", "randc", "randcase",
    "randsequence", "rcmos", "real", "realtime", "ref", "reg", "reject_on", "release", "repeat", "restrict", "rnmos",
    "rpmos", "rtran", "rtranif0", "rtranif1", "s_always", "s_eventually", "s_nexttime", "s_until", "s_until_with",
    "scalared", "sequence", "shortint", "shortreal", "showcancelled", "signed", "small", "soft", "solve", "specify",
    "specparam", "static", "string", "strong", "strong0", "strong1", "struct", "super", "supply0", "supply1",
    "sync_accept_on", "sync_reject_on", "table", "tagged", "task", "this", "throughout", "time", "timeprecision",
    "timeunit", "tran", "tranif0", "tranif1", "tri", "tri0", "tri1", "triand", "trior", "trireg", "typedef", "union",
    "unique", "unique0", "unsigned", "until_with", "untyped", "uwire", "var", "vectored", "virtual", "void",
    "wait_order", "wand", "weak", "weak0", "weak1", "wildcard", "wire", "within", "wor",
];

/// Names that Verilator, or its C++, keeps for itself.
const TAKEN: [&str; 18] = [
    "atClone",
    "contextp",
    "eval",
    "eval_step",
    "eventsPending",
    "final",
    "hierName",
    "main",
    "model",
    "modelName",
    "name",
    "nextTimeSlot",
    "rootp",
    "super",
    "this",
    "threads",
    "trace",
    "vlSymsp",
];

/// Returns GHDL's Verilog with escaped names.
pub(super) fn with_escaped_names(verilog: &str) -> String {
    let mut text = String::with_capacity(verilog.len());
    let mut is_head = false;
    for line in verilog.lines() {
        is_head |= line.starts_with("module ");
        let (keywords, rest) = line.split_at(own_words(line, is_head));
        is_head &= !line.ends_with(';');
        text += keywords;
        // The sides of a clock stand inside of the line.
        match rest.strip_prefix('(').filter(|_| keywords == "  always @") {
            Some(events) => {
                let (events, end) = events.split_once(')').unwrap_or((events, ""));
                let events = events.split(" or ").map(|event| match event.split_once(' ') {
                    Some((side, net)) => format!("{side} {}", escaped(net)),
                    None => escaped(event),
                });
                text += &format!("({}){end}", events.collect::<Vec<_>>().join(" or "));
            }
            None => text += &escaped(rest),
        }
        text += "\n";
    }
    text
}

/// Returns the length of the keywords with which a line of GHDL's begins; `is_head` is set where the line declares a
/// module and its ports.
fn own_words(line: &str, is_head: bool) -> usize {
    let indent = line.len() - line.trim_start_matches([' ', '(']).len();
    let rest = &line[indent..];
    let word = |words: &[&str]| words.iter().find(|word| rest.starts_with(**word)).map(|word| indent + word.len());
    let found = match indent {
        0 if rest == "endmodule" => Some(rest.len()),
        0 => word(&["module "]),
        _ if is_head => word(&["input ", "output ", "inout "]),
        // An instance: the names of a module and of the instance.
        2 if rest.ends_with(" (") => None,
        2 if ["always @*", "initial", "initial begin"].contains(&rest) => Some(line.len()),
        2 if rest.starts_with("always @(") => Some(indent + "always @".len()),
        2 => word(&["wire ", "reg ", "assign ", "integer ", "localparam ", "parameter "]),
        _ if rest == "endcase" => Some(line.len()),
        _ => word(&["default: "]),
    };
    found.unwrap_or(indent)
}

/// Returns a part of a line whose words are all names, literals or functions, with escaped names.
fn escaped(part: &str) -> String {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut text = String::with_capacity(part.len());
    let mut rest = part;
    while let Some(c) = rest.chars().next() {
        let end = |from: usize| rest[from..].find(|c| !is_part(c)).map_or(rest.len(), |end| from + end);
        let length = if rest.starts_with("//") {
            rest.len()
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if c == '\\' && rest[1..].contains('\\') {
            // Behind an extended identifier, GHDL writes the rest of a net's name.
            let inside = 1 + rest[1..].find('\\').unwrap_or_default();
            let length = end(inside + 1);
            let name = format!("{}{}", &rest[1..inside], &rest[inside + 1..length]);
            text += &format!("\\{} ", name.replace(char::is_whitespace, "_"));
            rest = &rest[length..];
            continue;
        } else if c == '$' || c == '\'' || is_part(c) {
            end(1)
        } else {
            c.len_utf8()
        };
        let word = &rest[..length];
        match (TAKEN.contains(&word), KEYWORDS.binary_search(&word)) {
            (true, _) => text += &format!("\\{word}$ "),
            (_, Ok(_)) => text += &format!("\\{word} "),
            _ => text += word,
        }
        rest = &rest[length..];
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keywords_are_in_order() {
        assert!(KEYWORDS.is_sorted());
    }

    #[test]
    fn names_are_escaped_and_keywords_are_not() {
        let verilog = "module table
  (input  clk,
   input  [3:0] reg,
   output \\a-b\\);
  reg [3:0] reg;
  wire [1:0] \\my-inst\\_wire;
  assign wire = $signed(ref) + 4'b0010 & input & this; // reg
  /* reg.vhd:6:32  */
  always @*
    initial = n38_q; // (isignal)
  initial
    always <= 4'b0000;
  always @(posedge posedge or negedge rst)
    case (reg)
      2'b10: n59_o <= edge;
      default: n59_o <= int[2];
    endcase
  reg wire (
    .reg(module),
    .wire(\\my-inst\\_wire));
endmodule
";
        let expected = "module \\table 
  (input  clk,
   input  [3:0] \\reg ,
   output \\a-b );
  reg [3:0] \\reg ;
  wire [1:0] \\my-inst_wire ;
  assign \\wire  = $signed(\\ref ) + 4'b0010 & \\input  & \\this$ ; // reg
  /* reg.vhd:6:32  */
  always @*
    \\initial  = n38_q; // (isignal)
  initial
    \\always  <= 4'b0000;
  always @(posedge \\posedge  or negedge rst)
    case (\\reg )
      2'b10: n59_o <= \\edge ;
      default: n59_o <= \\int [2];
    endcase
  \\reg  \\wire  (
    .\\reg (\\module ),
    .\\wire (\\my-inst_wire ));
endmodule
";
        assert_eq!(with_escaped_names(verilog), expected);
        assert_eq!(with_escaped_names(&with_escaped_names("  assign a = b;\n")), "  assign a = b;\n");
    }
}
