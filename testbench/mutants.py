#!/usr/bin/env python3
"""Mutants of the VHDL: one error each, seeded over all files, held against the emulator; with --rust, of the emulator.

Of a block that is proved (`hpu check --formal`), a mutant is refuted, or proved to be equivalent in every listed
configuration. A loop is compared with its wiring: a mutant of it is refuted where the wiring differs, and equivalent
where its netlist is the same. Of the others, and where no solver decides, `hpu check` on vectors kills it or it
survives. Of these survivors, those in EQUIVALENT were judged one by one. Mutants that GHDL refuses are drawn again.

With --rust, the errors are in the equations of blocks (functions over any `Word`) in crates/datapath, which are held
against the VHDL as it is. One of each file is built at a time.

On a farm, `--shard I/N -o DIR` does the I-th of N shares of the files (I from 0), and `--gather DIR` merges all shares:
it prints the same bytes as a run without shares. With --rust there are no shares: one build has a mutant of each file.

Usage: testbench/mutants.py [--rust] [--count N] [--seed S] [--jobs J] [--only FILE,FILE] [--update]
       testbench/mutants.py --shard I/N -o DIR [--count N] [--seed S] [--jobs J] [--only FILE,FILE] [--hpu PROGRAM]
       testbench/mutants.py --gather DIR [--update]
Exit codes: 0 every mutant is killed or proved equivalent, 1 some survive, 2 wrong usage, 3 a tool is missing.
"""

import argparse
import hashlib
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
# By hand, and generated; the packages hold constants only.
VHDL = sorted([*HDL.glob("*.vhd"), *HDL.glob("generated/*.vhd")])
FILES = {file.stem: file for file in VHDL if "_pkg" not in file.stem}
RECORDS = ROOT / "testbench" / "record"
DATAPATH = "crates/datapath/src"

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

# The same of equations in Rust.
EQUATIONS = [
    ("operator", r" \+ ", " - "),
    ("operator", r" - ", " + "),
    ("operator", r" \* ", " + "),
    ("operator", r" & ", " | "),
    ("operator", r" \| ", " & "),
    ("relation", r"\.at_least\(", ".above("),
    ("relation", r"\.above\(", ".at_least("),
    ("relation", r"\.equals\(", ".at_least("),
    ("relation", r"\.greater\(", ".lesser("),
    ("relation", r"\.lesser\(", ".greater("),
    ("sign", r"(?<=[( ])-(?=[a-zA-Z(])", ""),
    ("sign", r"(?<=[( ])!(?=[a-z(])", ""),
    ("constant", r"W::int\(0\)", "W::int(1)"),
    ("constant", r"W::int\(1\)", "W::int(2)"),
    ("shift", r"\.shl\(", ".shr("),
    ("shift", r"\.shr\(", ".shl("),
]
# Files of equations that blocks share, and the block by which their mutants are judged.
SHARED = {"step": "zero_order_hold", "history": "window_difference", "words": "phantom_torque", "phase": "trig_cordic"}

