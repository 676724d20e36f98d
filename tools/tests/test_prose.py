"""Words that only this project uses are found in pages, and what is code is not read."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools.prose import main

PAGE = """# Title

One sentence has five words. Another, of Smith et al. 2014,
reads
well, as `worst first` does not.

```
told from
```

| luck | 1 |
|---|---|
| no | 2 |
"""


def test_words_are_named_with_file_and_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "README.md").write_text(PAGE, encoding="utf-8")
    assert main(tmp_path) == 1
    printed = capsys.readouterr().out.splitlines()
    start = printed.index("Words that only this project uses, in pages: 2")
    assert [line.partition(";")[0] for line in printed[start + 1 :]] == [
        "README.md:4: 'reads well'",
        "README.md:11: 'luck'",
    ]
    assert "  12 README.md:3: Another, of Smith et al. 2014, reads well, as `...` does not." in printed


def test_plain_pages_pass_whatever_the_code_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "README.md").write_text("# Title\n\nThis is plain.\n", encoding="utf-8")
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "module.py").write_text('"""Told from luck."""\n', encoding="utf-8")
    assert main(tmp_path) == 0
    assert "src/module.py:1: 'Told from'" in capsys.readouterr().out
