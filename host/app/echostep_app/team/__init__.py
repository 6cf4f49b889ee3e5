# SPDX-License-Identifier: MIT
"""Reports to a commander over MQTT and Cursor-on-Target, and the commander's view.

In: estimates. Out: reports to brokers and TAK; on the commander's side, a roster of the team from those reports. Owns the connections and
the outboxes.
"""
