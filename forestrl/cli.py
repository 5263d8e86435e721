"""``forestrl <command> [overrides]`` is ``python -m forestrl.<command> [overrides]``."""

import sys
from importlib import import_module

from forestrl import __version__

COMMANDS = {
    "train": "train a policy with PPO",
    "eval": "measure a policy on fixed arenas",
    "render": "draw an episode",
    "figures": "draw the figures from their result files",
    "bench": "measure frames per second on this machine",
    "collisions": "count collisions with and without the filter",
}


def main() -> None:
    """Hands over to the command named first on the command line, and the rest to Hydra."""
    command = sys.argv[1] if len(sys.argv) > 1 else "no command"
    if command in COMMANDS:
        del sys.argv[1]
        import_module(f"forestrl.{command}").main()
    elif command in ("-h", "--help"):
        print(_help())
    elif command == "--version":
        print(f"forestrl {__version__}")
    else:
        print(f"forestrl: {command}: choose one of {', '.join(COMMANDS)}", file=sys.stderr)
        sys.exit(2)


def _help() -> str:
    commands = "\n".join(f"  {name:<11}{line}" for name, line in COMMANDS.items())
    return (
        "usage: forestrl <command> [overrides]\n\n"
        f"commands:\n{commands}\n\n"
        "Overrides are Hydra's: `forestrl train env.n_trees=75`, `forestrl train -m seed=0,1,2`.\n"
        "`forestrl <command> --help` shows a command's configuration."
    )
