"""A user's FILE.py: loaded once, edited files anew, files beside it, and every failure in one line."""

from __future__ import annotations

import os
import sys

import pytest

from swarmscope.errors import InputFileError
from swarmscope.user_files import load_file


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def refused(path):
    with pytest.raises(InputFileError) as error:
        load_file(path)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_file_is_run_once_and_again_when_it_was_edited(tmp_path):
    counter, path = tmp_path / "count", tmp_path / "mine.py"
    write(path, f"open({str(counter)!r}, 'a').write('x')\nA = 1\n")
    first = load_file(path)
    assert load_file(path) is first and first.A == 1 and counter.read_text() == "x"
    assert sys.modules[first.__name__] is first
    write(path, "A = 22\n")
    assert load_file(path).A == 22 and first.A == 1


def test_files_beside_it_are_its_own(tmp_path):
    for k in (1, 2):
        write(tmp_path / f"{k}/helper.py", f"VALUE = {k}\n")
        write(tmp_path / f"{k}/pack/__init__.py", "")
        write(tmp_path / f"{k}/pack/deep.py", "import helper\nfrom .near import N\nVALUE = helper.VALUE * N\n")
        write(tmp_path / f"{k}/pack/near.py", f"N = {10 * k}\n")
        write(tmp_path / f"{k}/random.py", "raise RuntimeError('the standard library is meant')\n")
        text = "import helper as h\nimport pack.deep, random\nfrom helper import VALUE\n"
        write(tmp_path / f"{k}/mine.py", text + "def late():\n    import helper\n    return helper.VALUE\n")
    one, two = (load_file(tmp_path / f"{k}/mine.py") for k in (1, 2))
    assert (one.VALUE, one.h.VALUE, one.pack.deep.VALUE, one.late()) == (1, 1, 10, 1)
    assert (two.VALUE, two.h.VALUE, two.pack.deep.VALUE, two.late()) == (2, 2, 40, 2)
    assert "helper" not in sys.modules and str(tmp_path) not in " ".join(sys.path)
    assert one.random.random() < 1.0


def test_an_edited_helper_is_run_again_with_all_that_imports_it(tmp_path):
    write(tmp_path / "helper.py", "VALUE = 1\n")
    write(tmp_path / "other.py", "OTHER = 1\n")
    path = write(tmp_path / "mine.py", "import helper, other\nfrom helper import VALUE\n")
    first = load_file(path)
    write(tmp_path / "helper.py", "VALUE = 222\n")
    second = load_file(path)
    assert (first.VALUE, second.VALUE) == (1, 222)
    assert second.other is first.other


def test_names_that_are_no_identifiers_are_fine(tmp_path):
    one, two = write(tmp_path / "my-file.py", "A = 1\n"), write(tmp_path / "my_file.py", "A = 2\n")
    assert (load_file(one).A, load_file(two).A, load_file(one).A) == (1, 2, 1)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = (\n", "is not Python: line 1: '(' was never closed"),
        ("\nimport nothing_like_this\n", "raised ModuleNotFoundError in line 2: No module named 'nothing_like_this'"),
        ("def f():\n    1 / 0\nf()\n", "raised ZeroDivisionError in line 2: division by zero"),
        ("import sys\nsys.exit(3)\n", "raised SystemExit in line 2: 3"),
        ("raise ValueError('two\\nlines')\n", "raised ValueError in line 1: two lines"),
        ("from swarmscope.tasks import Nothing\n", "raised ImportError in line 1: cannot import name 'Nothing'"),
        ("\x00", "is not Python: source code string cannot contain null bytes"),
        ("x = " + "(" * 5000 + "\n", "is not Python"),
    ],
)
def test_a_file_that_does_not_run_is_said_in_a_line(tmp_path, text, said):
    path = write(tmp_path / "mine.py", text)
    assert refused(path).startswith(f"{path}: {said}")
    write(path, "A = 1\n")
    assert load_file(path).A == 1


def test_an_error_in_a_file_beside_it_names_that_file(tmp_path):
    write(tmp_path / "helper.py", "\n\nx = undefined\n")
    path = write(tmp_path / "mine.py", "import helper\n")
    assert refused(path) == f"{tmp_path / 'helper.py'}: raised NameError in line 3: name 'undefined' is not defined"
    write(tmp_path / "helper.py", "x = = 1\n")
    assert refused(path) == f"{tmp_path / 'helper.py'}: is not Python: line 1: invalid syntax"


def test_nothing_but_a_regular_file_is_read(tmp_path):
    assert refused(tmp_path / "none.py") == f"{tmp_path}/none.py: No such file or directory"
    (tmp_path / "folder.py").mkdir()
    assert "is a folder" in refused(tmp_path / "folder.py")
    os.mkfifo(tmp_path / "pipe.py")
    assert "is not a regular file" in refused(tmp_path / "pipe.py")
    (tmp_path / "loop.py").symlink_to("loop.py")
    assert "symbolic links" in refused(tmp_path / "loop.py")
    assert "not called like a Python file" in refused(write(tmp_path / "mine.txt", ""))
    assert "name" in refused(tmp_path / "a\0b.py")
    assert "name too long" in refused(tmp_path / ("x" * 300 + ".py"))
