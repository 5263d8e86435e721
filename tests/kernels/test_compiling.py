"""What is compiled is kept, and made anew where anything it calls has changed."""

import os
import shutil
import subprocess
import sys

import pytest

from forestrl.kernels import compiling

MODULES = {
    "__init__": "",
    "kernels/__init__": "",
    "inner": "from small.kernels.compiling import compiled\n\n"
    "@compiled\ndef inner(x):\n    return x + 1\n",
    "middle": "from small.inner import inner\nfrom small.kernels.compiling import compiled\n\n"
    "@compiled\ndef middle(x):\n    return 2 * inner(x)\n",
    "outer": "from small.kernels.compiling import compiled\nfrom small.middle import middle\n\n"
    "@compiled\ndef outer(x):\n    return middle(x) + 100\n",
}
ASK = "from small.outer import outer; print(outer(1), len(outer.stats.cache_hits))"


@pytest.fixture
def package(tmp_path):
    """A package of its own, three modules deep."""
    for name, text in MODULES.items():
        path = tmp_path / f"small/{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    shutil.copy(compiling.__file__, tmp_path / "small/kernels/compiling.py")
    return tmp_path


def asked(package):
    """What the outermost function gives, and how often it was found compiled."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_CACHE")}
    words = [sys.executable, "-c", ASK]
    result = subprocess.run(
        words, cwd=package, capture_output=True, text=True, check=True, env=environment
    )
    return tuple(int(word) for word in result.stdout.split())


def test_compiled_code_is_kept_until_something_that_it_calls_changes(package):
    assert asked(package) == (104, 0)
    assert asked(package) == (104, 1)
    inner = package / "small/inner.py"
    inner.write_text(inner.read_text().replace("x + 1", "x + 21"))
    assert asked(package) == (144, 0)
    assert asked(package) == (144, 1)
