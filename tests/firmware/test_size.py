# SPDX-License-Identifier: MIT
"""The bound of the stack: a switch that jumps through a table is bounded by the table's entries, any other computed jump is an error."""

from __future__ import annotations

import runpy

import pytest

from board_runs import ROOT

SIZE = runpy.run_path(str(ROOT / "firmware/size.py"))
MAIN, WORK, TABLE_JUMP = 0x100, 0x114, 0x11A
# Switches as gcc 16 and gcc 5.4 compile them: 8 bits and a near default, 16 bits and a far one; the table's words are half the addresses.
MAIN_16 = """
00000100 <main>:
 100:	82 30       	cpi	r24, 0x02	; 2
 102:	38 f4       	brcc	.+14     	; 0x112 <.L1>
 104:	e8 2f       	mov	r30, r24
 106:	f0 e0       	ldi	r31, 0x00	; 0
 108:	e0 50       	subi	r30, 0x00	; 0
 10a:	ff 4f       	sbci	r31, 0xFF	; 255
 10c:	0c 94 8d 00 	jmp	0x11a	; 0x11a <__tablejump2__>
"""
MAIN_5 = """
00000100 <main>:
 100:	82 30       	cpi	r24, 0x02	; 2
 102:	91 05       	cpc	r25, r1
 104:	08 f0       	brcs	.+2      	; 0x108 <main+8>
 106:	05 c0       	rjmp	.+10     	; 0x112 <.L1>
 108:	fc 01       	movw	r30, r24
 10a:	e0 50       	subi	r30, 0x00	; 0
 10c:	ff 4f       	sbci	r31, 0xFF	; 255
 10e:	05 c0       	rjmp	.+10     	; 0x11a <__tablejump2__>
"""
REST = """
00000110 <.L2>:
 110:	01 d0       	rcall	.+2      	; 0x114 <work.isra.0>

00000112 <.L1>:
 112:	08 95       	ret

00000114 <work.isra.0>:
 114:	cf 93       	push	r28
 116:	cf 91       	pop	r28
 118:	08 95       	ret

0000011a <__tablejump2__>:
 11a:	ee 0f       	add	r30, r30
 11c:	ff 1f       	adc	r31, r31
 11e:	05 90       	lpm	r0, Z+
 120:	f4 91       	lpm	r31, Z
 122:	e0 2d       	mov	r30, r0
 124:	09 94       	ijmp

00000200 <.L3>:
 200:	88 00 89 00                                         ....
"""


def test_a_switch_through_a_table_is_bounded_by_its_entries() -> None:
    for main in (MAIN_16, MAIN_5):
        names, calls, pushed = SIZE["call_graph"](main + REST)
        assert (names[MAIN], names[WORK]) == ("main", "work")  # as in the compiler's files of frames
        assert calls[MAIN] >= {WORK, TABLE_JUMP}
        assert pushed == {MAIN: 0, WORK: 1, TABLE_JUMP: 0}


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("88 00 89 00", "88 00 8a 00"),  # an entry in another function
        ("r24, 0x02", "r24, 0x03"),  # longer than what is known of the flash
        ("cpi	r24", "cpi	r23"),  # another register is compared
        ("brcc", "breq"),
        ("; 0x114 <work.isra.0>", "; 0x106 <main+6>"),  # entered behind the comparison
        ("jmp	0x11a", "call	0x11a"),
        ("08 95       	ret", "09 95       	icall"),
    ],
)
def test_any_other_computed_jump_is_an_error(old: str, new: str) -> None:
    assert old in MAIN_16 + REST
    with pytest.raises(SystemExit, match="jumps to a computed address: its stack cannot be bounded"):
        SIZE["call_graph"]((MAIN_16 + REST).replace(old, new))
