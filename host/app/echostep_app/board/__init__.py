# SPDX-License-Identifier: MIT
"""The sensor board beyond its messages: what a host subscribes to, and what a board's reports say is wrong with it.

In: the board's reports. Out: findings with a remedy; subscriptions. Owns the words.
"""
