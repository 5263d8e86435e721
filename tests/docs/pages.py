"""What the pages say: their code blocks, their commands, and playing a page from top to bottom."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"))
)
RUN = "<!-- run -->"
"""The first line of a page that is run from top to bottom, in a folder of its own."""
_BLOCK = re.compile(r"^```(python|yaml|bash)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r"# ([\w/.]+\.(?:py|yaml))\n")
_NOT_RUN = re.compile(r"#.*(minutes|writes to ~)")


class Block(NamedTuple):
    kind: str
    text: str
    file: str | None
    """The file that the block belongs into, which its first line names."""


class Line(NamedTuple):
    words: list[str]
    runs: bool
    """Whether it is quick, by what the comment behind it says."""


def read(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def is_run(page: str) -> bool:
    return read(page).startswith(RUN)


def blocks(page: str) -> list[Block]:
    found = []
    for kind, text in _BLOCK.findall(read(page)):
        name = _FILE.match(text)
        found.append(Block(kind, text[name.end() :] if name else text, name[1] if name else None))
    return found


def lines(block: Block) -> Iterator[Line]:
    """The commands of a shell block, one of ``a && b`` each, without variables set for one."""
    for text in block.text.replace("\\\n", " ").splitlines():
        lexer = shlex.shlex(text, posix=True, punctuation_chars=";&|")
        lexer.whitespace_split = True
        command: list[str] = []
        for word in [*lexer, ";"]:
            if set(word) <= set(";&|"):
                if command:
                    yield Line(command, not _NOT_RUN.search(text))
                command = []
            elif command or not re.match(r"[A-Z_]+=", word):
                command.append(word)


def forestrl_words(words: list[str]) -> list[str] | None:
    """What stands behind ``forestrl``, also behind ``docker run``; None for another program."""
    if words[:2] == ["python", "-m"] and words[2].startswith("forestrl."):
        return [words[2].removeprefix("forestrl."), *words[3:]]
    if words[0] == "forestrl" or words[:2] == ["docker", "run"]:
        return words[words.index("forestrl") + 1 :]
    return None


def forget_modules(folder: Path) -> None:
    """Lets the modules of a page be imported as they now stand."""
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", "")).startswith(str(folder)):
            del sys.modules[name]


def explained_metrics() -> set[str]:
    """The metrics that the page of metrics names, with the levels written out."""
    levels = {"rollout/steps_to_N": (80, 90, 98), "eval/steps_to_N": (80, 95, 98)}
    found = set()
    for name in re.findall(r"^\| `([\w/]+)`", read("docs/metrics.md"), re.MULTILINE):
        found |= {name.replace("N", str(level)) for level in levels.get(name, (0,))}
    return found
