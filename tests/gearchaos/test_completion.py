"""The tab key completes commands, options, choices and files, in a real shell."""

import shutil
import subprocess

import pytest

from gearchaos.__main__ import COMMANDS, main

SWEEP_OPTIONS = {"--resume", "--dry-run", "--set", "--output", "--threads", "--shard"}


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    """Return a function that lists the completions of bash in a folder with two files."""
    if shutil.which("bash") is None:
        pytest.skip("there is no bash")
    folder = tmp_path_factory.mktemp("completion")
    for name in ("pair.toml", "pair.h5"):
        (folder / name).touch()

    def offered(script: str, *words: str) -> set[str]:
        typed = " ".join(f"'{word}'" for word in ("gearchaos", *words))
        asked = f"COMP_WORDS=({typed}); COMP_CWORD={len(words)}; _shtab_gearchaos"
        lines = [script, asked, 'printf "%s\\n" "${COMPREPLY[@]}"']
        done = subprocess.run(
            ["bash", "-c", "\n".join(lines)],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        return set(done.stdout.split())

    return offered


def test_bash_completes_commands_options_choices_and_files(complete, capsys):
    assert main(["completion", "bash"]) == 0
    script = capsys.readouterr().out
    assert complete(script, "") >= set(COMMANDS)
    assert complete(script, "s") == {"schema", "shares", "stages", "sweep"}
    assert complete(script, "sweep", "--") >= SWEEP_OPTIONS
    assert complete(script, "plot", "pair.h5", "--units", "p") == {"physical"}
    assert complete(script, "sweep", "pair.t") == {"pair.toml"}
    assert not complete(script, "plot", "--variable", "")


def test_zsh_gets_a_script_of_its_own_and_other_shells_are_refused(capsys):
    assert main(["completion", "zsh"]) == 0
    script = capsys.readouterr().out
    assert script.startswith("#compdef gearchaos")
    assert all(f"{name}:" in script for name in COMMANDS)
    assert main(["completion", "fish"]) == 2
    assert "bash" in capsys.readouterr().err
