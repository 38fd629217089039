"""Pages of the site that are made from what the program reads and prints: the keys of a study and of JSON from their
schemas, the Python package from its signatures and docstrings."""

import ast
import json

SCHEMA, PACKAGE = "data/study.schema.json", "python/tiltrim/__init__.py"
PRINTED = "data/output.schema.json"


def kinds_of(value):
    """What a key may be: its alternatives, each of one type."""
    return [kind for way in value["anyOf"] for kind in kinds_of(way)] if "anyOf" in value else [value]


def in_words(value):
    """The values of a key: "number, -90 to 90; `"free"`"."""
    words = []
    for kind in kinds_of(value):
        if "enum" in kind:
            words.append(", ".join(f'`"{choice}"`' for choice in kind["enum"]))
        elif kind.get("type") == "array" and kind["items"].get("type") != "object":
            size = f"{kind['minItems']}" if kind.get("maxItems") == kind["minItems"] else f"{kind['minItems']} or more"
            words.append(f"list of {size}: {in_words(kind['items'])}")
        elif kind.get("type") in ("number", "integer"):
            ends = [f"{kind[end]:.16g}" for end in ("minimum", "maximum") if end in kind]
            words.append(f"{kind['type']}, {' to '.join(ends)}" if len(ends) == 2 else kind["type"])
        elif kind.get("type") not in ("object", "array"):
            words.append("text")
    return "; ".join(words)


def unit_of(value):
    units = {kind.get("description") or kind.get("items", {}).get("description", "") for kind in kinds_of(value)}
    return ", ".join(sorted(units - {""}))


def tables_of(table, path):
    """(title, keys) of a table of a study and of those in it."""
    keys = {name: value for name, value in table["properties"].items()}
    yield path, keys
    for name, value in keys.items():
        for kind in kinds_of(value):
            inner = kind.get("items", {}) if kind.get("type") == "array" else kind
            if "properties" in inner:
                yield from tables_of(inner, f"{path}.{name}".lstrip("."))


def study_keys(root):
    """The page of the keys, of the tiltrotor's studies and of those with [model]."""
    schema = json.loads((root / SCHEMA).read_text(encoding="utf-8"))
    lines = ["# Keys of a study", "", "Types, ranges and choices as the program checks them, made from its schema. The",
             "[study file](../study.md) explains each key."]  # fmt: skip
    for title, family in (("the tiltrotor", "else"), ("[model]", "then")):
        lines += ["", f"## Studies of {title}" if family == "else" else f"## Studies with {title}"]
        for path, keys in tables_of(schema[family], ""):
            lines += ["", f"### {path or 'top level'}", "", "| key | values | unit |", "|---|---|---|"]
            lines += [f"| `{name}` | {in_words(value) or 'table'} | {unit_of(value)} |" for name, value in keys.items()]
    return "\n".join(lines) + "\n"


def printed_keys(schema, path=""):
    """(path, types) of every key of a command's JSON; [] is an element of a list, <name> a name of the study or model."""
    for name, value in schema.get("properties", {}).items():
        yield from printed_value(value, f"{path}.{name}".lstrip("."))
    if "additionalProperties" in schema:
        yield from printed_value(schema["additionalProperties"], f"{path}.<name>".lstrip("."))


def printed_value(value, path):
    types = [value["type"]] if isinstance(value["type"], str) else value["type"]
    while "items" in value and not {"object", "string"} & set(types):
        value = value["items"]
        path += "[]"
        types = [value["type"]] if isinstance(value["type"], str) else value["type"]
    yield path, types
    yield from printed_keys(value, path)
    if "object" in value.get("items", {}).get("type", ""):
        yield from printed_keys(value["items"], f"{path}[]")


def json_keys(root):
    """The page of the JSON that the commands print."""
    schema = json.loads((root / PRINTED).read_text(encoding="utf-8"))
    lines = ["# Keys of JSON", "", "What each command prints with `--format json`, key by key, made from a schema that a test",
             "compares with the output of every shipped study. `[]` stands for each element of a list, `<name>` for the name",
             "of a signal, a parameter or a key of the study. [The commands](../cli.md) have examples and the meaning of the",
             "keys. Later versions may add keys."]  # fmt: skip
    for command, printed in schema["definitions"].items():
        lines += ["", f"## {command}", "", "| key | type |", "|---|---|"]
        lines += [f"| `{path}` | {', '.join(types)} |" for path, types in printed_keys(printed)]
    return "\n".join(lines) + "\n"


def definitions(root):
    """The classes and functions of the package by name; the stub has those of the extension."""
    found = {}
    for file in sorted((root / PACKAGE).parent.glob("_*.py*")):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                found.setdefault(node.name, node)
    return found


def signature(node):
    """As in the source, one parameter a line if it is long."""
    returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    text = f"{node.name}({ast.unparse(node.args)}){returns}"
    if len(text) < 100:
        return text
    return broken(text)


def broken(text):
    """Breaks at the commas of the outermost parentheses."""
    depth, lines = 0, [""]
    for c in text:
        depth += (c in "([{") - (c in ")]}")
        if c == ")" and depth == 0:
            lines.append("")
        lines[-1] += c
        if (c == "," and depth == 1) or (c == "(" and depth == 1):
            lines.append("")
    return "\n".join(("    " if 0 < i < len(lines) - 1 else "") + line.strip() for i, line in enumerate(lines))


def entry(node):
    """A heading, the signature, the docstring; of a class its fields and methods too."""
    lines = ["", f"## {node.name}", ""]
    if isinstance(node, ast.FunctionDef):
        lines += ["```text", signature(node), "```", ""]
    if text := ast.get_docstring(node):
        lines += ["```text", text, "```"]
    if isinstance(node, ast.ClassDef):
        lines += [""]
        for part in node.body:
            if isinstance(part, ast.AnnAssign) and not part.target.id.startswith("_"):
                lines += [f"- `{part.target.id}: {ast.unparse(part.annotation)}`"]
            if isinstance(part, ast.FunctionDef) and not part.name.startswith("_"):
                about = (ast.get_docstring(part) or "").split("\n\n")[0].replace("\n", " ")
                given = "property" in [ast.unparse(d) for d in part.decorator_list]
                shown = part.name if given else f"{part.name}({ast.unparse(part.args)})".replace("self, ", "", 1)
                lines += [f"- `{shown.replace('(self)', '()')}`" + (f": {about}" if about else "")]
    return lines


def python_names(root):
    """The public names: __all__ of the package."""
    body = ast.parse((root / PACKAGE).read_text(encoding="utf-8")).body
    (names,) = [n.value for n in body if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == "__all__"]
    return ast.literal_eval(names)


def python_api(root):
    """The page of the package: its public names, from __all__."""
    known = definitions(root)
    lines = ["# Python: all names", "", "Signatures and docstrings of the package. [Python](../python.md) shows how they are",
             "used."]  # fmt: skip
    for name in sorted(python_names(root), key=str.lower):
        lines += entry(known[name])
    return "\n".join(lines) + "\n"


#: source in the repository: (page of the site, its text)
PAGES = {SCHEMA: ("reference/study-keys.md", study_keys), PRINTED: ("reference/json-keys.md", json_keys),
         PACKAGE: ("reference/python-names.md", python_api)}  # fmt: skip
