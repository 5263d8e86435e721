"""Completion in bash: of commands here, of their settings by Hydra."""

from __future__ import annotations

import os
from pathlib import Path

QUERY = "-sc"
"""Hydra's flag for a question about the line in ``COMP_LINE``."""

_SCRIPT = """\
_forestrl() {
    local line="${COMP_LINE:0:COMP_POINT}"
    local word="${line##* }"
    local found="$(COMP_LINE="$line" forestrl -sc query=bash 2> /dev/null)"
    COMPREPLY=($(compgen -W "$found" -- "$word"))
    if [[ $word == *=* ]]; then  # to bash, a word begins behind the sign
        COMPREPLY=("${COMPREPLY[@]#"${word%=*}="}")
    fi
}
complete -o nospace -o default -F _forestrl forestrl
"""


def install() -> str:
    """Writes the script for bash and lets ``~/.bashrc`` read it; returns what to say."""
    script = Path.home() / ".local/share/forestrl/completion.bash"
    script.parent.mkdir(parents=True, exist_ok=True)
    script.write_text(_SCRIPT)
    startup, line = Path.home() / ".bashrc", f"source {script}\n"
    before = startup.read_text() if startup.exists() else ""
    if line not in before:
        startup.write_text(before + line)
    return f"{startup} now reads {script}: it holds from the next bash on"


def command_on_line() -> str | None:
    """Takes the command out of the line to be completed, as Hydra knows of none.

    Returns:
        the command; None while it is still being typed.
    """
    _, _, rest = os.environ.get("COMP_LINE", "").partition(" ")
    command, ended, settings = rest.lstrip().partition(" ")
    if not ended:
        return None
    os.environ["COMP_LINE"] = f"forestrl {settings}"
    return command
