# SPDX-License-Identifier: MIT
"""Mutated inputs on every way into the host (`make fuzz-host`): every run goes on where the last one stopped.

In: the targets of `targets.py`, tests/hostile_inputs.jsonl (inputs that once were faults), the log in out/fuzz. Out: the log with one more line;
executions so far by target. Exit status 1 when a target raises what it may not, takes longer than `LONGEST_S` or more than `MOST_MEMORY`; the
input is then added to tests/hostile_inputs.jsonl. Owns both files.
"""

from __future__ import annotations

import contextlib
import random
import resource
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from functools import cache
from types import FrameType

from echostep.errors import EchostepError
from places import OUT, ROOT
from reliability.campaign import CampaignJournal, Figure, none, options, report
from reliability.fuzz.targets import ALLOWED, TARGETS

KEPT = ROOT / "tests/hostile_inputs.jsonl"
LOG = OUT / "fuzz/host.jsonl"
LONGEST_S = 10.0  # of one input, on a busy machine
MOST_MEMORY = 2_000_000  # kB, of the whole process
SHARD_S = 1.0  # of one target, then the next has its turn
SPECIAL = (b"\0", b"\xff", b"\x80", *b'- 1e308 nan inf 99999999999999999999 [ { " ,'.split(), b"\n")


class TooSlowError(Exception):
    """An input took longer than `LONGEST_S`."""


def mutate(seed: bytes, rng: random.Random) -> bytes:
    """Flip, replace, delete, repeat and insert, one to eight times; sometimes cut."""
    data = bytearray(seed)
    for _ in range(1 << rng.randrange(4)):
        at, length = rng.randrange(len(data) + 1), 1 << rng.randrange(6)
        match rng.randrange(6):
            case 0 if at < len(data):
                data[at] ^= 1 << rng.randrange(8)
            case 1:
                data[at : at + length] = rng.randbytes(min(length, len(data) - at))
            case 2:
                del data[at : at + length]
            case 3:
                data[at:at] = data[at : at + length] * (1 << rng.randrange(4))
            case 4:
                data[at : at + rng.randrange(4)] = rng.choice(SPECIAL)
            case _:
                begin = rng.randrange(len(data) + 1)
                data[at:at] = data[begin : begin + length]
    return bytes(data[: rng.randrange(len(data) + 1)] if rng.random() < 0.05 else data)


@cache
def warm_up(name: str) -> None:
    """Have a target take its valid input once: kernels may be compiled then, which takes longer than `LONGEST_S`."""
    with contextlib.suppress(Exception):
        TARGETS[name].take(TARGETS[name].seed())


def fault(name: str, data: bytes) -> str:
    """What a target did that it may not, as the last lines of a traceback; empty for nothing."""
    warm_up(name)
    signal.setitimer(signal.ITIMER_REAL, LONGEST_S)
    try:
        TARGETS[name].take(data)
    except (EchostepError, *ALLOWED.get(name, ())):
        pass
    except Exception:
        return "".join(traceback.format_exc().splitlines(keepends=True)[-5:])
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return f"{used} kB of memory are used" if used > MOST_MEMORY else ""


def kept_inputs() -> Iterator[tuple[str, bytes]]:
    """Inputs that once were faults."""
    for row in CampaignJournal(KEPT).rows:
        yield row["target"], bytes.fromhex(row["hex"])


def inputs(name: str, shard: int) -> Iterator[bytes]:
    """The inputs of one shard of a target, without end: the seed itself, then mutations of it and of mutations."""
    rng, seed = random.Random(f"{name} {shard}"), TARGETS[name].seed()
    yield seed
    while True:
        data = seed
        for _ in range(rng.choice((1, 1, 1, 4))):
            data = mutate(data, rng)
        yield data


def run_shard(name: str, shard: int, seconds: float, most: int = sys.maxsize) -> tuple[int, bytes, str]:
    """Executions of a shard, and the input and the text of its fault, if there was one."""
    end_s, count = time.monotonic() + seconds, 0
    for data in inputs(name, shard):
        if count >= most or time.monotonic() > end_s:
            break
        count += 1
        if problem := fault(name, data):
            return count, data, problem
    return count, b"", ""


def too_slow(_number: int, _frame: FrameType | None) -> None:
    raise TooSlowError(f"longer than {LONGEST_S} s")


def main() -> int:
    """Replay the kept inputs, then fuzz all targets in turn."""
    asked = options(__doc__, seconds=(60.0, "of this run"), targets=(sorted(TARGETS), "only these"))
    signal.signal(signal.SIGALRM, too_slow)
    journal, inputs = CampaignJournal(LOG), CampaignJournal(KEPT)
    shard, done = len(journal.rows) + 1, Counter[str]()
    failures = [(name, text) for name, data in kept_inputs() if (text := fault(name, data))]
    end_s, turn = time.monotonic() + asked.seconds, 0
    while time.monotonic() < end_s:
        name = asked.targets[turn % len(asked.targets)]
        count, data, text = run_shard(name, shard * 1_000_000 + turn, SHARD_S)
        done[name], turn = done[name] + count, turn + 1
        if text:
            failures.append((name, text))
            inputs.add({"target": name, "hex": data.hex()})
    journal.add({"shard": shard, "executions": done})
    for name, text in failures:
        print(f"{name}: {text}")
    total = sum((Counter(row["executions"]) for row in journal.rows), Counter[str]())
    return report(
        f"host, shard {shard}: {done.total():,} executions, {total.total():,} of all shards",
        [*(Figure(name, f"{count:,}") for name, count in sorted(total.items())), none("faults", len(failures))],
    )


if __name__ == "__main__":
    sys.exit(main())
