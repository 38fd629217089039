"""For Doxygen: what stands behind several names on one line is said of each of them.

    double x = 0.0, y = 0.0;  ///< m        is read as
    double x = 0.0; /**< m */ double y = 0.0;  ///< m
"""
import re
import sys

TYPE = r"(?:static constexpr |const )?[\w:]+(?:<[^=;]*?>)?"
NAME = r"\w+(?:\s*=\s*[^,;=]+|\{[^;{}]*\})?"
LINE = re.compile(rf"^(\s+)({TYPE}) ({NAME}(?:, {NAME})+);\s+///< (.*)$")


def expand(line):
    found = LINE.match(line)
    if not found:
        return line
    indent, kind, names, words = found.groups()
    words = words.replace("*/", "&lowast;/")
    names = re.findall(NAME, names)
    first = " ".join(f"{kind} {name}; /**< {words} */" for name in names[:-1])
    return f"{indent}{first} {kind} {names[-1]};  ///< {words}"


with open(sys.argv[1], encoding="utf-8") as source:
    for text in source:
        print(expand(text.rstrip("\n")))
