# SPDX-License-Identifier: MIT
"""All stages in one object: chunks of the ports -> estimates.

In: chunks in order of arrival. Out: `Tracker`: estimates, and copies of its state for views. Owns the filter and the front end.
"""

from echostep.tracker.tracker import Tracker

__all__ = ["Tracker"]
