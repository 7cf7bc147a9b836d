#!/usr/bin/env python3
"""Writes the tables of figures in docs/*.md from the data beside this script.

    tables.py                       writes every table between its markers
    tables.py --rows NAME < TABLE   first takes the rows of NAME.json from a Markdown table, as tests/python/conditions.py prints it
    tables.py --plot NAME FILE      draws the numbers of NAME.json as bars (needs matplotlib)

A page has the table of NAME.json between `<!-- figures: NAME -->` and `<!-- end -->`. The data of a table are its machine, date, command, columns
(name, and for numbers unit and digits; "shown" is false of one that the page leaves out) and rows. A cell is text, a number, null for no value, or a
list of numbers, such as scene and nearest.
"""
import argparse
import json
import re
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
MARKERS = re.compile(r"(<!-- figures: ([a-z0-9-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def read(name):
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def cell(value, column):
    if isinstance(value, list):
        return "/".join(cell(part, column) for part in value)
    if value is None:
        return "–"
    return value if isinstance(value, str) else f"{value:.{column['digits']}f}"


def heading(column):
    return column["name"] + (f", {column['unit']}" if column.get("unit") else "")


def table(data):
    shown = lambda cells: [cell for cell, column in zip(cells, data["columns"], strict=True) if column.get("shown", True)]
    columns = shown(data["columns"])
    line = lambda cells: "| " + " | ".join(cells) + " |\n"
    rule = "".join("|---:" if "digits" in column else "|---" for column in columns) + "|\n"
    rows = [line(cell(value, column) for value, column in zip(shown(row), columns)) for row in data["rows"]]
    source = f"*{data['machine']}, {data['date']}:* `{data['command']}`"
    return "\n" + line(map(heading, columns)) + rule + "".join(rows) + "\n" + source + "\n\n"


def number(text):
    text = text.strip()
    return json.loads(text) if re.fullmatch(r"-?\d+(\.\d+)?", text) else text


def rows_of(text):
    """Rows of all Markdown tables of a text, without their heads."""
    lines = [line.strip().strip("|").split("|") for line in text.splitlines() if line.strip().startswith("|")]
    heads = {i - 1 for i, line in enumerate(lines) if set(line[0].strip()) == {"-"}}
    body = [line for i, line in enumerate(lines) if i not in heads and i - 1 not in heads]
    split = lambda part: [number(p) for p in part.split("/")] if "/" in part else number(part)
    return [[line[0].strip(), *map(split, line[1:])] for line in body]


def write_rows(name, rows):
    data = read(name)
    wrong = [row for row in rows if len(row) != len(data["columns"])]
    if wrong or not rows:
        sys.exit(f"{name}: expected rows of {len(data['columns'])} cells, found {wrong[0] if wrong else 'no row'}")
    (FOLDER / f"{name}.json").write_text(text(data | {"rows": rows}), encoding="utf-8")


def text(data):
    """JSON with a column and a row a line."""
    dump = lambda value: json.dumps(value, ensure_ascii=False)
    lists = [f'  "{key}": [\n' + ",\n".join("    " + dump(item) for item in data[key]) + "\n  ]" for key in ("columns", "rows")]
    return "{\n" + ",\n".join([f'  "{key}": {dump(data[key])}' for key in ("machine", "date", "command")] + lists) + "\n}\n"


def length(value):
    """Of a bar; numbers whose digits differ within a column are texts."""
    value = number(value) if isinstance(value, str) else value
    return value if isinstance(value, (int, float)) else 0


def plot(name, file):
    from matplotlib import pyplot

    data = read(name)
    numeric = [i for i, column in enumerate(data["columns"]) if "digits" in column]
    figure, axes = pyplot.subplots(len(numeric), figsize=(8, 2 + 0.3 * len(data["rows"]) * len(numeric)), squeeze=False)
    labels = [" ".join(v for v in row if isinstance(v, str)) for row in data["rows"]]
    for axis, i in zip(axes[:, 0], numeric):
        cells = [row[i] if isinstance(row[i], list) else [row[i]] for row in data["rows"]]
        count = max(map(len, cells))
        for part in range(count):
            values = [length(c[part]) if part < len(c) else 0 for c in cells]
            axis.barh([y + 0.8 * part / count for y in range(len(cells))], values, 0.8 / count)
        axis.set_yticks(range(len(labels)), labels)
        axis.invert_yaxis()
        axis.set_title(heading(data["columns"][i]))
    figure.tight_layout()
    figure.savefig(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", metavar="NAME")
    parser.add_argument("--plot", nargs=2, metavar=("NAME", "FILE"))
    options = parser.parse_args()
    if options.plot:
        return plot(*options.plot)
    if options.rows:
        write_rows(options.rows, rows_of(sys.stdin.read()))
    for page in sorted(FOLDER.parent.glob("*.md")):
        old = page.read_text(encoding="utf-8")
        new = MARKERS.sub(lambda found: found[1] + table(read(found[2])) + found[3], old)
        if new != old:
            page.write_text(new, encoding="utf-8")
            print(page.name)


if __name__ == "__main__":
    main()
