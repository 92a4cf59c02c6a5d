"""The README's lines print a range with its σ. Runs by itself too, where there is nothing but the package."""

import math
import pathlib
import re
import subprocess
import sys

README = pathlib.Path(__file__).resolve().parents[1] / "README.md"


def test_the_lines_of_the_readme_print_a_range_with_its_sigma():
    lines = re.search(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)[1]
    assert len(lines.splitlines()) <= 10
    done = subprocess.run([sys.executable, "-c", lines], capture_output=True, text=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    found, std = map(float, re.fullmatch(r"([\d.]+) ± ([\d.]+) m\n", done.stdout).groups())
    by_hand = 0.40 / math.tan(math.radians(12) + math.atan(80 / 365))
    assert abs(found - by_hand) < 6e-4 and 0.0 < std < 0.1
    print(f"the README's lines say: {done.stdout.strip()}")


if __name__ == "__main__":
    test_the_lines_of_the_readme_print_a_range_with_its_sigma()
