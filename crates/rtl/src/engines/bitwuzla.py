"""Bitwuzla on a file of SMT-LIB, by its library for Python: prints what the program of that name prints."""

import site
import sys

# An isolated Python leaves out the packages that are installed for the user alone. They are the user's own, too.
if sys.prefix == sys.base_prefix:
    sys.path.append(site.getusersitepackages())

import bitwuzla

if sys.argv[1:] == ["--version"]:
    print(bitwuzla.version())
else:
    options = bitwuzla.Options()
    options.set(bitwuzla.Option.PRODUCE_MODELS, True)
    try:
        bitwuzla.Parser(bitwuzla.TermManager(), options).parse(sys.argv[1])
    except bitwuzla.BitwuzlaException as error:
        sys.exit(f"error: {error}")
