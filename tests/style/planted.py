#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The checkers of text find what they are there for, however it is spelled: each defect is planted alone in a copy of the sources,
and the checker has to fail and to say where. What is good is planted too, and has to pass.

planted.py SOURCE_DIR
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

LAYERING, MODEL, GLOSSARY = "tests/layering/includes.py", "tests/docs/model.py", "tests/docs/glossary.py"
CITATIONS, TYPES, ONE_CLASS = "tests/docs/citations.py", "tests/style/types_once.py", "tests/style/one_class.py"
TRACK = "core/track/orders.cpp"  # of a folder that may include neither core/log nor the daemon
LOG = '"core/log/raw/raw_log.hpp"'
# checker, file, what is put at its end (or in place of what stands before the arrow), what is said; "" where it shall pass
PLANTED = [
    (LAYERING, TRACK, f"#include {LOG}\n", "core/track may not include core/log"),
    (LAYERING, TRACK, "#include <core/log/raw/raw_log.hpp>\n", "core/track may not include core/log"),
    (LAYERING, TRACK, f"/* why */ #include {LOG}\n", "core/track may not include core/log"),
    (LAYERING, TRACK, f"#include /* why */ {LOG}\n", "core/track may not include core/log"),
    (LAYERING, TRACK, f"#incl\\\nude {LOG}\n", "core/track may not include core/log"),
    (LAYERING, TRACK, f"#include \\\n  {LOG}\n", "core/track may not include core/log"),
    (LAYERING, TRACK, f"/* over\nlines */ %:include {LOG}\n", "core/track may not include core/log"),
    (LAYERING, TRACK, f"#define THAT {LOG}\n#include THAT\n", "by name"),
    (LAYERING, TRACK, '#include "/usr/include/core/log/raw_log.hpp"\n', "by name"),
    (LAYERING, TRACK, '#include "rebase.hpp"\n', "by its path from the root"),
    (LAYERING, TRACK, "import core.log;\n", "modules"),
    (LAYERING, TRACK, f"// #include {LOG}\n", ""),
    (LAYERING, TRACK, f"/*\n#include {LOG}\n*/\n", ""),
    (LAYERING, TRACK, 'const char* kText = R"(\n#include "core/log/raw/raw_log.hpp"\n)";\n', ""),
    (LAYERING, TRACK, '#include "core/types/state.hpp"\n', ""),
    (MODEL, "docs/model.md", "→ `core/track/orders.cpp:next`, `core/track/orders.cpp:no_such_thing()`\n", "not only `path:symbol`"),
    (MODEL, "docs/model.md", "→ `core/track/orders.cpp:no_such_thing`\n", "core/track/orders.cpp has no no_such_thing"),
    (MODEL, "docs/model.md", "→ `core/track/orders.cpp:ends`\n", "core/track/orders.cpp has no ends"),  # a word of a comment
    (MODEL, "docs/model.md", "- **9-9 Another** equation\n", "does not begin its line"),
    (CITATIONS, TRACK, "// As row 99 asks.\n", "faults.md has no row 99"),
    (CITATIONS, TRACK, "/* As row\n * 99 asks. */\n", "faults.md has no row 99"),
    (CITATIONS, TRACK, "/* By equation 9-9. */\n", "model.md has no equation 9-9"),
    (CITATIONS, TRACK, "// Equation 9-9.\n", "model.md has no equation 9-9"),
    (CITATIONS, TRACK, '// As docs/model.md section 4, "The\n// loop".\n', "section 4 of model.md has no 'The loop'"),
    (CITATIONS, TRACK, '// As docs/model.md section 4, "Loop", and section 1, "Visible".\n', ""),
    (CITATIONS, "services/package/sbom.py", '"""Against\nrow 99."""\n', "faults.md has no row 99"),
    (TYPES, TRACK, "namespace backwash {\nnamespace track {\nclass Tracker : A {};\n}\n}\n", "backwash::track::Tracker is defined in"),
    (TYPES, TRACK, "namespace backwash::track {\nenum class Request : char { none };\n}\n", "backwash::track::Request is defined in"),
    (TYPES, TRACK, "namespace backwash::track {\nnamespace {\nclass Tracker {};\n}\n}\n", ""),
    (TYPES, TRACK, "namespace backwash::track {\nclass Tracker;\nvoid f() { struct Tracker {}; }\n}\n", ""),
    (ONE_CLASS, TRACK, "namespace backwash::track {\nvoid Tracker::again() {}\n}\n", "backwash::track::Tracker is defined in"),
    (ONE_CLASS, TRACK, "namespace backwash::track {\nTracker::Tracker(int a)\n    : a_(a) {}\n}\n", "backwash::track::Tracker is defined in"),
    (ONE_CLASS, TRACK, "namespace backwash::track {\nvoid again(Tracker& t) { t.Tracker::step(); }\n}\n", ""),
    (GLOSSARY, "README.md", "The GPHX is told by PHXQ. ", ""),
    (GLOSSARY, "README.md + core/README.md", "The PHXQ is told. ", "'PHXQ' is used by 2 documents"),
]


def main() -> int:
    source = pathlib.Path(sys.argv[1]).resolve()
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder)
        tracked = subprocess.run(["git", "-C", source, "ls-files", "-z"], check=True, capture_output=True, text=True).stdout
        for name in tracked.split("\0"):
            if name and (source / name).is_file():
                (copy / name).parent.mkdir(parents=True, exist_ok=True)
                if (source / name).stat().st_size < 1 << 20:  # what is larger is no text
                    shutil.copy(source / name, copy / name)
                else:
                    (copy / name).touch()
        subprocess.run(["git", "init", "-q", copy], check=True)
        subprocess.run(["git", "-C", copy, "add", "-A"], check=True, capture_output=True)

        def told(checker: str) -> tuple[int, str]:
            done = subprocess.run([sys.executable, copy / checker, copy], capture_output=True, text=True)
            return done.returncode, done.stdout + done.stderr

        for checker in (LAYERING, MODEL, CITATIONS, TYPES, ONE_CLASS, GLOSSARY):
            if told(checker)[0]:
                wrong += 1
                print(f"{checker} fails on the copy itself: {told(checker)[1]}")
        for checker, names, text, expected in PLANTED:
            files = [copy / name for name in names.split(" + ")]
            before = [file.read_text() for file in files]
            for file, held in zip(files, before):
                file.write_text(held + "\n" + text)
            code, said = told(checker)
            if (code != 0) != bool(expected) or expected not in said:
                wrong += 1
                print(f"{checker}: {text!r} in {names}: exit {code}, expected '{expected}', said: {said.strip()}")
            for file, held in zip(files, before):
                file.write_text(held)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
