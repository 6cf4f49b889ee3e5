# SPDX-License-Identifier: MIT
"""Xsens MT protocol, sans-I/O: frames, both measurement messages, configuration, and the axes of the MT world.

In: bytes from an MT's port. Out: batches of measurements that have passed every gate, and the bytes that configure the device.
Owns the unfinished frame and the counts. No module here opens a port or waits.

Sources, cited by these names:
LLCP: Xsens, "MT Low-Level Communication Protocol Documentation", MT0101P (legacy messages: revisions up to U).
Manual: Xsens, "MTi and MTx User Manual and Technical Documentation", MT0100P.N.
CMT: the constants of Xsens' public C++ SDK (cmtdef.h), for fields that both documents omit.
"""

from echostep.xsens.frames import MTDATA, MTDATA2, Frame, FrameReader, encode_frame
from echostep.xsens.message import MtMessage
from echostep.xsens.mtdata import PROJECT, MtSample, OutputFormat, pack_mtdata
from echostep.xsens.reader import MtBatch, MtxCounts, MtxLimits, MtxReader

__all__ = [
    "MTDATA", "MTDATA2", "PROJECT", "Frame", "FrameReader", "MtBatch", "MtMessage", "MtSample", "MtxCounts", "MtxLimits", "MtxReader",
    "OutputFormat", "encode_frame", "pack_mtdata",
]  # fmt: skip
