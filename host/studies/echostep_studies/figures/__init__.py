# SPDX-License-Identifier: MIT
"""README's figures and pictures that no study prints.

In: recordings, simulated walks. Out: figures on the terminal, pictures. Owns nothing.
"""
