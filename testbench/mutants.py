#!/usr/bin/env python3
"""Mutants of the VHDL: one error each, seeded over all files, held against the emulator.

Of a block that is proved (`hpu check --formal`), a mutant is refuted, or proved to be equivalent in every listed
configuration; of the others, and where no solver decides, `hpu check` on vectors kills it or it survives. Of
these survivors, those in EQUIVALENT were judged one by one. Mutants that GHDL refuses are drawn again.

Usage: testbench/mutants.py [--count N] [--seed S] [--jobs J] [--only FILE,FILE] [--update]
Exit codes: 0 every mutant is killed or proved equivalent, 1 some survive, 2 wrong usage, 3 a tool is missing.
"""

import argparse
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
HDL = ROOT / "hdl"
RECORD = ROOT / "testbench" / "record" / "mutants.txt"

# What is exchanged, and what it is called. Each match is a place.
OPERATORS = [
    ("operator", r" \+ ", " - "),
    ("operator", r" - (?!1 downto)", " + "),
    ("operator", r" \* ", " + "),
    ("operator", r" and ", " or "),
    ("operator", r" or ", " and "),
    ("operator", r" xor ", " and "),
    ("relation", r" = (?!')", " /= "),
    ("relation", r" /= ", " = "),
    ("relation", r" > ", " >= "),
    ("relation", r" < ", " <= "),
    ("sign", r"(?<=[( ])-(?=[a-zA-Z(])", ""),
    ("sign", r"\bnot ", ""),
    ("constant", r"'1'", "'0'"),
    ("constant", r"'0'", "'1'"),
    ("constant", r"(?<![\w.#\"])(\d+)(?![\w.\"])", None),
    ("slice", r" - 1 downto 0", " - 2 downto 0"),
    ("slice", r"'high", "'low"),
    ("reset", r"rst = '1'", "rst = '0'"),
    ("enable", r"countdown = 0", "countdown /= 0"),
]

# Survivors that are equivalent, by their file and what they put, and why.
EQUIVALENT = {
    ("energy_bounding", "null;"): "the energy to come is set before it is read, in the sample edge or as the root comes",
    ("input_shaper", "COEF_INT     => 30,"): "the coefficients' signs fill more bits: the same numbers",
    ("passivity_controller", ":= maximum(maximum(ENERGY_WIDTH, TORQUE_WIDTH + WIDTH), 32) + 2;"): "one more bit of sign",
    ("passivity_controller", "for i in TORQUE_WIDTH to WIDE_WIDTH - 3 loop"): "what is topped is a demand and a correction, far below these bits",
    ("passivity_controller_loop", "LIMIT     => 2**PWM_WIDTH + 1"): "the law's torque is never above 2**PWM_WIDTH - 1",
    ("passivity_controller_loop", "LIMIT     => 3**PWM_WIDTH - 1"): "the law's torque is never above 2**PWM_WIDTH - 1",
    ("phantom_engine", ":= maximum(A_WIDTH + B_WIDTH, 32 + TRIG_FRAC + POSITION_FRAC) + 3;"): "one more bit of sign",
    ("phantom_loop", "valid1  => valid2,"): "the three sources are valid at the same edges",
    ("sampled_wall_loop", "SCALE_FRAC      => PWM_WIDTH,"): "the law does not read the scale",
    ("trig_interpolated", "rise      := to_unsigned(RISES(index), TRIG_FRAC - 1) * place(REST_WIDTH - 1 downto 0) + HALF;"):
        "of four steps or more, no rise is half a unit",
    ("trig_interpolated", "sum := term + sum;"): "a sum",
    ("virtual_coupling_loop", "LIMIT     => 3**PWM_WIDTH - 1"): "the law's torque is never above 2**PWM_WIDTH - 1",
    ("virtual_coupling_loop", "LIMIT     => 2**PWM_WIDTH + 1"): "the law's torque is never above 2**PWM_WIDTH - 1",
    ("virtual_coupling_loop", "penetration => stiffness,"): "the law does not read the penetration",
}


