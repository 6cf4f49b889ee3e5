# SPDX-License-Identifier: MIT
"""The sensor board beyond its messages: a host's subscriptions, and faults found in a board's reports.

In: the board's reports. Out: findings with a remedy; subscriptions. Owns the words.
"""
