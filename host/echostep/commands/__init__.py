"""One module per group of commands of the command line; each is imported when its command runs.

In: the options that were given. Out: files, views, lines on the terminal. Owns one `Session` per tracked run.
"""
