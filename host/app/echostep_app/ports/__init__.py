# SPDX-License-Identifier: MIT
"""Ports: serial ports, UDP and TCP, opened and read as chunks; who holds them, and their faults.

In: names of ports and URLs. Out: chunks. Owns the open ports.
"""
