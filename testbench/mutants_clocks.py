#!/usr/bin/env python3
"""Mutants of the VHDL of which a simulation by rows says little: of clocks, resets, latches, memories, generics and Z.

Each has one error of a kind that designs really have: another edge, a data line or a gated clock as the clock, one of
two processes or instances on the inverted clock, a missing else, an asynchronous or inverted reset, a register without
reset or with an initial value instead, another enable, a generic in another's place, and high impedance for one code.
Every kind is sown at every block where it can be made. `hpu check --formal` has to refute each or refuse it. Vectors
are asked only about a block whose clock edge is not told as equations: of it, a proof reads the clocks alone. First,
each block as it is must be proved, wired where a leaf is not proved, or open for want of equations.

Usage: testbench/mutants_clocks.py [--only FILE,FILE] [--kinds KIND,KIND] [--jobs J] [--hpu PROGRAM] [--update]
Exit codes: 0 every mutant is refuted or refused, 1 some are not, 2 wrong usage, 3 a tool is missing.
"""

import argparse
import json
import os
import random
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from mutants import FILES, RECORDS, ROOT, run

# Labels of configurations, in the order in which they are taken.
QUICK = ["all_distinct", "distinct", "short", "small", "narrow", "8_bit", "6_bit", "5_bit", "4_bit", "settling_1"]
# The most mutants of one kind in a file. A loop has a hundred generics, many of which do not fit in another's place:
# GHDL refuses these, and the next one is taken.
MOST = {"generics": 4, "no reset": 1, "enable": 2, "inverted": 2}
# Mutants that are proved because they change nothing, by file and line as they are put, and why.
EQUIVALENT = {
    ("control_switch", "if loads = '1' then"): "just before, `loads` has become `sample`",
    ("gimbal_loop", "LENGTH_FRAC  => OFFSET,"): "`crank_table` takes all lengths in one unit, whichever it is",
    ("sampled_wall", "SCALE_FRAC   => ESTIMATOR,"): "this `velocity_register` does not rescale",
}

EDGE = "rising_edge(clk)"


def entity(text):
    """Ports and generics of the entity: (name, mode or "", type), in their order."""
    body = text[text.index("\nentity ") : text.index("\narchitecture ")]
    code = "\n".join(line.split("--")[0] for line in body.splitlines())
    ports = re.findall(r"^\s*(\w+)\s*:\s*(in|out)\s+([^;:\n]+?)\s*\)?;?\s*$", code, re.M)
    generics = re.findall(r"^\s*([A-Z]\w*)\s*:\s*(\w+)[^;]*:=", code, re.M)
    return ports, generics


def data_bit(text):
    """A bit of an input that is neither clock nor reset."""
    for name, mode, kind in entity(text)[0]:
        if mode == "in" and name not in ("clk", "rst"):
            return name if kind == "std_logic" else f"{name}(0)"
    return None


def with_signal(text, name, value):
    """The text with one more signal, which has this value."""
    head, body = text[: text.index("\narchitecture ")], text[text.index("\narchitecture ") :]
    put = f"\n  signal {name} : std_logic;\n\nbegin\n\n  {name} <= {value};\n"
    return head + body.replace("\nbegin\n", put, 1)


def reset_branch(text):
    """The last `if rst = '1' then` of a clocked process: its match, or nothing."""
    branch = r"\n( +)if rst = '1' then\n((?:(?!\n\1end if;).)*\n)\1end if;\n( +)end if;\n +end process"
    return re.search(branch, text, re.S)


