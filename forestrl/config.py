"""Where the configuration lives: ``conf/`` beside a checkout, ``forestrl/conf/`` inside a wheel."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
CONF_DIR = str(next(p for p in (_PACKAGE / "conf", _PACKAGE.parent / "conf") if p.is_dir()))
