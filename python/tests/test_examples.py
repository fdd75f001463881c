"""Scripts of the guide."""

import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parent.parent
CHAPTER = ROOT.parent / "docs" / "src" / "python.md"


def test_the_first_chapter_runs(tmp_path):
    pytest.importorskip("skfem")
    pytest.importorskip("pyvista")
    script = ROOT / "examples" / "cooled_block.py"
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "20.0 to 40" in done.stdout and not done.stderr
    assert (tmp_path / "cooled_block.png").stat().st_size > 10_000
    assert (tmp_path / "cooled_block.vtu").stat().st_size > 1_000_000


def test_the_guide_shows_the_script():
    script = (ROOT / "examples" / "cooled_block.py").read_text()
    assert f"```python\n{script}```" in CHAPTER.read_text()