def sown(block, text):
    """All mutants of a file, as (kind, place, text)."""
    found = []

    def add(kind, mutant, place=None):
        if mutant and mutant != text:
            same = next(i for i, (a, b) in enumerate(zip(text + "\0", mutant + "\1")) if a != b)
            found.append((kind, same if place is None else place, mutant))

    ports, generics = entity(text)
    bit = data_bit(text)
    array = re.search(r"\btype \w+ is array", text) is not None
    edges = [match.start() for match in re.finditer(re.escape(EDGE), text)]
    for at in edges:
        rest = text[at + len(EDGE) :]
        add("memory edge" if array else "other edge", f"{text[:at]}falling_edge(clk){rest}", at)
        if bit:
            add("data clock", f"{text[:at]}rising_edge({bit}){rest}", at)
            gated = with_signal(f"{text[:at]}rising_edge(gated){rest}", "gated", f"clk and not {bit}")
            add("gated clock", gated.replace("process (clk)", "process (gated)"), at)
        twice = with_signal(with_signal(f"{text[:at]}rising_edge(again){rest}", "again", "not once"), "once", "not clk")
        add("twice inverted", twice.replace("process (clk)", "process (again)"), at)
    # One of several instances on the inverted clock.
    for match in list(re.finditer(r"\n +clk( *)=> clk,", text))[: MOST["inverted"]]:
        mutant = text[: match.start()] + match.group().replace("=> clk", "=> inverted") + text[match.end() :]
        add("inverted", with_signal(mutant, "inverted", "not clk"), match.start() + 1)
    reset = reset_branch(text)
    if reset:
        body_at = text.rindex(EDGE, 0, reset.start())
        head = text.rindex("\n", 0, body_at)
        line = text[head : text.index("\n", body_at)]
        if line.strip() == f"if {EDGE} then":
            indent = reset.group(3)
            moved = text[: reset.start()] + f"\n{indent}end if;\n" + text[reset.start(3) + len(f"{indent}end if;\n") :]
            resets = reset.group(2)
            first = f"\n{indent}if rst = '1' then\n{resets}{indent}elsif {EDGE} then"
            moved = moved[:head] + first + moved[head + len(line) :]
            begun = moved.rindex("process (clk)", 0, head)
            moved = moved[:begun] + "process (clk, rst)" + moved[begun + len("process (clk)") :]
            add("async reset", moved, head + 1)
        inverted = reset.group().replace("rst = '1'", "rst = '0'", 1)
        add("inverted reset", text[: reset.start()] + inverted + text[reset.end() :])
        assigned = list(re.finditer(r"^ +(\w+)(?:\([^)]*\))? +(?:<=|:=) ([^;]+);\n", reset.group(2), re.M))
        for match in assigned[: MOST["no reset"]]:
            begin, end = reset.start(2) + match.start(), reset.start(2) + match.end()
            without = text[:begin] + "        null;\n" + text[end:]
            add("no reset", without, begin + 1)
            declared = re.compile(rf"^( +(?:variable|signal) +{match[1]} *: [^;:]+)(;)", re.M)
            port = re.compile(rf"^( +{match[1]} *: out +(?:std_logic_vector\([^\n;]*\)|std_logic))(;| *$)", re.M)
            for pattern in (declared, port):
                if pattern.search(without):
                    add("initial", pattern.sub(rf"\1 := {match[2]}\2", without, count=1), begin + 1)
                    break
    conditions = [match for match in re.finditer(r"\b(\w+) = '1' then", text) if match[1] != "rst"]
    names = list(dict.fromkeys(match[1] for match in conditions))
    for match in conditions[: MOST["enable"]]:
        other = next((name for name in names if name != match[1]), None)
        put = f"{other} = '1' then" if other else f"{match[1]} = '0' then"
        add("enable", text[: match.start()] + put + text[match.end() :], match.start())
    for match in list(re.finditer(r"\bcountdown = 0 then", text))[:1]:
        add("enable", text[: match.start()] + "countdown /= 0 then" + text[match.end() :], match.start())
    # Without its default, an output that a process assigns under conditions keeps its value.
    for process in re.finditer(r"process \(all\)(?:(?!end process).)*", text, re.S):
        for match in re.finditer(r"^ +(\w+) +<= [^;]+;\n", process.group(), re.M):
            if re.search(rf"\bthen\n(?:(?!end if).)*\b{match[1]} +<= ", process.group()[match.end() :], re.S):
                begin, end = process.start() + match.start(), process.start() + match.end()
                add("latch", text[:begin] + text[end:], begin)
                break
    for match in list(re.finditer(r"^( +\w+ +<= [^;\n]+? when [^;\n]+?) else [^;]+;", text, re.M))[:1]:
        add("latch", text[: match.start()] + match[1] + ";" + text[match.end() :], match.start())
    for match in list(re.finditer(r"\n( +)else\n((?:(?!\n\1end if;).)*\n)\1end if;", text, re.S)):
        process = text.rfind("process (", 0, match.start())
        if process > 0 and text.startswith("process (all)", process):
            add("latch", text[: match.start()] + f"\n{match[1]}end if;" + text[match.end() :], match.start() + 1)
            break
    kinds = {name: kind for name, kind in generics}
    changed = []
    for match in re.finditer(r"^( +\w+ +=> )([A-Z][A-Z0-9_]*)(,?\)?.*)$", text, re.M):
        if match[2] not in kinds:
            continue
        same = [name for name, kind in generics if kind == kinds[match[2]] and name != match[2]]
        # The generic beside it: the likeliest slip.
        order = [name for name, kind in generics if kind == kinds[match[2]]]
        at = order.index(match[2])
        if same:
            other = order[at + 1] if at + 1 < len(order) else order[at - 1]
            changed.append((match.start(), text[: match.start(2)] + other + text[match.end(2) :]))
    for place, mutant in random.Random(block).sample(changed, len(changed)):
        add("generics", mutant, place)
    outputs = [name for name, mode, _ in ports if mode == "out" and re.search(rf"^\s+{name}\s+<= ", text, re.M)]
    inputs = [(name, kind) for name, mode, kind in ports if mode == "in" and name not in ("clk", "rst")]
    if outputs and inputs:
        name, kind = inputs[0]
        code = f"{name} = '1'" if kind == "std_logic" else f"{name} = ({name}'range => '1')"
        wide = next(kind for port, _, kind in ports if port == outputs[0]) != "std_logic"
        floats = "(others => 'Z')" if wide else "'Z'"
        clocked = text[text.rindex("process", 0, reset.start()) : reset.start()] if reset else ""
        if re.search(rf"\b{outputs[0]}\s+<= ", clocked):
            indent = reset.group(1)
            added = f"\n{indent}if {code} then\n{indent}  {outputs[0]} <= {floats};\n{indent}end if;\n"
            add("Z", text[: reset.start()] + added + text[reset.start() :], reset.start() + 1)
        else:
            whole = re.search(rf"^  ({outputs[0]}\s+<= )([^;]+);", text, re.M)
            process = re.search(r"process \(all\)(?:(?!end process).)*", text, re.S)
            if whole and " when " not in whole[2]:
                put = f"  {whole[1]}{floats} when {code} else {whole[2]};"
                add("Z", text[: whole.start()] + put + text[whole.end() :], whole.start())
            elif process and re.search(rf"\b{outputs[0]}\s+<= ", process.group()):
                added = f"  if {code} then\n      {outputs[0]} <= {floats};\n    end if;\n  "
                add("Z", text[: process.end()] + added + text[process.end() :], process.end())
    return found


