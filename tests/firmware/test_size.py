# SPDX-License-Identifier: MIT
"""The bound of the stack: what each function pushes, reserves and calls; what cannot be bounded is an error."""

from __future__ import annotations

import runpy

import pytest

from board_runs import ROOT

SIZE = runpy.run_path(str(ROOT / "firmware/size.py"))
MAIN, WORK = 0x100, 0x114
# A frame of 0x133 bytes as avr-gcc makes it, a push, and two bytes by a call of the next instruction.
CODE = """
00000100 <main>:
 100:	cf 93       	push	r28
 102:	cd b7       	in	r28, 0x3d	; 61
 104:	de b7       	in	r29, 0x3e	; 62
 106:	c3 53       	subi	r28, 0x33	; 51
 108:	d1 40       	sbci	r29, 0x01	; 1
 10a:	de bf       	out	0x3e, r29	; 62
 10c:	cd bf       	out	0x3d, r28	; 61
 10e:	02 d0       	rcall	.+4      	; 0x114 <work.isra.0>
 110:	08 95       	ret

00000114 <work.isra.0>:
 114:	00 d0       	rcall	.+0      	; 0x116 <work.isra.0+0x2>
 116:	cd b7       	in	r28, 0x3d	; 61
 118:	de b7       	in	r29, 0x3e	; 62
 11a:	08 95       	ret
"""


def test_a_function_takes_its_address_its_pushes_and_its_frame() -> None:
    names, calls, stacks = SIZE["call_graph"](CODE)
    assert (names[MAIN], names[WORK]) == ("main", "work")
    assert calls[MAIN] == {WORK}
    assert stacks == {MAIN: 2 + 1 + 0x133, WORK: 2 + 2}


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ("08 95       	ret", "09 95       	icall", "main jumps to a computed address"),
        (
            "rcall	.+4      	; 0x114 <work.isra.0>",
            "jmp	0x124	; 0x124 <__tablejump2__>",
            "main jumps to a computed address",
        ),
        ("in	r29, 0x3e", "in	r25, 0x3e", "main sets the stack pointer"),
    ],
)
def test_what_cannot_be_bounded_is_an_error(old: str, new: str, error: str) -> None:
    assert old in CODE
    with pytest.raises(SystemExit, match=f"{error}.*cannot be bounded"):
        SIZE["call_graph"](CODE.replace(old, new))
