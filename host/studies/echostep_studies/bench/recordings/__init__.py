# SPDX-License-Identifier: MIT
"""Public recordings of feet and legs that several studies read.

In: a folder of recordings. Out: samples, each recording with its truth and the metric of its set. Owns nothing.
"""
