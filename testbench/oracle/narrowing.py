"""narrowing.py NARROW [SEED [FORMATS]]: holds the rounding and overflow of hpu's words against APyTypes.

NARROW is the example `narrow` of crates/signal. First every word of up to 6 bits into every narrower format, in every
rounding and overflow that hpu has; then random operations (cast, add, multiply) on random formats of 1 to 64 bits,
signed and unsigned, in all of these modes: in FORMATS [40] of them for each mode and operation.
An exact value has up to 127 bits and a sign.
APyTypes has no unsigned words: an unsigned operand gets one more bit; a result that wraps into an unsigned word is the
bit pattern of the signed one; one that saturates there is rounded by APyTypes and clamped here, and counted apart.
Every exact value is given more than 64 bits before it is narrowed: within 64, APyTypes 0.5.1 loses what its own steps
carry out of them (2^63 - 1 to the nearest multiple of 16; 420829617312/2^22 saturated into 40 bits with 55 of
fraction). Prints the first operation that differs, and counts. Exit codes: 0 all agree, 1 one differs.
"""

import itertools
import random
import subprocess
import sys
from collections import Counter

from apytypes import APyFixedArray, OverflowMode, QuantizationMode

ROUNDINGS = {
    "Truncate": QuantizationMode.TO_NEG,
    "TowardZero": QuantizationMode.TO_ZERO,
    "NearestUp": QuantizationMode.TIES_POS,
    "NearestDown": QuantizationMode.TIES_NEG,
    "NearestAway": QuantizationMode.TIES_AWAY,
    "NearestInward": QuantizationMode.TIES_ZERO,
    "NearestEven": QuantizationMode.TIES_EVEN,
    "NearestOdd": QuantizationMode.TIES_ODD,
}
OVERFLOWS = {"Wrap": OverflowMode.WRAP, "Saturate": OverflowMode.SAT}
OPERATIONS = ("cast", "add", "multiply")
ROWS = 256  # operations a group
WIDEST = (1, 0, 63), (1, -1, 64), (1, 63, 0)  # a product of 128 bits of which 127 are dropped


def width(word):
    return sum(word)


