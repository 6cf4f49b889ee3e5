"""Recordings: every chunk as it arrived, in an MCAP file, and back again.

In: chunks, or a file. Out: a file, or portions of chunks. Owns the file while it is written. Recovery, cutting and repair of files are here too.
"""
