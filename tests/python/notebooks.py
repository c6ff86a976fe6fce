# SPDX-License-Identifier: BSD-3-Clause
"""The notebooks run as they stand, each in 90 s of a processor's time; they are kept without outputs, and name no place of a machine.

notebooks.py FOLDER
"""
import pathlib
import re
import resource
import sys

import nbclient
import nbformat

FOLDER = pathlib.Path(sys.argv[1])
MOST_S = 90
texts = {}
for path in sorted(FOLDER.glob("*.ipynb")):
    book = nbformat.read(path, as_version=4)
    nbformat.validate(book)
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in code), f"{path.name} is kept with outputs"
    assert not re.search(r"/(home|root|work|tmp)/", path.read_text()), f"{path.name} names a place of a machine"
    begun = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    nbclient.NotebookClient(book, kernel_name="python3", timeout=10 * MOST_S, resources={"metadata": {"path": str(FOLDER)}}).execute()
    said = "".join(out.get("text", "") for cell in code for out in cell.outputs)
    pictures = sum("image/png" in out.get("data", {}) for cell in code for out in cell.outputs)
    took_s = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - begun
    assert 1 < took_s < MOST_S, f"{path.name}: {took_s:.0f} s"
    print(f"{path.name}: {took_s:.0f} s, {len(book.cells)} cells, {pictures} pictures\n{said}")
    assert not any(out.get("name") == "stderr" and "Error" in out["text"] for cell in code for out in cell.outputs)
    texts[path.stem] = ("\n".join(cell.source for cell in book.cells), len(book.cells), said, pictures)

# The paper's figures by number, and what is printed of them.
text, cells, said, pictures = texts["paper"]
headings = " ".join(re.findall(r"^## (.*?):", text, re.M))
numbers = {int(n) for n in re.findall(r"\d+", headings.replace("Table I", ""))}
assert cells == 20 and numbers == set(range(1, 11)) and "Table I" in headings and pictures >= 7, (cells, headings, pictures)
inside = [tuple(map(int, row)) for row in re.findall(r"(\d+) of (\d+) samples inside", said)]
assert len(inside) == 2 and all(a == b > 100 for a, b in inside) and said.count("touched: False") == 2, said
bounded = re.findall(r"bounded along x, y, z: (\d+) %, (\d+) %, (\d+) %", said)
assert len(bounded) == 5 and all(50 < int(share) <= 100 for row in bounded for share in row), bounded
solved = dict(re.findall(r"^(sets|paper|margin 0\.\d m) +(\d+) ", said, re.M))
assert int(solved["sets"]) > int(solved["margin 0.3 m"]) > int(solved["margin 0.4 m"]) > 0, solved
assert {"payload"} <= set(re.findall(r"\w+", texts["my_room"][2])) and "cause_found" in texts["my_room"][2] and "True" in texts["my_room"][2]
