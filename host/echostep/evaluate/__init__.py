"""Studies: the papers' experiments and ours, walked in simulation or taken from real recordings, and judged against truth.

Every study writes JSON of one form, `{study, runs, seed, rows}`, and says on the terminal how it compares with what others reported.
"""
