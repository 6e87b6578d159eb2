"""Two sweeps never write to one output, with every kind of file locks and without locks.

Separate processes imitate Windows and a file system without locks. Locks of byte ranges on Windows
become such locks of POSIX, which other processes see in the same way.
"""

import re
import subprocess
import sys
from contextlib import ExitStack, contextmanager

import pytest

from gearchaos.results.files.file_locks import _HOST

from .commands import HANGS, small_config

SYSTEMS = {
    "unix": "",
    "windows": """
import fcntl, os, subprocess, sys, types
def locking(descriptor, how, length):
    at = os.lseek(descriptor, 0, os.SEEK_CUR)
    kinds = {0: fcntl.LOCK_UN, 2: fcntl.LOCK_EX | fcntl.LOCK_NB}
    try:
        posix.lockf(descriptor, kinds[how], length, at)
    except BlockingIOError:
        raise PermissionError(13, "Permission denied") from None
posix = fcntl
sys.modules["msvcrt"] = types.SimpleNamespace(locking=locking, LK_UNLCK=0, LK_NBLCK=2)
sys.modules["fcntl"] = sys.modules["resource"] = None
for name in ("fork", "register_at_fork", "geteuid", "O_NOFOLLOW", "O_NONBLOCK"):
    delattr(os, name)
""",
    "no locks": """
import errno, fcntl, os
def flock(descriptor, how):
    raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))
fcntl.flock = flock
""",
}
HOLD = """
import sys
from pathlib import Path
from gearchaos.errors import FileError
from gearchaos.results.files.block_folder import StoreLock, folder_of
try:
    lock = StoreLock(folder_of("out.h5"), Path("out.h5"), shared=sys.argv[1] == "shared")
except FileError as error:
    print("refused:", error, flush=True)
    sys.exit()
print("locked", flush=True)
for line in sys.stdin:
    print("alone" if lock.alone() else "not alone", flush=True)
lock.release()
"""

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="imitates Windows on Unix")


@contextmanager
def holder(system, kind, folder):
    """Start a process that locks an output; yield it and its first line."""
    command = [sys.executable, "-c", SYSTEMS[system] + HOLD, kind]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=folder, stdin=pipe, stdout=pipe, text=True) as process:
        try:
            yield process, process.stdout.readline()
        finally:
            process.kill()


def alone(process):
    """Ask a holder to take the lock alone, and return whether it has done so."""
    process.stdin.write("\n")
    process.stdin.flush()
    return process.stdout.readline().strip() == "alone"


@pytest.fixture(params=SYSTEMS)
def hold(request, tmp_path):
    """Return a function that starts a holder in this system; it runs until the test ends."""
    with ExitStack() as stack:
        yield lambda kind: stack.enter_context(holder(request.param, kind, tmp_path))


def test_one_process_keeps_all_others_out(hold):
    assert hold("whole")[1] == "locked\n"
    for kind in ("whole", "shared"):
        text = hold(kind)[1]
        assert text.startswith("refused: out.h5: another sweep is writing to it; wait for its end")


def test_shards_share_a_lock_until_one_of_them_is_the_last(hold):
    (first, said), (second, also) = hold("shared"), hold("shared")
    assert said == also == "locked\n"
    assert hold("whole")[1].startswith("refused: ")
    assert not alone(first)
    # The first process still holds its share.
    assert not alone(second)
    second.kill()
    second.wait()
    assert alone(first)
    assert hold("shared")[1].startswith("refused: ")


def test_a_killed_process_leaves_nothing_locked(hold):
    first, _ = hold("whole")
    first.kill()
    first.wait()
    assert hold("whole")[1] == "locked\n"


def test_a_claim_of_another_machine_is_named_with_the_remedy(tmp_path):
    folder = tmp_path / "out.h5.blocks"
    folder.mkdir()
    claim = folder / "lock.alone.elsewhere.1-ab.claim"
    claim.touch()
    (folder / f"lock.alone.{_HOST}.99999999-ab.claim").touch()
    with holder("no locks", "whole", tmp_path) as (_, said):
        assert re.search(
            r"if its process has ended, delete .*lock\.alone\.elsewhere\.1-ab\.claim", said
        )
    claim.unlink()
    with holder("no locks", "whole", tmp_path) as (_, said):
        assert said == "locked\n"


@pytest.mark.parametrize("system", ["windows", "no locks"])
def test_a_sweep_runs_and_leaves_no_folder(system, tmp_path):
    small_config(tmp_path)
    script = SYSTEMS[system] + "import sys; from gearchaos.sweep import main; sys.exit(main())"
    command = [sys.executable, "-c", script, "gears.toml", "--set", "sweep.count=3", "--quiet"]
    for more, printed in (["--dry-run"], "memory: "), ([], "gears.h5\n"):
        run = {"cwd": tmp_path, "capture_output": True, "text": True, "timeout": HANGS}
        done = subprocess.run([*command, *more], **run)
        assert done.returncode == 0 and printed in done.stdout + done.stderr, done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["gears.h5", "gears.toml"]
