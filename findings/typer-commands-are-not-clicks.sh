#!/bin/sh
# One would expect typer.main.get_command to return a command of click, which a click group runs and whose errors it reports like its own.
# typer 0.29.2 carries a click of its own: the group runs such a command, but a wrong argument raises an exception that is none of click's.
# It hurts programs that put typer commands under a click group: a typing error of a user ends in a traceback and status 1, not in a usage line and 2.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check typer==0.29.2 click==8.5.1
cat >"$folder/mixed.py" <<'PY'
import click
import typer
from click.testing import CliRunner

app = typer.Typer()


@app.command()
def walk(steps: int) -> None:
    print(steps)


@click.command()
@click.argument("steps", type=int)
def stroll(steps: int) -> None:
    print(steps)


group = click.Group("group")
group.add_command(typer.main.get_command(app), "walk")
group.add_command(stroll)
for name, word in (("stroll", "3"), ("walk", "3"), ("stroll", "three"), ("walk", "three")):
    result = CliRunner().invoke(group, [name, word])
    print(name, word, result.exit_code, end="; ")
print(issubclass(typer.BadParameter, click.ClickException))
PY
found=$("$folder/env/bin/python" "$folder/mixed.py")
echo "typer 0.29.2 in a group of click 8.5.1: command, word, exit status: $found (typer's error is one of click's)"
[ "$found" = "stroll 3 0; walk 3 0; stroll three 2; walk three 1; False" ] || { echo "this has changed"; exit 1; }
