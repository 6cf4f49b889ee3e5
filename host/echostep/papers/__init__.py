"""The methods of three papers as printed: Girard 2011, Fischer 2008, Lee 2010. Nothing of ours imports them but the studies and `--profile`.

In: what their authors measured. Out: what they computed. Owns their state.
"""
