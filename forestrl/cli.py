"""``forestrl <command> [overrides]`` is ``python -m forestrl.<command> [overrides]``."""

import os
import sys
from importlib import import_module

from forestrl import completion
from forestrl.terminal import lasting_output

COMMANDS = {
    "train": "train a policy with PPO",
    "eval": "measure a policy on fixed arenas",
    "render": "draw an episode",
    "show": "write a page that plays an episode",
    "figures": "draw the figures from their result files",
    "bench": "measure frames per second on this machine",
    "collisions": "count collisions with and without the filter",
    "export": "write a world as map files",
    "dashboard": "save a workspace for your runs on Weights & Biases",
    "plan": "tell a robot where to go, by lines of JSON",
}


def main() -> None:
    """Hands over to the command named first on the command line, and the rest to Hydra."""
    with lasting_output():
        _run(sys.argv[1] if len(sys.argv) > 1 else "no command")


def _run(command: str) -> None:
    _find_modules_here()
    if command in COMMANDS:
        del sys.argv[1]
        import_module(f"forestrl.{command}").main()
    elif command in ("-h", "--help"):
        print(_help())
    elif command == "--version":
        from forestrl import __version__  # here, as looking it up takes half the time of --help

        print(f"forestrl {__version__}")
    elif command == "--install-completion":
        print(completion.install())
    elif command == completion.QUERY:
        _complete()
    else:
        print(f"forestrl: {command}: choose one of {', '.join(COMMANDS)}", file=sys.stderr)
        sys.exit(2)


def _find_modules_here() -> None:
    """Lets ``_target_: mine.Reward`` be found in this folder, as with ``python -m``."""
    if not sys.flags.safe_path and os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())


def _complete() -> None:
    """Completes the name of a command, or lets Hydra complete its settings."""
    command = completion.command_on_line()
    if command in COMMANDS:
        import_module(f"forestrl.{command}").main()
    elif command is None:
        print(*COMMANDS)


def _help() -> str:
    commands = "\n".join(f"  {name:<11}{line}" for name, line in COMMANDS.items())
    return (
        "usage: forestrl <command> [overrides]\n\n"
        f"commands:\n{commands}\n\n"
        "Overrides are Hydra's: `forestrl train env.n_trees=75`, `forestrl train -m seed=0,1,2`.\n"
        "`forestrl <command> --help` explains a command's settings,\n"
        "`forestrl --install-completion` lets bash complete them."
    )
