"""What each command of the command line does; imported when it runs.

In: options that the user gave. Out: files, a view, text. Owns the run.
"""
