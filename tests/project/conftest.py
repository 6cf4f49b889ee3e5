# SPDX-License-Identifier: MIT
"""Fixtures of the app."""

from app_fixtures import browser, chromium, computer_of_one_user, signals_as_they_were  # noqa: F401