# Survivors that are equivalent, by their file and what they put (of a deletion, what they delete), and why.
EQUIVALENT = {
    ("cube_room", "let beyond = self.position.width() - 1;"): "a hint of a proof: where it may begin anew",
    ("energy_bounding", "filled    := (others => '0');"): "the energy to come is set before it is read",
    ("input_shaper", "COEF_INT     => 30,"): "the coefficients' signs fill more bits: the same numbers",
    ("passivity_controller", ":= maximum(maximum(ENERGY_WIDTH, TORQUE_WIDTH + WIDTH), 32) + 2;"):
        "one more bit of sign",
    ("passivity_controller", "for i in TORQUE_WIDTH to WIDE_WIDTH - 3 loop"):
        "what is topped is a demand and a correction, far below these bits",
    ("phantom_engine", ":= maximum(A_WIDTH + B_WIDTH, 32 + TRIG_FRAC + POSITION_FRAC) + 3;"): "one more bit of sign",
    (
        "trig_interpolated",
        "rise      := to_unsigned(RISES(index), TRIG_FRAC - 1) * place(REST_WIDTH - 1 downto 0) + HALF;",
    ): "of four steps or more, no rise is half a unit",
    ("trig_interpolated", "sum := term + sum;"): "a sum",
    ("trig_table", "sine   <= (others => 'X');"): "for counts with unknown bits, which are no number",
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
    """The verdicts of a block's configurations: proved, wired, refuted, open."""
    chosen = [word for variant in variants for word in ("--variant", variant)]
    done = run([hpu, "check", "--formal", block, *chosen, "--hdl", folder, "--json", "-j", "1", "--tool-timeout", "10"])
    if done.returncode == 3:
        sys.exit(done.stderr)
    # An equation that computes what no word holds ends the program.
    if "panicked at" in done.stderr:
        return ["panics"]
    if done.returncode == 4:
        return ["refused" if "ghdl" in done.stderr.lower() else "open"]
    # Refused for its clocks, before a question: as good as refuted. Here "refused" is what GHDL refuses.
    verdicts = [row["verdict"] for row in json.loads(done.stdout)["rows"]]
    return ["refuted" if verdict == "refused" else verdict for verdict in verdicts]


def vectors(hpu, folder, block):
    """Whether the vectors of a block's configurations tell a difference; None where GHDL refuses the VHDL."""
    # Most fall to few rows.
    for rows in ("500", "2000"):
        done = run([hpu, "check", block, "--hdl", folder, "-j", "1", "--rows", rows, "--tool-timeout", "60"])
        said = done.stdout + done.stderr
        if "panicked at" in said:
            return True
        # Words of other widths do not fit together.
        if "ghdl could not analyse" in said or "error during elaboration" in said or done.returncode == 4:
            return None
        if done.returncode == 1:
            return True
    return False


def told(hpu, folder, block, proved):
    """What becomes of a mutant: by the solvers where the block is proved in these configurations, else by vectors."""
    # Of a block whose default no solver decides, vectors are sooner asked.
    if "default" in proved:
        first = formal(hpu, folder, block, ["default"])
        if first == ["refused"]:
            return "refused"
        if first == ["panics"]:
            return "killed"
        if "refuted" in first:
            return "refuted"
        verdicts = formal(hpu, folder, block, proved) if first[0] in ("proved", "wired") else first
        if "refuted" in verdicts:
            return "refuted"
        if set(verdicts) <= {"proved", "wired"}:
            return "equivalent"
    killed = vectors(hpu, folder, block)
    return "refused" if killed is None else "killed" if killed else "survives"


def judged(hpu, block, text, proved):
    """What becomes of a mutant of a block's VHDL."""
    with tempfile.TemporaryDirectory() as folder:
        for stem, file in FILES.items():
            if stem != block:
                os.symlink(file, Path(folder) / file.name)
        (Path(folder) / f"{block}.vhd").write_text(text)
        is_leaf = "entity work." not in text
        if is_leaf and run(["ghdl", "-s", "--std=08", str(Path(folder) / f"{block}.vhd")]).returncode != 0:
            return "refused"
        return told(hpu, folder, block, proved)


def judged_by(before, after):
    """The line by which a survivor is judged."""
    return before if after == "null;" else after


def row_of(block, kind, verdict, text, mutant, begin):
    """A row of the record: the line as it was, and as it is."""
    before = text[text.rfind("\n", 0, begin) + 1 : text.find("\n", begin)].strip()
    at = mutant.rfind("\n", 0, begin) + 1
    after = mutant[at : mutant.find("\n", begin)].strip()
    if verdict == "survives" and (block, judged_by(before, after)) in EQUIVALENT:
        verdict = "judged"
    return block, text.count("\n", 0, begin) + 1, kind, verdict, before, after


def equations(text):
    """Every place to change in the functions of a file that are over any word, as (kind, begin, end, replacement)."""
    found = []
    for head in re.finditer(r"\bfn \w+<[^(]*W: Word(?:(?!;\n).)*?\{\n", text, re.S):
        depth, end = 1, head.end()
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        for kind, pattern, put in EQUATIONS:
            for match in re.finditer(pattern, text[head.end() : end]):
                line = text[text.rfind("\n", 0, head.end() + match.start()) + 1 :].split("\n", 1)[0]
                if "//" not in line and "expect(" not in line:
                    found.append((kind, head.end() + match.start(), head.end() + match.end(), put))
    return sorted(set(found), key=lambda place: place[1:])


def of_equations(options, proved):
    """Rows of mutants of equations. The tree is copied, and one mutant of each file is built at a time."""
    files = {file.stem: file for file in sorted((ROOT / DATAPATH).rglob("*.rs")) if "W: Word" in file.read_text()}
    files = {stem: file for stem, file in files.items() if stem in proved or stem in SHARED}
    if options.only:
        files = {stem: file for stem, file in files.items() if stem in options.only.split(",")}
    texts = {stem: file.read_text() for stem, file in files.items()}
    drawn = {stem: equations(text) for stem, text in texts.items()}
    files = {stem: file for stem, file in files.items() if drawn[stem]}
    for stem, found in drawn.items():
        random.Random(f"{options.seed} {stem}").shuffle(found)
    each = -(-options.count // len(files))
    rows = {stem: [] for stem in files}
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "mutants"
    environment = {**os.environ, "CARGO_TARGET_DIR": str(target)}
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in tracked.splitlines():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
        build = ["cargo", "build", "--locked", "--quiet", "-p", "hpu", "--message-format", "short"]
        own = [stem for stem in files if stem not in SHARED]
        # What blocks share is built alone.
        for turn in [own] * each + [[stem] for stem in files if stem in SHARED for _ in range(2)]:
            sown = {stem: drawn[stem].pop() for stem in turn if drawn[stem]}
            while sown:
                for stem, file in files.items():
                    _, begin, end, new = sown.get(stem, (None, 0, 0, ""))
                    content = texts[stem][:begin] + new + texts[stem][end:]
                    place = tree / file.relative_to(ROOT)
                    if place.read_text() != content:
                        place.write_text(content)
                done = subprocess.run(build, cwd=tree, env=environment, capture_output=True, text=True, check=False)
                refused = {Path(name).stem for name in re.findall(r"^(\S+\.rs):\d+:\d+: error", done.stderr, re.M)}
                if done.returncode == 0:
                    break
                if not refused & set(sown):
                    sys.exit(done.stderr)
                for stem in refused & set(sown):
                    if drawn[stem]:
                        sown[stem] = drawn[stem].pop()
                    else:
                        del sown[stem]

            def verdict(stem):
                kind, begin, end, new = sown[stem]
                block = SHARED.get(stem, stem)
                found = told(str(target / "debug" / "hpu"), str(HDL), block, proved[block])
                mutant = texts[stem][:begin] + new + texts[stem][end:]
                rows[stem].append(row_of(stem, kind, found, texts[stem], mutant, begin))
                if found in ("survives", "refused"):
                    print(rows[stem][-1], file=sys.stderr, flush=True)

            with ThreadPoolExecutor(options.jobs) as pool:
                list(pool.map(verdict, sown))
            print(f"{sum(map(len, rows.values()))} mutants", file=sys.stderr, flush=True)
    return [row for found in rows.values() for row in found]


def of_vhdl(options, hpu, blocks, proved, each):
    """Rows of mutants of VHDL, so many of each block."""
    texts = {block: FILES[block].read_text() for block in blocks}
    # Of each file the same ones, whichever others are asked for.
    drawn = {}
    for block in blocks:
        found = places(texts[block])
        drawn[block] = random.Random(f"{options.seed} {block}").sample(found, len(found))

    def of_block(block):
        rows = []
        for kind, begin, end, new in drawn[block]:
            if len(rows) == each:
                break
            text = texts[block]
            mutant = text[:begin] + new + text[end:]
            verdict = judged(hpu, block, mutant, proved[block])
            if verdict != "refused":
                rows.append(row_of(block, kind, verdict, text, mutant, begin))
        live = [row[5] for row in rows if row[3] == "survives"]
        print(f"{block}: {len(rows)} mutants, {len(live)} live {live}", file=sys.stderr, flush=True)
        return rows

    with ThreadPoolExecutor(options.jobs) as pool:
        return [row for part in pool.map(of_block, blocks) for row in part]


def kept(rows, settings):
    """A share as text: its settings with the SHA-256 of its rows, then a row a line."""
    lines = "".join(json.dumps(row) + "\n" for row in rows)
    return json.dumps({**settings, "sha256": hashlib.sha256(lines.encode()).hexdigest()}) + "\n" + lines


def gathered(folder):
    """Settings and rows of all shares in a folder. Ends the program if one is missing, damaged or set otherwise."""
    files = sorted(Path(folder).glob("mutants-*.jsonl"))
    shares, wrong = {}, []
    for file in files:
        head, _, lines = file.read_text().partition("\n")
        try:
            settings = json.loads(head)
            whole = settings.pop("sha256") == hashlib.sha256(lines.encode()).hexdigest()
            index, of = settings.pop("shard")
        except (ValueError, KeyError, TypeError, AttributeError):
            whole = False
        if not whole:
            wrong.append(f"{file.name}: damaged")
            continue
        if (index, of) in shares or file.name != f"mutants-{index}-of-{of}.jsonl":
            wrong.append(f"{file.name}: a copy of share {index} of {of}")
            continue
        shares[index, of] = settings, [json.loads(line) for line in lines.splitlines()]
    if len({json.dumps(settings) for settings, _ in shares.values()}) > 1 or len({of for _, of in shares}) > 1:
        wrong.append("the shares have different settings, VHDL or programs")
    of = max((of for _, of in shares), default=1)
    wrong += [f"mutants-{index}-of-{of}.jsonl: missing" for index in range(of) if (index, of) not in shares]
    if wrong:
        sys.exit("error: " + "\n".join(wrong))
    # A share has every `of`-th block, so a stable sort by the block is the order of one machine.
    rows = [row for key in sorted(shares) for row in shares[key][1]]
    return shares[0, of][0], sorted(rows, key=lambda row: row[0])


def share(text):
    """Reads I/N."""
    found = re.fullmatch(r"(\d+)/(\d+)", text)
    index, of = (int(found[1]), int(found[2])) if found else (0, 0)
    if index >= of:
        raise argparse.ArgumentTypeError("write I/N with I from 0 to N - 1, as in 0/4")
    return index, of


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rust", action="store_true")
    parser.add_argument("--count", type=int, default=320)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", default="")
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--shard", type=share, metavar="I/N")
    parser.add_argument("-o", dest="out", metavar="DIR")
    parser.add_argument("--gather", metavar="DIR")
    parser.add_argument("--hpu", metavar="PROGRAM", help="this program instead of one that is built")
    options = parser.parse_args()
    if (options.shard is None) != (options.out is None) or (options.rust and (options.shard or options.gather)):
        parser.error("--shard takes -o DIR; neither --shard nor --gather goes with --rust")
    if options.gather:
        settings, rows = gathered(options.gather)
        options.count, options.seed, options.only = (settings[key] for key in ("count", "seed", "only"))
        report(options, rows)
    for tool in ("ghdl", "yosys", "z3", "yices-smt2"):
        if shutil.which(tool) is None:
            print(f"error: {tool} is missing", file=sys.stderr)
            sys.exit(3)
    hpu = options.hpu
    if hpu is None:
        target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
        subprocess.run(["cargo", "build", "--locked", "--release", "--quiet", "-p", "hpu"], cwd=ROOT, check=True)
        hpu = str(target / "release" / "hpu")

    blocks = sorted(FILES)
    if options.only and not options.rust:
        blocks = [block for block in blocks if block in options.only.split(",")]
    each = -(-options.count // len(blocks))
    if options.shard:
        index, of = options.shard
        place = Path(options.out) / f"mutants-{index}-of-{of}.jsonl"
        sources = b"".join(file.read_bytes() for file in [*FILES.values(), Path(__file__), Path(hpu)])
        settings = {key: getattr(options, key) for key in ("count", "seed", "only")}
        settings |= {"sources": hashlib.sha256(sources).hexdigest(), "shard": [index, of]}
        if place.exists() and place.read_text().startswith(json.dumps(settings)[:-1]):
            print(f"{place} is done", file=sys.stderr)
            sys.exit(0)
        blocks = blocks[index::of]
    # What the VHDL as it is is proved to be: configurations by block.
    proved = {block: [] for block in blocks}
    check = [hpu, "check", "--formal", *blocks, "--json", "--tool-timeout", "10"]
    for row in json.loads(run(check).stdout)["rows"] if blocks else []:
        # Wired: its own file is decided, whatever the blocks inside are.
        if row["verdict"] in ("proved", "wired"):
            proved[row["block"]].append(row["variant"])
    rows = of_equations(options, proved) if options.rust else of_vhdl(options, hpu, blocks, proved, each)
    if options.shard:
        # The file appears whole.
        place.parent.mkdir(parents=True, exist_ok=True)
        aside = place.with_name(f".{place.name}.{os.getpid()}.tmp")
        aside.write_text(kept(rows, settings))
        os.replace(aside, place)
        sys.exit(0)
    report(options, rows)


def report(options, rows):
    """Prints the record, and ends the program."""
    verdicts = ("refuted", "equivalent", "killed", "judged", "survives")
    count = {verdict: sum(row[3] == verdict for row in rows) for verdict in verdicts}
    only = f" --only {options.only}" if options.only else ""
    rust, end = (" --rust", "rs") if options.rust else ("", "vhd")
    text = f"# testbench/mutants.py{rust} --count {options.count} --seed {options.seed}{only}\n"
    counts = ", ".join(f"{n} {what}" for what, n in count.items())
    text += f"# {len(rows)} mutants of {len({row[0] for row in rows})} files: {counts}\n"
    text += "# refuted: by a solver or the wiring; equivalent: proved in every configuration; "
    text += "killed: by vectors; judged: see the reason\n"
    for block, line, kind, verdict, before, after in rows:
        text += f"{block}.{end}:{line:<5} {kind:<10} {verdict:<10}\n"
        if verdict in ("survives", "equivalent", "judged"):
            text += f"    - {before}\n    + {after}\n"
        if verdict == "judged":
            text += f"    {EQUIVALENT[block, judged_by(before, after)]}\n"
    print(text, end="")
    if options.update:
        (RECORDS / ("mutants-rust.txt" if options.rust else "mutants.txt")).write_text(text)
    sys.exit(1 if count["survives"] else 0)


if __name__ == "__main__":
    main()