def body(text):
    """Where the code of a file's architecture begins, behind its declarations of functions too."""
    return text.index("\narchitecture ")


def places(text):
    """Every place to change, as (kind, begin, end, replacement)."""
    found = []
    start = body(text)
    lines = []
    for match in re.finditer(r"^.*$", text[start:], re.M):
        line, begin = match.group(), start + match.start()
        code = line.split("--")[0]
        if not code.strip() or re.match(r"\s*(type|subtype|variable|end|library|use|architecture)\b", code):
            continue
        lines.append((begin, code))
    # A connection takes what the next one of its map takes.
    connections = [(begin, re.match(r"^(\s*\w+\s*=> )(\w+)(,?\s*)$", code)) for begin, code in lines]
    for (begin, one), (_, other) in zip(connections, connections[1:]):
        if one and other and one[2] != other[2]:
            found.append(("wired", begin + one.start(2), begin + one.end(2), other[2]))
    for begin, code in lines:
        for kind, pattern, put in OPERATORS:
            for match in re.finditer(pattern, code):
                new = put if put is not None else str(int(match.group(1)) + 1)
                found.append((kind, begin + match.start(), begin + match.end(), new))
        whole = re.match(r"^\s*[\w(). ,]+ (<=|:=) [^;]*;\s*$", code)
        if whole and " when " not in code:
            found.append(("deleted", begin + len(code) - len(code.lstrip()), begin + len(code.rstrip()), "null;"))
            names = re.findall(r"\b[a-z]\w+\b", code.split(whole.group(1), 1)[1])
            words = {"signed", "unsigned", "resize", "others", "and", "or", "not"}
            names = [name for name in names if name not in words]
            if len(set(names)) > 1:
                first, second = list(dict.fromkeys(names))[:2]
                at = code.index(whole.group(1))
                left, right = code[:at], code[at:]
                swapped = re.sub(rf"\b({first}|{second})\b", lambda m: second if m.group() == first else first, right)
                found.append(("swapped", begin, begin + len(code), left + swapped))
    return found


def run(arguments):
    return subprocess.run(arguments, capture_output=True, text=True, check=False)


def formal(hpu, folder, block, variants):
    """The verdicts of a block's configurations."""
    chosen = [word for variant in variants for word in ("--variant", variant)]
    done = run([hpu, "check", "--formal", block, *chosen, "--hdl", folder, "--json", "-j", "1", "--tool-timeout", "10"])
    if done.returncode == 3:
        sys.exit(done.stderr)
    if done.returncode == 4:
        return ["refused" if "ghdl" in done.stderr.lower() else "open"]
    return [row["verdict"] for row in json.loads(done.stdout)["rows"]]


def vectors(hpu, folder, block):
    """Whether the vectors of a block's configurations tell a difference; None where GHDL refuses the VHDL."""
    # Most fall to few rows.
    for rows in ("500", "2000"):
        done = run([hpu, "check", block, "--hdl", folder, "-j", "1", "--rows", rows, "--tool-timeout", "60"])
        said = done.stdout + done.stderr
        # Words of other widths do not fit together.
        if "ghdl could not analyse" in said or "error during elaboration" in said or done.returncode == 4:
            return None
        if done.returncode == 1:
            return True
    return False