def quick(block):
    """Configurations that are proved fast: one in which all generics differ where there is one, and a small one."""
    labels = {file.name.removesuffix("-directed.txt") for file in (ROOT / "vectors" / block).glob("*-directed.txt")}
    if f'"{block}",' in (ROOT / "crates/datapath/src/distinct.rs").read_text():
        labels.add("all_distinct")
    return [label for label in QUICK if label in labels][:2] or ["default"]


def others(block):
    """The other configurations, for mutants in parts of the VHDL that the quick ones do not have."""
    files = (ROOT / "vectors" / block).glob("*-directed.txt")
    labels = (file.name.removesuffix("-directed.txt") for file in files)
    return sorted(label for label in labels if label not in quick(block))


def judged(hpu, block, mutant, variants):
    """The verdict on a mutant in these configurations: refuted, refused, by synthesis, or what else the proof says."""
    with tempfile.TemporaryDirectory() as folder:
        for stem, file in FILES.items():
            if stem != block:
                os.symlink(file, Path(folder) / file.name)
        (Path(folder) / f"{block}.vhd").write_text(mutant)
        verdicts = []
        for variant in variants:
            done = run([hpu, "check", "--formal", block, "--variant", variant, "--hdl", folder, "--json", "-j", "1"])
            if done.returncode == 3:
                sys.exit(done.stderr)
            if done.returncode == 4 or not done.stdout.startswith("{"):
                said = done.stderr.lower()
                return "synthesis" if "latch" in said else "wrong"
            row = json.loads(done.stdout)["rows"][0]
            if row["verdict"] in ("refuted", "refused"):
                return row["verdict"]
            if "ghdl" in str(row["why"]).lower():
                return "synthesis" if "latch" in str(row["why"]).lower() else "wrong"
            verdicts.append(row["verdict"])
        if set(verdicts) <= {"proved", "wired"}:
            return "proved"
        # No vectors are written for the configurations that only proofs use, so all others are run.
        done = run([hpu, "check", block, "--hdl", folder, "--json", "-j", "1"])
        return "vectors" if done.returncode == 1 else "open"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="")
    parser.add_argument("--kinds", default="")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--hpu", metavar="PROGRAM", help="this program instead of one that is built")
    parser.add_argument("--list", action="store_true", help="print the mutants and judge none")
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args()
    hpu = options.hpu
    if hpu is None:
        subprocess.run(["cargo", "build", "--locked", "--release", "--quiet", "-p", "hpu"], cwd=ROOT, check=True)
        hpu = str(Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "hpu")
    blocks = [block for block in sorted(FILES) if not options.only or block in options.only.split(",")]
    mutants = []
    for block in blocks:
        text = FILES[block].read_text()
        for kind, place, mutant in sown(block, text):
            if not options.kinds or kind in options.kinds.split(","):
                mutants.append((block, kind, text.count("\n", 0, place) + 1, text, mutant))
    if options.list:
        for block, kind, line, text, mutant in mutants:
            print(f"{block}.vhd:{line} {kind}")
        return
    def sound(block):
        """Configurations of the VHDL as it is that are proved, or wired, or open for a leaf without equations."""
        chosen = [word for variant in quick(block) for word in ("--variant", variant)]
        done = run([hpu, "check", "--formal", block, *chosen, "--json", "-j", "1"])
        if done.returncode == 3:
            sys.exit(done.stderr)
        rows = json.loads(done.stdout)["rows"]
        return {row["variant"]: row["verdict"] for row in rows if row["verdict"] in ("proved", "wired", "open")}

    with ThreadPoolExecutor(options.jobs) as pool:
        proved = dict(zip(blocks, pool.map(sound, blocks)))
    for block in blocks:
        if len(proved[block]) < len(quick(block)):
            sys.exit(f"error: {block} as it is is not proved: {proved[block]}")

    def of(one):
        block, kind, line, text, mutant = one
        verdict = judged(hpu, block, mutant, quick(block))
        if verdict == "proved" and others(block):
            verdict = judged(hpu, block, mutant, others(block))
        at = mutant.rfind("\n", 0, sum(len(part) + 1 for part in text.split("\n")[: line - 1])) + 1
        print(f"{block}.vhd:{line} {kind}: {verdict}", file=sys.stderr, flush=True)
        return block, line, kind, verdict, mutant[at : mutant.find("\n", at)].strip()

    def some(ones):
        """The rows of mutants that GHDL takes, as many as there may be of one kind."""
        rows = []
        for one in ones:
            row = of(one)
            rows += [row] if row[3] != "wrong" else []
            if len(rows) == MOST["generics"]:
                break
        return rows

    exchanged = [[one for one in mutants if one[:2] == (block, "generics")] for block in blocks]
    tasks = [[one] for one in mutants if one[1] != "generics"] + exchanged
    with ThreadPoolExecutor(options.jobs) as pool:
        rows = sorted((row for rows in pool.map(some, tasks) for row in rows), key=lambda row: row[:3])
    names = ("refuted", "refused", "synthesis", "vectors", "proved", "open")
    count = {name: sum(row[3] == name for row in rows) for name in names}
    kinds = {kind: sum(row[2] == kind for row in rows) for kind in sorted({row[2] for row in rows})}
    asked = "".join(f" --{name} {value}" for name in ("only", "kinds") if (value := getattr(options, name)))
    text = f"# testbench/mutants_clocks.py{asked}\n# {len(rows)} mutants of {len({row[0] for row in rows})} files: "
    text += ", ".join(f"{number} {name}" for name, number in count.items()) + "\n"
    text += "# " + ", ".join(f"{number} {kind}" for kind, number in kinds.items()) + "\n"
    text += "# refuted: by a solver or the wiring; refused: by what clocks the registers; "
    text += "synthesis: GHDL takes no latch\n"
    text += "# vectors: by these alone, of a block whose clock edge is not told as equations\n"
    sane = [verdict for found in proved.values() for verdict in found.values()]
    sane = ", ".join(f"{sane.count(verdict)} {verdict}" for verdict in ("proved", "wired", "open"))
    text += f"# the same configurations of the VHDL as it is: {sane}\n"
    survivors = 0
    for block, line, kind, verdict, after in rows:
        known = EQUIVALENT.get((block, after))
        verdict = "judged" if verdict == "proved" and known else verdict
        survivors += verdict in ("proved", "open")
        text += f"{block}.vhd:{line:<5} {kind:<15} {verdict}\n"
        if verdict in ("proved", "open", "judged"):
            text += f"    + {after}\n" + (f"    {known}\n" if known else "")
    print(text, end="")
    if options.update:
        (RECORDS / "mutants-clocks.txt").write_text(text)
    sys.exit(1 if survivors else 0)


if __name__ == "__main__":
    main()
