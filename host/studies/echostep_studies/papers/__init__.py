# SPDX-License-Identifier: MIT
"""The methods of three papers as printed: Girard 2011, Fischer 2008, Lee 2010. Only the studies and `--profile` use them.

In: the measurements that each paper uses. Out: what it computes. Owns the state of each.
"""