def judged(hpu, block, text, proved):
    """What becomes of a mutant."""
    with tempfile.TemporaryDirectory() as folder:
        for file in HDL.glob("*.vhd"):
            if file.stem != block:
                os.symlink(file, Path(folder) / file.name)
        (Path(folder) / f"{block}.vhd").write_text(text)
        is_leaf = "entity work." not in text
        if is_leaf and run(["ghdl", "-s", "--std=08", str(Path(folder) / f"{block}.vhd")]).returncode != 0:
            return "refused"
        # Of a block whose default no solver decides, vectors are sooner asked.
        if "default" in proved:
            first = formal(hpu, folder, block, ["default"])
            if first == ["refused"]:
                return "refused"
            if "refuted" in first:
                return "refuted"
            verdicts = formal(hpu, folder, block, proved) if first == ["proved"] else first
            if "refuted" in verdicts:
                return "refuted"
            if set(verdicts) == {"proved"}:
                return "equivalent"
        killed = vectors(hpu, folder, block)
        return "refused" if killed is None else "killed" if killed else "survives"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=320)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", default="")
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args()
    for tool in ("ghdl", "yosys", "z3", "yices-smt2"):
        if shutil.which(tool) is None:
            print(f"error: {tool} is missing", file=sys.stderr)
            sys.exit(3)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    subprocess.run(["cargo", "build", "--locked", "--release", "--quiet", "-p", "hpu"], cwd=ROOT, check=True)
    hpu = str(target / "release" / "hpu")

    blocks = sorted(file.stem for file in HDL.glob("*.vhd"))
    if options.only:
        blocks = [block for block in blocks if block in options.only.split(",")]
    # What the VHDL as it is is proved to be: configurations by block.
    told = json.loads(run([hpu, "check", "--formal", *blocks, "--json", "--tool-timeout", "4"]).stdout)
    proved = {block: [] for block in blocks}
    for row in told["rows"]:
        if row["verdict"] == "proved":
            proved[row["block"]].append(row["variant"])

    texts = {block: (HDL / f"{block}.vhd").read_text() for block in blocks}
    # Of each file the same ones, whichever others are asked for.
    drawn = {}
    for block in blocks:
        found = places(texts[block])
        drawn[block] = random.Random(f"{options.seed} {block}").sample(found, len(found))
    each = -(-options.count // len(blocks))

    def of_block(block):
        rows = []
        for kind, begin, end, new in drawn[block]:
            if len(rows) == each:
                break
            text = texts[block]
            mutant = text[:begin] + new + text[end:]
            verdict = judged(hpu, block, mutant, proved[block])
            if verdict == "refused":
                continue
            line = text.count("\n", 0, begin) + 1
            before = text[text.rfind("\n", 0, begin) + 1 : text.find("\n", begin)].strip()
            at = mutant.rfind("\n", 0, begin) + 1
            after = mutant[at : mutant.find("\n", begin)].strip()
            if verdict == "survives" and (block, after) in EQUIVALENT:
                verdict = "judged"
            rows.append((block, line, kind, verdict, before, after))
        live = [row[5] for row in rows if row[3] == "survives"]
        print(f"{block}: {len(rows)} mutants, {len(live)} live {live}", file=sys.stderr, flush=True)
        return rows

    with ThreadPoolExecutor(options.jobs) as pool:
        rows = [row for part in pool.map(of_block, blocks) for row in part]

    verdicts = ("refuted", "equivalent", "killed", "judged", "survives")
    count = {verdict: sum(row[3] == verdict for row in rows) for verdict in verdicts}
    only = f" --only {options.only}" if options.only else ""
    text = f"# testbench/mutants.py --count {options.count} --seed {options.seed}{only}\n"
    counts = ", ".join(f"{n} {what}" for what, n in count.items())
    text += f"# {len(rows)} mutants of {len(blocks)} files: {counts}\n"
    text += "# refuted: by a solver; equivalent: proved in every configuration; killed: by vectors; judged: equivalent, by reason\n"
    for block, line, kind, verdict, before, after in rows:
        text += f"{block}.vhd:{line:<5} {kind:<10} {verdict:<10}\n"
        if verdict in ("survives", "equivalent", "judged"):
            text += f"    - {before}\n    + {after}\n"
        if verdict == "judged":
            text += f"    {EQUIVALENT[block, after]}\n"
    print(text, end="")
    if options.update:
        RECORD.write_text(text)
    sys.exit(1 if count["survives"] else 0)


if __name__ == "__main__":
    main()
