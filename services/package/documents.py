#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A program's man page and bash completion, made of what its --help says and of nothing else.

documents.py PAGE OUT_DIR [EMULATOR …] PROGRAM     PAGE: NAME.SECTION; writes OUT_DIR/PAGE.gz and OUT_DIR/NAME
"""
import gzip
import pathlib
import re
import subprocess
import sys

SEE_ALSO = {"backwash": "backwashd(8), backwashctl(1)", "backwashctl": "backwashd(8)", "backwashd": "backwashctl(1), backwash(1)",
            "backwash-bench": "backwashd(8), backwash(1)"}


def help_of(program: list[str], name: str, *verb: str) -> str:
    """What --help prints, without what is the machine's: the program's path, and the user and host of a default."""
    text = subprocess.run([*program, *verb, "--help"], capture_output=True, text=True, check=True).stdout
    return re.sub(r"=\S+@\S+", "=USER@HOST ", text.replace(program[-1], name))


def verbs_of(text: str) -> list[str]:
    part = re.search(r"^Subcommands:\n((?:  .*\n)+)", text, re.M)
    return re.findall(r"^  (\w[\w-]*)", part[1], re.M) if part else []


def options_of(text: str) -> list[str]:
    return sorted(set(re.findall(r"^  (?:-\w,)?(--[\w-]+)", text, re.M)))


def roff(text: str) -> str:
    """As it stands, line by line; a line may begin with what roff takes for a request."""
    escaped = text.strip("\n").replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq")
    return re.sub(r"^\.", "\\\\&.", escaped, flags=re.M)


def page(name: str, section: str, texts: dict[str, str]) -> str:
    first = texts[""].lstrip().splitlines()[0]
    about = roff(first.removeprefix(f"{name}: ").rstrip("."))
    out = [f".TH {name.upper()} {section} \"\" backwash", ".SH NAME", f"{roff(name)} \\- {about}"]
    for verb, text in texts.items():
        out += [f".SH {roff(verb.upper())}" if verb else ".SH SYNOPSIS AND OPTIONS", ".nf", roff(text), ".fi"]
    out += [".SH SEE ALSO", roff(SEE_ALSO[name]), ".PP",
            "/usr/share/doc/backwash: the interfaces (every option, file, topic and exit code), the faults, the model."]
    return "\n".join(out) + "\n"


def completion(name: str, texts: dict[str, str]) -> str:
    function = "_" + name.replace("-", "_")
    cases = "".join(f"    {verb.split()[-1]}) words='{' '.join([*verbs_of(text), *options_of(text)])}' ;;\n"
                    for verb, text in texts.items() if verb)
    first = " ".join([*(v for v in texts if v and " " not in v), *options_of(texts[""])])
    return f"""# bash completion of {name}: verbs and options; values that are files
{function}() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} words='{first}' verb
  for verb in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case $verb in
{cases}    *) ;;
    esac
  done
  COMPREPLY=($(compgen -W "$words" -- "$word"))
  [[ ${{#COMPREPLY[@]}} -gt 0 || $word == -* ]] || COMPREPLY=($(compgen -f -- "$word"))
}}
complete -o filenames -F {function} {name}
"""


def main() -> int:
    if len(sys.argv) < 4:
        print(__doc__, file=sys.stderr)
        return 64
    (name, section), out, program = sys.argv[1].rsplit(".", 1), pathlib.Path(sys.argv[2]), sys.argv[3:]
    texts = {"": help_of(program, name)}
    for verb in verbs_of(texts[""]):
        texts[verb] = help_of(program, name, verb)
        texts |= {f"{verb} {inner}": help_of(program, name, verb, inner) for inner in verbs_of(texts[verb])}
    (out / f"{sys.argv[1]}.gz").write_bytes(gzip.compress(page(name, section, texts).encode(), 9, mtime=0))
    (out / name).write_text(completion(name, texts))
    return 0


if __name__ == "__main__":
    sys.exit(main())
