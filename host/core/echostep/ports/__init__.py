# SPDX-License-Identifier: MIT
"""Sources of bytes: serial ports, UDP, check-ins from the page.

In: URLs of ports. Out: `Chunk(port, t_arrival_ns, data)`, and `Portion`s of many chunks as columns. Owns the open ports. Bytes are not decoded
here, except check-ins.
"""
