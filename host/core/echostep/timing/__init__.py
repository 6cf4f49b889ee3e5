# SPDX-License-Identifier: MIT
"""Every clock: board ticks, the MTx sample counter, arrival times and SyncOut edges -> one time `t_s`.

In: counters and arrival times of messages. Out: seconds of the board's clock for each. Owns the clock models. Nothing else converts between clocks.
"""
