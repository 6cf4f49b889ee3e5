"""The papers' experiments and ours: one module or folder a study; `study` is the frame that all of them share.

In: seeds, or recordings. Out: rows, a table, JSON, Parquet, pictures. Owns a journal to resume from.
"""