def low_high(word):
    """The least and the greatest integer of a format (S,I,F), in units of its least significant bit."""
    sign, bits = word[0], width(word)
    return (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if sign else (0, (1 << bits) - 1)


def random_format(random):
    sign = random.randrange(2)
    bits = random.choice((random.randint(1 + sign, 12), random.randint(1 + sign, 64)))
    near = random.choice((8, 8, 40, 63))
    frac = random.randint(max(-near, bits - sign - 64), min(near, bits - sign + 63))
    return sign, bits - sign - frac, frac


def exact_range(operation, a, b):
    """Fraction bits of an operation's exact value, and the ends of its range."""
    ends = low_high(a), low_high(b)
    if operation == "cast":
        return a[2], *ends[0]
    if operation == "multiply":
        products = [x * y for x in ends[0] for y in ends[1]]
        return a[2] + b[2], min(products), max(products)
    frac = max(a[2], b[2])
    return frac, *(sum(end << frac - word[2] for end, word in zip(pair, (a, b))) for pair in zip(*ends))


def formats(random, operation):
    """Operands and result of an operation whose exact value, and whose value in the result's units, hpu holds."""
    while True:
        a, b, to = (random_format(random) for _ in range(3))
        frac, low, high = exact_range(operation, a, b)
        if random.random() < 0.5:
            # Few bits to drop, so that ties are met.
            near = frac - random.randint(-2, 8)
            if max(abs(near), abs(width(to) - to[0] - near)) < 64:
                to = to[0], width(to) - to[0] - near, near
        added = max(0, to[2] - frac)
        if -(1 << 127) < low << added and high << added < 1 << 127:
            return a, b, to


def operands(random, word):
    """A group's words: ends and zeros now and then, of the widest words always, and words with zeros below. So
    overflows and ties are met."""
    bits, (low, high) = width(word), low_high(word)
    ends = low, high, 0, min(1, high), max(-1, low)
    share = 1 if word in WIDEST else 0.1
    for _ in range(ROWS):
        if random.random() < share:
            yield ends[int(random.random() * len(ends))]
        else:
            keep = int(random.random() * bits) if random.random() < 0.5 else 0
            yield low + random.getrandbits(bits) >> keep << keep


def signed(patterns, bits):
    return [p - (1 << bits) if p >> (bits - 1) else p for p in patterns]


def array(values, word):
    """Values as APyTypes' words, an unsigned one with a sign bit in front."""
    bits = width(word) + 1 - word[0]
    return APyFixedArray([value % (1 << bits) for value in values], bits=bits, frac_bits=word[2])


def expected(operation, a, b, to, rounding, overflow, rows):
    """What APyTypes says of each row: the value, whether bits are lost below and above, whether it is a tie."""
    x, y = array([row[0] for row in rows], a), array([row[1] for row in rows], b)
    exact = {"cast": lambda: x, "add": lambda: x + y, "multiply": lambda: x * y}[operation]()
    values = signed(exact.to_bits(), exact.bits)
    drop = exact.frac_bits - to[2]
    # With room for every value, in more than 64 bits.
    bits = max(exact.bits, 64) + max(-drop, 0) + 2
    exact = exact.cast(bits=bits, frac_bits=exact.frac_bits)
    wide = signed(exact.cast(bits=bits, frac_bits=to[2], quantization=ROUNDINGS[rounding]).to_bits(), bits)
    size, (low, high) = width(to), low_high(to)
    if to[0] or overflow == "Wrap":
        word = exact.cast(bits=size, frac_bits=to[2], quantization=ROUNDINGS[rounding], overflow=OVERFLOWS[overflow])
        words = signed(word.to_bits(), size) if to[0] else word.to_bits()
    else:
        words = [min(max(value, low), high) for value in wide]
    rest = [value % (1 << drop) if drop > 0 else 0 for value in values]
    tie = 1 << drop - 1 if drop > 0 else -1
    return [
        (word, int(rest != 0), int(not low <= value <= high), rest == tie)
        for word, rest, value in zip(words, rest, wide)
    ]


def narrower(rounding, overflow):
    """A cast of every word of each format of up to 6 bits into each that has no more bits on either side."""
    frac = 3
    for sign, bits in itertools.product((0, 1), range(1, 7)):
        a = sign, bits - sign - frac, frac
        low, high = low_high(a)
        for to_sign, to_frac, to_int in itertools.product((0, 1), range(frac - 6, frac + 1), range(-6, a[1] + 1)):
            if to_sign + to_frac + to_int >= 1:
                rows = [(word, 0) for word in range(low, high + 1)]
                yield "cast", a, (0, 1, 0), (to_sign, to_int, to_frac), rounding, overflow, rows


def answered(narrow, groups):
    """What hpu answers to each row of the groups."""
    text = []
    for operation, a, b, to, rounding, overflow, rows in groups:
        words = ("({},{},{})".format(*word) for word in (a, b, to))
        text.append(" ".join((operation, *words, rounding, overflow)))
        text.extend(f"{x} {y}" for x, y in rows)
        text.append("")
    run = subprocess.run([narrow], input="\n".join(text), capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f"error: {narrow}: {run.stderr.strip()}")
    return run.stdout.splitlines()


def main(narrow, seed=1, formats_each=40):
    source = random.Random(int(seed))
    counts = Counter()
    # What differs at the beginning is told before the rest is made.
    for operation, rounding, overflow in itertools.product(("narrow", *OPERATIONS), ROUNDINGS, OVERFLOWS):
        groups = list(narrower(rounding, overflow)) if operation == "narrow" else []
        for group in range(int(formats_each) if operation != "narrow" else 0):
            widest = operation == "multiply" and group == 0
            a, b, to = WIDEST if widest else formats(source, operation)
            rows = list(zip(operands(source, a), operands(source, b), strict=True))
            groups.append((operation, a, b, to, rounding, overflow, rows))
        answers = iter(answered(narrow, groups))
        for made, a, b, to, _, _, rows in groups:
            for row, told in zip(rows, expected(made, a, b, to, rounding, overflow, rows), strict=True):
                answer = tuple(map(int, next(answers).split()))
                *told, tie = told
                if answer != tuple(told):
                    print(f"{operation} a={row[0]} {a} b={row[1]} {b} to {to} {rounding} {overflow}:")
                    print(f"  hpu {answer}, APyTypes {tuple(told)} (value, lost below, lost above)")
                    return 1
                counts["rounded"] += told[1]
                counts["overflowed"] += told[2]
                counts["ties"] += tie
            counts[operation] += len(rows)
            counts["products beyond 64 bits"] += len(rows) * (operation == "multiply" and width(a) + width(b) > 64)
            counts["clamped here"] += len(rows) * (not to[0] and overflow == "Saturate")
        assert next(answers, None) is None, "more answers than operations"
    known = ("narrow", *OPERATIONS)
    operations = [f"{counts[operation]} {operation}" for operation in known]
    others = [f"{count} {what}" for what, count in counts.items() if what not in known]
    total = sum(counts[operation] for operation in known)
    print(f"{total} operations agree with APyTypes ({', '.join(operations)}):\n  {', '.join(others)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
