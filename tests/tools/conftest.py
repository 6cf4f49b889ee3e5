# SPDX-License-Identifier: MIT
"""Fixtures of the app."""

from app_fixtures import computer_of_one_user, signals_as_they_were  # noqa: F401
