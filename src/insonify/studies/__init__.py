"""Studies: questions about sound and instruments put to simulations, with tables and pictures.

Each study is a module with a function that writes a page into a folder; `insonify study` runs them.
"""
