# SPDX-License-Identifier: MIT
"""Meetings on the page: who can be met, what is sent, and what it is told."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from echostep.aiding import MeetingEffect
from echostep_app.page.elements.marks import WORDS, ShownMeeting
from echostep_app.page.mailbox import popped
from echostep_app.page.requests import Met, parse_request
from page.browser import looking, violations, wait_for
from page.frames import scene, served
from waiting import until


def test_every_effect_has_its_words() -> None:
    assert set(WORDS) == set(MeetingEffect)
    assert all(text.format("Kim") != text for text in WORDS.values())


@given(st.text(max_size=40) | st.none() | st.integers() | st.lists(st.text(max_size=3), max_size=2))
def test_a_meeting_needs_a_name(name: object) -> None:
    request = parse_request(json.dumps({"kind": "met", "name": name}))
    assert request == (Met(name) if isinstance(name, str) and 0 < len(name) <= 32 else None)


def test_a_teammate_is_chosen_and_the_page_says_what_it_did(browser: Any) -> None:
    met: list[str] = []
    with served() as (server, mailbox):
        mailbox.publish(scene())
        page = looking(browser, server.url, "bright")
        wait_for(page, "echostep.last !== null && document.querySelector('#met').hidden")
        mailbox.set_team(("anna", "<b>zoe"))
        wait_for(page, "!document.querySelector('#met').hidden")
        assert page.eval_on_selector_all("#met option", "all => all.map(({ text }) => text)") == [
            "I met…",
            "anna",
            "<b>zoe",
        ]
        found = violations(page)
        page.select_option("#met", "<b>zoe")

        def is_told() -> bool:
            met.extend(popped(mailbox.met))
            return bool(met)

        assert until(is_told)
        assert met == ["<b>zoe"]
        assert page.input_value("#met") == ""
        mailbox.publish(replace(scene(), met=ShownMeeting(1, "Your position is now beside <b>zoe.")))
        wait_for(page, "document.querySelector('#hint').textContent === 'Your position is now beside <b>zoe.'")
        page.evaluate("() => echostep.link.send('met', { name: 'nobody' })")
        wait_for(page, "document.querySelector('#hint').textContent === 'nobody is not heard.'")
        mailbox.set_team(())
        wait_for(page, "document.querySelector('#met').hidden")
        assert not page.wrong
    assert not list(popped(mailbox.met))
    assert found == []
